"""How a fast target is followed from where it comes up to where it leaves what is allowed: the plan of a pass.

Of all ways, two postures and every winding, the one that is on the target for longest is taken: it keeps the whole
pass without a flip where any does. What even the best one loses where the drive is too slow, the keyhole, is stated.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from pointing.geometry import Geometry
from pointing.keyhole import lost
from pointing.limits import Check
from pointing.mount import POSTURES, Posture
from pointing.next_limit import next_limit
from pointing.plan import Leading, Start
from pointing.targets import Target
from pointing.trajectory import LED_ABOVE, Trajectory

LONGEST_PASS_S = 7200.0
UP_S = 0.2
"""After which a target that has come up is well above the horizon, be its first moment off by a rounding."""
_INSIDE_S = 0.1  # the place of waiting lies inside the limit that is crossed when it becomes reachable


@dataclass(frozen=True)
class PassPlan:
    """One pass of a fast target.

    Parameters
    ----------
    target : str
        The target's name.
    reachable : float
        POSIX seconds from which it stands at an allowed place.
    posture : Posture
        The posture that is kept throughout.
    wait : tuple of float
        Axis angles, radians, at which it is waited for.
    joined : float
        POSIX seconds at which both axes go along with it.
    ends : float
        POSIX seconds at which it is followed no further, by the rule of `pointing.next_limit`.
    limit : Check, optional
        What forbids to follow it any further; none within two hours.
    lost : tuple of (begin, end)
        When the drive is too slow for it and the telescope more than 5″ off, POSIX seconds.
    trajectory : Trajectory
        The way itself.
    rotator : float, optional
        The angle of an instrument rotator, radians, at which it waits.
    """

    target: str
    reachable: float
    posture: Posture
    wait: tuple[float, float]
    joined: float
    ends: float
    limit: Check | None
    lost: tuple[tuple[float, float], ...]
    trajectory: Trajectory = field(repr=False, compare=False)
    rotator: float | None = None

    @property
    def lost_s(self) -> float:
        """Seconds for which the drive is too slow to stay on the target."""
        return sum(end - begin for begin, end in self.lost)

    @property
    def followed_s(self) -> float:
        """Seconds on the target."""
        return max(0.0, self.ends - self.joined - self.lost_s)


def is_fast(geometry: Geometry, target: Target, time: float) -> bool:
    """Whether a target at a time is too fast to be met at rest."""
    state = geometry.track(target, time, "normal", (0.0, 0.0))
    return max(abs(rate) for _, rate in state) > LED_ABOVE


def pass_plan(geometry: Geometry, target: Target, reachable: float, leading: Leading | None) -> PassPlan | None:
    """Plan the pass of a target that becomes reachable at a time; None where no posture can join it.

    Parameters
    ----------
    geometry : Geometry
        The telescope.
    target : Target
        What is followed.
    reachable : float
        POSIX seconds from which it stands at an allowed place.
    leading : Leading, optional
        What the axes can do; without it they are planned to be on it at once.
    """
    plans = _plans(geometry, target, reachable, leading)
    return max(plans, key=lambda plan: plan.followed_s, default=None)


def _plans(geometry: Geometry, target: Target, reachable: float, leading: Leading | None) -> Iterator[PassPlan]:
    begin = reachable + _INSIDE_S
    for posture in POSTURES:
        (angle1, _), (angle2, _) = geometry.track(target, begin, posture, (0.0, 0.0))
        for wait in geometry.windings((angle1, angle2), (0.0, 0.0)):
            one, two = (axis.gearing.counts(angle) for axis, angle in zip(geometry.axes, wait, strict=True))
            start = None if leading is None else Start(begin, (one, two))
            trajectory = Trajectory(geometry, target, posture, wait, leading, start)
            if not trajectory.unmet:
                yield planned_pass(trajectory, reachable, wait)


def planned_pass(trajectory: Trajectory, reachable: float, wait: tuple[float, float]) -> PassPlan:
    """Follow a trajectory to the limit before which it is stopped."""
    target, joined = trajectory.target, trajectory.joined
    begin = max(joined, reachable) if math.isfinite(joined) else reachable
    found = next_limit(trajectory, begin, LONGEST_PASS_S)
    ends, limit = found or (begin + LONGEST_PASS_S, None)
    gaps = lost(trajectory, ends)
    return PassPlan(target.name, reachable, trajectory.posture, wait, begin, ends, limit, gaps, trajectory)
