"""When a telescope that goes on along a trajectory meets its next limit, and which.

The search goes forward by half the time in which the nearest limit could be reached at the present rates, so that it
closes in on a limit without passing it.
"""

import math
from collections.abc import Iterator

from pointing.errors import TargetError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import Check
from pointing.path import horizon_check, sun_check
from pointing.plan import AxisState
from pointing.sky import SkyFrame
from pointing.trajectory import Trajectory
from pointing.vectors import Vector

DAY_S = 86_400.0
_LEAST_STEP_S, _LARGEST_STEP_S = 0.5, 300.0  # a limit that is passed and left again within the least is not seen
_CLOSE_S = 0.01
_SUN_RATE = 8e-5  # rad/s, above the Earth's turn


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
    """
    clear, due = time, time
    while due <= time + span:
        looked = _look(trajectory, due)
        if isinstance(looked, Check):
            return _closed_in(trajectory, clear, due, looked)
        clear, due = due, due + min(max(looked / 2.0, _LEAST_STEP_S), _LARGEST_STEP_S)
    return None


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
    frame = geometry.sky.at(Instant.from_posix(time))
    observed = geometry.mount.observed(state[0][0], state[1][0])
    failed = next((check for check in _checks(geometry, frame, observed, state) if not check.ok), None)
    if failed is not None:
        return failed
    return min(*_axis_seconds(geometry, state), _sky_seconds(geometry, frame, observed, state))


def _checks(geometry: Geometry, frame: SkyFrame, observed: Vector, state: AxisState) -> tuple[Check, ...]:
    return (
        *geometry.axis_checks((state[0][0], state[1][0])),
        horizon_check(geometry.limits, observed, "then"),
        sun_check(geometry.limits, geometry.sun(frame), observed, "then"),
    )


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
