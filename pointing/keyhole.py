"""When a telescope that is led along a moving target is off it, for the drive is too slow: the keyhole.

An axis leaves the target's way when the acceleration it needs is more than the drive has; the telescope is off the
target only when that shows on the sky, a second or two later near the pole of axis 1. What is lost is counted by what
shows.
"""

import math
from collections.abc import Callable, Iterator

from pointing.instant import Instant
from pointing.limits import separation
from pointing.trajectory import Trajectory

OFF_TARGET = math.radians(5.0 / 3600.0)  # on the sky; a drive that is led keeps within it wherever it can follow

_STEP_S = 0.2  # between two looks at a bridge; shorter moments beyond the bound, or within it, do not count
_EXACT_S = 1e-3


def lost(trajectory: Trajectory, until: float) -> tuple[tuple[float, float], ...]:
    """When a trajectory is off its target, after both axes had joined it and before `until`: (begin, end) each.

    Parameters
    ----------
    trajectory : Trajectory
        The way of both axes.
    until : float
        POSIX seconds.

    Returns
    -------
    tuple
        POSIX seconds between which it is more than 5″ off, to 1 ms.

    Raises
    ------
    TargetError
        The target has no place by then.
    """

    def is_off(time: float) -> bool:
        return off_target(trajectory, time) > OFF_TARGET

    return tuple(span for begin, end in trajectory.gaps(until) for span in _spans(is_off, begin, end))


def off_target(trajectory: Trajectory, time: float) -> float:
    """Angle on the sky, radians, between the target and where a trajectory leads the telescope."""
    geometry = trajectory.geometry
    (one, _), (two, _) = trajectory.angles(time)
    frame = geometry.sky.at(Instant.from_posix(time))
    return separation(geometry.mount.observed(one, two), trajectory.target.observed(frame))


def _spans(holds: Callable[[float], bool], begin: float, end: float) -> Iterator[tuple[float, float]]:
    """Within `begin` to `end`, when something holds."""
    count = max(1, math.ceil((end - begin) / _STEP_S))
    times = [begin + (end - begin) * k / count for k in range(count + 1)]
    held = [holds(time) for time in times]
    since = begin if held[0] else None
    for k in range(1, count + 1):
        if held[k] == held[k - 1]:
            continue
        turn = _turn(holds, times[k - 1], times[k])
        if since is not None:
            yield since, turn
        since = turn if held[k] else None
    if since is not None:
        yield since, end


def _turn(holds: Callable[[float], bool], early: float, late: float) -> float:
    """When what holds changes between two moments."""
    was = holds(early)
    while late - early > _EXACT_S:
        middle = (early + late) / 2.0
        early, late = (middle, late) if holds(middle) == was else (early, middle)
    return late
