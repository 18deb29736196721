"""For how long a target is lost to a limit: until it stands at an allowed place again that the drive can follow.

So the time above the highest altitude of the axes is known, and that in the keyhole, before either is met.
"""

from contextlib import suppress

from pointing.errors import TargetError, Unreachable
from pointing.geometry import Geometry
from pointing.mount import POSTURES
from pointing.next_limit import speed_checks
from pointing.targets import Target
from pointing.visibility import forbidden_s

LONGEST_S = 10_800.0
_STEP_S = 10.0
_CLOSE_S = 0.01


def regained(geometry: Geometry, target: Target, lost: float) -> float | None:
    """When a target that met a limit at a time can be tracked again, in whichever posture and winding.

    Parameters
    ----------
    lost : float
        POSIX seconds.

    Returns
    -------
    float or None
        POSIX seconds to 0.01 s, without the slew that takes it up; None when it is not within three hours. For a
        moment between two looks, 10 s apart, it may be allowed unseen.

    Notes
    -----
    Where it stands at a forbidden place, the next look is after the time in which it surely stands at no other.
    """
    with suppress(TargetError):  # nobody knows its place any further
        if _followed(geometry, target, lost + _CLOSE_S):  # another winding goes on at once
            return lost
        early, end = lost, lost + LONGEST_S
        while early < end:
            late = min(end, early + max(_STEP_S, forbidden_s(geometry, target, early)))
            if _followed(geometry, target, late):
                return _closed_in(geometry, target, early, late)
            early = late
    return None


def _closed_in(geometry: Geometry, target: Target, early: float, late: float) -> float:
    while late - early > _CLOSE_S:
        middle = (early + late) / 2.0
        early, late = (early, middle) if _followed(geometry, target, middle) else (middle, late)
    return late


def _followed(geometry: Geometry, target: Target, time: float) -> bool:
    """Whether it stands at an allowed place where some posture can follow it."""
    if not geometry.allowed(target, time):
        return False
    for posture in POSTURES:
        with suppress(Unreachable):
            state = geometry.track(target, time, posture, (0.0, 0.0))
            angles = state[0][0], state[1][0]
            if any(geometry.windings(angles, (0.0, 0.0))) and not any(speed_checks(geometry, state)):
                return True
    return False
