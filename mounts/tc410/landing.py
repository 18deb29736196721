"""From a slew that has ended to tracking: the moment it landed, found to milliseconds.

The flags show the landing only between two polls. From then on the axis moves at its known tracking rate, so where
it is found tells when it set off: a count of 16 a second, narrowed by every further reading, is far finer.
"""

from dataclasses import dataclass

from mounts.tc410.calibration import Interval
from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import TICK_S
from mounts.tc410.slew_watch import AxisWatch, SlewWatch
from mounts.tc410.tracking import TrackedAxis

_TELLING_RATE = 1.0  # counts/s; slower axes say too little of the time
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
    since : tuple of Interval
        The same for the moment each axis took up tracking.
    tracked : tuple of TrackedAxis, optional
        The dead reckoning since then; None when the drive does not track.
    """

    watch: SlewWatch
    landings: tuple[Interval, Interval]
    since: tuple[Interval, Interval]
    tracked: tuple[TrackedAxis, TrackedAxis] | None

    @classmethod
    def of(cls, watch: SlewWatch, *, tracking: bool, together: bool) -> "Landing":
        """Take over a slew that is over; `together` when tracking resumes on both axes at the later landing."""
        one, two = (_bounded(axis) for axis in watch.axes)
        both = Interval(max(one.low, two.low), max(one.high, two.high))
        since = (both, both) if together else (one, two)
        tracked = None
        if tracking:
            tracked = _tracked(watch.axes[0], since[0]), _tracked(watch.axes[1], since[1])
        return cls(watch, (one, two), since, tracked)

    def is_settled(self, time: float) -> bool:
        """Whether nothing more can be learnt by waiting."""
        return self.tracked is None or time > self.watch.axes[0].began + self.since[0].high + _SETTLED_S

    def found(self) -> tuple[Interval, Interval] | None:
        """Seconds from the start between which each axis landed; None when something disturbed it."""
        if self.tracked is None:
            return self.landings
        if any(axis.disturbed for axis in self.tracked):
            return None
        found = list(self.landings)
        for i, (axis, since) in enumerate(zip(self.tracked, self.since, strict=True)):
            rate = self.watch.axes[i].rate_after
            if abs(rate) < _TELLING_RATE:
                continue
            middle = (since.low + since.high) / 2.0 - axis.corrected / rate
            width = axis.margin / abs(rate) + TICK_S
            later = self._later() if self.since[0] == self.since[1] else i
            common = Interval(middle - width, middle + width).within(found[later])
            if common is None:
                return None
            found[later] = common
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


def _tracked(axis: AxisWatch, since: Interval) -> TrackedAxis:
    """Track from the middle of the time in which the axis landed."""
    ramp = axis.model.acceleration << 8
    middle = axis.began + (since.low + since.high) / 2.0
    tracked = TrackedAxis(axis.target, middle, 0, ramp, 0.0)
    tracked.command(round(axis.rate_after / COUNTS_PER_SECOND), middle)
    tracked.margin += abs(axis.rate_after) * (since.high - since.low) / 2.0
    return tracked
