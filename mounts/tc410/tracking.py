"""Tracking one axis to a fraction of a count through a drive that reports whole counts.

The velocity register is exact, so between two commands the 48-bit position is known by dead reckoning. A reported
count c only says that the position lies in [c, c + 1); many of them, at many phases of the motion, leave a narrow
interval in which it must lie. The dead reckoning is moved only when it leaves that interval: a single count is never
fed back. The velocity chosen each time brings it onto the path; its rounding stays in the dead reckoning, which
dithers neighbouring register values by itself.
"""

import math
from dataclasses import dataclass

from mounts.tc410.interval import Interval
from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import FRACTION_BITS, STEPS_PER_TICK, TICK_S, LandingLaw

_COUNT = float(1 << FRACTION_BITS)
_CLOCK_ERROR = 1.5e-4  # by which the unit's clock and the host's may run differently
_JITTER_S = 0.0005  # of the time of a position, besides what the link shows
_DISTURBED = 1.0  # counts beyond the interval at which something else moved the axis
_UNSEEN_S = 5.0  # without an observation, after which only the next one counts
_LEAST_WIDTH = 0.01  # counts
_RAMPED = 0.95  # of the time to the next command that a change of velocity may take


@dataclass(frozen=True)
class Pace:
    """How often an axis is commanded, and how it closes an error.

    Attributes
    ----------
    period_s : float
        Seconds to the next command.
    beat_s : float
        Seconds over which an error on the path is closed.
    catch_up : float
        Counts per second beyond the path's own rate, at most, while it is.
    """

    period_s: float
    beat_s: float
    catch_up: float


class TrackedAxis:
    """The dead reckoning of one axis while tracking.

    Parameters
    ----------
    position : float
        Counts, with their fraction.
    time : float
        POSIX seconds at which the axis is there.
    velocity : int
        The tracking velocity in force, register units.
    law : LandingLaw
        The ramps by which the drive changes its velocity.
    below, above : float
        By how many counts the axis may be below or above `position`.
    """

    def __init__(
        self, position: float, time: float, velocity: int, law: LandingLaw, below: float = 0.5, above: float = 0.5
    ) -> None:
        self.position = position
        self.time = time
        self.velocity = velocity
        self.below = below
        self.above = above
        self.corrected = 0.0
        """Counts by which observations have moved the dead reckoning."""
        self.disturbed = False
        """Whether an observation contradicted it."""
        self.since = -math.inf
        """POSIX seconds before which what is observed says nothing of it."""
        self._doubt: tuple[float, int, int] | None = None
        self._law = law

    @property
    def rate(self) -> float:
        """Counts per second."""
        return self.velocity * COUNTS_PER_SECOND

    @property
    def doubtful(self) -> bool:
        """Whether the last command may not have reached the drive."""
        return self._doubt is not None

    @property
    def margin(self) -> float:
        """Counts by which the position may be off, either way."""
        return max(self.below, self.above)

    def margin_at(self, time: float) -> float:
        """Counts by which the position may be off at a later time, either way."""
        slower, faster = self._led(time)
        return max(self.below + slower, self.above + faster)

    def at(self, time: float) -> float:
        """Position in counts at a time, if nothing is commanded."""
        return self.position + self.rate * (time - self.time)

    def expects(self, counts: float, time: float) -> bool:
        """Whether a count reported at a time agrees with the dead reckoning."""
        slack = self.margin_at(time) + abs(self.rate) * _CLOCK_ERROR * abs(time - self.time) + _DISTURBED
        return abs(counts + 0.5 - self.at(time)) <= slack + 0.5

    def observe(self, counts: float, time: float, late_s: float = 0.0) -> float:
        """Take a count reported between `time` and `time` + `late_s`; return by how many counts this moved it."""
        if time < self.since:
            return 0.0
        expected = self.at(time)
        self._doubted(time)
        self._widen(abs(self.rate) * _CLOCK_ERROR * abs(time - self.time))
        blur = abs(self.rate) * _JITTER_S
        lowest = counts - blur - max(0.0, self.rate * late_s)
        highest = counts + 1.0 + blur - min(0.0, self.rate * late_s)
        low, high = max(lowest, expected - self.below), min(highest, expected + self.above)
        if low > high:  # what was known is wrong: only the reading counts
            self.disturbed |= low - high > _DISTURBED
            low, high = lowest, highest
        elif time - self.time > _UNSEEN_S:  # it may have stood still for a moment
            low, high = lowest, highest
        position = Interval(low, high).nearest(expected)
        self.position, self.time = position, time
        self.below = max(position - low, _LEAST_WIDTH)
        self.above = max(high - position, _LEAST_WIDTH)
        self.corrected += position - expected
        return position - expected

    def _widen(self, counts: float) -> None:
        self.below += counts
        self.above += counts

    def attempt(self, velocity: int, time: float) -> None:
        """Note that the drive may be told another velocity from `time` on, until `command` says that it was."""
        since, lowest, highest = self._doubt or (time, self.velocity, self.velocity)
        self._doubt = since, min(lowest, velocity), max(highest, velocity)

    def _led(self, time: float) -> tuple[float, float]:
        """Counts by which the velocities that the drive may have had could have led it down, and up, by a time."""
        if self._doubt is None:
            return 0.0, 0.0
        since, lowest, highest = self._doubt
        elapsed = max(0.0, time - since) * COUNTS_PER_SECOND
        return (self.velocity - lowest) * elapsed, (highest - self.velocity) * elapsed

    def _doubted(self, time: float) -> None:
        """Take in what doubt there was until a time."""
        if self._doubt is None:
            return
        slower, faster = self._led(time)
        self.below += slower
        self.above += faster
        since, lowest, highest = self._doubt
        self._doubt = max(time, since), lowest, highest

    def command(self, velocity: int, time: float) -> None:
        """Note that the drive ramps to another velocity from `time` on."""
        self._doubted(time)
        self.position, self.time = self.at(time), time
        change = velocity - self.velocity
        self._widen(abs(change) * COUNTS_PER_SECOND * TICK_S)
        ramp = self._law.ramp(self.velocity, velocity)
        self.position += (ramp.gained - STEPS_PER_TICK * velocity * ramp.ticks) / _COUNT
        self.velocity = velocity
        self._doubt = None

    def velocity_for(self, here: float, ahead: float, time: float, pace: Pace) -> int:
        """Velocity register that leads the axis along its path until the next command.

        It is the path's own mean rate until then, and what closes the error over a beat; a change that the ramps
        do not complete until then is not asked for.

        Parameters
        ----------
        here, ahead : float
            Where the path is at `time`, and a period later, counts.
        time : float
            When the velocity will take effect.
        pace : Pace
            The period, and how errors are closed.
        """
        feed, error = (ahead - here) / pace.period_s, (here - self.at(time)) / pace.beat_s
        mean = feed + min(max(error, -pace.catch_up), pace.catch_up)
        step = self._step(mean - self.rate, pace.period_s)
        bounded = min(max(self.rate + step, feed - pace.catch_up), feed + pace.catch_up)
        rate = self.rate + math.copysign(min(abs(bounded - self.rate), abs(step)), step)
        wanted = round(rate / COUNTS_PER_SECOND)
        return min(max(wanted, -self._law.max_velocity), self._law.max_velocity)

    def _step(self, mean: float, period: float) -> float:
        """Change of velocity, counts per second, whose mean over the period is `mean`, its ramp included.

        Of a step Δ that is ramped by a, the period gains Δ p − Δ²/2a.
        """
        ramp = min(self._law.acceleration, self._law.deceleration) * COUNTS_PER_SECOND / TICK_S
        reach = _RAMPED * period
        ahead = period * period - 2.0 * abs(mean) * period / ramp
        seconds = reach if ahead <= 0.0 else min(reach, period - math.sqrt(ahead))
        return math.copysign(ramp * seconds, mean)
