"""Targets displaced on the sky, against spherical trigonometry."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.offset import OffsetTarget, carried, offset_between
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import FixedAltAz, FixedHaDec, Star
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


@settings(derandomize=True, deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-1.57, 1.57), st.floats(0.0, 3.0), st.floats(-math.pi, math.pi))
def test_how_far_two_places_are_apart_is_the_offset_that_leads_from_one_to_the_other(
    hour_angle, declination, distance, bearing
):
    base, latitude = FixedHaDec(hour_angle, declination), SKY.site.latitude
    east, north = distance * math.sin(bearing), distance * math.cos(bearing)
    moved = OffsetTarget(base, east, north).observed(FRAME)
    assert offset_between(base.observed(FRAME), moved, latitude) == pytest.approx((east, north), abs=1e-14)


@pytest.mark.parametrize("declination", [-math.pi / 2, math.pi / 2])
def test_at_a_pole_the_way_to_a_place_is_that_of_the_offset_as_well(declination):
    base = FixedHaDec(0.0, declination)
    moved = OffsetTarget(base, 1e-3, -2e-3).observed(FRAME)
    assert offset_between(base.observed(FRAME), moved, SKY.site.latitude) == pytest.approx((1e-3, -2e-3), abs=1e-14)


def test_a_rotation_carries_its_start_to_its_end_and_leaves_what_is_across_both():
    start, end, other = (FixedAltAz(a, e).observed(FRAME) for a, e in ((1.0, 0.5), (1.2, 0.45), (1.05, 0.55)))
    assert carried(start, start, end) == pytest.approx(end, abs=1e-15)
    assert carried(other, start, start) == pytest.approx(other, abs=1e-15)
    turned = carried(other, start, end)
    assert math.dist(turned, end) == pytest.approx(math.dist(other, start), abs=1e-15)
    axis = _across(start, end)
    assert sum(a * b for a, b in zip(axis, turned, strict=True)) == pytest.approx(
        sum(a * b for a, b in zip(axis, other, strict=True)), abs=1e-15
    )


def _across(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
