import math

import pytest
from apo_slews import between
from orbit import Overhead
from planning_bench import MIDNIGHT, planner

from mounts.apo.tracking_nodes import LONGEST_S, SHORTEST_S, interval_s
from pointing.instant import Instant
from pointing.mount import MountType
from pointing.solar_system import SolarSystemBody
from pointing.targets import Star

MAS = 1.0 / 3.6e6  # degrees
LATITUDE = 32.78
SUBJECT = planner(MountType.ALTAZ_FORK, LATITUDE, limits_deg=((-400.0, 400.0), (0.0, 95.0)), turned=(False, False))


def axis_paths(target, near=MIDNIGHT):
    """Degrees and degrees per second of both axes on a target, wound on from one time."""
    start = SUBJECT.track(target, near, "normal", (0.0, 0.7))
    wound = {"near": (start[0][0], start[1][0])}

    def of(axis):
        def where(when):
            state = SUBJECT.track(target, when, "normal", wound["near"])
            wound["near"] = state[0][0], state[1][0]
            return tuple(map(math.degrees, state[axis]))

        return where

    return of(0), of(1)


def star_at_zenith_distance(degrees):
    """A star that culminates so far south of the zenith at MIDNIGHT."""
    frame = SUBJECT.sky.at(Instant.from_posix(MIDNIGHT))
    low, high = 0.0, 360.0
    for _ in range(200):  # the right ascension that is on the meridian: east of it a star still rises
        middle = (low + high) / 2.0
        _, east, up = Star.from_degrees(middle, LATITUDE - degrees).observed(frame)
        anchor = math.atan2(east, up)
        low, high = (middle, high) if anchor < 0.0 else (low, middle)
    return Star.from_degrees((low + high) / 2.0, LATITUDE - degrees)


def walked(where, begin, end):
    """Nodes at the intervals told, and the worst error of the cubics between them, degrees."""
    when, steps, worst = begin, [], 0.0
    while when < end:
        step = interval_s(where, when)
        one, two = ((t, *where(t)) for t in (when, when + step))
        for k in range(1, 8):
            t = when + step * k / 8.0
            worst = max(worst, abs(between(one, two, t)[0] - where(t)[0]))
        steps.append(step)
        when += step
    return steps, worst


def told(name, where, begin, end):
    steps, worst = walked(where, begin, end)
    fastest = max(abs(where(begin + (end - begin) * k / 40.0)[1]) for k in range(41))
    spaced = f"{len(steps)} nodes of {min(steps):.2f} to {max(steps):.2f} s"
    print(f"{name}: {spaced}, {worst / MAS:.4f} mas, {fastest:.3f}°/s")
    return steps, worst


@pytest.mark.parametrize("distance", [0.5, 1.0, 5.0, 40.0])
def test_cubics_keep_within_a_milliarcsecond_of_a_star_that_passes_the_zenith(distance):
    for axis, where in zip(("azimuth", "altitude"), axis_paths(star_at_zenith_distance(distance)), strict=True):
        steps, worst = told(f"star {distance}° from the zenith, {axis}", where, MIDNIGHT - 60.0, MIDNIGHT + 60.0)
        assert worst < MAS
        assert max(steps) <= LONGEST_S


@pytest.mark.parametrize("name", ["Moon", "Mars", "Jupiter"])
def test_cubics_keep_within_a_milliarcsecond_of_moon_and_planets(name):
    target = SolarSystemBody(name)
    begin = next(
        MIDNIGHT + hour * 3600.0
        for hour in range(25)
        if target.observed(SUBJECT.sky.at(Instant.from_posix(MIDNIGHT + hour * 3600.0)))[2] > 0.4
    )
    for axis, where in zip(("azimuth", "altitude"), axis_paths(target, begin), strict=True):
        steps, worst = told(f"{name}, {axis}", where, begin, begin + 120.0)
        assert worst < MAS
        assert min(steps) == LONGEST_S


@pytest.mark.parametrize("miss", [0.2, 1.0, 3.0])
def test_cubics_keep_within_a_milliarcsecond_of_a_satellite_at_400_km(miss):
    target = Overhead(MIDNIGHT, 1.1, math.radians(miss))
    for axis, where in zip(("azimuth", "altitude"), axis_paths(target, MIDNIGHT - 90.0), strict=True):
        steps, worst = told(f"satellite {miss}°, {axis}", where, MIDNIGHT - 60.0, MIDNIGHT + 60.0)
        assert worst < MAS
        assert min(steps) >= SHORTEST_S


def test_a_quiet_path_has_nodes_as_far_apart_as_a_controller_may_be_left_alone():
    assert interval_s(lambda when: (0.004 * when, 0.004), 100.0) == LONGEST_S
    assert (
        interval_s(lambda when: (0.001 * when**2 - when**3 * 1e-6, 0.002 * when - when**2 * 3e-6), 9.0) == LONGEST_S
    )


def test_nodes_of_a_quartic_are_no_closer_than_its_bound_and_safety_ask():
    """The error of a cubic on a quartic c t⁴ is c h⁴/16 exactly."""
    for size in (1e-6, 1e-4, 1e-2):
        h = interval_s(lambda when, c=size: (c * when**4, 4.0 * c * when**3), 0.0)
        error = size * h**4 / 16.0
        print(f"{size:g} t⁴: {h:.3f} s, {error / MAS:.3f} mas")
        assert error <= MAS
        assert error > 0.1 * MAS or h == LONGEST_S
