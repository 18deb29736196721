"""When a telescope that goes on along a trajectory meets its next limit, and which.

The search goes forward by half the time in which the nearest limit could be reached at the present rates, so that it
closes in on a limit without passing it.

A drive that follows by itself loses its target where an axis would have to be faster than it can: the *keyhole* about
the pole of axis 1. A target that passes the pole at the angle ζ needs v / sin ζ of axis 1, v its speed on the sky.
(Its acceleration, 0.65 times the square of that, is no bound before the speed is: 2°/s need 0.05°/s².)

What is led is stopped earlier, by one rule that the session keeps and every plan foresees. On the target, the place
where both axes would come to rest must be allowed. On a bridge, which turns by itself in time, it is that and all of
the way until both are on the target again: a bridge that leads to a limit, or on which a stop would, is not begun.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from pointing.errors import TargetError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import Check
from pointing.path import horizon_check, sun_check
from pointing.plan import AxisState, Leading
from pointing.short_moves import fastest, held
from pointing.sky import SkyFrame
from pointing.trajectory import Trajectory
from pointing.vectors import Vector

DAY_S = 86_400.0
_CLOSE_S = 0.01
_SUN_RATE = 8e-5  # rad/s, above the Earth's turn


class _Steps(NamedTuple):
    """Seconds between two looks; a limit that is passed and left again within the least is not seen."""

    least: float
    largest: float


_TRACKED = _Steps(0.5, 300.0)
_LED = _Steps(0.1, 1.0)  # an axis can turn within seconds


def next_limit(trajectory: Trajectory, time: float, span: float = DAY_S) -> tuple[float, Check] | None:
    """The first moment at which a trajectory leads to a limit; None when it does not within `span` seconds.

    Parameters
    ----------
    trajectory : Trajectory
        The way that is followed from `time` on, POSIX seconds.
    span : float
        How far to look ahead.

    Returns
    -------
    tuple
        POSIX seconds, and the check that fails from then on; it fails at `time` already where tracking is forbidden.
        Of a trajectory that is led, when it is stopped for it.
    """
    found = forbidden(trajectory, time, time + span)
    if found is None or trajectory.leading is None:
        return found
    moment, check = found
    begun = trajectory.left(moment - _CLOSE_S)
    return (moment if begun is None else max(time, begun)), check


def forbidden(trajectory: Trajectory, time: float, until: float) -> tuple[float, Check] | None:
    """The first moment from `time` to `until`, POSIX seconds, at which a trajectory leads where it must not.

    Returns
    -------
    tuple
        POSIX seconds to 0.01 s, and the check that fails, of where it would rest or, on a bridge, of the place.
    """
    steps = _TRACKED if trajectory.leading is None else _LED
    clear = due = time
    while True:
        looked = _look(trajectory, due)
        if isinstance(looked, Check):
            return _closed_in(trajectory, clear, due, looked)
        if due >= until:
            return None
        clear, due = due, min(until, due + min(max(looked / 2.0, steps.least), steps.largest))


def _closed_in(trajectory: Trajectory, clear: float, broken: float, check: Check) -> tuple[float, Check]:
    while broken - clear > _CLOSE_S:
        middle = (clear + broken) / 2.0
        looked = _look(trajectory, middle)
        if isinstance(looked, Check):
            broken, check = middle, looked
        else:
            clear = middle
    return broken, check


def _look(trajectory: Trajectory, time: float) -> float | Check:
    """Seconds to the nearest limit at the present rates, or the check that fails."""
    geometry = trajectory.geometry
    try:
        state = trajectory.angles(time)
    except (TargetError, Unreachable) as error:  # it has no place, or one where the pointing origin does not come
        return Check("target", ok=False, detail=str(error))
    asked = [state]
    if trajectory.leading is not None:
        rest = _at_rest(geometry, trajectory.leading, state)
        asked = [rest] if trajectory.is_joined(time) else [state, rest]
    frame = geometry.sky.at(Instant.from_posix(time))
    seconds = math.inf
    for each in asked:
        observed = geometry.mount.observed(each[0][0], each[1][0])
        failed = next((check for check in _checks(geometry, frame, observed, each) if not check.ok), None)
        if failed is not None:
            return failed
        seconds = min(seconds, *_axis_seconds(geometry, each), _keyhole_seconds(geometry, each))
        seconds = min(seconds, _sky_seconds(geometry, frame, observed, each))
    return seconds


def _at_rest(geometry: Geometry, leading: Leading, state: AxisState) -> AxisState:
    """The angles at which the axes would come to rest, with the rates of now."""
    gearings = [axis.gearing for axis in geometry.axes]
    counts = [gearing.counts(angle) for gearing, (angle, _) in zip(gearings, state, strict=True)]
    rates = [rate * gearing.counts_per_radian for gearing, (_, rate) in zip(gearings, state, strict=True)]
    one, two = geometry.angles(leading.rest((counts[0], counts[1]), (rates[0], rates[1])))
    return (one, state[0][1]), (two, state[1][1])


def _checks(geometry: Geometry, frame: SkyFrame, observed: Vector, state: AxisState) -> tuple[Check, ...]:
    return (
        *geometry.axis_checks((state[0][0], state[1][0])),
        *speed_checks(geometry, state),
        horizon_check(geometry.limits, observed, "then"),
        sun_check(geometry.limits, geometry.sun(frame), observed, "then"),
    )


def speed_checks(geometry: Geometry, state: AxisState) -> Iterator[Check]:
    """Those that fail of whether the axes can follow, of drives that say how fast they can."""
    for axis, (_, rate) in zip(geometry.axes, state, strict=True):
        if abs(rate) > axis.fastest:
            needed, most = math.degrees(abs(rate)), math.degrees(axis.fastest)
            detail = (
                f"{axis.name} would have to follow at {needed:.3f}°/s, the drive reaches {most:.3f}°/s: the keyhole"
            )
            yield Check(f"{axis.name} speed", ok=False, detail=detail)
        if (check := held(axis, rate)) is not None and not check.ok:
            yield check


def _keyhole_seconds(geometry: Geometry, state: AxisState) -> float:
    """Seconds to the nearest keyhole, at the present speed on the sky."""
    most, ((_, rate1), (angle2, rate2)) = fastest(geometry.axes[0]), state
    speed = math.hypot(rate1 * math.cos(angle2), rate2)
    if math.isinf(most) or not speed:
        return math.inf
    distance = math.asin(min(1.0, abs(math.cos(angle2))))
    return max(0.0, distance - math.asin(min(1.0, speed / most))) / speed


def _axis_seconds(geometry: Geometry, state: AxisState) -> Iterator[float]:
    for axis, (angle, rate) in zip(geometry.free, state, strict=True):
        room = axis.maximum - angle if rate > 0.0 else angle - axis.minimum
        yield room / abs(rate) if rate else math.inf


def _sky_seconds(geometry: Geometry, frame: SkyFrame, observed: Vector, state: AxisState) -> float:
    (_, rate1), (angle2, rate2) = state
    speed = math.hypot(rate1 * math.cos(angle2), rate2)
    low = geometry.limits.horizon.room(observed)
    bright = geometry.limits.sun_margin(observed, geometry.sun(frame))
    return min(low / max(speed, 1e-9), bright / (speed + _SUN_RATE))
