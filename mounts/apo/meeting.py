"""How an axis that drifts comes onto a path: when its nodes begin, where it meets the path, the nodes to there."""

from collections.abc import Callable
from dataclasses import dataclass

from mounts.apo.node_queue import PathNode
from mounts.apo.settings import AxisSettings
from mounts.apo.slew_profile import SlewProfile, on_grid
from mounts.errors import DriveRefused

_ROUNDS = 60
_MET_S = 1e-7
_LONGEST_S = 3600.0

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
    begin, duration = earliest, 0.0
    for _ in range(_ROUNDS):
        found = profile(line.at(begin), line.velocity, *where(begin + duration))
        changed = abs(found.duration - duration)
        duration = found.duration
        wanted = earliest if arrival is None else max(earliest, on_grid(arrival - duration))
        if changed <= _MET_S and abs(wanted - begin) <= _MET_S:
            return Meeting(_checked(axis, found, begin))
        begin = wanted
        if duration > _LONGEST_S:
            break
    raise DriveRefused(
        f"{axis.name}: what it must meet moves nearly as fast as the axis, {axis.max_speed_deg_s:g}°/s; no arrival "
        "was found: `goto` it when it is slower"
    )


def _checked(axis: AxisSettings, found: SlewProfile, begin: float) -> tuple[PathNode, ...]:
    low, high = found.extremes
    if low < axis.lowest_deg or high > axis.highest_deg:
        value = low if low < axis.lowest_deg else high
        raise DriveRefused(
            f"{axis.name}: the way leads to {value:.4f}°, outside {axis.lowest_deg:g}° to {axis.highest_deg:g}°; "
            "`stop`, then go from rest"
        )
    return tuple(PathNode(begin + node.time, node.position, node.velocity) for node in found.nodes)
