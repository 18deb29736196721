"""The Slew Table of the box, and how long a slew takes by it (manual, section 8).

The byte of an entry, plus one, is the compare count of a timer. The entry is that of the step counter below 1024
(low gear), else of a sixteenth of it, at most the last one (high gear). The counter runs up to half of the steps and
down again, and the step between k and k + 1 lasts the same both ways.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from pathlib import Path

from mounts.avr_box.timers import CRYSTAL_HZ, SLEW_GEARS, Gears
from mounts.errors import DriveError

ENTRIES = 1024
HIGH_GEAR = 1024  # the step counter from which on the high gear runs
PER_ENTRY = 16  # steps of the high gear that share an entry
FULL_SPEED = ENTRIES * PER_ENTRY
_FASTEST = 15  # the smallest byte at which the manual's motors lose no step


class SlewTableError(DriveError):
    """What was given as a Slew Table is none."""


def standard() -> tuple[int, ...]:
    """The table of a constant acceleration: byte p is 512/√(p + 1) − 1, rounded, at most 255."""
    return tuple(min(255, round(512.0 / math.sqrt(p + 1)) - 1) for p in range(ENTRIES))


def read_slew_table(path: Path | str) -> tuple[int, ...]:
    """Read a table of 1024 bytes, written as numbers parted by commas, blanks or lines, `#` beginning a remark.

    Raises
    ------
    SlewTableError
        It cannot be read, is not of 1024 bytes, or its speeds do not rise along it.
    """
    try:
        text = Path(path).read_text(encoding="ascii")
    except (OSError, UnicodeDecodeError) as error:
        raise SlewTableError(
            f"the slew table {path} cannot be read: {error}; give a text file of 1024 numbers"
        ) from None
    words = " ".join(line.partition("#")[0] for line in text.splitlines()).replace(",", " ").split()
    try:
        table = tuple(int(word, 0) for word in words)
    except ValueError:
        raise SlewTableError(
            f"the slew table {path} has words that are no whole numbers: give 1024, from 0 to 255"
        ) from None
    return checked(table, str(path))


def checked(table: Sequence[int], name: str = "the slew table") -> tuple[int, ...]:
    """Return a table if it can drive a motor.

    Raises
    ------
    SlewTableError
        It is not of 1024 bytes, or its speeds do not rise along it.
    """
    if len(table) != ENTRIES:
        raise SlewTableError(f"{name} has {len(table)} entries; the box's has {ENTRIES}")
    for index, byte in enumerate(table):
        if not 0 <= byte <= 255:
            raise SlewTableError(f"{name}: entry {index} is {byte}; a byte is 0 to 255")
        if index and byte > table[index - 1]:
            raise SlewTableError(
                f"{name}: entry {index} is {byte}, after {table[index - 1]}; entries fall, as a slew only gets faster"
            )
    if table[-1] < 1:
        raise SlewTableError(
            f"{name} ends at {table[-1]}, which no motor follows; the standard one ends at {_FASTEST}"
        )
    return tuple(table)


@dataclass(frozen=True)
class SlewLaw:
    """How one axis slews.

    Parameters
    ----------
    table : tuple of int
        The box's table.
    gears : Gears
        The prescalers of the axis.
    """

    table: tuple[int, ...]
    gears: Gears
    _up_to: tuple[int, ...] = field(init=False, repr=False, compare=False)  # cycles from 0 to each count

    def __post_init__(self) -> None:
        durations = (self.step_cycles(k) for k in range(FULL_SPEED))
        object.__setattr__(self, "_up_to", (0, *accumulate(durations)))

    def step_cycles(self, count: int) -> int:
        """Crystal cycles of the step between a count and the next."""
        if count < HIGH_GEAR:
            return 2 * self.gears.low * (self.table[count] + 1)
        return 2 * self.gears.high * (self.table[min(count // PER_ENTRY, ENTRIES - 1)] + 1)

    @cached_property
    def fastest(self) -> float:
        """Microsteps a second at full speed."""
        return CRYSTAL_HZ / self.step_cycles(FULL_SPEED)

    def climb_cycles(self, count: int) -> int:
        """Crystal cycles in which the counter runs from 0 up to a count."""
        if count <= FULL_SPEED:
            return self._up_to[count]
        return self._up_to[FULL_SPEED] + (count - FULL_SPEED) * self.step_cycles(FULL_SPEED)

    def climbed(self, cycles: int) -> int:
        """The count that the counter has reached so many crystal cycles after 0: the inverse of `climb_cycles`."""
        if cycles < self._up_to[FULL_SPEED]:
            return bisect_right(self._up_to, cycles) - 1
        return FULL_SPEED + (cycles - self._up_to[FULL_SPEED]) // self.step_cycles(FULL_SPEED)

    def cycles(self, half: int) -> int:
        """Crystal cycles of a slew of twice `half` microsteps."""
        return 2 * self.climb_cycles(half)

    def made(self, half: int, cycles: int) -> int:
        """Microsteps made so many crystal cycles after a slew of twice `half` began."""
        total = self.cycles(half)
        if cycles <= 0:
            return 0
        if cycles >= total:
            return 2 * half
        if 2 * cycles < total:
            return min(self.climbed(cycles), half)
        left = total - cycles
        down = self.climbed(left)
        return 2 * half - down - (self.climb_cycles(down) < left)

    def half_within(self, cycles: int) -> int:
        """The largest half of a slew that ends within so many crystal cycles."""
        return max(0, self.climbed(cycles // 2))


def laws(table: tuple[int, ...]) -> tuple[SlewLaw, SlewLaw]:
    """The laws of both axes by one table."""
    one, two = (SlewLaw(table, gears) for gears in SLEW_GEARS)
    return one, two
