"""Where one telescope may stand, and where its axes must be for a target; no motion."""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from pointing.errors import PointingError, Unreachable
from pointing.instant import Instant
from pointing.limits import Check, Limits
from pointing.mount import POSTURES, Mount, MountType, Posture
from pointing.path import horizon_check, sun_check
from pointing.plan import Axis, AxisState
from pointing.sky import Sky, SkyFrame
from pointing.targets import Target
from pointing.vectors import Vector

if TYPE_CHECKING:
    from pointing.rotator import Rotator

_SHOWN_DEG = 0.001
_ROUNDING = 1e-12  # rad, by which one limit computed in two ways may differ from itself


class Geometry:
    """The directions and axis angles of one telescope.

    Parameters
    ----------
    sky : Sky
        The sky over the site.
    mount : Mount
        The mount and its misalignment.
    axes : tuple of Axis
        Gearing and limits.
    limits : Limits
        Horizon and Sun.
    past_meridian : float
        German mounts: how far past the meridian the mechanical hour angle may go, radians.
    """

    def __init__(
        self, sky: Sky, mount: Mount, axes: tuple[Axis, Axis], limits: Limits, past_meridian: float = math.inf
    ) -> None:
        self.sky = sky
        self.mount = mount
        self.rotator: Rotator | None = None
        """Of a telescope that has one; whoever puts the telescope together says so."""
        self.axes = axes
        self.limits = limits
        if math.isnan(past_meridian):
            raise PointingError("a German window of nan past the meridian: give an angle, or infinity for none")
        self.past_meridian = past_meridian if mount.type is MountType.GERMAN else math.inf
        low, high = -self.past_meridian, math.pi + self.past_meridian
        first = replace(axes[0], minimum=max(axes[0].minimum, low), maximum=min(axes[0].maximum, high))
        self.free = (first, axes[1])
        """The axes with the travel that is free in every way: that of a German mount's axis 1 ends at its window."""

    def track(self, target: Target, time: float, posture: Posture, near: tuple[float, float]) -> AxisState:
        """Where the axes must be for a target, and how fast they move.

        Parameters
        ----------
        target : Target
            What is tracked.
        time : float
            POSIX seconds.
        posture : Posture
            The posture to keep.
        near : tuple of float
            Axis angles, radians, to which the windings are the nearest.

        Returns
        -------
        tuple
            ((angle, rate) of axis 1, (angle, rate) of axis 2), radians and radians per second.
        """
        return self.state(target, self.sky.at(Instant.from_posix(time)), posture, near)

    def state(self, target: Target, frame: SkyFrame, posture: Posture, near: tuple[float, float]) -> AxisState:
        """As `track`, in a frame that is there already."""
        (a1, w1), (a2, w2) = self.mount.axes_and_rates(*target.observed_with_rate(frame), posture)
        return (_nearest(a1, near[0]), w1), (_nearest(a2, near[1]), w2)

    def observed(self, counts: tuple[float, float]) -> Vector:
        """The observed direction at which the axes point, horizon frame."""
        return self.mount.observed(self.axes[0].gearing.angle(counts[0]), self.axes[1].gearing.angle(counts[1]))

    def angles(self, counts: tuple[float, float]) -> tuple[float, float]:
        """Axis angles at counts, radians."""
        return self.axes[0].gearing.angle(counts[0]), self.axes[1].gearing.angle(counts[1])

    def standing(self, angles: tuple[float, float], time: float) -> tuple[Check, ...]:
        """Every check at fixed axis angles and a time: what the session asks each cycle."""
        observed = self.mount.observed(*angles)
        frame = self.sky.at(Instant.from_posix(time))
        return (
            *self.axis_checks(angles),
            horizon_check(self.limits, observed, "now"),
            sun_check(self.limits, frame.sun(), observed, "now"),
        )

    def allowed(self, target: Target, time: float) -> bool:
        """Whether a target stands at an allowed place at a time, whatever the way there."""
        frame = self.sky.at(Instant.from_posix(time))
        observed, _ = target.observed_with_rate(frame)
        if self.limits.horizon.margin(observed) < 0 or self.limits.sun_margin(observed, frame.sun()) < 0:
            return False
        with suppress(Unreachable):  # where the origin passes the pole of axis 1 by, there are no axis angles
            return any(
                True for posture in POSTURES for _ in self.windings(self.mount.axes(observed, posture), (0.0, 0.0))
            )
        return False

    def reach(self, observed: Vector) -> float:
        """How far, radians, a direction is at least from the edge of what the axes reach; negative when outside.

        A limit of axis 1 is half a great circle through its pole, one of axis 2 a circle round it.
        """
        return max(self._reach(*self.mount.axes(observed, posture)) for posture in POSTURES)

    def _reach(self, angle1: float, angle2: float) -> float:
        across, along = _spare(self.free[0], angle1), _spare(self.free[1], angle2)
        turned = math.sin(min(abs(across), math.pi / 2.0)) * abs(math.cos(angle2))
        return min(math.copysign(math.asin(turned), across) if math.isfinite(across) else math.inf, along)

    def windings(self, angles: tuple[float, float], slack: tuple[float, float]) -> Iterator[tuple[float, float]]:
        """Every pair of axis angles within the limits, widened by `slack`, that is the same direction as `angles`."""
        for wound1 in self.free[0].windings(angles[0], slack[0]):
            for wound2 in self.free[1].windings(angles[1], slack[1]):
                yield wound1, wound2

    def sun(self, frame: SkyFrame) -> Vector:
        """Direction of the Sun where it matters, else the zenith."""
        return frame.sun() if self.limits.sun_avoidance else (0.0, 0.0, 1.0)

    def axis_checks(self, angles: tuple[float, float]) -> tuple[Check, ...]:
        """The soft limits of both axes, and the window of a German mount."""
        checks = tuple(
            _within(f"{axis.name} soft limit", axis.name, angle, axis.minimum, axis.maximum)
            for axis, angle in zip(self.axes, angles, strict=True)
        )
        if math.isinf(self.past_meridian):
            return checks
        low, high = -self.past_meridian, math.pi + self.past_meridian
        return *checks, _within("hour-angle window", "mechanical hour angle", angles[0], low, high)

    def no_placement(
        self, target: Target, time: float, postures: tuple[Posture, ...] = POSTURES
    ) -> tuple[Check, ...]:
        """What forbids a place that no posture and winding reaches: the sky, and the limits missed by least."""
        frame = self.sky.at(Instant.from_posix(time))
        observed = target.observed(frame)
        misses = []
        for posture in postures:
            angle1, angle2 = (
                _nearest(angle, (axis.minimum + axis.maximum) / 2.0)
                for angle, axis in zip(self.mount.axes(observed, posture), self.free, strict=True)
            )
            excess = sum(
                max(axis.minimum - angle, angle - axis.maximum, 0.0)
                for axis, angle in zip(self.free, (angle1, angle2), strict=True)
            )
            misses.append((excess, (angle1, angle2)))
        return (
            horizon_check(self.limits, observed, "now"),
            sun_check(self.limits, self.sun(frame), observed, "now"),
            *self.axis_checks(min(misses)[1]),
        )


def _spare(axis: Axis, angle: float) -> float:
    """By how much an angle, wound as is best, is within the travel of an axis; infinite for more than a turn."""
    travel = axis.maximum - axis.minimum
    if travel >= math.tau:
        return math.inf
    return travel / 2.0 - abs(math.remainder(angle - (axis.minimum + axis.maximum) / 2.0, math.tau))


def _within(name: str, what: str, angle: float, low: float, high: float) -> Check:
    degrees, lowest, highest = math.degrees(angle), math.degrees(low), math.degrees(high)
    allowed, margin = f"{lowest:.2f}° to {highest:.2f}°", min(angle - low, high - angle)
    if low - _ROUNDING <= angle <= high + _ROUNDING:
        return Check(name, ok=True, detail=f"{what} at {degrees:.3f}°, allowed {allowed}", margin=margin)
    beyond = max(lowest - degrees, degrees - highest)
    detail = f"{what} at {degrees:.3f}° is {outside(beyond)} {allowed}"
    return Check(name, ok=False, detail=detail, margin=margin)


def outside(beyond: float) -> str:
    """By how much, degrees, something is outside a travel, in words; as it leaves it there is no figure."""
    return "at the end of" if beyond < _SHOWN_DEG / 2.0 else f"{beyond:.3f}° outside"


def _nearest(angle: float, near: float) -> float:
    """The winding of `angle` nearest to `near`."""
    return angle + math.tau * round((near - angle) / math.tau)
