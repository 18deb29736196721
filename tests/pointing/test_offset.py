"""Targets displaced on the sky, against spherical trigonometry."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.offset import OffsetTarget
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import FixedHaDec, Star
from pointing.vectors import horizon_to_equatorial, hour_angle_declination

ARCSEC = math.pi / 648_000.0
MIDNIGHT = 1_800_000_000.0
SKY = Sky(Site.from_degrees(-42.4, 173.7, 30.0))
FRAME = SKY.at(Instant.from_posix(MIDNIGHT))


def place(target):
    return hour_angle_declination(horizon_to_equatorial(target.observed(FRAME), SKY.site.latitude))


@settings(derandomize=True, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(1e-7, 1.0), st.floats(-math.pi, math.pi))
def test_an_offset_is_a_great_circle_distance_in_its_direction(hour_angle, declination, distance, bearing):
    """Sine and cosine rules of the triangle with the pole; the bearing counts from north through east."""
    base = FixedHaDec(hour_angle, declination)
    moved = OffsetTarget(base, distance * math.sin(bearing), distance * math.cos(bearing))
    h, d = place(moved)
    expected = math.sin(declination) * math.cos(distance) + math.cos(declination) * math.sin(distance) * math.cos(
        bearing
    )
    assert math.sin(d) == pytest.approx(expected, abs=1e-14)
    across = math.sin(bearing) * math.sin(distance)
    along = math.cos(distance) * math.cos(declination) - math.sin(distance) * math.sin(declination) * math.cos(
        bearing
    )
    assert math.hypot(across, along) * math.sin(hour_angle - h - math.atan2(across, along)) == pytest.approx(
        0.0, abs=1e-14
    )


def test_north_raises_the_declination_and_east_lowers_the_hour_angle():
    base = FixedHaDec(0.5, 0.3)
    h, d = place(OffsetTarget(base, 0.0, 10.0 * ARCSEC))
    assert (d - 0.3) / ARCSEC == pytest.approx(10.0, abs=1e-9)
    h, d = place(OffsetTarget(base, 10.0 * ARCSEC, 0.0))
    assert (0.5 - h) * math.cos(0.3) / ARCSEC == pytest.approx(10.0, rel=1e-7)


def test_moving_further_adds_up_and_no_offset_is_the_target_itself():
    star = Star.from_degrees(100.0, -30.0, "here")
    moved = OffsetTarget(star, 0.0, 0.0).moved(1e-4, 2e-4).moved(-1e-4, -2e-4)
    assert moved.observed(FRAME) == star.observed(FRAME)
    assert moved.name == "here"


@pytest.mark.parametrize("declination_deg", [-89.95, -30.0, 20.0])
def test_the_rate_is_the_derivative(declination_deg):
    target = OffsetTarget(Star.from_degrees(80.0, declination_deg), 0.02, -0.01)
    instant = Instant.from_posix(MIDNIGHT)
    rate = target.observed_with_rate(FRAME)[1]

    def difference(step):
        late, early = (target.observed(SKY.at(instant.plus(sign * step))) for sign in (1, -1))
        return [(a - b) / (2.0 * step) for a, b in zip(late, early, strict=True)]

    fine, coarse = difference(8.0), difference(16.0)
    measured = [(4.0 * a - b) / 3.0 for a, b in zip(fine, coarse, strict=True)]
    worst = max(math.degrees(abs(a - b)) for a, b in zip(rate, measured, strict=True))
    print(f"declination {declination_deg}°: rate within {worst:.1e}°/s")
    assert worst < 1e-9


@pytest.mark.parametrize("declination", [-math.pi / 2, math.pi / 2])
def test_an_offset_at_the_pole_is_finite_and_as_long_as_asked(declination):
    base = FixedHaDec(0.0, declination)
    moved, rate = OffsetTarget(base, 1e-3, 2e-3).observed_with_rate(FRAME)
    assert all(math.isfinite(value) for value in (*moved, *rate))
    chord = math.dist(moved, base.observed(FRAME))
    assert 2.0 * math.asin(chord / 2.0) == pytest.approx(math.hypot(1e-3, 2e-3), abs=1e-12)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 4.0])
def test_an_impossible_offset_is_refused(bad):
    with pytest.raises(TargetError, match="possible are 180°"):
        OffsetTarget(FixedHaDec(0.0, 0.0), bad, 0.0)
