"""From a slew that has ended to tracking: the moment it landed, found to milliseconds.

The flags show the landing only between two polls. From then on the axis moves at its known tracking rate, so where
it is found tells when it set off: a count of 16 a second, narrowed by every further reading, is far finer.
"""

from dataclasses import dataclass

from mounts.tc410.interval import Interval
from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import TICK_S
from mounts.tc410.slew_watch import AxisWatch, SlewWatch
from mounts.tc410.tracking import TrackedAxis

_TELLING_RATE = 1.0  # counts/s; slower axes say too little of the time
_WATCHED_S = 2.0  # a landing that the flags do not show within this could be that of either axis
_SETTLED_S = 8.0  # of tracking, after which the landing is known as well as it will be


@dataclass
class Landing:
    """Both axes just after a slew, tracking again.

    Attributes
    ----------
    watch : SlewWatch
        The slew.
    landings : tuple of Interval
        Seconds from its start between which each axis landed, by the flags.
    supposed : tuple of float
        Seconds from its start after which each axis is supposed to have taken up tracking.
    together : bool
        Whether tracking resumed on both axes at the later landing.
    tracked : tuple of TrackedAxis, optional
        The dead reckoning since then; None when the drive does not track.
    """

    watch: SlewWatch
    landings: tuple[Interval, Interval]
    supposed: tuple[float, float]
    together: bool
    tracked: tuple[TrackedAxis, TrackedAxis] | None

    @classmethod
    def of(cls, watch: SlewWatch, *, tracking: bool, together: bool) -> "Landing":
        """Take over a slew that is over; `together` when tracking resumes on both axes at the later landing."""
        one, two = (_bounded(axis) for axis in watch.axes)
        both = Interval(max(one.low, two.low), max(one.high, two.high))
        since = (both, both) if together else (one, two)
        durations = [axis.travel.duration for axis in watch.axes]
        expected = [max(durations)] * 2 if together else durations
        supposed = since[0].nearest(expected[0]), since[1].nearest(expected[1])
        tracked = None
        if tracking:
            tracked = (
                _tracked(watch.axes[0], since[0], supposed[0]),
                _tracked(watch.axes[1], since[1], supposed[1]),
            )
        return cls(watch, (one, two), supposed, together, tracked)

    def is_settled(self, time: float) -> bool:
        """Whether nothing more can be learnt by waiting."""
        return self.tracked is None or time > self.watch.axes[0].began + max(self.supposed) + _SETTLED_S

    def found(self) -> tuple[Interval, Interval] | None:
        """Seconds from the start between which each axis landed; None when something disturbed it."""
        if self.tracked is None:
            return self.landings
        if any(axis.disturbed for axis in self.tracked):
            return None
        found = list(self.landings)
        for i, axis in enumerate(self.tracked):
            rate = self.watch.axes[i].rate_after
            if abs(rate) < _TELLING_RATE:
                continue
            late = sorted((-(axis.corrected - axis.below) / rate, -(axis.corrected + axis.above) / rate))
            supposed = self.supposed[i]
            landed = self._later() if self.together else i
            if found[landed].high - found[landed].low > _WATCHED_S:
                continue
            common = Interval(supposed + late[0] - TICK_S, supposed + late[1] + TICK_S).within(found[landed])
            if common is None:
                return None
            found[landed] = common
        return found[0], found[1]

    def _later(self) -> int:
        """The axis whose landing ended the slew."""
        one, two = (axis.travel.duration for axis in self.watch.axes)
        overlap = self.landings[0].within(self.landings[1])
        if overlap is None:
            return 0 if self.landings[0].low > self.landings[1].low else 1
        return 0 if one >= two else 1


def _bounded(axis: AxisWatch) -> Interval:
    low, high = axis.landing
    return Interval(low, high) if high >= low else Interval(high, high)


def _tracked(axis: AxisWatch, since: Interval, supposed: float) -> TrackedAxis:
    """Track from the moment at which the axis is supposed to have landed."""
    late, early = axis.rate_after * (since.high - supposed), axis.rate_after * (supposed - since.low)
    below, above = (late, early) if axis.rate_after > 0.0 else (-early, -late)
    tracked = TrackedAxis(axis.target, axis.began + supposed, 0, axis.model.law, below, above)
    tracked.command(round(axis.rate_after / COUNTS_PER_SECOND), tracked.time)
    tracked.since = axis.began + since.high
    return tracked
