"""Following one target: where both axes must be at any time, and how far they are from it."""

import math
from typing import NamedTuple

from mounts.drive import Reading
from pointing.instant import Instant
from pointing.limits import Check, separation
from pointing.mount import Posture
from pointing.next_limit import DAY_S, forbidden, next_limit
from pointing.plan import AxisState, Leading, Start
from pointing.planner import Planner
from pointing.rotator import Hold, RotatorPath
from pointing.targets import Target
from pointing.trajectory import LED_ABOVE, LED_UNTIL, Trajectory

_LIMIT_AGE_S = 20.0  # after which a limit is looked for again where none was found
_LED_SPAN_S = 3600.0
_ROTATOR_SPAN_S = 21_600.0


class _Foreseen(NamedTuple):
    """The next limit, as found at a time and under circumstances."""

    time: float
    under: tuple[object, ...]
    found: tuple[float, Check] | None

    def holds(self, time: float, under: tuple[object, ...], *, lasts: bool) -> bool:
        """Whether it need not be looked for again; `lasts` where one that was found stays the next one."""
        if time < self.time or under != self.under:
            return False
        if self.found is None or not lasts:
            return time - self.time < _LIMIT_AGE_S
        return time < self.found[0]


class Pursuit:
    """A target being followed in one posture; keeps `mounts.drive.AxisPath`.

    Parameters
    ----------
    planner : Planner
        Sky, mount and gearing.
    target : Target
        What is followed.
    posture : Posture
        The posture to keep.
    near : tuple of float
        Axis angles, radians; windings stay the nearest to where the axes were last asked to be.
    leading : Leading, optional
        What the drive can be led along; without it every target is left to the drive's own tracking.
    trajectory : Trajectory, optional
        The way to the target that has been planned, where the axes are led to it.
    rotator : RotatorPath, optional
        The way of the instrument rotator, of a telescope that has one.
    """

    def __init__(
        self,
        planner: Planner,
        target: Target,
        posture: Posture,
        near: tuple[float, float],
        leading: Leading | None = None,
        trajectory: Trajectory | None = None,
        rotator: RotatorPath | None = None,
    ) -> None:
        self._planner = planner
        self.target = target
        self.posture = posture
        self._leading = leading
        self._trajectory = trajectory or Trajectory(planner, target, posture, near)
        self._rotator = rotator
        self._bridge: tuple[object, Check | None] | None = None  # what was asked of a bridge, and the answer
        self._limit: _Foreseen | None = None

    @property
    def hold(self) -> Hold | None:
        """What the rotator holds; None without a rotator."""
        return None if self._rotator is None else self._rotator.held.hold

    def turns_at(self, time: float) -> bool:
        """Whether the rotator is still on its way to what it is to hold."""
        return self._rotator is not None and time < self._rotator.since

    @property
    def led(self) -> bool:
        """Whether the axes are led, for the target is too fast to be left to the drive alone."""
        return self._trajectory.leading is not None

    def angles(self, time: float) -> AxisState:
        """(angle, rate) of each axis at POSIX `time`, radians and radians per second.

        Raises
        ------
        TargetError
            The target has no place then.
        """
        return self._trajectory.angles(time)

    def at(self, time: float) -> tuple[tuple[float, float], ...]:
        """(counts, counts per second) of each axis at POSIX `time`, and of a rotator after them."""
        axes = self._trajectory.at(time)
        return axes if self._rotator is None else (*axes, self._rotator.at(time))

    @property
    def axes(self) -> int:
        """Both, and a rotator where there is one."""
        return 2 if self._rotator is None else 3

    def axis_at(self, axis: int, time: float) -> tuple[float, float]:
        """(counts, counts per second) of one axis at POSIX `time`; the rotator's costs ten times as much."""
        return self._rotator.at(time) if self._rotator is not None and axis > 1 else self._trajectory.at(time)[axis]

    def adapt(self, time: float) -> bool:
        """Begin or end to lead the axes as the target has become fast or slow; return whether that changed."""
        state = self.angles(time)
        fastest, led = max(abs(rate) for _, rate in state), self.led
        if led and fastest < LED_UNTIL and self._trajectory.is_joined(time):
            self._trajectory = Trajectory(self._planner, self.target, self.posture, _places(state))
        elif not led and fastest > LED_ABOVE and self._leading is not None:
            self._trajectory = Trajectory(self._planner, self.target, self.posture, _places(state), self._leading)
        return self.led != led

    def next_limit(self, time: float) -> tuple[float, Check] | None:
        """When following it meets a limit, POSIX seconds, and which; None when it does not within a day.

        What was found holds until then, as long as sky, mount, limits and the way to the target are the same. That
        nothing was found, or what concerns a rotator, which is looked ahead for less, is looked for again.
        """
        planner = self._planner
        under = self._trajectory, planner.sky, planner.mount, planner.limits, planner.axes, planner.free
        if self._limit is None or not self._limit.holds(time, under, lasts=self._rotator is None):
            self._limit = _Foreseen(time, under, self._next_limit(time, _LED_SPAN_S if self.led else DAY_S))
        return self._limit.found

    def _next_limit(self, time: float, span: float) -> tuple[float, Check] | None:
        found = next_limit(self._onwards(self.target, time), time, span)
        if self._rotator is None:
            return found
        until = min(time + _ROTATOR_SPAN_S, time + span if found is None else found[0])
        return self._rotator.next_limit(time, until) or found

    def barred(self, reading: Reading) -> tuple[Check, ...]:
        """What forbids to go on: the rotator's limit, and to lead the axes, by the rule of `pointing.next_limit`.

        Where the axes would come to rest is asked of every reading; a bridge is a way that was planned, asked once.
        """
        return (*self._rotator_barred(reading.time), *self._axes_barred(reading))

    def _rotator_barred(self, time: float) -> tuple[Check, ...]:
        """The rotator's limit, where what it holds has come to it: it must be wound back."""
        if self._rotator is None or time < self._rotator.since:
            return ()
        check = self._rotator.rotator.check(self._rotator.angle(time))
        return () if check.ok else (check,)

    def _axes_barred(self, reading: Reading) -> tuple[Check, ...]:
        way, leading = self._trajectory, self._trajectory.leading
        if leading is None:
            return ()
        one, two = reading.axes[:2]
        rest = leading.rest((one.counts, two.counts), (one.rate, two.rate))
        checks = self._planner.standing(self._planner.angles(rest), reading.time)
        failed = tuple(check for check in checks if not check.ok)
        if failed or way.is_joined(reading.time):
            return failed
        found = self._on_bridge(way, reading.time + leading.notice_s)
        return () if found is None else (found,)

    def _on_bridge(self, way: Trajectory, begin: float) -> Check | None:
        """What forbids the way from `begin` until both axes are on the target again: the same for all of a gap."""
        planner, end = self._planner, way.rejoined(begin)
        asked = way, end, planner.mount, planner.limits, planner.free
        if self._bridge is None or self._bridge[0] != asked:
            found = forbidden(way, begin, end)
            self._bridge = asked, None if found is None else found[1]
        return self._bridge[1]

    def errors(self, reading: Reading) -> tuple[float, float]:
        """By how many counts each axis is ahead of where it should be."""
        (one, _), (two, _) = self._trajectory.at(reading.time)
        return reading.axes[0].counts - one, reading.axes[1].counts - two

    def error_arcsec(self, reading: Reading) -> float:
        """Angle on the sky between where the telescope points and the target, arcseconds."""
        frame = self._planner.sky.at(Instant.from_posix(reading.time))
        points = self._planner.observed(reading.counts)
        return math.degrees(separation(points, self.target.observed_with_rate(frame)[0])) * 3600.0

    def astray_arcsec(self, reading: Reading) -> float:
        """Angle on the sky between where the telescope points and where it should, on its way to the target too."""
        (one, _), (two, _) = self.angles(reading.time)
        points = self._planner.observed(reading.counts)
        return math.degrees(separation(points, self._planner.mount.observed(one, two))) * 3600.0

    def moved_to(self, target: Target, time: float) -> "Pursuit":
        """Follow another target from here, in the same posture; axes under way to it go on from where they are."""
        onwards = self._onwards(target, time)
        near, turned = _places(self.angles(time)), self.turning(target, self.posture)
        return Pursuit(self._planner, target, self.posture, near, self._leading, onwards, turned)

    def turning(self, target: Target, posture: Posture) -> RotatorPath | None:
        """The way of the rotator along a target, from where it is, to hold the same; None without a rotator."""
        return None if self._rotator is None else self._rotator.moved_to(target, posture)

    def _onwards(self, target: Target, time: float) -> Trajectory:
        """The way from here along a target, led as now; axes on a bridge go on from where they are."""
        near, leading, start = _places(self.angles(time)), self._trajectory.leading, None
        if leading is not None and not self._trajectory.is_joined(time):
            (one, rate1), (two, rate2) = self._trajectory.at(time)
            start = Start(time, (one, two), (rate1, rate2))
        return Trajectory(self._planner, target, self.posture, near, leading, start)


def _places(state: AxisState) -> tuple[float, float]:
    return state[0][0], state[1][0]
