"""Ending moves that nobody asked for: a move of 5′ begins anew and so ends the one under way (A).

The letter may be lost as well, so it is seen whether the axis slows down, and it is sent again where it does not.
"""

from collections.abc import Sequence
from typing import NamedTuple

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.encoders import Encoder

AGAIN_S = 0.3  # between two looks at an axis that is astray: at full speed it makes 4 counts
RUNS_COUNTS = 2.5  # beyond what was asked of it, between them
BOUND_COUNTS = 2.0  # where an axis may be off that is reckoned within a count of what its encoder says, to a count
_ENDINGS = 4  # commands to end a runaway, should some be lost


class Runaway(NamedTuple):
    """An axis that runs where it was not sent."""

    axis: BoxAxis
    encoder: Encoder
    rising: bool  # the way its counts go

    @property
    def ending(self) -> bytes:
        """The move of 5′ against it."""
        falls = self.rising is (self.axis.sign > 0)  # what ends it goes to smaller angles
        return commands.LETTERS[self.axis.index][falls is self.axis.north_falls]

    def stands(self, first: Told, second: Told) -> bool:
        """Whether it did no more than it does by itself between two looks."""
        made = (second.pair[self.axis.index] - first.pair[self.axis.index]) * self.encoder.steps_per_count
        by_itself = self.axis.own_rate * (second.middle - first.middle)
        return abs(made - by_itself) <= RUNS_COUNTS * self.encoder.step


def end(box: Box, running: Sequence[Runaway]) -> list[Runaway]:
    """End them all at once; return those that run on. Those that stand are where their encoders say.

    Raises
    ------
    TransportError, DriveRefused
        The box does not answer any more, or must not be asked.
    """
    left, slowed, until = list(running), list[Runaway](), 0.0
    for _ in range(_ENDINGS):
        until = max(_told(box, each) for each in left)
        first, second = _looks(box)
        slowed += [each for each in left if each.stands(first, second)]  # a move of 5′ begins slowly
        left = [each for each in left if not each.stands(first, second)]
        if not left:
            break
    box.pause(until + AGAIN_S)
    return left + running_on(box, slowed)


def break_off(box: Box, axis: BoxAxis, encoder: Encoder) -> None:
    """End the move under way of an axis that no encoder sees: nobody can look whether it did."""
    if not axis.begun(box.now()):
        return
    rising = axis.at(box.now()).rate > 0.0
    begin = box.send(Runaway(axis, encoder, rising).ending)
    state = axis.at(begin)
    axis.halted(state.counts, begin, state.uncertainty)
    axis.moved(commands.FIVE_ARCMIN[axis.index], -1 if rising else 1, begin)


def running_on(box: Box, running: Sequence[Runaway]) -> list[Runaway]:
    """Look which of them still run; those that stand are where their encoders say.

    Raises
    ------
    TransportError, DriveRefused
        As `end`.
    """
    left, (first, second) = [], _looks(box)
    for each in running:
        if each.stands(first, second):
            tied = each.encoder.zero is not None  # else it was never known where it is
            here = each.encoder.steps(second.pair[each.axis.index]) if tied else each.axis.at(second.middle).counts
            each.axis.halted(here, second.middle, BOUND_COUNTS * each.encoder.step)
        else:
            left.append(each)
    return left


def _told(box: Box, running: Runaway) -> float:
    """Send a move of 5′; return when that is over, POSIX seconds."""
    begin = box.send(running.ending)
    running.axis.unproved = True
    return begin + running.axis.duration(commands.FIVE_ARCMIN[running.axis.index])


def _looks(box: Box) -> tuple[Told, Told]:
    first = box.ask(commands.ASK_ENCODERS)
    box.pause(first.latest + AGAIN_S)
    return first, box.ask(commands.ASK_ENCODERS)
