"""The horizon, the Sun's zone, and tables that cannot be one."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.limits import Horizon, Limits, separation
from pointing.vectors import azimuth_altitude, from_azimuth_altitude

HILLS = ((0.0, 10.0), (80.0, 12.0), (90.0, 35.0), (100.0, 12.0), (200.0, -3.0), (300.0, 40.0))


def profile(rows=HILLS):
    return Horizon(tuple((math.radians(azimuth), math.radians(altitude)) for azimuth, altitude in rows))


@cache
def widened(limits, by):
    return limits.widened(by)


def looking(azimuth_deg, altitude_deg):
    return from_azimuth_altitude(math.radians(azimuth_deg), math.radians(altitude_deg))


def test_a_horizon_runs_straight_between_its_points_and_closes_through_north():
    horizon = profile()
    azimuths = np.linspace(-400.0, 400.0, 4001)
    table = [*((azimuth - 360.0, altitude) for azimuth, altitude in HILLS), *HILLS, (360.0, 10.0)]
    wanted = np.interp(azimuths % 360.0, [row[0] for row in table], [row[1] for row in table])
    ours = [math.degrees(horizon.altitude(math.radians(azimuth))) for azimuth in azimuths]
    assert np.allclose(ours, wanted, atol=1e-9)
    assert math.degrees(horizon.altitude(-1e-300)) == pytest.approx(10.0)


def test_a_level_horizon_is_the_same_all_round():
    horizon = Horizon.level(15.0)
    for azimuth in (-1.0, 0.0, 2.0, 7.0):
        assert math.degrees(horizon.altitude(azimuth)) == pytest.approx(15.0)
    assert math.degrees(horizon.margin(looking(123.0, 17.5))) == pytest.approx(2.5)


@settings(derandomize=True, deadline=None)
@given(
    st.floats(0.0, 360.0),
    st.floats(-89.0, 90.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, math.tau),
    st.sampled_from((0.0, -0.1)),
)
def test_nothing_within_the_room_of_a_direction_is_below_the_horizon(azimuth, altitude, part, bearing, floor):
    horizon = profile()
    here = looking(azimuth, altitude)
    room = horizon.room(here, floor)
    if room <= 0.0:
        assert horizon.margin(here) <= floor + 1e-12
        return
    assert horizon.margin(here) >= floor
    v = np.array(here)
    up = np.array((0.0, 0.0, 1.0)) if abs(v[2]) < 0.9 else np.array((1.0, 0.0, 0.0))
    one = np.cross(v, up) / np.linalg.norm(np.cross(v, up))
    two = np.cross(v, one)
    step = part * room
    there = v * math.cos(step) + math.sin(step) * (one * math.cos(bearing) + two * math.sin(bearing))
    assert horizon.margin(tuple(there)) >= floor - 1e-9


@settings(derandomize=True, deadline=None)
@given(st.floats(0.0, 6.28), st.floats(-1.5, 1.5), st.floats(0.0, 6.28), st.floats(-1.5, 1.5))
def test_separation_is_that_of_the_haversine_whatever_the_lengths(a1, e1, a2, e2):
    a, b = from_azimuth_altitude(a1, e1), from_azimuth_altitude(a2, e2)
    chord = math.hypot(*(p - q for p, q in zip(a, b, strict=True)))
    assert separation(a, b) == pytest.approx(2.0 * math.asin(min(1.0, chord / 2.0)), abs=1e-7)
    assert separation(a, tuple(0.3 * c for c in b)) == pytest.approx(separation(a, b), abs=1e-12)


def test_the_sun_keeps_its_distance_and_no_zone_is_no_limit():
    limits = Limits(Horizon.level(0.0), math.radians(20.0))
    assert math.degrees(limits.sun_margin(looking(0, 30), looking(0, 55))) == pytest.approx(5.0)
    assert math.degrees(limits.sun_margin(looking(0, 30), looking(0, 40))) == pytest.approx(-10.0)
    assert Limits(Horizon.level(0.0)).sun_margin(looking(0, 30), looking(0, 30)) == math.inf


@pytest.mark.parametrize("zone", [-0.1, math.nan, 4.0, math.inf])
def test_an_impossible_zone_round_the_sun_is_refused(zone):
    with pytest.raises(PointingError, match="allowed are 0° "):
        Limits(Horizon.level(0.0), zone)


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "horizon.csv"
    path.write_text(text, encoding=encoding)
    return Horizon.read(path)


@pytest.mark.parametrize(
    "text",
    [
        "azimuth_deg,altitude_deg\n0,10\n90,20\n270,5\n",
        "azimuth_deg,altitude_deg\r\n270,5\r\n-0,10\r\n90,20",
        "altitude_deg,azimuth_deg,what\n5,-90,trees\n20,90,hill\n10,0,\n10,360,the first again\n",
        "\ufeffazimuth_deg, altitude_deg\n0, 10\n90, 20\n270, 5\n\n",
        "azimuth_deg,altitude_deg\n-1e-20,10\n90,20\n270,5\n",
    ],
)
def test_one_horizon_may_be_written_in_many_ways(tmp_path, text):
    horizon = read(tmp_path, text)
    degrees = [(math.degrees(azimuth), math.degrees(altitude)) for azimuth, altitude in horizon.altitudes]
    assert np.allclose(degrees, [(0.0, 10.0), (90.0, 20.0), (270.0, 5.0)])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "first line must name the columns azimuth_deg,altitude_deg"),
        ("azimuth_deg,altitude_deg\n", "has no rows"),
        ("azimuth,altitude\n0,10\n", "first line must name"),
        ("0,10\n90,20\n", "first line must name"),
        ("azimuth_deg,altitude_deg\n0,10\n90\n", "line 3: '90', None are not two numbers"),
        ("azimuth_deg,altitude_deg\n0,10\n\n90,low\n", "line 4: '90', 'low'"),
        ("azimuth_deg,altitude_deg\n0,10\n0,20\n", r"line 3: azimuth 0° has two altitudes, 10° and 20°"),
        ("azimuth_deg,altitude_deg\n0,10\n360,20\n", "two altitudes"),
        ("azimuth_deg,altitude_deg\n0,nan\n", "line 2: azimuth 0°, altitude nan°; possible are"),
        ("azimuth_deg,altitude_deg\n1e400,5\n", "possible are"),
        ("azimuth_deg,altitude_deg\n10,90\n", "below 90°"),
        ("azimuth_deg,altitude_deg\n3600,5\n", "possible are −360° to 360°"),
    ],
)
def test_a_bad_horizon_file_is_refused_with_file_and_line(tmp_path, text, said):
    with pytest.raises(PointingError, match=said) as refused:
        read(tmp_path, text)
    assert "horizon.csv" in str(refused.value)


def test_a_missing_or_binary_horizon_file_is_refused(tmp_path):
    with pytest.raises(PointingError, match="check the path"):
        Horizon.read(tmp_path / "none.csv")
    (tmp_path / "horizon.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(PointingError, match=r"horizon\.csv"):
        Horizon.read(tmp_path / "horizon.csv")


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ((), "empty horizon"),
        (((90.0, 5.0), (10.0, 5.0)), "must ascend"),
        (((10.0, 5.0), (10.0, 6.0)), "must ascend"),
        (((-10.0, 5.0),), "must ascend"),
        (((10.0, 95.0),), "95°"),
        (((10.0, math.nan),), "nan"),
        (((math.nan, 5.0),), "must ascend"),
    ],
)
def test_a_horizon_out_of_order_is_refused(rows, said):
    with pytest.raises(PointingError, match=said):
        profile(rows)


def test_a_direction_keeps_its_azimuth_in_the_table():
    assert math.degrees(azimuth_altitude(looking(300.0, 40.0))[0]) == pytest.approx(300.0)
    assert profile().margin(looking(300.0, 40.0)) == pytest.approx(0.0, abs=1e-12)


@settings(derandomize=True, deadline=None)
@given(
    st.sampled_from((HILLS, ((0.0, 15.0),), ((0.0, 3.0), (0.5, 60.0), (1.0, 3.0)))),
    st.floats(0.0, 360.0),
    st.floats(-20.0, 90.0),
    st.sampled_from((0.01, 0.5, 3.0, 14.0)),
    st.floats(0.0, math.tau),
    st.floats(0.0, 1.0),
)
def test_what_is_allowed_by_widened_limits_is_allowed_all_round(rows, azimuth, altitude, by_deg, bearing, part):
    """Any direction within the radius, by a rotation about a perpendicular axis, keeps horizon and Sun."""
    by, sun = math.radians(by_deg), np.array(looking(40.0, 30.0))
    limits, here = Limits(profile(rows), math.radians(20.0)), looking(azimuth, altitude)
    wide = widened(limits, by)
    up = (0.0, 0.0, 1.0) if abs(here[2]) < 0.9 else (1.0, 0.0, 0.0)
    one = np.cross(here, up) / np.linalg.norm(np.cross(here, up))
    across = one * math.cos(bearing) + np.cross(here, one) * math.sin(bearing)
    beside = tuple(np.array(here) * math.cos(by * part) + across * math.sin(by * part))
    if wide.horizon.margin(here) >= 0.0:
        assert limits.horizon.margin(beside) >= -1e-9
    if wide.sun_margin(here, tuple(sun)) >= 0.0:
        assert limits.sun_margin(beside, tuple(sun)) >= -1e-9


def test_a_level_horizon_is_widened_by_just_so_much_and_hills_by_little_more():
    by = math.radians(2.0)
    assert math.degrees(Horizon.level(15.0).widened(by).altitude(1.0)) == pytest.approx(17.0)
    assert Horizon.level(15.0).widened(0.0) == Horizon.level(15.0)
    hills = profile(((0.0, 10.0), (90.0, 20.0), (180.0, 10.0), (270.0, 10.0)))
    worst = max(
        math.degrees(hills.widened(by).altitude(azimuth) - hills.altitude(azimuth))
        for azimuth in np.radians(np.arange(0.0, 360.0, 0.25))
    )
    slope = 10.0 / 90.0
    print(f"a hill of {slope:.2f} is raised by at most {worst:.2f}° for 2°")
    assert worst < 2.0 + slope * (2.0 / math.cos(math.radians(24.0)) + 2.0)
    assert math.degrees(Horizon.level(88.0).widened(math.radians(10.0)).altitude(0.0)) < 90.0


def test_no_zone_round_the_sun_stays_none_when_limits_are_widened():
    assert Limits(Horizon.level(0.0)).widened(0.1).sun_avoidance == 0.0
    assert Limits(Horizon.level(0.0), 3.1).widened(0.1).sun_avoidance == math.pi
