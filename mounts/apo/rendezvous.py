"""How an axis that drifts comes onto a moving path soonest: there when the path is there, with its velocity.

At each trial arrival the path is taken as the line that touches it there, and the quickest way onto that line gives
the next. Its duration depends steadily on the line, for the line sees its end at rest, so that there is always an
answer: the rounds converge as Newton's do, and where the path bends too much they are caught between an arrival that
is too early and one that is too late.
"""

import math
from collections.abc import Callable

from mounts.apo.errors import ApoError
from mounts.apo.sendable import sendable
from mounts.apo.slew_profile import GRID_S, MARGIN, Limits, Line, Slew, SlewProfile, on_grid, quickest, too_fast

Where = Callable[[float], tuple[float, float]]
"""Position and velocity of a path so many seconds after the slew begins, degrees and degrees per second."""

LONGEST_S = 3600.0
"""For which an arrival is looked for."""
_ROUNDS = 80
_LATER_S = 10.0
_FARTHEST = 4.0  # times the gap, for a trial that the last two foretell
_LOWER = (
    1.0,
    0.95,
    0.85,
    0.7,
)  # of acceleration and jerk, where the stretching leaps at the arrival itself
_BESIDE = 3  # trials that were a step of the grid off, as where the arrival is between two of its times
_PATIENCE = 8  # rounds between which halving takes turns


def meeting(start: float, start_rate: float, where: Where, limits: Limits) -> SlewProfile:
    """The soonest meeting that can be sent.

    Parameters
    ----------
    start, start_rate : float
        Of the drift as the slew begins, degrees and degrees per second.
    where : callable
        The path.
    limits : Limits
        Of the axis.

    Raises
    ------
    ApoError
        The path is faster than the axis where they would meet, or runs away from it.
    """
    for lower in _LOWER:
        less = Limits(limits.velocity, limits.acceleration * lower, limits.jerk * lower)
        if found := _met(start, start_rate, where, less, sendable):
            return found
    raise ApoError(_missed(where(0.0)[1], limits))


def soonest(start: float, start_rate: float, where: Where, limits: Limits) -> SlewProfile:
    """The soonest meeting within limits times 0.999, whatever its phases.

    Raises
    ------
    ApoError
        As for `meeting`.
    """
    if found := _met(start, start_rate, where, limits, quickest):
        return found
    raise ApoError(_missed(where(0.0)[1], limits))


def _met(
    start: float, start_rate: float, where: Where, limits: Limits, solve: Callable[[Slew, Limits], SlewProfile]
) -> SlewProfile | None:
    """The meeting to which the trials lead, or none where they do not end; raises where it would be too late."""
    early, late, due = 0.0, math.inf, 0.0
    before, beside = None, 0
    for turn in range(1, _ROUNDS + 1):
        found = solve(Slew(start, start_rate, _touching(where, due, limits)), limits)
        arrives = on_grid(found.duration)
        gap = arrives - due
        beside += abs(gap) <= GRID_S
        if (gap == 0.0 or beside > _BESIDE) and abs(where(due)[1]) <= limits.velocity * MARGIN:
            return found
        if gap >= 0.0:
            early = max(early, due)
        else:
            late = min(late, due)
        trial = _next(due, gap, before)
        if late < math.inf and (not early < trial < late or turn % _PATIENCE == 0):
            trial = (early + late) / 2.0
        before, due = (due, gap), on_grid(trial)
        if due > LONGEST_S:
            raise ApoError(_missed(where(LONGEST_S)[1], limits))
    return None


def _missed(rate: float, limits: Limits) -> str:
    """That a target is too fast to be met, or that it is as good as."""
    if abs(rate) > limits.velocity * MARGIN:
        return too_fast(rate, limits)
    return (
        f"the target moves at {rate:.6g}°/s and runs away from an axis of {limits.velocity:g}°/s, no arrival was "
        f"found within {LONGEST_S:g} s; wait until it is slower or comes nearer"
    )


def _next(due: float, gap: float, before: tuple[float, float] | None) -> float:
    """The next trial arrival: where the gap to the one that it gives would close, by the last two trials."""
    if gap > LONGEST_S or gap == 0.0:  # it is too fast there, and may slow down later
        return 2.0 * due + _LATER_S
    if before is None or gap == before[1]:
        return due + gap
    step = -gap * (due - before[0]) / (gap - before[1])
    return due + (step if 0.0 < step / gap < _FARTHEST else gap)


def _touching(where: Where, due: float, limits: Limits) -> Line:
    """The line that touches a path at a time; the steepest that can be met, where trial arrivals are too steep."""
    position, rate = where(due)
    most = limits.velocity * MARGIN
    rate = min(max(rate, -most), most)
    return Line(position - rate * due, rate)
