import math
import random
from dataclasses import replace
from fractions import Fraction

import pytest
from apo_slews import AXES
from orbit import Overhead
from planning_bench import MIDNIGHT, random_star

from mounts.apo.slew_model import ApoSlewModel
from pointing.errors import Unreachable
from pointing.gearing import Gearing
from pointing.limits import Horizon, Limits
from pointing.mount import Mount, MountType
from pointing.plan import Axis, Start, Timing
from pointing.planner import Planner
from pointing.site import Site
from pointing.sky import Sky
from pointing.slew import Waiting, meets

ARCSEC = 1.0 / 3600.0
LATITUDE = 32.7803


def telescope(kind, *, low_deg=20.0):
    """A planner in the controllers' degrees, and the laws of its axes, each of which joins its target by itself."""
    (az, az_low, az_high), (alt, alt_low, alt_high) = (AXES[f"{kind} {axis}"] for axis in ("azimuth", "altitude"))
    axes = tuple(
        Axis(f"axis{i + 1}", Gearing(Fraction(1), 0, 0.0), math.radians(low), math.radians(high), "degrees")
        for i, (low, high) in enumerate(((az_low, az_high), (alt_low, alt_high)))
    )
    planner = Planner(
        Sky(Site.from_degrees(LATITUDE, -105.8203, 2788.0)),
        Mount(MountType.ALTAZ_FORK, math.radians(LATITUDE), 0.0, 0.0),
        (axes[0], axes[1]),
        Limits(Horizon.level(low_deg), 0.0),
    )
    return planner, Timing((az, alt), 2.0, together=False)


def missed(planner, plan, target, timing):
    """By how much each axis misses its target in place and velocity as it lands, degrees, and per second."""
    begin = plan.start + timing.latency
    found = []
    for i, axis in enumerate(plan.axes):
        there, rate = planner.track(target, begin + axis.travel.duration, plan.posture, near(plan))[i]
        _, landed, velocity = axis.travel.way.end
        found.append((abs(landed - math.degrees(there)), abs(velocity - math.degrees(rate))))
    return found


def near(plan):
    return plan.axes[0].angle, plan.axes[1].angle


@pytest.mark.parametrize("arcsec", [0.0, 5.0, 60.0])
def test_a_short_slew_is_planned_to_last_and_is_where_it_ends_until_then(arcsec):
    law = replace(AXES["3.5 m azimuth"][0], shortest_s=1.5)
    travel = law.travel(10.0, 10.0 + arcsec * ARCSEC, 0.0, 0.0)
    assert travel.way.duration < travel.duration == 1.5
    assert travel.position(travel.way.duration) == travel.position(1.5) == travel.landed


@pytest.mark.parametrize("kind", ["3.5 m", "SDSS"])
def test_the_planner_meets_stars_in_place_and_velocity_from_any_drift(kind):
    planner, timing = telescope(kind)
    rng = random.Random(1)  # noqa: S311 - nothing secret
    worst, planned = [0.0, 0.0], 0
    while planned < 12:
        target = random_star(rng)
        start = Start(MIDNIGHT, (rng.uniform(-150.0, 300.0), rng.uniform(30.0, 80.0)), (rng.uniform(-1.0, 1.0), 0.1))
        best, _ = planner.straight(target, start, timing)
        if best is None:
            continue
        planned += 1
        for place, speed in missed(planner, best, target, timing):
            worst = max(worst[0], place), max(worst[1], speed)
    print(f"{kind}: {planned} stars met within {worst[0] / ARCSEC:.1e}″ and {worst[1] / ARCSEC:.1e}″/s")
    assert worst[0] < 0.05 * ARCSEC
    assert worst[1] < 0.05 * ARCSEC


@pytest.mark.parametrize("kind", ["3.5 m", "SDSS"])
def test_the_planner_meets_a_satellite_in_place_and_velocity(kind):
    planner, timing = telescope(kind)
    worst, met = [0.0, 0.0], 0
    for miss in (6.0, 9.0):
        target = Overhead(MIDNIGHT, 1.1, math.radians(miss))
        for ahead in (-110.0, -60.0, -20.0, 20.0):
            start = Start(MIDNIGHT + ahead, (100.0, 50.0), (0.05, -0.02))
            best, refused = planner.straight(target, start, timing)
            plan = best or refused
            if any(check.name == "arrival" for check in plan.checks):
                continue
            met += 1
            for place, speed in missed(planner, plan, target, timing):
                worst = max(worst[0], place), max(worst[1], speed)
    print(f"{kind}: {met} satellites met within {worst[0] / ARCSEC:.1e}″ and {worst[1] / ARCSEC:.1e}″/s")
    assert met == 8
    assert worst[0] < 0.05 * ARCSEC
    assert worst[1] < 0.05 * ARCSEC


@pytest.mark.parametrize("kind", ["3.5 m", "SDSS"])
def test_axes_that_land_together_do_when_the_slower_one_could_from_any_drift(kind):
    planner, each = telescope(kind)
    together = replace(each, together=True)
    rng = random.Random(3)  # noqa: S311 - nothing secret
    planned, apart, missed_deg, waits = 0, 0.0, 0.0, []
    while planned < 12:
        here, drift = (
            (rng.uniform(-100.0, 200.0), rng.uniform(30.0, 80.0)),
            (rng.gauss(0.0, 0.3), rng.gauss(0.0, 0.1)),
        )
        start = Start(MIDNIGHT, here, drift)
        target = random_star(rng)
        try:
            soonest = planner.plan(target, start, each, search=False)
        except Unreachable:
            continue
        plan = planner.plan(target, start, together, search=False)
        planned += 1
        assert plan.arrival == pytest.approx(soonest.arrival, abs=1e-3)
        one, two = (axis.travel for axis in plan.axes)
        apart = max(apart, abs(one.duration - two.duration))
        for i, travel in enumerate((one, two)):
            there = math.degrees(planner.track(target, plan.arrival, plan.posture, near(plan))[i][0])
            missed_deg = max(missed_deg, abs(travel.landed - there))
            if isinstance(travel, Waiting):
                waits.append(travel.wait)
                before, after = (travel.position(travel.wait + k * 1e-7) for k in (-1.0, 1.0))
                assert after == pytest.approx(before, abs=1e-6)
                begins = start.counts[i] + start.rates[i] * together.latency
                assert travel.position(0.0) == pytest.approx(begins, abs=1e-9)
    waited = f"waits of {min(waits):.1f} to {max(waits):.1f} s"
    print(f"{kind}: {apart:.1e} s apart, {missed_deg / ARCSEC:.1e}″ off, {waited}")
    assert len(waits) == planned
    assert apart < 1e-5
    assert missed_deg < 0.01 * ARCSEC


def test_the_law_is_one_that_can_be_asked_how_soon_it_is_on_a_line():
    assert meets(ApoSlewModel(1.0, 1.0, 1.0))


def star_near(planner, azimuth_deg):
    """A star within 3° of an azimuth, 25° to 60° high, which turns clockwise: those but above the pole."""
    rng = random.Random(3)  # noqa: S311 - nothing secret
    for _ in range(20_000):
        star, anchor = random_star(rng), (math.radians(azimuth_deg), 0.7)
        (azimuth, rate), (altitude, _) = planner.track(star, MIDNIGHT, "normal", anchor)
        if abs(math.degrees(azimuth) - azimuth_deg) < 3.0 and 25.0 < math.degrees(altitude) < 60.0 and rate > 0.0:
            return star
    raise AssertionError(azimuth_deg)


@pytest.mark.parametrize(
    ("kind", "begin", "seen", "wound"),
    [
        ("3.5 m", 300.0, -5.0, -5.0),  # at 355° it would reach the end of the travel within the hour
        ("3.5 m", 250.0, 200.0, 200.0),  # both ways are long enough: the nearer one
        ("3.5 m", -100.0, 200.0, -160.0),
        ("SDSS", 420.0, 70.0, 70.0),  # at 430° likewise
        ("SDSS", 300.0, -5.0, 355.0),  # beyond 360° there is room for hours
        ("SDSS", -190.0, 170.0, -190.0),
    ],
)
def test_the_winding_is_the_nearest_in_which_the_target_can_be_tracked_for_two_hours(kind, begin, seen, wound):
    planner, timing = telescope(kind)
    plan = planner.plan(star_near(planner, seen), Start(MIDNIGHT, (begin, 45.0)), timing)
    print(f"{kind}, from {begin}°: {math.degrees(plan.axes[0].angle):.1f}° at arrival")
    assert math.degrees(plan.axes[0].angle) == pytest.approx(wound, abs=5.0)
