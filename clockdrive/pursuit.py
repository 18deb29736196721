"""Following one target: where both axes must be at any time, and how far they are from it."""

import math

from mounts.drive import Reading
from pointing.instant import Instant
from pointing.limits import Check, separation
from pointing.mount import Posture
from pointing.next_limit import DAY_S, next_limit
from pointing.plan import AxisState, Leading, Start
from pointing.planner import Planner
from pointing.targets import Target
from pointing.trajectory import LED_ABOVE, LED_UNTIL, Trajectory

_LIMIT_AGE_S = 20.0  # after which the next limit is looked for again
_LED_SPAN_S = 3600.0


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
    """

    def __init__(
        self,
        planner: Planner,
        target: Target,
        posture: Posture,
        near: tuple[float, float],
        leading: Leading | None = None,
        trajectory: Trajectory | None = None,
    ) -> None:
        self._planner = planner
        self.target = target
        self.posture = posture
        self._leading = leading
        self._trajectory = trajectory or Trajectory(planner, target, posture, near)
        self._limit: tuple[float, tuple[float, Check] | None] | None = None  # as found at a time

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

    def at(self, time: float) -> AxisState:
        """(counts, counts per second) of each axis at POSIX `time`."""
        return self._trajectory.at(time)

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
        """When following it meets a limit, POSIX seconds, and which; None when it does not within a day."""
        if self._limit is None or not 0.0 <= time - self._limit[0] < _LIMIT_AGE_S:
            state = self.angles(time)
            ahead = Trajectory(self._planner, self.target, self.posture, _places(state), self._trajectory.leading)
            self._limit = time, next_limit(ahead, time, _LED_SPAN_S if self.led else DAY_S)
        return self._limit[1]

    def is_joined(self, time: float) -> bool:
        """Whether both axes are supposed to be on the target, and not on their way to it."""
        return self._trajectory.is_joined(time)

    def rejoined(self, time: float) -> float:
        """When both axes are supposed to be on the target again, POSIX seconds."""
        return self._trajectory.rejoined(time)

    def errors(self, reading: Reading) -> tuple[float, float]:
        """By how many counts each axis is ahead of where it should be."""
        (one, _), (two, _) = self.at(reading.time)
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
        state = self.angles(time)
        moved = Pursuit(self._planner, target, self.posture, _places(state), self._leading)
        if self._trajectory.leading is not None:
            (one, rate1), (two, rate2) = self.at(time)
            start = None if self._trajectory.is_joined(time) else Start(time, (one, two), (rate1, rate2))
            moved._trajectory = Trajectory(
                self._planner, target, self.posture, _places(state), self._trajectory.leading, start
            )
        return moved


def _places(state: AxisState) -> tuple[float, float]:
    return state[0][0], state[1][0]
