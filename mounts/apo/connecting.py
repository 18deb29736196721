"""What is asked of a controller once, when it is connected to, and what its answers differ from."""

from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mounts.apo.axis import ControlledAxis
from mounts.apo.errors import CommandRefused, MalformedReply
from mounts.apo.settings import AxisSettings
from mounts.errors import WrongProtocol
from transports.errors import NoAnswer, WrongAnswer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_TOLD = 1e-4  # degrees or degrees per second, to which they are told


def identified(axis: ControlledAxis) -> str:
    """Ask ID, which nothing else answers so; return what it says.

    Raises
    ------
    WrongProtocol, TransportError
        Something else answers; nothing does. The text names the axis.
    """
    try:
        return axis.asked(lambda: _identity(axis))
    except WrongAnswer as error:
        raise WrongProtocol(f"{error}; no axis controller speaks on this line: check link and drive.kind") from error
    except NoAnswer as error:
        what = "what does not know this command is silent, as a TC410 is: check link and drive.kind too"
        raise NoAnswer(f"{error}; {what}") from error


def _identity(axis: ControlledAxis) -> str:
    try:
        return axis.controller.identity().text
    except CommandRefused as error:
        said = f"{axis.name}: ID was answered with {error.reason[:60]!r}"
        raise WrongProtocol(f"{said}; {_OTHERWISE[axis.word.kind]}") from error


_OTHERWISE = {
    "apo": "where the axes share this line drive.kind is sdss",
    "sdss": "check drive.axis_select; where each axis has a line of its own drive.kind is apo",
}


@dataclass(frozen=True)
class Setting:
    """Something that a controller holds and the configuration has as well."""

    axis: str
    name: str
    told: float
    configured: float
    unit: str
    remark: str

    @property
    def differs(self) -> bool:
        """Whether the controller has it otherwise."""
        return abs(self.told - self.configured) > _TOLD

    @property
    def note(self) -> str:
        """What a person should know of the difference."""
        both = f"{self.told:g} {self.unit}, configured {self.configured:g} {self.unit}"
        return f"{self.axis}: the controller's {self.name} is {both}; {self.remark}"


def settings_of(axis: ControlledAxis) -> list[Setting]:
    """All settings that a controller tells; what it does not tell is left out."""
    settings, found = axis.settings, []
    with suppress(CommandRefused, MalformedReply):
        low, high = axis.controller.limits()
        found += [
            _limit(settings, "lower soft limit", low, settings.lowest_deg, narrower=low > settings.lowest_deg),
            _limit(settings, "upper soft limit", high, settings.highest_deg, narrower=high < settings.highest_deg),
        ]
    with suppress(CommandRefused, MalformedReply):
        speed = axis.controller.max_velocity()
        slower = speed < settings.max_speed_deg_s
        remark = (
            "it clips what is planned: correct max_speed_deg_s" if slower else "the configured one is planned with"
        )
        found.append(Setting(settings.name, "MAXV", speed, settings.max_speed_deg_s, "deg/s", remark))
    return found


def settings_notes(axis: ControlledAxis, found: "Sequence[Setting]") -> list[str]:
    """Say what a controller that tells these settings holds otherwise than configured, and what it does not tell."""
    names = {each.name for each in found}
    untold = [
        f"{axis.name}: the controller does not tell its {what}; what is configured is kept by this host"
        for what, name in (("soft limits", "lower soft limit"), ("MAXV", "MAXV"))
        if name not in names
    ]
    return [*(each.note for each in found if each.differs), *untold]


def _limit(settings: AxisSettings, name: str, told: float, configured: float, *, narrower: bool) -> Setting:
    remark = "it stops before the configured one" if narrower else "the configured one is kept by this host"
    return Setting(settings.name, name, told, configured, "deg", remark)


def told(axis: ControlledAxis) -> dict[str, str]:
    """All that a controller tells of itself, as a person reads it; what it does not tell is said so."""
    sight = axis.look()
    controller = axis.controller
    rows = {
        "position": f"{sight.position:.7f}°",
        "velocity": f"{sight.velocity:+.5f}°/s",
        "clock offset": f"{axis.offset.value:+.4f} ± {axis.offset.uncertainty_s:.4f} s",
        "status": ", ".join(axis.word.names) or "none",
    }
    if axis.word.unknown:
        rows["unknown bits"] = ", ".join(map(str, axis.word.unknown))
    asked: dict[str, Callable[[], str]] = {
        "identity": lambda: controller.identity().text,
        "soft limits": lambda: _span(*controller.limits()),
        "max velocity": lambda: f"{controller.max_velocity():g}°/s",
        "output limit": lambda: f"{controller.output_limit()} %",
    }
    for name, ask in asked.items():
        try:
            rows[name] = ask()
        except (CommandRefused, MalformedReply) as error:
            rows[name] = f"not told: {error}"
    return rows


def _span(low: float, high: float) -> str:
    return f"{low:g}° to {high:g}°"
