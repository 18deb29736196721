"""The keyhole and the highest altitude, foretold: against places that ERFA gives and their differences."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rotator_bench import AIR, LATITUDE, TIME, erfas, star_at, subject

from pointing.next_limit import next_limit
from pointing.time_lost import regained
from pointing.trajectory import Trajectory

BEFORE_S = 1200.0


def at(geometry, distance_deg):
    """A star that passes the zenith at a distance, south of it, BEFORE_S after TIME."""
    return star_at(geometry, 180.0, 90.0 - distance_deg, TIME + BEFORE_S)


def with_limits(fastest_deg_s, highest_deg):
    geometry = subject(misaligned=False)
    one, two = geometry.axes
    geometry.axes = geometry.free = (
        replace(one, minimum=math.radians(-195.0), maximum=math.radians(435.0), fastest=math.radians(fastest_deg_s)),
        replace(two, minimum=math.radians(6.0), maximum=math.radians(highest_deg), fastest=math.radians(1.5)),
    )
    return geometry


def speeds(star, times):
    """Speed in azimuth, degrees per second, and altitude, degrees, from places that ERFA gives 0.1 s apart."""
    places = [np.stack([erfas(star.ra, star.dec, AIR, t + dt) for dt in (-0.05, 0.05)]) for t in times]
    azimuth = [np.arctan2(p[:, 1], -p[:, 0]) for p in places]
    turned = [math.remainder(a[1] - a[0], math.tau) / 0.1 for a in azimuth]
    return np.degrees(np.abs(turned)), np.degrees([math.asin(p[:, 2].mean()) for p in places])


@pytest.mark.parametrize("distance_deg", [0.5, 0.2])
def test_sdss_follows_a_star_to_half_a_degree_from_the_zenith_and_nearer(distance_deg):
    geometry = with_limits(2.0, 90.0)
    star = at(geometry, distance_deg)
    fastest = speeds(star, np.arange(TIME + BEFORE_S - 60.0, TIME + BEFORE_S + 61.0, 2.0))[0].max()
    print(f"{distance_deg}° from the zenith the azimuth turns at {fastest:.3f}°/s")
    assert fastest < 2.0
    near = geometry.track(star, TIME, "normal", (math.pi, 0.0))
    way = Trajectory(geometry, star, "normal", (near[0][0], near[1][0]))
    assert next_limit(way, TIME, 2.0 * BEFORE_S) is None


@pytest.mark.parametrize("distance_deg", [0.09, 0.05, 0.02])
def test_the_keyhole_is_foretold_to_the_second_with_what_is_lost_in_it(distance_deg):
    geometry = with_limits(2.0, 90.0)
    star = at(geometry, distance_deg)
    times = TIME + BEFORE_S + np.arange(-30.0, 30.0, 0.1)
    too_fast = times[speeds(star, times)[0] > 2.0]
    near = geometry.track(star, TIME, "normal", (math.pi, 0.0))
    found = next_limit(Trajectory(geometry, star, "normal", (near[0][0], near[1][0])), TIME, 2.0 * BEFORE_S)
    assert found is not None
    moment, check = found
    again = regained(geometry, star, moment)
    print(f"{distance_deg}°: lost for {again - moment:.2f} s, ERFA's differences say {np.ptp(too_fast):.2f} s")
    assert check.name == "axis1 speed"
    assert "2.000°/s: the keyhole" in check.detail
    assert moment == pytest.approx(too_fast[0], abs=0.15)
    assert again == pytest.approx(too_fast[-1], abs=0.15)


def test_the_3_5_m_is_told_what_it_loses_above_85_degrees():
    geometry = with_limits(1.75, 85.0)
    star = at(geometry, 1.0)
    times = TIME + BEFORE_S + np.arange(-2400.0, 2400.0, 5.0)
    above = times[speeds(star, times)[1] > 85.0]
    begin = above[0] - 600.0
    near = geometry.track(star, begin, "normal", (math.pi, 0.0))
    moment, check = next_limit(Trajectory(geometry, star, "normal", (near[0][0], near[1][0])), begin)
    again = regained(geometry, star, moment)
    print(f"{again - moment:.1f} s are lost above 85°, by ERFA {np.ptp(above):.0f} s; latitude {LATITUDE:.2f}°")
    assert check.name == "axis2 soft limit"
    assert moment == pytest.approx(above[0], abs=5.1)
    assert again == pytest.approx(above[-1], abs=5.1)


def test_what_sets_is_not_regained_and_what_another_winding_goes_on_with_is_at_once():
    geometry = with_limits(2.0, 90.0)
    setting = star_at(geometry, 280.0, 8.0)
    near = geometry.track(setting, TIME, "normal", (math.pi, 0.0))
    moment, check = next_limit(Trajectory(geometry, setting, "normal", (near[0][0], near[1][0])), TIME)
    assert check.name in {"horizon", "axis2 soft limit"}
    assert regained(geometry, setting, moment) is None
    assert regained(geometry, star_at(geometry, 100.0, 50.0), TIME) == TIME


@pytest.mark.parametrize(("azimuth_deg", "altitude_deg"), [(85.0, -3.0), (60.0, -20.0), (270.0, 4.0), (20.0, -9.0)])
def test_what_is_forbidden_for_long_is_found_again_by_few_looks_as_one_each_ten_seconds_finds_it(
    azimuth_deg, altitude_deg
):
    geometry = subject(misaligned=False)
    star = star_at(geometry, azimuth_deg, altitude_deg, TIME)
    grid = np.arange(0.0, 10_801.0, 10.0)
    steps = [seconds for seconds in grid if geometry.allowed(star, TIME + seconds)]
    before = geometry.sky._frames.cache_info().misses
    again = regained(geometry, star, TIME)
    looks = geometry.sky._frames.cache_info().misses - before
    print(f"{looks} looks, regained after {'no time' if again is None else f'{again - TIME:.2f} s'}")
    assert looks < 80
    if not steps:
        assert again is None
    else:
        assert steps[0] - 10.0 < again - TIME <= steps[0]
        assert geometry.allowed(star, again)
        assert not geometry.allowed(star, again - 0.02)
