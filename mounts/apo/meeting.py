"""How an axis that drifts comes onto a path: when its nodes begin, where it meets the path, the nodes to there."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from mounts.apo.node_queue import PathNode
from mounts.apo.settings import AxisSettings
from mounts.apo.slew_profile import MARGIN, SlewProfile, on_grid
from mounts.errors import DriveRefused

_ROUNDS = 60
_MET_S = 1e-7
_LONGEST_S = 3600.0
_LATER_S = (3.0, 6.0, 12.0, 24.0)  # after which a path is met that cannot be met as soon as possible

Where = Callable[[float], tuple[float, float]]
"""Position and velocity of the path at POSIX time, degrees and degrees per second."""


@dataclass(frozen=True)
class Meeting:
    """The nodes of a slew, the first on the drift and the last on the path."""

    nodes: tuple[PathNode, ...]

    @property
    def arrival(self) -> float:
        """POSIX seconds at which the axis is on the path."""
        return self.nodes[-1].time


def meet(
    axis: AxisSettings,
    line: PathNode,
    earliest: float,
    where: Where,
    arrival: float | None,
    profile: Callable[[float, float, float, float], SlewProfile],
) -> Meeting:
    """Solve the arrival: the profile ends where the path is when it ends, with the path's velocity.

    Parameters
    ----------
    axis : AxisSettings
        Whose travel bounds the way.
    line : PathNode
        The drift on which it is until the first node.
    earliest : float
        POSIX seconds before which no node can be.
    where : callable
        The path.
    arrival : float, optional
        When it was planned to arrive; where it could be earlier it drifts on and begins later.
    profile : callable
        The quickest way from position and velocity to position and velocity.

    Raises
    ------
    DriveRefused
        The path runs away, or the way leads out of the travel.
    """
    earliest = on_grid(earliest)
    for later in (None, *_LATER_S):
        due = arrival if later is None else max(arrival or 0.0, earliest) + later
        if (found := _solved(line, earliest, where, due, profile)) is not None:
            return Meeting(_checked(axis, *found))
    raise DriveRefused(
        f"{axis.name}: what it must meet moves nearly as fast as the axis, {axis.max_speed_deg_s:g}°/s; no arrival "
        "was found: `goto` it when it is slower"
    )


def ramp(
    axis: AxisSettings, line: PathNode, earliest: float, rate: float, profile: Callable[..., SlewProfile]
) -> Meeting:
    """The nodes that bring an axis from its drift to another velocity.

    Raises
    ------
    DriveRefused
        The way leads out of the travel.
    """
    begin, change = on_grid(earliest), abs(rate - line.velocity)
    acceleration, jerk = axis.acceleration_deg_s2 * MARGIN, axis.jerk_deg_s3 * MARGIN
    if change >= acceleration**2 / jerk:
        seconds = change / acceleration + acceleration / jerk
    else:
        seconds = 2.0 * math.sqrt(change / jerk)
    here = line.at(begin)
    found = profile(here, line.velocity, here + (line.velocity + rate) / 2.0 * seconds, rate)
    return Meeting(_checked(axis, found, begin))


def _solved(
    line: PathNode, earliest: float, where: Where, arrival: float | None, profile: Callable[..., SlewProfile]
) -> tuple[SlewProfile, float] | None:
    """The profile and its begin; None where going round does not settle."""
    begin, duration = earliest, 0.0
    for _ in range(_ROUNDS):
        found = profile(line.at(begin), line.velocity, *where(begin + duration))
        changed = abs(found.duration - duration)
        duration = found.duration
        wanted = earliest if arrival is None else max(earliest, on_grid(arrival - duration))
        if changed <= _MET_S and abs(wanted - begin) <= _MET_S:
            return found, begin
        begin = wanted
        if duration > _LONGEST_S:
            return None
    return None


def _checked(axis: AxisSettings, found: SlewProfile, begin: float) -> tuple[PathNode, ...]:
    low, high = found.extremes
    if low < axis.lowest_deg or high > axis.highest_deg:
        value = low if low < axis.lowest_deg else high
        raise DriveRefused(
            f"{axis.name}: the way leads to {value:.4f}°, outside {axis.lowest_deg:g}° to {axis.highest_deg:g}°; "
            "`stop`, then go from rest"
        )
    return tuple(PathNode(begin + node.time, node.position, node.velocity) for node in found.nodes)
