"""Following one target: where both axes must be at any time, and how far they are from it."""

import math

from mounts.drive import Reading
from pointing.instant import Instant
from pointing.limits import separation
from pointing.mount import Posture
from pointing.planner import Planner
from pointing.targets import Target


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
    """

    def __init__(self, planner: Planner, target: Target, posture: Posture, near: tuple[float, float]) -> None:
        self._planner = planner
        self.target = target
        self.posture = posture
        self._near = near

    def angles(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """(angle, rate) of each axis at POSIX `time`, radians and radians per second."""
        state = self._planner.track(self.target, time, self.posture, self._near)
        self._near = (state[0][0], state[1][0])
        return state

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """(counts, counts per second) of each axis at POSIX `time`."""
        one, two = (
            (axis.gearing.counts(angle), rate * axis.gearing.counts_per_radian)
            for axis, (angle, rate) in zip(self._planner.axes, self.angles(time), strict=True)
        )
        return one, two

    def errors(self, reading: Reading) -> tuple[float, float]:
        """By how many counts each axis is ahead of the target."""
        (one, _), (two, _) = self.at(reading.time)
        return reading.axes[0].counts - one, reading.axes[1].counts - two

    def error_arcsec(self, reading: Reading) -> float:
        """Angle on the sky between where the telescope points and the target, arcseconds."""
        frame = self._planner.sky.at(Instant.from_posix(reading.time))
        points = self._planner.observed((reading.axes[0].counts, reading.axes[1].counts))
        return math.degrees(separation(points, self.target.observed_with_rate(frame)[0])) * 3600.0

    def moved_to(self, target: Target) -> "Pursuit":
        """Follow another target from here, in the same posture."""
        return Pursuit(self._planner, target, self.posture, self._near)
