"""How the rotator gets where it holds the field: which winding, when it is there, how long it may stay.

The rotator goes while the axes do: it meets the angle that is right when they arrive, or later by itself where its
way takes longer. The plan arrives when all do. Of two legs the rotator goes on the second: the first one halts it.
Of the windings within its limits the one that holds the target for longest is taken, up to two hours; of those that
hold it as long, the one that is there first. One that holds it for less than half a minute is none.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from pointing.errors import PointingError, TargetError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import Check
from pointing.plan import AxisPlan, Plan, RotatorPlan, Start, Timing
from pointing.rotator import Held, Hold, Rotator, RotatorPath
from pointing.slew import Travel, travelled
from pointing.targets import Target
from pointing.way_round import BETWEEN_S

_KEPT_S = 7200.0  # for which a winding should hold its target
_ALIKE_S = 2.0  # by which two may differ and hold it equally long
_LEAST_S = 30.0  # a drive is given its path ten seconds ahead
_LONGEST_S = 3600.0  # for which a rotator may be on its way
_ROUNDS = 60  # the fixed point contracts by field rotation over speed, 0.2 at 0.5° from the zenith


def with_rotator(
    geometry: Geometry, plan: Plan, target: Target, start: Start, timing: Timing, hold: Hold | None = None
) -> Plan:
    """Add to a plan what the rotator does, where the telescope has one.

    Parameters
    ----------
    geometry : Geometry
        Sky and mount.
    plan : Plan
        Of the axes; its posture is kept.
    target : Target
        At which the rotator holds what it is to hold.
    start, timing : Start, Timing
        Where the rotator is, and its law of motion.
    hold : Hold, optional
        What it is to hold; by default what the telescope's rotator holds.

    Raises
    ------
    Unreachable
        It is to hold an angle outside its limits, or turn faster than it can.
    PointingError
        There is no north, or no way up, at the target.
    """
    if geometry.rotator is None:
        return plan
    rotator, start = geometry.rotator.holding(hold), _on_the_last_leg(plan, start)
    held = Held(geometry, target, plan.posture, rotator.hold)
    ways = sorted(_ways(held, plan, rotator, start, timing), key=lambda way: way.arrival)
    best, kept = None, 0.0
    for way in ways:
        holds = _KEPT_S if way.limit is None else min(way.limit[0] - way.arrival, _KEPT_S)
        if best is None or holds > kept + _ALIKE_S:
            best, kept = way, holds
    if best is None or kept < _LEAST_S:
        check = _missed(held, plan.arrival, rotator, timing)
        if best is not None and best.limit is not None:
            check = _soon(best.arrival, *best.limit)
        raise Unreachable(f"{plan.target}: {check.detail}", checks=(*plan.checks, check))
    checks = (*plan.checks, rotator.check(best.axis.angle), _speed(best, rotator, timing))
    if not checks[-1].ok:
        raise Unreachable(f"{plan.target}: {checks[-1].detail}; hold the mount, or wait", checks=checks)
    return _arriving_together(geometry, replace(plan, rotator=best, checks=checks), target)


def _on_the_last_leg(plan: Plan, start: Start) -> Start:
    """Where the rotator is when the last leg of a plan begins."""
    if plan.via is None or start.rotator is None:
        return start
    return replace(start, time=plan.via.arrival + BETWEEN_S, rotator=(start.rotator[0], 0.0))


def _arriving_together(geometry: Geometry, plan: Plan, target: Target) -> Plan:
    """The plan with the arrival of its rotator, where that is the last; the axes are where they track it then."""
    turns = plan.rotator
    if turns is None or turns.arrival <= plan.arrival:
        return plan
    near = plan.axes[0].angle, plan.axes[1].angle
    one, two = (
        replace(axis, angle=angle, rate=rate)
        for axis, (angle, rate) in zip(
            plan.axes, geometry.track(target, turns.arrival, plan.posture, near), strict=True
        )
    )
    observed = target.observed(geometry.sky.at(Instant.from_posix(turns.arrival)))
    return replace(plan, arrival=turns.arrival, axes_arrival=plan.arrival, axes=(one, two), observed=observed)


def rotator_path(geometry: Geometry, plan: Plan, target: Target) -> RotatorPath | None:
    """The way of the rotator along a target, from a plan on; None where the plan has none."""
    if plan.rotator is None or geometry.rotator is None:
        return None
    held = Held(geometry, target, plan.posture, plan.rotator.hold)
    return RotatorPath(geometry.rotator, held, plan.rotator.axis.angle, plan.rotator.arrival)


def turned_to(geometry: Geometry, plan: Plan, angle: float, start: Start, timing: Timing) -> Plan:
    """Add to a plan that ends at rest the rotator's way to an angle, radians, at which it rests.

    Raises
    ------
    Unreachable
        The angle is outside its limits.
    PointingError
        There is no rotator.
    """
    rotator = geometry.rotator
    if rotator is None:
        raise PointingError("this telescope has no rotator that could turn")
    check = rotator.check(angle)
    if not check.ok:
        raise Unreachable(f"{plan.target}: {check.detail}", checks=(*plan.checks, check))
    there = rotator.axis.nearest(angle)
    here, travel = _travel(there, 0.0, start, timing)
    axis = AxisPlan(rotator.axis.name, angle, 0.0, here, there, 0.0, travel)
    turns = RotatorPlan(Hold("mount", angle), axis, start.time + timing.latency + travel.duration)
    plan = replace(plan, rotator=turns, checks=(*plan.checks, check))
    if turns.arrival <= plan.arrival:
        return plan
    return replace(plan, arrival=turns.arrival, axes_arrival=plan.arrival)


def _ways(held: Held, plan: Plan, rotator: Rotator, start: Start, timing: Timing) -> Iterator[RotatorPlan]:
    """Each winding within the limits that can be met and holds the target from then on."""
    for near in rotator.axis.windings(held.angle(plan.arrival)):
        way = _met(held, near, plan.arrival, rotator, start, timing)
        if way is not None:
            yield way


def _met(
    held: Held, near: float, soonest: float, rotator: Rotator, start: Start, timing: Timing
) -> RotatorPlan | None:
    """Solve the arrival and the angle together, on the winding of `near` at the time `soonest`."""
    axis, begin = rotator.axis, start.time + timing.latency
    path = RotatorPath(rotator, held, near)
    angle, rate = path.state(soonest)
    arrival = soonest
    for _ in range(_ROUNDS):
        target, rate_counts = axis.nearest(angle), rate * axis.gearing.counts_per_radian
        here, travel = _travel(target, rate_counts, start, timing, arrival - begin)
        arrival = max(begin + travel.duration, soonest)
        if travel.duration > _LONGEST_S:
            return None
        path.near = angle
        angle, rate = path.state(arrival)
        if abs(axis.nearest(angle) - target) <= axis.settled:
            break
    else:
        return None
    if not rotator.check(angle).ok:
        return None
    plan = AxisPlan(axis.name, angle, rate, here, target, rate_counts, travel)
    limit = None
    with suppress(TargetError):  # nobody knows its place so far ahead
        limit = path.next_limit(arrival, arrival + _KEPT_S)
    return RotatorPlan(rotator.hold, plan, arrival, limit)


def _soon(arrival: float, moment: float, check: Check) -> Check:
    """That the best winding meets its limit at once."""
    return replace(check, detail=f"{moment - arrival:.0f} s after the arrival the {check.detail}")


def _missed(held: Held, time: float, rotator: Rotator, timing: Timing) -> Check:
    """Why no winding holds a target from a time on: its limits, or that the field turns away."""
    angle, rate = held.state(time, (rotator.axis.minimum + rotator.axis.maximum) / 2.0)
    check = rotator.check(angle, f"rotator, to hold {rotator.hold},")
    if not check.ok:
        return check
    most = 0.0 if timing.rotator is None else timing.rotator.max_rate * rotator.axis.gearing.step_deg_float
    said = f"the field turns at {math.degrees(rate):.5f}°/s, nearly as fast as the rotator, {most:.3f}°/s"
    return Check("rotator", ok=False, detail=f"{said}: no arrival was found; hold the mount, or wait")


def _travel(
    target: float, rate: float, start: Start, timing: Timing, due: float | None = None
) -> tuple[float, Travel]:
    """Where the rotator is, counts, and its travel from where it will be when the motion begins.

    It goes to `target` counts, or is there `due` seconds after that, of a drive that meets what moves.
    """
    if start.rotator is None or timing.rotator is None:
        raise PointingError("a rotator whose position or law of motion nobody knows: give Start and Timing its own")
    here, before = start.rotator
    return here, travelled(timing.rotator, here + before * timing.latency, before, target, rate, due)


def _speed(way: RotatorPlan, rotator: Rotator, timing: Timing) -> Check:
    """Whether the rotator can follow the field once it is there."""
    degrees = rotator.axis.gearing.step_deg_float
    most = 0.0 if timing.rotator is None else timing.rotator.max_rate * degrees
    needed = abs(way.axis.rate_counts) * degrees
    said = f"the rotator turns with the field at {needed:.5f}°/s, the drive reaches {most:.3f}°/s"
    return Check("rotator speed", ok=needed <= most, detail=said)
