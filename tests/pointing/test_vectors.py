"""Angles and vectors: signs against the definitions, and closure."""

import math
import random

import pytest

from pointing import vectors

EAST, NORTH_HORIZON, ZENITH, SOUTH_HORIZON = (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("azimuth_deg", "altitude_deg", "expected"),
    [(0, 0, NORTH_HORIZON), (90, 0, EAST), (180, 0, SOUTH_HORIZON), (123, 90, ZENITH)],
)
def test_azimuth_counts_from_north_through_east(azimuth_deg, altitude_deg, expected):
    v = vectors.from_azimuth_altitude(math.radians(azimuth_deg), math.radians(altitude_deg))
    assert v == pytest.approx(expected, abs=1e-15)


def test_hour_angle_is_positive_in_the_west():
    western = vectors.from_hour_angle_declination(math.radians(90), 0.0)
    assert vectors.equatorial_to_horizon(western, 0.7) == pytest.approx((0.0, -1.0, 0.0), abs=1e-15)


@pytest.mark.parametrize("latitude_deg", [-90, -42.4, 0, 51, 90])
def test_the_north_pole_stands_as_high_as_the_latitude(latitude_deg):
    pole = vectors.equatorial_to_horizon((0.0, 0.0, 1.0), math.radians(latitude_deg))
    azimuth, altitude = vectors.azimuth_altitude(pole)
    assert math.degrees(altitude) == pytest.approx(latitude_deg, abs=1e-6)
    if latitude_deg in (0, 51):
        assert math.sin(azimuth) == pytest.approx(0, abs=1e-12)
        assert math.cos(azimuth) == pytest.approx(1)


def test_every_conversion_closes_to_a_nanoarcsecond():
    rng = random.Random(4)  # noqa: S311 - nothing secret
    for _ in range(2000):
        longitude, latitude = rng.uniform(0, math.tau), math.asin(rng.uniform(-1, 1))
        site = rng.uniform(-1.5, 1.5)
        v = vectors.from_longitude_latitude(longitude, latitude)
        assert vectors.longitude_latitude(v) == pytest.approx((longitude, latitude), abs=1e-11)
        assert vectors.from_azimuth_altitude(*vectors.azimuth_altitude(v)) == pytest.approx(v, abs=5e-15)
        assert vectors.from_hour_angle_declination(*vectors.hour_angle_declination(v)) == pytest.approx(v, abs=5e-15)
        there = vectors.horizon_to_equatorial(v, site)
        assert vectors.equatorial_to_horizon(there, site) == pytest.approx(v, abs=5e-15)


@pytest.mark.parametrize("tiny", [-1e-17, -1e-20, -0.0])
def test_azimuth_never_reaches_a_full_turn(tiny):
    azimuth, _ = vectors.azimuth_altitude((-1.0, tiny, 0.0))
    assert 0.0 <= azimuth < math.tau


def test_the_poles_have_an_angle_of_nothing():
    assert vectors.azimuth_altitude(ZENITH) == (0.0, math.pi / 2)
    assert vectors.hour_angle_declination((0.0, 0.0, -1.0)) == (0.0, -math.pi / 2)
