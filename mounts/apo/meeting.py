"""How an axis that drifts comes onto a path: when its nodes begin, where it meets the path, the nodes to there."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from mounts.apo.errors import ApoError
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import AxisSettings
from mounts.apo.slew_profile import GRID_S, MARGIN, SlewProfile, on_grid
from mounts.errors import DriveRefused

_ROUNDS = 60  # in which the beginning is found; where it is not, it arrives before it was planned to

Where = Callable[[float], tuple[float, float]]
"""Position and velocity of the path at POSIX time, degrees and degrees per second."""
Soonest = Callable[[float, float, Where], SlewProfile]
"""The soonest meeting, from position and velocity, with a path told by seconds after the beginning."""


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
    soonest: Soonest,
) -> Meeting:
    """Find when to begin, and where the path is met.

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
    soonest : callable
        The axis's law.

    Raises
    ------
    DriveRefused
        The path is too fast or runs away, or the way leads out of the travel.
    """
    earliest = begin = on_grid(earliest)
    for _ in range(_ROUNDS):
        found = _from(axis, line, begin, where, soonest)
        wanted = earliest if arrival is None else max(earliest, on_grid(arrival - found.duration))
        if abs(wanted - begin) <= GRID_S:
            return Meeting(_checked(axis, found, begin))
        begin = wanted
    return Meeting(_checked(axis, _from(axis, line, earliest, where, soonest), earliest))


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


def excursion(
    axis: AxisSettings,
    line: PathNode,
    earliest: float,
    rate: float,
    seconds: float,
    profile: Callable[..., SlewProfile],
) -> Meeting:
    """The nodes that bring an axis to another velocity, along with it for so many seconds, and to rest.

    Raises
    ------
    DriveRefused
        The way leads out of the travel.
    """
    there = ramp(axis, line, earliest, rate, profile).nodes
    last = there[-1]
    rest = ramp(axis, last, last.time + seconds, 0.0, profile).nodes
    return Meeting((*there, *rest))


def _from(axis: AxisSettings, line: PathNode, begin: float, where: Where, soonest: Soonest) -> SlewProfile:
    try:
        return soonest(line.at(begin), line.velocity, lambda elapsed: where(begin + elapsed))
    except ApoError as error:
        raise DriveRefused(f"{axis.name}: {error}") from error


def _checked(axis: AxisSettings, found: SlewProfile, begin: float) -> tuple[PathNode, ...]:
    low, high = found.extremes
    if low < axis.lowest_deg or high > axis.highest_deg:
        value = low if low < axis.lowest_deg else high
        raise DriveRefused(
            f"{axis.name}: the way leads to {value:.4f}°, outside {axis.lowest_deg:g}° to {axis.highest_deg:g}°; "
            "`stop`, then go from rest"
        )
    return tuple(PathNode(begin + node.time, node.position, node.velocity) for node in found.nodes)
