"""The commands of the box: a letter, its argument bytes, and what comes back (manual, section 9).

Nothing is acknowledged, and a command cut short leaves the box waiting for the rest: each goes out in one write.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from mounts.errors import DriveError

Direction = Literal["north", "south", "east", "west"]
BINS = 519
"""Bins of the PEC table, 0 to 518."""
MOST_STEPS = 2**32 - 1
_SIGN = 0x80


class AvrBoxError(DriveError):
    """What was asked for is no command of the box."""


@dataclass(frozen=True)
class Command:
    """One kind of command.

    Parameters
    ----------
    letter : str
        Its byte.
    arguments : int
        Bytes that follow.
    axis : int
        0 or 1 where it moves that axis, whichever byte says so where it is None; -1 where it moves nothing.
    meaning : str
        As people read it.
    answered : bool
        Whether two numbers come back.
    """

    letter: str
    arguments: int
    axis: int | None
    meaning: str
    answered: bool = False


_NOTHING = -1
COMMANDS = {
    command.letter: command
    for command in (
        Command("B", 2, _NOTHING, "set the PEC bin"),
        Command("C", 1, _NOTHING, "set the drive correction flags"),
        Command("D", 0, 1, "one microstep of axis 2"),
        Command("E", 0, 0, "5′ east"),
        Command("M", 5, None, "a number of microsteps of one axis"),
        Command("N", 0, 1, "5′ north"),
        Command("P", 0, _NOTHING, "the PEC bin and the PEC zero", answered=True),
        Command("Q", 0, _NOTHING, "the counts of both encoders", answered=True),
        Command("S", 0, 1, "5′ south"),
        Command("W", 0, 0, "5′ west"),
        Command("Z", 2, _NOTHING, "set the PEC zero"),
        Command("n", 0, 1, "5′ north at a quarter of the speed"),
        Command("s", 0, 1, "5′ south at a quarter of the speed"),
        Command("+", 1, _NOTHING, "axis 1 faster for a number of ticks"),
        Command("-", 1, _NOTHING, "axis 1 slower for a number of ticks"),
        Command("<", 1, 1, "a number of microsteps south"),
        Command(">", 1, 1, "a number of microsteps north"),
    )
}

FIVE_ARCMIN = (2763, 1382)
"""Half of the microsteps of `E` and `W`, and of `N` and `S`: the `step_max` of the firmware."""

FLAGS = {"encoder": 0x01, "ra_guiding": 0x02, "pec": 0x04, "dec_guiding": 0x10}
"""Bits of the argument of `C`."""


FILL = bytes((8, 0, 0, 0, 0))
"""Bytes that are no command, nor a bit from one; they complete `E` that was taken for `M` to 8 microsteps."""
LETTERS = ((b"E", b"W"), (b"S", b"N"))
"""Which turn an axis by that, to smaller and larger angles. `E` alone is a bit from `M`."""


def flags(*names: str) -> bytes:
    """`C` with the flags of these names set, all others cleared."""
    return bytes((ord("C"), sum(FLAGS[name] for name in names)))


def guiding_flags(*, pec: bool) -> bytes:
    """`C` with guiding of both axes on, and the box's own PEC as asked: it cannot be read back."""
    return flags("ra_guiding", "dec_guiding", *(("pec",) if pec else ()))


def move(axis: int, wire_count: int, *, decreasing: bool, axis_bit: int = 1) -> bytes:
    """`M`: move axis 0 or 1 by a count as the box takes it, upward or downward.

    `axis_bit` is the value of bit 1 that means axis 2.

    Raises
    ------
    AvrBoxError
        The count does not fit into 32 bits.
    """
    if not 0 <= wire_count <= MOST_STEPS:
        raise AvrBoxError(f"a move of {wire_count} microsteps: 0 to {MOST_STEPS} go into a command")
    bit = axis_bit if axis == 1 else 1 - axis_bit
    return b"M" + wire_count.to_bytes(4, "little") + bytes(((_SIGN if decreasing else 0) | bit << 1,))


def harmless_below(wire_count: int, step: int = 1) -> int:
    """The largest multiple of `step` up to a count whose bytes are no commands, should the letter before be lost.

    Of the 256 bytes 17 are letters of commands; 0 is none.
    """
    found = wire_count - wire_count % step
    while (at := _highest_letter(found)) is not None:
        found = (found >> 8 * at << 8 * at) - 1  # the byte falls by one, those below it to their largest
        found -= found % step
    return found


def _highest_letter(wire_count: int) -> int | None:
    """Which byte of a count, 3 to 0, is the letter of a command."""
    for at, byte in reversed(tuple(enumerate(wire_count.to_bytes(4, "little")))):
        if chr(byte) in COMMANDS:
            return at
    return None


def rest_of(command: bytes) -> bytes:
    """What is sent after a command, so that no part of it waits for a rest: after `M` its last byte, again."""
    return command[-1:] * 5 if command[:1] == b"M" else FILL


def misread(command: bytes) -> Iterator[tuple[int, int]]:
    """All that a box may take `M` for where one byte of it is lost, doubled, or has one bit otherwise.

    Yields the bit that names the axis, and the count; `rest_of` it follows.
    """
    for at, byte in enumerate(command):
        before, after = command[:at], command[at + 1 :]
        flipped = (bytes((byte ^ 1 << bit,)) for bit in range(8))
        for middle in (b"", bytes((byte, byte)), *flipped):
            heard = (before + middle + after + rest_of(command))[: len(command)]
            if heard[:1] == b"M":
                yield heard[5] >> 1 & 1, int.from_bytes(heard[1:5], "little")


def faster(ticks: int) -> bytes:
    """`+`: axis 1 faster until so many ticks of TIMER1 have passed."""
    return b"+" + _byte("ticks", ticks)


def slower(ticks: int) -> bytes:
    """`-`: axis 1 slower until so many ticks of TIMER1 have passed."""
    return b"-" + _byte("ticks", ticks)


def north(steps: int) -> bytes:
    """`>`: so many microsteps of axis 2 upward."""
    return b">" + _byte("microsteps", steps)


def south(steps: int) -> bytes:
    """`<`: so many microsteps of axis 2 downward."""
    return b"<" + _byte("microsteps", steps)


def set_bin(number: int) -> bytes:
    """`B`: set the PEC bin."""
    return b"B" + _bin(number)


def set_zero(number: int) -> bytes:
    """`Z`: set the PEC bin at which the index pulse finds the worm."""
    return b"Z" + _bin(number)


def harmless_up_to(number: int) -> int:
    """The largest argument byte up to a number of 1 to 255 that is no command, should the letter before be lost."""
    return next(byte for byte in range(number, 0, -1) if chr(byte) not in COMMANDS)


ASK_PEC = b"P"
ASK_ENCODERS = b"Q"


def _byte(name: str, number: int) -> bytes:
    if not 0 <= number <= 255:
        raise AvrBoxError(f"{number} {name}: a command takes 0 to 255")
    return bytes((number,))


def _bin(number: int) -> bytes:
    if not 0 <= number < BINS:
        raise AvrBoxError(f"PEC bin {number}: there are 0 to {BINS - 1}")
    data = number.to_bytes(2, "little")
    if letters := [chr(byte) for byte in data if chr(byte) in COMMANDS]:
        raise AvrBoxError(
            f"PEC bin {number}: its byte is the command {letters[0]!r}, and begins that if the one before is lost; "
            "take a bin beside it"
        )
    return data
