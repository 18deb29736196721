"""A plan that leads both axes to a fast target, so that each joins it with its velocity."""

import math

from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import Check
from pointing.mount import Posture
from pointing.path import Leg, SlewPath
from pointing.plan import AxisPlan, Leading, Plan, Start
from pointing.profile import Motion, Phase
from pointing.targets import Target
from pointing.trajectory import LedTravel, Trajectory
from pointing.vectors import Vector

_NOWHERE = Motion((Phase(0.0, 0.0, 0.0, 0.0),))


def led_plan(
    geometry: Geometry,
    target: Target,
    posture: Posture,
    near: tuple[float, float],
    sun: Vector,
    start: Start,
    leading: Leading,
) -> Plan:
    """Plan the earliest moment at which both axes are on the target with its velocity.

    Parameters
    ----------
    geometry : Geometry
        The telescope.
    target : Target
        What is met.
    posture, near
        The way to point there: posture, and axis angles, radians, whose windings are the nearest.
    sun : Vector
        Direction of the Sun as the motion begins.
    start : Start
        Where the axes are.
    leading : Leading
        What the axes can do.

    Returns
    -------
    Plan
        With its trajectory and all checks; they are not ok where it is forbidden or the target too fast.
    """
    delay = leading.delay_s
    counts = tuple(here + rate * delay for here, rate in zip(start.counts, start.rates, strict=True))
    begin = Start(start.time + delay, (counts[0], counts[1]), start.rates)
    trajectory = Trajectory(geometry, target, posture, near, leading, begin)
    if trajectory.unmet:
        detail = "the target is faster than the drive can be led, now and for the next ten minutes"
        return _nowhere(geometry, target, posture, near, start, Check("arrival", ok=False, detail=detail))
    arrival = max(trajectory.joined, begin.time)
    (angle1, rate1), (angle2, rate2) = trajectory.angles(arrival)
    axes, legs = [], []
    for i, (angle, rate) in enumerate(((angle1, rate1), (angle2, rate2))):
        setup, travel = geometry.axes[i], LedTravel(trajectory, i, begin.time, arrival - begin.time)
        gearing, scale = setup.gearing, abs(setup.gearing.counts_per_radian)
        rate_counts = rate * gearing.counts_per_radian
        axes.append(AxisPlan(setup.name, angle, rate, start.counts[i], setup.nearest(angle), rate_counts, travel))
        fastest = max(leading.ramps[i].max_rate, abs(start.rates[i])) / scale
        legs.append(Leg(gearing, travel, fastest, abs(start.rates[i]) / scale, joined=rate))
    path = SlewPath(
        geometry.mount, (legs[0], legs[1]), (sun, geometry.sun(geometry.sky.at(Instant.from_posix(arrival))))
    )
    turning = [
        check
        for angles in zip(*trajectory.extremes, strict=True)
        for check in geometry.axis_checks((angles[0], angles[1]))
        if not check.ok
    ]
    return Plan(
        target=target.name,
        start=start.time,
        arrival=arrival,
        posture=posture,
        observed=geometry.mount.observed(angle1, angle2),
        axes=(axes[0], axes[1]),
        checks=(*geometry.axis_checks((angle1, angle2)), *turning, *path.checks(geometry.limits, ends_clear=True)),
        trajectory=trajectory,
    )


def _nowhere(
    geometry: Geometry, target: Target, posture: Posture, near: tuple[float, float], start: Start, check: Check
) -> Plan:
    """A plan that leads nowhere, and says why."""
    one, two = (
        AxisPlan(axis.name, angle, 0.0, here, round(here), 0.0, _NOWHERE)
        for axis, angle, here in zip(geometry.axes, near, start.counts, strict=True)
    )
    return Plan(target.name, start.time, math.inf, posture, geometry.mount.observed(*near), (one, two), (check,))
