"""The plan of a pass: what is lost, and when it is over, by the rule by which the telescope is stopped."""

import math
from dataclasses import replace

import pytest
from orbit import Overhead
from planning_bench import COUNTS_PER_DEGREE, MIDNIGHT, planner

from pointing.instant import Instant
from pointing.mount import MountType
from pointing.pass_plan import pass_plan, planned_pass
from pointing.plan import Leading, Start
from pointing.profile import Ramps
from pointing.trajectory import Trajectory

SPEED, RAMP, PERIOD = 4.0, 0.9, 0.1  # degrees a second, and a second each second; seconds between two looks
AXIS = Ramps(SPEED * COUNTS_PER_DEGREE, RAMP * COUNTS_PER_DEGREE)
LEADING = Leading((AXIS, AXIS), 0.5, PERIOD)
ARCSEC = math.pi / 648_000.0
ZENITH = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.05))


def subject(travel_deg=(-400.0, 400.0)):
    return planner(MountType.ALTAZ_FORK, limits_deg=(travel_deg, (-5.0, 95.0)), turned=(False, False))


def best_pass(geometry, target):
    time = MIDNIGHT
    while not geometry.allowed(target, time):
        time += 0.5
    return pass_plan(geometry, target, time, LEADING)


def cut_short(found, edge, *, above):
    """The same pass where the travel of axis 1 ends at an angle, radians, too narrow for the other way round."""
    geometry = subject()
    lowest, highest = (edge - math.radians(200.0), edge) if above else (edge, edge + math.radians(200.0))
    axis = replace(geometry.axes[0], minimum=lowest, maximum=highest)
    geometry.axes = geometry.free = (axis, geometry.axes[1])
    begin = found.reachable + 0.1
    counts = tuple(each.gearing.counts(angle) for each, angle in zip(geometry.axes, found.wait, strict=True))
    way = Trajectory(geometry, ZENITH, found.posture, found.wait, LEADING, Start(begin, counts))
    return planned_pass(way, found.reachable, found.wait)


def off_arcsec(geometry, found, time):
    """Angle between two unit vectors by their difference."""
    (one, _), (two, _) = found.trajectory.angles(time)
    there = geometry.mount.observed(one, two), ZENITH.observed(geometry.sky.at(Instant.from_posix(time)))
    return 2.0 * math.asin(math.dist(*there) / 2.0) / ARCSEC


def test_what_is_lost_is_what_is_more_than_five_arcseconds_off():
    geometry = subject()
    found = best_pass(geometry, ZENITH)
    ((left, joined),) = found.trajectory.gaps(found.ends)
    step = 0.01
    times = [left - 1.0 + step * k for k in range(round((joined - left + 2.0) / step))]
    off = [time for time in times if off_arcsec(geometry, found, time) > 5.0]
    ((begin, end),) = found.lost
    print(f"on a bridge for {joined - left:.2f} s, off for {len(off) * step:.2f} s, told {found.lost_s:.2f} s")
    assert begin == pytest.approx(off[0], abs=step)
    assert end == pytest.approx(off[-1], abs=step)
    assert found.lost_s == pytest.approx(len(off) * step, abs=2.0 * step)
    assert left < begin < end < joined


@pytest.mark.parametrize("short_deg", [0.5, 30.0, 120.0])
def test_a_bridge_that_leads_to_a_limit_ends_the_pass_where_it_would_begin(short_deg):
    """Anywhere on the way of axis 1 round the zenith, and for however short a stretch."""
    found = best_pass(subject(), ZENITH)
    ((begin, end),) = found.trajectory.gaps(found.ends)
    way = [found.trajectory.angles(begin + (end - begin) * k / 400)[0][0] for k in range(401)]
    up = way[-1] > way[0]
    farthest = max(way) if up else min(way)
    edge = farthest - math.copysign(math.radians(short_deg), 1.0 if up else -1.0)
    cut = cut_short(found, edge, above=up)
    print(f"limit {short_deg}° before the end: over {cut.ends - begin:+.3f} s after the bridge begins")
    assert cut.ends == pytest.approx(begin, abs=1e-6)
    assert cut.lost == ()
    assert cut.limit.name == "axis1 soft limit"


def test_a_pass_is_over_when_the_axes_would_not_come_to_rest_within_the_limits():
    """Braking integrated in steps of a millisecond from the look after the next, against the plan."""
    found = best_pass(subject(), ZENITH)
    ((begin, _),) = found.trajectory.gaps(found.ends)
    here, there = (found.trajectory.angles(begin - ahead)[0][0] for ahead in (60.0, 2.0))
    up = there > here
    cut = cut_short(found, there, above=up)

    def rests(time):
        angle, rate = found.trajectory.angles(time)[0]
        angle, braking = angle + rate * 2.0 * PERIOD, math.copysign(math.radians(RAMP), rate)
        while rate * braking > 0.0:
            angle, rate = angle + rate * 1e-3, rate - braking * 1e-3
        return angle

    time = begin - 10.0
    while (rests(time) < there) == up:
        time += 0.01
    reached = begin - 2.0
    print(f"over {reached - cut.ends:.2f} s before the limit is reached, by integration {reached - time:.2f} s")
    assert cut.ends == pytest.approx(time, abs=0.03)
    assert reached - cut.ends > 2.0 * PERIOD
