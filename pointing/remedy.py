"""What a person can do about a place to which the telescope must not go."""

from collections.abc import Collection

from pointing.limits import Check
from pointing.short_moves import too_fast

_FILTERED = (
    "choose a target farther from the Sun; only with a filter in front of the whole aperture lower sun_avoidance_deg"
)
_WAIT = "wait until then, or choose another target"
_NEVER = "it will not be allowed within a day: choose another target, or move the limit if that is wrong"
_SLOWER = "take smaller rates, or a target that is slower in this axis"
_ASK = "choose another target, or ask `plan`, which says from when it can be reached"
OF_A_WAY = "choose another place, or another way there"
"""What to do about a way to fixed axis angles."""


def remedy(checks: Collection[Check], free: float | None, *, searched: bool) -> str:
    """Say what to do about a target that is refused.

    Parameters
    ----------
    checks : collection of Check
        All that was asked.
    free : float or None
        POSIX seconds from which it is allowed.
    searched : bool
        Whether that was searched for, over a day.
    """
    if free is not None:
        return _WAIT
    if any(map(too_fast, checks)):
        return _SLOWER
    if any(check.name == "Sun" and not check.ok for check in checks):
        return _FILTERED
    return _NEVER if searched else _ASK
