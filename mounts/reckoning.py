"""Where an axis is that cannot be asked: by all that it was told since it was last known, and how surely.

An axis goes on at a *rate*, which changes at known times, and makes *motions* of known course, some of which take the
motor from the rate while they last. Each adds its own uncertainty, and the rate one that grows with the way: the
drive's clock is not the host's.
"""

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple


class Reckoned(NamedTuple):
    """An axis at a time."""

    counts: float
    rate: float  # counts per second
    uncertainty: float  # counts
    moving: bool  # a motion is under way


@dataclass(frozen=True)
class Motion:
    """A motion of known course.

    Parameters
    ----------
    begin, duration : float
        POSIX seconds, seconds.
    made : callable
        Counts made, signed, so many seconds after the beginning; from `duration` on all of them.
    suspends : bool
        Whether the rate rests meanwhile.
    uncertainty : float
        Counts, once it is done.
    """

    begin: float
    duration: float
    made: Callable[[float], float]
    suspends: bool = True
    uncertainty: float = 0.0

    @property
    def end(self) -> float:
        """POSIX seconds."""
        return self.begin + self.duration


class Reckoning:
    """One axis.

    Parameters
    ----------
    counts, time : float
        Where it is, and when, POSIX seconds.
    uncertainty : float
        By how much that may be off, counts.
    rate : float
        With which it goes on, counts per second.
    rate_uncertainty : float
        By which fraction of its way at the rate that may be off.
    """

    def __init__(
        self, counts: float, time: float, uncertainty: float = 0.0, rate: float = 0.0, rate_uncertainty: float = 0.0
    ) -> None:
        self.rate_uncertainty = rate_uncertainty
        self._counts, self._time, self._uncertainty = counts, time, uncertainty
        self._times, self._rates = [-math.inf], [rate]
        self._motions: list[Motion] = []

    def at(self, time: float) -> Reckoned:
        """Where it is at a time not before that at which it was last known."""
        way = self.way(self._time, time)
        counts, uncertainty, moving, suspended = self._counts + way, self._uncertainty, False, False
        for motion in self._motions:
            if time <= motion.begin:
                continue
            begun = motion.duration if time >= motion.end else time - motion.begin
            counts += motion.made(begun)
            if motion.suspends:
                counts -= self.way(motion.begin, motion.begin + begun)
            uncertainty += motion.uncertainty
            under_way = time < motion.end
            moving, suspended = moving or under_way, suspended or (under_way and motion.suspends)
        rate = 0.0 if suspended else self._rates[bisect_right(self._times, time) - 1]
        rate += sum(_speed(motion, time) for motion in self._motions if motion.begin < time < motion.end)
        return Reckoned(counts, rate, uncertainty + abs(way) * self.rate_uncertainty, moving)

    def way(self, begin: float, end: float) -> float:
        """Counts that the rate makes from one time to another, without motions."""
        if end <= begin:
            return -self.way(end, begin) if end < begin else 0.0
        way, here = 0.0, begin
        index = bisect_right(self._times, begin) - 1
        while here < end:
            until = min(end, self._times[index + 1]) if index + 1 < len(self._times) else end
            way += self._rates[index] * (until - here)
            here, index = until, index + 1
        return way

    def goes_on(self, rate: float, time: float) -> None:
        """From `time` on it goes on at another rate; what was said of later times is void."""
        index = bisect_right(self._times, time)
        if self._times[index - 1] == time:
            index -= 1
        self._times[index:], self._rates[index:] = [time], [rate]

    def moves(self, motion: Motion) -> None:
        """A motion begins; what was settled before it is put together."""
        self._settle(motion.begin)
        self._motions.append(motion)

    def known(self, counts: float, time: float, uncertainty: float) -> None:
        """It is known where it is; motions under way go on from there."""
        state = self.at(time)
        self._counts += counts - state.counts
        self._uncertainty += uncertainty - state.uncertainty

    def halted(self, counts: float, time: float, uncertainty: float) -> None:
        """Every motion is over, as planned or not, and it is known where it is."""
        self._motions.clear()
        self._counts, self._time, self._uncertainty = counts, time, uncertainty

    @property
    def ends(self) -> float:
        """When the last motion ends, POSIX seconds; minus infinity where there is none."""
        return max((motion.end for motion in self._motions), default=-math.inf)

    def _settle(self, time: float) -> None:
        """Put together all up to a time, when no motion is under way."""
        if time <= self._time or any(motion.end > time for motion in self._motions):
            return
        state = self.at(time)
        self._counts, self._time, self._uncertainty = state.counts, time, state.uncertainty
        self._motions.clear()
        first = bisect_right(self._times, time) - 1
        self._times, self._rates = [-math.inf, *self._times[first + 1 :]], self._rates[first:]


_MOMENT = 1e-3


def _speed(motion: Motion, time: float) -> float:
    elapsed = time - motion.begin
    before, after = max(0.0, elapsed - _MOMENT), min(motion.duration, elapsed + _MOMENT)
    return (motion.made(after) - motion.made(before)) / (after - before)
