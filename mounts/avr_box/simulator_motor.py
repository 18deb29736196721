"""The motors of the simulated box, driven step by step by its timers, in whole cycles of the crystal.

The stepping is run as the firmware runs it: a counter goes up and down through the table, entry by entry. Steps of
one entry are taken together, which changes nothing and saves time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

_LOW_COUNTS = 1024  # below this step count the low gear runs
_SHARED = 16
_LAST_ENTRY = 1023


@dataclass
class Slew:
    """A slew under way: the firmware's `step_max`, its up/down counter, and how long the present step has run."""

    step_max: int
    direction: int
    slowed: int = 1  # a quarter of the speed: prescalers times 4
    counter: int = 0
    down: bool = False
    run: int = 0  # cycles of the present step that have passed


class Motor:
    """One motor.

    Parameters
    ----------
    table : sequence of int
        The Slew Table.
    low, high : int
        Prescalers of the low and the high gear.
    position : int
        Microsteps at which it stands.
    more : int
        Timer clocks of half a step beyond the byte of the table.
    """

    def __init__(self, table: Sequence[int], low: int, high: int, position: int = 0, more: int = 1) -> None:
        self._clocks = [byte + more for byte in table]
        self._low, self._high = low, high
        self.position = position
        self.made_at_speed = 0  # steps of the high gear, signed: of those each way some may have been lost
        self.slew: Slew | None = None

    def begin(self, step_max: int, direction: int, slowed: int = 1) -> None:
        """Begin a slew, whatever was under way."""
        self.slew = Slew(step_max, direction, slowed) if step_max else None

    def run(self, cycles: int) -> int:
        """Slew for at most so many crystal cycles; return those that are left when the slew ends before."""
        while self.slew is not None:
            slew = self.slew
            # Going up the step under way leads from `counter`, going down to the count below it.
            index = slew.counter - 1 if slew.down else slew.counter
            each, alike = self._step(slew, index)
            steps = min((slew.run + cycles) // each, alike)
            if steps == 0:
                slew.run += cycles
                return 0
            cycles -= steps * each - slew.run
            slew.run = 0
            self._made(slew, steps, fast=index >= _LOW_COUNTS)
        return cycles

    def _step(self, slew: Slew, index: int) -> tuple[int, int]:
        """Cycles of the step at an index, and how many steps from there on are alike."""
        if index < _LOW_COUNTS:
            return 2 * self._low * slew.slowed * self._clocks[index], 1
        entry = min(index // _SHARED, _LAST_ENTRY)
        each = 2 * self._high * slew.slowed * self._clocks[entry]
        first = entry * _SHARED
        if slew.down:
            return each, index - first + 1
        end = slew.step_max if entry == _LAST_ENTRY else min(first + _SHARED, slew.step_max)
        return each, end - index

    def _made(self, slew: Slew, steps: int, *, fast: bool) -> None:
        self.position += slew.direction * steps
        if fast:
            self.made_at_speed += slew.direction * steps
        slew.counter += -steps if slew.down else steps
        if not slew.down and slew.counter == slew.step_max:
            slew.down = True
        elif slew.down and slew.counter == 0:
            self.slew = None
