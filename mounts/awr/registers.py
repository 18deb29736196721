"""The registers of an AWR Microstep, in one table; 16-bit words, written in RAM (address bit 7) or for good.

A rate is two words, counts and flags; it falls with the counts, so only its ratio to another is known without the
factory's sheet. 3F, BF and FF are never written.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

from mounts.awr.errors import AwrError

RAM = 0x80  # address bit of a soft write
WORD = 0xFFFF
CRC, VERSION = 0x3F, 0xFF
NEVER_WRITTEN = frozenset({CRC, CRC | RAM, VERSION})
_LEAST_COUNTS = 16  # below which the unit's division overflows (A)

Kind = Literal["bits", "counts", "flags", "frequency", "acceleration", "reserved", "steps", "crc", "version"]


@dataclass(frozen=True)
class Register:
    """One word."""

    address: int
    name: str
    kind: Kind
    meaning: str
    lowest: int = 0
    highest: int = WORD

    @property
    def is_rate(self) -> bool:
        """Whether the unit divides by it."""
        return self.kind in {"counts", "flags"}

    @property
    def is_counts(self) -> bool:
        """Whether it holds the counts of a rate."""
        return self.kind == "counts"

    @property
    def writable(self) -> bool:
        """Whether a host may write it."""
        return self.address not in NEVER_WRITTEN and self.kind != "reserved"


def _table() -> Iterator[Register]:
    yield Register(0x00, "directions", "bits", "direction senses and their override", highest=0x7)
    rates = (
        ("drive_ra", "rate of axis 1 with no key pressed"),
        ("drive_dec", "rate of axis 2 with no key pressed"),
        ("guide_up", "GUIDE rate of UP and DOWN"),
        ("guide_right", "GUIDE rate of RIGHT"),
        ("guide_left", "GUIDE rate of LEFT"),
        ("centre_up", "CENTRE rate of UP and DOWN"),
        ("centre_right", "CENTRE rate of RIGHT"),
        ("centre_left", "CENTRE rate of LEFT"),
    )
    for i, (name, meaning) in enumerate(rates):
        yield Register(1 + 2 * i, f"{name}_counts", "counts", f"{meaning}: counts, the rate falls with them",
                       _LEAST_COUNTS)  # fmt: skip
        yield Register(2 + 2 * i, f"{name}_flags", "flags", f"{meaning}: enable, direction, postscaler",
                       highest=0xFF03)  # fmt: skip
    frequencies = (
        (0x11, "move_up", "MOVE speed of UP and DOWN"),
        (0x12, "move_right", "MOVE speed of RIGHT"),
        (0x13, "move_left", "MOVE speed of LEFT"),
        (0x14, "slew_up", "SLEW speed of UP and DOWN"),
        (0x15, "slew_right", "SLEW speed of RIGHT and LEFT"),
    )
    for address, name, meaning in frequencies:
        yield Register(address, name, "frequency", meaning, 1)
    yield Register(0x16, "max_accel_ra", "acceleration", "acceleration of axis 1", 1)
    yield Register(0x17, "max_accel_dec", "acceleration", "acceleration of axis 2", 1)
    yield Register(0x18, "reserved", "reserved", "reserved")
    yield Register(0x19, "ra_backlash", "steps", "steps by which axis 1 takes up its backlash; 0: it does not")
    yield Register(0x1A, "dec_backlash", "steps", "steps by which axis 2 takes up its backlash; 0: it does not")
    yield Register(CRC, "crc", "crc", "check word of the registers")
    yield Register(VERSION, "version", "version", "firmware, two digits and two decimals")


REGISTERS = tuple(_table())
BY_ADDRESS = {register.address: register for register in REGISTERS}
BY_NAME = {register.name: register for register in REGISTERS}
DIRECTION_BITS = {"override": 0x1, "ra_sense": 0x2, "dec_sense": 0x4}


class Flags(NamedTuple):
    """The flags of a rate."""

    enable: bool
    positive: bool
    postscaler: int

    @classmethod
    def of(cls, word: int) -> "Flags":
        """From the word; inverse of `word`."""
        return cls(bool(word & 1), bool(word & 2), word >> 8)

    @property
    def word(self) -> int:
        """As the register holds it."""
        return self.enable | self.positive << 1 | self.postscaler << 8

    def __str__(self) -> str:
        """As a person reads it."""
        return (
            f"{'enabled' if self.enable else 'off'}, {'positive' if self.positive else 'negative'}, "
            f"postscaler {self.postscaler}"
        )


def by_name(name: str) -> Register:
    """The register of a name, or of an address as the manual writes it, `0B`.

    Raises
    ------
    AwrError
        There is none; says which there are.
    """
    if name in BY_NAME:
        return BY_NAME[name]
    digits = name.removeprefix("0x")
    if not digits or set(digits.upper()) - set("0123456789ABCDEF"):
        raise AwrError(f"no register {name!r}; there are {', '.join(BY_NAME)}, or addresses, 00 to 1A, 3F and FF")
    if digits.upper() != digits:
        raise AwrError(f"register {name}: hexadecimal digits are upper case here, {digits.upper()}")
    return _at(int(digits, 16), name)


def _at(address: int, name: str) -> Register:
    """The register at an address, written so by a person."""
    if len(name) == 2 and address in BY_ADDRESS:
        return BY_ADDRESS[address]
    plain = address & ~RAM
    if address in NEVER_WRITTEN:
        raise AwrError(f"{name} is never written: it is {BY_ADDRESS[plain].meaning}; {_WRITABLE}")
    if plain in BY_ADDRESS and plain != address:
        raise AwrError(f"register {name}: that is {plain:02X} with bit 7, which is added by itself; give {plain:02X}")
    raise AwrError(
        f"no register {name}: two digits as the manual has them, 00 to 1A, 3F or FF; `drive show` lists them all"
    )


_WRITABLE = "what may be written are 00 to 17, 19 and 1A"


def checked(register: Register, value: int) -> int:
    """A value that may be written.

    Raises
    ------
    AwrError
        It may not: this register never, or not this value.
    """
    if not register.writable:
        raise AwrError(f"{register.name} ({register.address:02X}) is never written: {register.meaning}; {_WRITABLE}")
    if not register.lowest <= value <= register.highest:
        raise AwrError(
            f"{register.name} ({register.address:02X}) = {value}: give {register.lowest} to {register.highest}"
        )
    return value


def value_of(text: str) -> int:
    """The number that a person wrote: decimal, or four hexadecimal digits of the manual behind `0x`.

    Raises
    ------
    AwrError
        It is none; lower-case digits are refused, as the unit discards them.
    """
    digits = text.strip()
    try:
        number = int(digits, 16 if digits.startswith("0x") else 10)
    except ValueError:
        raise AwrError(f"{text!r}: give a whole number, or hexadecimal digits as 0x1A2B") from None
    if digits[2:].upper() != digits[2:]:
        raise AwrError(f"{text}: hexadecimal digits are upper case here, 0x{digits[2:].upper()}")
    return number


def shown(register: Register, value: int) -> str:
    """A value as a person reads it."""
    if register.kind == "flags":
        return f"0x{value:04X}: {Flags.of(value)}"
    if register.kind == "bits":
        names = [name for name, bit in DIRECTION_BITS.items() if value & bit]
        return f"0x{value:04X}: {', '.join(names) or 'none'}"
    if register.kind == "version":
        return str(version_of(value))
    return f"0x{value:04X}" if register.kind in {"crc", "reserved"} else str(value)


class Version(NamedTuple):
    """Firmware: two decimal digits, two decimals."""

    major: int
    minor: int

    def __str__(self) -> str:
        """As the manual writes it."""
        return f"{self.major}.{self.minor:02d}"


def version_of(word: int) -> Version:
    """What the VERSION register says; its digits are decimal.

    Raises
    ------
    AwrError
        They are not.
    """
    digits = f"{word:04X}"
    if not digits.isdecimal():
        raise AwrError(
            f"the VERSION register reads {digits}, which is no firmware version DD.DD: check that this is an AWR "
            "Microstep, 9600 baud, 8N1, and read it again"
        )
    return Version(int(digits[:2]), int(digits[2:]))


EARLIEST, SURE, LATEST = Version(0, 54), Version(0, 59), Version(0, 77)
"""The postscaler is as it is now; packets, which came between the two, are there for sure; the last described."""
WITH_BACKLASH, WITH_STATUS, WITH_LINES = Version(0, 59), Version(0, 72), Version(0, 77)


def supported(version: Version) -> str:
    """What a person should know of a firmware; empty where it is one of those that the manual knows.

    Raises
    ------
    AwrError
        It is too old: its postscaler is another, and it says nothing in packets.
    """
    if version < EARLIEST:
        raise AwrError(
            f"firmware {version} is older than the packets and the postscaler of today; {SURE} or later is "
            "needed: ask AWR for a new chip"
        )
    if version < SURE:
        return (
            f"firmware {version} is older than {SURE}, the first that the manual surely describes; it is driven as "
            "it answers in packets"
        )
    if version > LATEST:
        return f"firmware {version} is newer than {LATEST}, the last that the manual describes; it is taken for that"
    return ""
