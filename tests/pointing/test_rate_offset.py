"""Rates of one's own on any target: against spherical trigonometry and the measured derivative."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rate_oracle import share_of_allowed

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.minor_body import MinorBody
from pointing.offset import OffsetTarget
from pointing.rate_offset import RateOffsetTarget
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import FixedAltAz, FixedHaDec, Star
from pointing.two_body import Orbit
from pointing.vectors import horizon_to_equatorial, hour_angle_declination

ARCSEC = math.pi / 648_000.0
NOW = Instant.from_posix(1_800_000_000.0)
SKY = Sky(Site.from_degrees(-42.4, 173.7, 30.0))
COMET = MinorBody("comet", Orbit(NOW.plus(-3e6), 0.8, 1.0, 1.0, 2.0, 3.0))
BASES = {
    "star": Star.from_degrees(80.0, -30.0),
    "star near the pole": Star.from_degrees(80.0, -89.9),
    "altaz": FixedAltAz(1.0, 0.7),
    "hadec": FixedHaDec(0.5, -1.2),
    "comet": COMET,
    "displaced star": OffsetTarget(Star.from_degrees(10.0, -60.0), 1e-3, 2e-3),
}


def place(target, instant):
    return hour_angle_declination(horizon_to_equatorial(target.observed(SKY.at(instant)), SKY.site.latitude))


@pytest.mark.parametrize("base", BASES.values(), ids=BASES)
@pytest.mark.parametrize("rates", [(0.02, -0.05), (15.0, 3.0), (-900.0, 1800.0)])
@pytest.mark.parametrize("seconds", [0.0, 1e-4, 600.0, -5000.0])
def test_the_rate_is_the_derivative_of_the_whole_chain(base, rates, seconds):
    target = RateOffsetTarget(base, rates[0] * ARCSEC, rates[1] * ARCSEC, NOW.plus(-seconds))
    step = 4.0 if max(map(abs, rates)) > 100.0 else 40.0  # the displacement bends as it turns the sky
    share = share_of_allowed(target, SKY, NOW, step)
    print(f"{rates}″/s after {seconds:g} s: {share:.2f} of what is allowed")
    assert share <= 1.0


@settings(derandomize=True, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-1.4, 1.4), st.floats(-300.0, 300.0), st.floats(-300.0, 300.0))
def test_the_drift_is_a_great_circle_distance_of_rate_times_time(hour_angle, declination, east, north):
    """The sine rule of the triangle with the pole: which way, and the cosine rule: how far."""
    base = FixedHaDec(hour_angle, declination)
    target = RateOffsetTarget(base, east * ARCSEC, north * ARCSEC, NOW)
    h, d = place(target, NOW.plus(250.0))
    far = math.hypot(east, north) * ARCSEC * 250.0
    bearing = math.atan2(east, north)
    turned = hour_angle - h
    sine = math.sin(declination) * math.cos(far) + math.cos(declination) * math.sin(far) * math.cos(bearing)
    assert math.sin(d) == pytest.approx(sine, abs=1e-13)
    assert math.sin(turned) * math.cos(d) == pytest.approx(math.sin(bearing) * math.sin(far), abs=1e-13)


def test_it_is_the_target_itself_at_the_moment_it_begins():
    for base in BASES.values():
        target = RateOffsetTarget(base, 1e-5, -1e-5, NOW)
        assert target.observed(SKY.at(NOW)) == pytest.approx(base.observed(SKY.at(NOW)), abs=1e-15)


def test_a_rate_in_right_ascension_is_the_sidereal_rate_less():
    """15.04″/s east on the equator all but stops the hour angle; the declination stays."""
    sidereal = math.tau / 86164.0905
    target = RateOffsetTarget(FixedHaDec(0.0, 0.0), sidereal, 0.0, NOW)
    (h, d), (later, _) = place(target, NOW), place(target, NOW.plus(100.0))
    assert h == pytest.approx(0.0, abs=1e-15)
    assert d == pytest.approx(0.0, abs=1e-15)
    assert later == pytest.approx(-100.0 * sidereal, rel=1e-9)


def test_a_drift_at_the_pole_is_finite():
    for declination in (-math.pi / 2, math.pi / 2):
        target = RateOffsetTarget(FixedHaDec(0.0, declination), 1e-4, 2e-4, NOW)
        seen = target.observed_with_rate(SKY.at(NOW.plus(100.0)))
        assert all(math.isfinite(value) for vector in seen for value in vector)


@pytest.mark.parametrize("bad", [(math.nan, 0.0), (0.0, math.inf), (36001.0, 0.0), (30000.0, 30000.0)])
def test_an_impossible_rate_is_refused(bad):
    with pytest.raises(TargetError, match=r"together at most 36000″/s; give arcseconds a second"):
        RateOffsetTarget(BASES["star"], bad[0] * ARCSEC, bad[1] * ARCSEC, NOW)


def test_the_note_says_how_it_drifts_after_what_its_base_says():
    target = RateOffsetTarget(FixedAltAz(1.0, 0.5, "lamp"), 0.3 * ARCSEC, -0.4 * ARCSEC, NOW)
    expected = "lamp: drifts by +0.3″/s east, -0.4″/s north since 2027-01-15T08:00:00Z, 50.0″ by now"
    assert target.note_at(NOW.plus(100.0)) == expected
    both = RateOffsetTarget(COMET, 0.3 * ARCSEC, -0.4 * ARCSEC, NOW).note_at(NOW)
    assert both.startswith("comet: its elements do not say when")
    assert both.endswith("; it drifts by +0.3″/s east, -0.4″/s north since 2027-01-15T08:00:00Z, 0.0″ by now")
