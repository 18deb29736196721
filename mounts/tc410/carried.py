"""A position carried from the moment it was read to that of the flags, and by how much that may be off.

Positions and flags come in different requests, between which an axis in motion goes on. Where it keeps to the law of
its slew, the law says how far. Where something stops or pushes it, its measured velocity does, and no axis changes
its velocity faster than its ramps allow, unless it loses its power.
"""

from math import sqrt
from typing import NamedTuple

from mounts.tc410.look import Look
from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import STEPS_PER_TICK, TICK_S, Tc410SlewModel
from mounts.tc410.slew_watch import STEEPER, WAIT_S, AxisWatch
from mounts.tc410.unit import Values

STEP_S = TICK_S / STEPS_PER_TICK  # the drive moves in steps of 50 µs
_RAMP = 0x100 * COUNTS_PER_SECOND / TICK_S  # counts/s² for 1 in the acceleration register


class Carried(NamedTuple):
    """One axis at the moment of the flags."""

    counts: float
    uncertainty: float
    rate: float


def by_law(watch: AxisWatch, counts: float, at: Values, state: Values) -> Carried:
    """Carry a count by the law of the slew under way.

    An axis that is astray from where the law has it has another velocity as well. Where its ramp is another one,
    they differ by 2 d/t after a time t; where something stops it, ramps of a that part from each other by a distance
    d differ by √(4 a d), one speeding up while the other slows down.
    """
    rate, elapsed = watch.rate(state.time), state.time - at.time
    moved = watch.position(state.time) - watch.position(at.time)
    ramp = _steepest(watch.model)
    astray = watch.astray(counts, at)
    off = ramp * WAIT_S + 4.0 * astray / max(at.time - watch.began, WAIT_S)
    if not watch.keeps_to_law(counts, at):
        off = max(off, sqrt(4.0 * ramp * astray))
    late = at.late_s + state.late_s + STEP_S
    return Carried(counts + 0.5 + moved, 0.5 + off * elapsed + (abs(rate) + off) * late, rate)


def by_velocity(
    model: Tc410SlewModel, seen: Look, velocity: Values, axis: int, moved: tuple[float, float]
) -> Carried:
    """Carry the count of axis 1 or 2 by its velocity, read after the flags.

    An axis that has `moved` by d in the t since the look before, in ramps of a, was no faster than d/t + a t/2, and
    no faster than √(2 a d) where that ramp is shorter than t. One that stands still may have lost its power, and
    stopped at once.
    """
    at, state = seen.positions[axis - 1], seen.state
    rate, elapsed = velocity[f"axis{axis}_velocity"] * COUNTS_PER_SECOND, state.time - at.time
    ramp, (way, since) = _steepest(model), (moved[0] + 1.0, moved[1])
    since = min(since, sqrt(2.0 * way / ramp)) if since > 0.0 else sqrt(2.0 * way / ramp)
    off = abs(rate) + min(model.max_rate, way / since + ramp * since / 2.0)
    if seen.powered and seen.motion and rate:
        off = min(off, ramp * (velocity.time + velocity.late_s - at.time))
    late = at.late_s + state.late_s + STEP_S
    counts = seen.counts[axis - 1] + 0.5 + rate * elapsed
    return Carried(counts, 0.5 + off * elapsed + (abs(rate) + off) * late, rate)


def _steepest(model: Tc410SlewModel) -> float:
    """The fastest change of velocity, counts/s²."""
    return max(model.acceleration, model.deceleration) * _RAMP * STEEPER
