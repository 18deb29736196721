"""Counts and angles, against exact rational arithmetic."""

import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.gearing import Gearing

CENTRE = 0x800000
MANUAL = (200, Fraction(1, 285), Fraction(16, 40), 10)  # the manual's example with Gecko drives

gearings = st.builds(
    lambda steps, main, secondary, per_step, centre_deg, turned: Gearing.of_motor(
        steps, main, secondary, per_step, centre_counts=CENTRE, centre_deg=centre_deg, reversed=turned
    ),
    st.integers(24, 800),
    st.fractions(Fraction(1, 1000), Fraction(1, 90), max_denominator=1000),
    st.fractions(Fraction(1, 20), Fraction(2), max_denominator=100),
    st.sampled_from((1, 10, 16, 64)),
    st.floats(-180.0, 180.0, allow_subnormal=False),
    st.booleans(),
)


def manual_gearing(*, turned: bool = False) -> Gearing:
    return Gearing.of_motor(*MANUAL, centre_counts=CENTRE, centre_deg=0.0, reversed=turned)


def test_the_step_is_the_manuals():
    gearing = manual_gearing()
    assert gearing.step_deg == Fraction(360 * 16, 200 * 285 * 40 * 10)
    assert 10 * gearing.step_arcsec == pytest.approx(9.0947, abs=5e-5)
    assert gearing.step_deg_float == pytest.approx(float(gearing.step_deg), rel=1e-15)


@settings(derandomize=True, deadline=None)
@given(gearings, st.integers(0, 0xFFFFFF))
def test_every_count_returns_from_its_angle(gearing, counts):
    again = gearing.counts(gearing.angle(counts))
    assert round(again) == counts
    assert abs(again - counts) < 1e-6


@pytest.mark.parametrize("turned", [False, True])
def test_every_count_of_the_range_returns_exactly(turned):
    gearing = manual_gearing(turned=turned)
    samples = range(0, 1 << 24, 997)
    worst = max(abs(gearing.counts(gearing.angle(counts)) - counts) for counts in samples)
    print(f"{len(samples)} counts there and back: worst {worst:.1e} count")
    assert worst < 1e-8


def test_an_angle_returns_from_its_counts():
    gearing = manual_gearing()
    angles = [math.radians(k * 0.0137 - 170.0) for k in range(25_000)]
    worst = max(abs(gearing.angle(gearing.counts(angle)) - angle) for angle in angles)
    print(f"{len(angles)} angles there and back: worst {math.degrees(worst) * 3600:.1e}″")
    assert worst < 1e-14


@settings(derandomize=True, deadline=None)
@given(gearings, st.fractions(-400, 400, max_denominator=10**6))
def test_counts_agree_with_exact_fractions(gearing, angle_deg):
    sign = -1 if gearing.reversed else 1
    exact = CENTRE + sign * (angle_deg - Fraction(gearing.centre_deg)) / gearing.step_deg
    assert gearing.counts(math.radians(float(angle_deg))) == pytest.approx(float(exact), abs=1e-6, rel=1e-13)


def test_a_reversed_axis_mirrors_about_the_centre():
    plain, turned = manual_gearing(), manual_gearing(turned=True)
    for angle in (-2.0, -0.1, 0.0, 0.3, 2.9):
        assert plain.counts(angle) - CENTRE == pytest.approx(CENTRE - turned.counts(angle), abs=1e-8)


@pytest.mark.parametrize(
    ("step", "centre_deg", "said"),
    [(Fraction(0), 0.0, "above 0"), (Fraction(-1, 9), 0.0, "-1/9"), (Fraction(1, 9), math.nan, "nan")],
)
def test_an_impossible_gearing_is_refused_with_its_value(step, centre_deg, said):
    with pytest.raises(PointingError, match=said):
        Gearing(step, CENTRE, centre_deg)
