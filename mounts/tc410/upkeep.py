"""What a person does with the registers of a TC410: look at any, change those that may be changed by hand.

A register by which the telescope would move, or by which its position would come to lie, is not changed here without
`force`: the table names the command that does it properly. The bits by which the host moves the axes are never set
by hand: only commands that check the way set them. Whatever is written is read back.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from mounts.errors import DriveRefused
from mounts.tc410.input_modes import LOGARITHMIC, MODES, MOST_SHIFT
from mounts.tc410.motors import MOST_A
from mounts.tc410.registers import DRIVE_TYPES, MOUNT_TYPES, REGISTERS, Register, by_name
from mounts.tc410.unit import Unit, Values

_NOTHING: Mapping[str, float] = MappingProxyType({})
_MOST_WORDS = 12  # of one request: a telescope that tracks must not wait long for its next velocity
_CONTROL = by_name("velocity_control")
_HOST = _CONTROL.mask("slew_to_target", "remote_control", "tracking")
_WORDS = {"mount_type": MOUNT_TYPES, "axis1_drive_type": DRIVE_TYPES, "axis2_drive_type": DRIVE_TYPES}

ACTIONS = {
    "all_stop": "`stop`",
    "load_factory": "`drive factory --yes`",
    "save_configuration": "`drive save`",
    "load_configuration": "`drive reload --yes`",
}
"""The command in place of each register that is an action."""

_FAN_START, _FAN_STOP = "fan_start_temperature", "fan_stop_temperature"

_PROPERLY = {  # by the end of the name
    "power": "`drive power on` and `drive power standby` switch it, and stop the telescope first",
    "velocity_control": "`goto`, `track`, `drive speed` and `stop` set it, and check the way first",
    "_position": "`sync TARGET` declares where the telescope points, and `goto` or `jog` move it",
    "_target_velocity": "`drive speed` and `jog` move at a speed, and check the way first",
    "_negative_limit": "it is written from min_deg and max_deg at every connection; change those",
    "_positive_limit": "it is written from min_deg and max_deg at every connection; change those",
}


@dataclass(frozen=True)
class Shown:
    """One register as it reads now."""

    register: Register
    value: float
    raw: tuple[int, ...]

    @property
    def flags(self) -> tuple[str, ...]:
        """Names of the flags asserted."""
        return self.register.asserted(self.raw[0]) if self.register.flags else ()

    @property
    def group(self) -> str:
        """The heading under which a person looks for it."""
        kind = {"coil": "control", "discrete": "inputs", "input": "measured", "holding": "control"}[
            self.register.kind
        ]
        kind = "configuration" if self.register.saved else kind
        return f"axis {self.register.axis}, {kind}" if self.register.axis else kind

    @property
    def text(self) -> str:
        """The value as a person reads it."""
        row = self.register
        if row.flags:
            return ", ".join(self.flags) or "none"
        words = _WORDS.get(row.name, {}).get(int(self.value), "")
        return f"{self.value:.10g} {row.unit}".strip() + (f" ({words})" if words else "")


class Upkeep:
    """The registers of one unit.

    Parameters
    ----------
    unit : Unit
        Whose they are.
    about_to_write, written : callable
        Called with a register and its words, before and after they are written.
    """

    def __init__(
        self,
        unit: Unit,
        about_to_write: Callable[[Register, tuple[int, ...]], object],
        written: Callable[[Register, tuple[int, ...]], object],
    ) -> None:
        self._unit = unit
        self._about_to_write = about_to_write
        self._written = written

    def show(self, names: Sequence[str] = ()) -> tuple[Shown, ...]:
        """Read registers, all that can be read when none is named; an axis may be left out of a name.

        Raises
        ------
        RegisterError
            There is no such register.
        DriveRefused
            It cannot be read.
        """
        shown: dict[str, Shown] = {}
        for rows in _blocks(_chosen(names)):
            found = self._unit.read(rows[0].name, rows[-1].name)
            shown |= {row.name: _shown(row, found) for row in rows}
        return tuple(shown.values())

    def write(self, name: str, value: float, *, force: bool = False, beside: Mapping[str, float] = _NOTHING) -> Shown:
        """Write a register and read it back.

        Parameters
        ----------
        name : str
            The register's.
        value : float
            In its unit.
        force : bool
            Write also what another command does properly.
        beside : mapping
            Values of other registers that are written with it, and judged in place of the unit's own.

        Raises
        ------
        RegisterError
            There is no such register, or it does not hold such a value; nothing was written.
        DriveRefused
            It is not to be changed so, or not without `force`; or it reads back otherwise.
        """
        row = by_name(name)
        self._check(row, value, force=force)
        if row.name in {_FAN_START, _FAN_STOP}:
            self._check_fan(row.name, value, beside)
        words = row.encode(value, self._unit.position_format)
        self._about_to_write(row, words)
        if row.kind == "coil":
            self._unit.power(on=bool(words[0]))
        else:
            self._unit.write_words(row.name, words)
        found = _shown(row, self._unit.read(row.name))
        self._written(row, words)
        if found.raw != words:
            wrote, reads = (" ".join(f"0x{word:04X}" for word in side) for side in (words, found.raw))
            raise DriveRefused(
                f"{row.name} reads back {reads} instead of {wrote}: the unit did not keep what was written; "
                "try again, and check the unit"
            )
        return found

    def act(self, name: str) -> None:
        """Do an action: `load_factory`, `save_configuration` or `load_configuration`."""
        row, words = by_name(name), (1,)
        self._about_to_write(row, words)
        self._unit.write_words(name, words)
        self._written(row, words)

    def _check(self, row: Register, value: float, *, force: bool) -> None:
        if row.access == "read":
            raise DriveRefused(f"{row.name} is measured by the drive and cannot be written; `drive show` reads it")
        if row.access == "write":
            raise DriveRefused(f"{row.name} is an action and holds no value; use {ACTIONS[row.name]}")
        properly = next((text for ending, text in _PROPERLY.items() if row.name.endswith(ending)), "")
        if properly and not force:
            raise DriveRefused(
                f"{row.name} is not changed by hand: {properly}. With --force it is written all the same"
            )
        row.encode(value, self._unit.position_format)
        if row is _CONTROL:
            self._check_control(int(value))
        if row.name in {"joystick_mode", "autoguider_mode"} and value not in MODES:
            raise DriveRefused(
                f"{row.name} = {value:g}: allowed 0 to {MOST_SHIFT}, a shift of the linear range, or {LOGARITHMIC}, "
                "logarithmic; nothing would move perceptibly with another"
            )
        if row.name.endswith("_motor_current"):
            self._check_current(row, value)

    def _check_control(self, word: int) -> None:
        present = int(self._unit.read(_CONTROL.name)[_CONTROL.name])
        changed = _CONTROL.asserted((word ^ present) & _HOST)
        if changed:
            raise DriveRefused(
                f"velocity_control = {word}: {', '.join(changed)} would change, which is never done by hand; "
                f"{_PROPERLY[_CONTROL.name]}"
            )

    def _check_fan(self, name: str, value: float, beside: Mapping[str, float]) -> None:
        other = _FAN_STOP if name == _FAN_START else _FAN_START
        there = beside[other] if other in beside else self._unit.read(other)[other]
        if value != there and (value > there) == (name == _FAN_START):
            return
        where = "above" if name == _FAN_START else "below"
        raise DriveRefused(f"{name} = {value:g} °C: allowed {where} {other} = {there:g} °C; change that one first")

    def _check_current(self, row: Register, value: float) -> None:
        kind = int(self._unit.read(f"axis{row.axis}_drive_type")[f"axis{row.axis}_drive_type"])
        most = MOST_A.get(DRIVE_TYPES.get(kind, "").lower(), max(MOST_A.values()))
        if value > most:
            raise DriveRefused(
                f"{row.name} = {value:g} A: allowed 1 to {most:g} A with the drive type "
                f"{DRIVE_TYPES.get(kind, 'unknown')}; more would overheat the motor"
            )


def _shown(row: Register, found: Values) -> Shown:
    return Shown(row, found[row.name], found.words[row.name])


def _chosen(names: Sequence[str]) -> Iterable[Register]:
    if not names:
        return (row for row in REGISTERS if row.access != "write")
    known = {row.name for row in REGISTERS}
    wanted: dict[str, Register] = {}
    for name in names:
        both = [f"axis{axis}_{name}" for axis in (1, 2) if f"axis{axis}_{name}" in known]
        wanted |= {each: by_name(each) for each in ([name] if name in known or not both else both)}
    actions = [row.name for row in wanted.values() if row.access == "write"]
    if actions:
        raise DriveRefused(f"{actions[0]} is an action and cannot be read; {ACTIONS[actions[0]]} does it")
    return (row for row in REGISTERS if row.name in wanted)


def _blocks(rows: Iterable[Register]) -> Iterator[list[Register]]:
    """Rows that follow each other without a gap, few enough for one request."""
    block: list[Register] = []
    for row in rows:
        words = sum(other.words for other in block) + row.words
        last = block[-1] if block else None
        follows = last is not None and last.kind == row.kind and last.address + last.words == row.address
        if block and (not follows or words > _MOST_WORDS):
            yield block
            block = []
        block.append(row)
    if block:
        yield block
