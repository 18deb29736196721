"""The axis controllers of a telescope simulated on the wire: one line each on the 3.5 m, one for all on the SDSS."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from mounts.apo.commands import MAX_LINE, Kind
from mounts.apo.simulator_axis import SimulatedController
from mounts.apo.simulator_commands import obey
from mounts.apo.simulator_settings import HARDWARE, AxisHardware, SimulatorSettings

AXIS_WORDS = ("AZ", "ALT", "ROT")
_CR = b"\r"
_LINE_FEEDS = re.compile(rb"[\n\x00]")


class SimulatedLine:
    """The far end of a line; keeps `transports.memory.Device`.

    Parameters
    ----------
    controllers : mapping
        Those on the line by their words; a single one under the empty word needs none.
    settings : SimulatorSettings
        How lines end, where OK stands, and how an axis is chosen.
    """

    def __init__(self, controllers: Mapping[str, SimulatedController], settings: SimulatorSettings) -> None:
        self._controllers = controllers
        self._settings = settings
        self._chosen = next(iter(controllers)) if len(controllers) == 1 else ""
        self._begun = b""

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers to the lines that they complete."""
        *lines, begun = _LINE_FEEDS.sub(b"", self._begun + data).split(_CR)
        self._begun = begun[: MAX_LINE + 1]
        return b"".join(self._answer(raw[: MAX_LINE + 1].decode("latin-1"), t) for raw in lines)

    @property
    def state(self) -> list[str]:
        """JSON-able: the axis chosen, and the line begun."""
        return [self._chosen, self._begun.decode("latin-1")]

    @state.setter
    def state(self, state: Sequence[str]) -> None:
        self._chosen, begun = state
        self._begun = begun.encode("latin-1")

    def _answer(self, text: str, t: float) -> bytes:
        word, rest = self._addressed(text)
        if word not in self._controllers:
            return self._written(text, (), f"which axis: {', '.join(self._controllers)}?")
        axis = self._controllers[word]
        axis.advance(t)
        if t < axis.silent_until:
            return b""
        banner = (axis.said_at_boot() + self._settings.line_end).encode("latin-1") if axis.banner else b""
        if len(text) >= MAX_LINE:
            return banner + self._written(text, (), f"a line has at most {MAX_LINE} characters")
        if not rest.strip():
            return banner + self._written(text, (), "")
        return banner + self._written(text, *obey(axis, rest, t))

    def _addressed(self, text: str) -> tuple[str, str]:
        """Return the word of the axis that is meant, and the command for it."""
        if set(self._controllers) == {""}:
            return "", text
        head, *rest = text.split(maxsplit=1) or [""]
        if self._settings.axis_select == "prefix":
            return head.upper(), " ".join(rest)
        if head.upper() in self._controllers and not rest:
            self._chosen = head.upper()
            return self._chosen, ""
        return self._chosen, text

    def _written(self, echo: str, lines: Sequence[str], error: str) -> bytes:
        all_lines = [echo, *lines, *([f"ERR: {error}"] if error else [])]
        if self._settings.ok == "alone":
            all_lines.append("OK")
        else:
            all_lines[-1] += " OK"
        end = self._settings.line_end
        return (end.join(all_lines) + end).encode("latin-1", "replace")


class SimulatedObservatory:
    """Azimuth, altitude and perhaps the rotator of a telescope.

    Parameters
    ----------
    kind : str
        "apo" or "sdss".
    settings : SimulatorSettings
        How its controllers read the manual.
    t0 : float
        POSIX time at which they start.
    hardware : sequence of AxisHardware
        Its axes, two or three.
    positions : sequence of float
        Degrees at which they stand, and which the controllers believe.
    """

    def __init__(
        self,
        kind: Kind,
        settings: SimulatorSettings,
        t0: float,
        hardware: Sequence[AxisHardware] | None = None,
        positions: Sequence[float] | None = None,
    ) -> None:
        bolted = HARDWARE[kind] if hardware is None else hardware
        stand = [axis.stow_deg for axis in bolted] if positions is None else positions
        self.kind, self.settings = kind, settings
        self.axes = tuple(
            SimulatedController(kind, settings, axis, t0, position)
            for axis, position in zip(bolted, stand, strict=True)
        )
        words = dict(zip(AXIS_WORDS, self.axes, strict=False))
        on_lines = [words] if kind == "sdss" else [{"": axis} for axis in self.axes]
        self._lines = tuple(SimulatedLine(controllers, settings) for controllers in on_lines)

    @property
    def lines(self) -> tuple[SimulatedLine, ...]:
        """The far ends: one for each axis of the 3.5 m, one for all of the SDSS."""
        return self._lines

    def advance(self, t: float) -> None:
        """Let the axes run until POSIX `t`; a time already passed changes nothing."""
        for axis in self.axes:
            axis.advance(t)

    def true_position(self, axis: int) -> float:
        """Where axis 1, 2 or 3 truly is, degrees, as of the last `advance`, whatever its controller believes."""
        return self.axes[axis - 1].true_position()

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as JSON-able values; settings and hardware are not in it."""
        return {"axes": [axis.state() for axis in self.axes], "lines": [line.state for line in self._lines]}

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go back to the state of a snapshot."""
        for axis, state in zip(self.axes, snapshot["axes"], strict=True):
            axis.restore(state)
        for line, kept in zip(self._lines, snapshot["lines"], strict=True):
            line.state = kept
