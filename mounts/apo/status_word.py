"""The status word of an axis controller, bit by bit.

The two families differ from bit 8 on. Sticky bits stay set until INIT, on the SDSS until they have been read by
STATUS; the limit, fiducial and stop bits, and bit 0, follow the state. Bits that the manual does not name are told as
`bit 20`. The masks are the manual's; where they speak of bits without a name, those count all the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from mounts.apo.commands import Kind

BITS = 32


@dataclass(frozen=True)
class StatusBit:
    """One bit: its number, a name, what it means to a person, and whether it stays until cleared."""

    bit: int
    name: str
    meaning: str
    sticky: bool = True


_ALIKE = (
    StatusBit(0, "buffer_empty", "no node is left in the buffer", sticky=False),
    StatusBit(1, "update_late", "a node came too late, or the path ran out"),
    StatusBit(2, "reverse_soft_limit", "at the lower soft limit", sticky=False),
    StatusBit(3, "forward_soft_limit", "at the upper soft limit", sticky=False),
    StatusBit(4, "velocity_limited", "more velocity was asked than the axis may have"),
    StatusBit(5, "acceleration_limited", "more acceleration was asked than the axis may have"),
    StatusBit(6, "reverse_limit_switch", "the lower limit switch is closed", sticky=False),
    StatusBit(7, "forward_limit_switch", "the upper limit switch is closed", sticky=False),
)

TABLES: Mapping[Kind, tuple[StatusBit, ...]] = MappingProxyType(
    {
        "apo": (
            *_ALIKE,
            StatusBit(8, "overspeed", "the axis ran too fast"),
            StatusBit(11, "stop_button", "a stop button is pressed; release it, then INIT", sticky=False),
            StatusBit(12, "disable_switch", "the disable switch is on"),
            StatusBit(13, "output_disabled", "the motor output is disabled"),
            StatusBit(14, "motion_error", "the axis did not follow its path"),
            StatusBit(15, "slip", "the drive slipped"),
            StatusBit(16, "one_hz_lost", "the 1 Hz clock signal is lost"),
            StatusBit(18, "amplifier_hot", "the amplifier is hot"),
            StatusBit(19, "current_limit", "the motor current is limited"),
            StatusBit(24, "fiducial_error", "the error at a fiducial is too large to correct", sticky=False),
            StatusBit(29, "motor_velocity", "the motor velocity is too large"),
            StatusBit(30, "restarted", "the controller has restarted"),
        ),
        "sdss": (
            *_ALIKE,
            StatusBit(11, "out_of_closed_loop", "the axis is out of closed loop"),
            StatusBit(12, "amplifier_bad", "the amplifier is bad"),
            StatusBit(13, "stop_button", "a stop button is pressed; release it, then INIT", sticky=False),
            StatusBit(14, "semaphore_taken", "somebody else has the semaphore", sticky=False),
            StatusBit(16, "one_hz_lost", "the 1 Hz clock signal is lost"),
            StatusBit(17, "clock_slow", "the clock is slow"),
            StatusBit(18, "clock_not_set", "the clock is not set"),
            StatusBit(24, "fiducial_error", "the correction by a fiducial is too large", sticky=False),
        ),
    }
)

ERROR_MASKS: Mapping[Kind, int] = MappingProxyType({"apo": 0xCD71CC, "sdss": 0x45800})
WARNING_MASKS: Mapping[Kind, int] = MappingProxyType({"apo": 0x61040033, "sdss": 0x610320FF})
_STOP_BUTTON, _SLIP, _RESTARTED = 1 << 11, 1 << 15, 1 << 30
_ERRORS: Mapping[Kind, int] = {**ERROR_MASKS, "apo": ERROR_MASKS["apo"] | _STOP_BUTTON}  # it halts and needs INIT
_WARNINGS: Mapping[Kind, int] = {**WARNING_MASKS, "apo": WARNING_MASKS["apo"] | _SLIP}
_NAMES = {kind: {row.bit: row.name for row in rows} for kind, rows in TABLES.items()}
_BITS = {kind: {row.name: row.bit for row in rows} for kind, rows in TABLES.items()}


def mask_of(name: str, kind: Kind) -> int:
    """Return the mask of a bit by its name.

    Raises
    ------
    KeyError
        This kind has none such; says which there are.
    """
    if name not in _BITS[kind]:
        raise KeyError(f"a controller of kind {kind} has no status bit {name!r}; there is {', '.join(_BITS[kind])}")
    return 1 << _BITS[kind][name]


def sticky_mask(kind: Kind) -> int:
    """Return the bits that stay set until they are cleared."""
    return _RESTARTED | sum(1 << row.bit for row in TABLES[kind] if row.sticky)


@dataclass(frozen=True)
class StatusWord:
    """A status word, 32 bits.

    Attributes
    ----------
    value : int
        As reported; a signed report of bit 31 is understood.
    kind : str
        Whose table holds.
    """

    value: int
    kind: Kind = "apo"

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", self.value & (1 << BITS) - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """The bits that are set and have a name, lowest first."""
        return tuple(_NAMES[self.kind][bit] for bit in _set_bits(self.value) if bit in _NAMES[self.kind])

    @property
    def unknown(self) -> tuple[int, ...]:
        """The numbers of the bits that are set and have no name."""
        return tuple(bit for bit in _set_bits(self.value) if bit not in _NAMES[self.kind])

    @property
    def errors(self) -> tuple[str, ...]:
        """What is an error, by name or as `bit 22`; of the 3.5 m also the stop button, which its mask lacks."""
        return self._told(_ERRORS[self.kind])

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is a warning and no error; of the 3.5 m also the slip, which its mask lacks."""
        return self._told(_WARNINGS[self.kind] & ~_ERRORS[self.kind])

    @property
    def restarted(self) -> bool:
        """Whether the controller has restarted; the SDSS's table leaves the bit out, its warning mask has it."""
        return bool(self.value & _RESTARTED)

    @property
    def meanings(self) -> tuple[str, ...]:
        """What is set, in words for a person."""
        rows = {row.bit: row.meaning for row in TABLES[self.kind]}
        return tuple(rows.get(bit, f"bit {bit}, which the manual does not explain") for bit in _set_bits(self.value))

    def has(self, name: str) -> bool:
        """Whether the bit of this name is set; never where this kind has no such bit."""
        bit = _BITS[self.kind].get(name)
        return bit is not None and bool(self.value >> bit & 1)

    def __or__(self, other: "StatusWord") -> "StatusWord":
        return StatusWord(self.value | other.value, self.kind)

    def _told(self, mask: int) -> tuple[str, ...]:
        return tuple(_NAMES[self.kind].get(bit, f"bit {bit}") for bit in _set_bits(self.value & mask))


def _set_bits(value: int) -> list[int]:
    return [bit for bit in range(BITS) if value >> bit & 1]
