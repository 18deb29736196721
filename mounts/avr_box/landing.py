"""The last piece of a slew: which move, begun when, ends nearest to the aim.

A move is an even number of microsteps, and a tracking axis loses the microstep that it interrupts. So a move that
begins earlier by a part of a microstep of tracking can end on an odd place as well. What tracks stands on each
microstep until the next, half of one behind its even way on the average: so it is to land half of one ahead. Of the
moves that have it within a microstep of its way when both axes have landed, that one is the best which comes nearest.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

_PARTS = (0.0, 0.5, 1.0)  # of the time in which it is on one place on arrival, less its edges
_EDGE = 0.04  # microsteps: a rate that changes within one, as guiding begins and ends, moves its end by up to 0.018
_ROUNDS = 6
_APART = 8  # half microsteps over which it is looked how far a longer move leads
_LEAST_SLOPE = 0.3  # microsteps a half; a move that is as slow as tracking leads no farther
_NEAR = range(-2, 3)  # half microsteps to either side that are tried
_WITHIN = 0.95  # microsteps from its way on arrival


class Lands(Protocol):
    """An axis of the box."""

    index: int
    sign: int

    @property
    def own_rate(self) -> float:
        """Counts per second that it makes when nothing is asked of it."""
        ...

    def duration(self, half: int) -> float:
        """Seconds of a move of twice `half` microsteps."""
        ...

    def starts_from(self, time: float) -> float:
        """Where a move that begins then begins, counts."""
        ...

    def part_made(self, time: float) -> float:
        """What part of a microstep of tracking is under way then."""
        ...

    def tracks(self, begin: float, end: float) -> float:
        """Counts that tracking makes from one time to another, guided where it is; below 0 where `end` is before."""
        ...


@dataclass(frozen=True)
class Aim:
    """Where an axis is to be at a time, and go on from as it tracks then."""

    counts: float
    time: float  # POSIX seconds
    arrival: float  # when both axes are to have landed, POSIX seconds


@dataclass(frozen=True)
class Landing:
    """A move that ends near to an aim: half of its microsteps, signed, and when it begins, POSIX seconds."""

    half: int
    begin: float
    off: float  # microsteps from half of one ahead where it tracks, from its aim where it does not
    off_on_arrival: float  # microsteps from its way when both axes have landed


def best(axis: Lands, aim: Aim, earliest: float, planned: int, allowed: Callable[[int], bool]) -> Landing | None:
    """The best of `landings`; None where there is none."""
    found = landings(axis, aim, earliest, planned, allowed)
    return min(found, key=lambda each: (max(each.off_on_arrival, _WITHIN), abs(each.off)), default=None)


def landings(
    axis: Lands, aim: Aim, earliest: float, planned: int, allowed: Callable[[int], bool]
) -> Iterator[Landing]:
    """All moves that may be made and end about the aim's time, not after it but where `earliest` is too late."""
    step = 1.0 / abs(axis.own_rate) if axis.own_rate else 0.0
    middle = 0.5 * axis.sign if step else 0.0
    tried = {near + more for near in (planned, solved(axis, aim, earliest, planned)) for more in _NEAR}
    for half in filter(allowed, sorted(tried)):
        for early in _phases(axis, aim, _begin(axis, aim, earliest, 0.0, half), half):
            begin = _begin(axis, aim, earliest, early * step, half)
            off, end = _off(axis, aim, begin, half), begin + axis.duration(abs(half))
            yield Landing(half, begin, off - middle, _later_off(axis, off, end, aim.arrival))


def _phases(axis: Lands, aim: Aim, begin: float, half: int) -> Iterator[float]:
    """Parts of a microstep of tracking by which a move may begin earlier: each has it elsewhere on arrival.

    It then interrupts the microstep before, or one more is made after it until the arrival.
    """
    if not axis.own_rate:
        yield 0.0
        return
    after = axis.sign * axis.tracks(begin + axis.duration(abs(half)), aim.arrival)
    bounds = sorted((0.0, axis.part_made(begin), 1.0 - after % 1.0, 1.0))
    for first, last in pairwise(bounds):
        if (wide := last - first - 2.0 * _EDGE) > 0.0:
            yield from (first + _EDGE + wide * part for part in _PARTS)


def _begin(axis: Lands, aim: Aim, earliest: float, early: float, half: int) -> float:
    latest = aim.time - axis.duration(abs(half))
    step = 1.0 / abs(axis.own_rate) if axis.own_rate else 0.0
    return max(latest, earliest + step) - early  # one that cannot begin in time has all phases, too


def solved(axis: Lands, aim: Aim, earliest: float, planned: int) -> int:
    """Half of the microsteps of the move that comes nearest; a longer one leaves less time for tracking."""
    half = planned
    for _ in range(_ROUNDS):
        here, more = (_off(axis, aim, _begin(axis, aim, earliest, 0.0, each), each) for each in (half, half + _APART))
        slope = (more - here) / _APART
        if abs(slope) < _LEAST_SLOPE:
            break
        half -= round(here / slope)
    return half


def _off(axis: Lands, aim: Aim, begin: float, half: int) -> float:
    """Microsteps by which a move ends beyond where it should."""
    end = begin + axis.duration(abs(half))
    return axis.starts_from(begin) + 2 * half - aim.counts - axis.tracks(aim.time, end)


def _later_off(axis: Lands, off: float, end: float, arrival: float) -> float:
    """Microsteps from its way on arrival, of a move that ended before: it makes whole ones."""
    made = axis.sign * axis.tracks(end, max(end, arrival))
    return abs(off + axis.sign * (math.floor(made) - made))
