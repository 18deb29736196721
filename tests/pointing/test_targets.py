"""Targets: ERFA's space motion, astropy's coordinates, and places that stand still."""

import math
import random

import erfa
import pytest

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import FixedAltAz, FixedHaDec, Star
from pointing.vectors import (
    azimuth_altitude,
    from_longitude_latitude,
    horizon_to_equatorial,
    hour_angle_declination,
)

MAS = math.pi / 648000e3
SITE = Site.from_degrees(-42.4, 173.7, 30.0)
FRAME = Sky(SITE).at(Instant.from_utc_iso("2026-03-01T10:00:00Z"))


def test_space_motion_is_erfas():
    rng = random.Random(21)  # noqa: S311 - nothing secret
    worst = 0.0
    for _ in range(2000):
        place = (rng.uniform(0, math.tau), math.asin(rng.uniform(-1, 1)))
        motion = (rng.gauss(0, 2e-5), rng.gauss(0, 1e-5), rng.uniform(0, 0.8), rng.gauss(0, 100))
        ours = Star("", *place, *motion).astrometric(FRAME)
        theirs = erfa.pmpx(*place, *motion, FRAME.years, FRAME.position_au)
        worst = max(worst, *(abs(a - b) for a, b in zip(ours, theirs, strict=True)))
    print(f"pmpx: worst {worst:.1e}")
    assert worst < 1e-15


def test_the_rate_of_a_moving_star_is_its_derivative():
    star = Star("", 1.0, 0.3, 5e-5, -4e-5, 0.77, -110.0)
    sky, h = Sky(SITE), 43200.0
    direction, rate = star.astrometric_with_rate(FRAME)
    assert direction == star.astrometric(FRAME)
    ahead, behind = (star.astrometric(sky.at(FRAME.instant.plus(step))) for step in (h, -h))
    measured = [(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)]
    assert rate == pytest.approx(measured, abs=1e-14)  # the observer goes round with the Earth meanwhile


def test_catalogue_units_are_what_catalogues_use():
    star = Star.from_degrees(10.0, 60.0, pm_ra_cosdec_mas=100.0, pm_dec_mas=-50.0, parallax_mas=20.0, rv_km_s=5.0)
    assert star.pm_ra == pytest.approx(200.0 * MAS)
    assert star.pm_dec == pytest.approx(-50.0 * MAS)
    assert (star.parallax_arcsec, star.rv_km_s) == (0.02, 5.0)
    assert star.name == "10.000000,+60.000000"


def test_an_epoch_of_its_own_moves_the_star_along():
    at_2000 = Star.from_degrees(10.0, 20.0, pm_ra_cosdec_mas=1000.0)
    at_2016 = Star.from_degrees(
        10.0 + 16.0 / 3600 / math.cos(math.radians(20)), 20.0, pm_ra_cosdec_mas=1000.0, epoch=2016
    )
    assert math.dist(at_2000.astrometric(FRAME), at_2016.astrometric(FRAME)) < 1 * MAS


class TestSkyCoord:
    """astropy's coordinates at the edge."""

    def test_a_plain_coordinate_is_its_place(self):
        from astropy.coordinates import SkyCoord

        star = Star.from_skycoord(SkyCoord(83.6, -22.0, unit="deg"), "here")
        assert (math.degrees(star.ra), math.degrees(star.dec)) == pytest.approx((83.6, -22.0))
        assert (star.name, star.pm_ra, star.parallax_arcsec, star.epoch) == ("here", 0.0, 0.0, 2000.0)

    def test_any_frame_is_brought_to_icrs(self):
        from astropy.coordinates import SkyCoord

        galactic = SkyCoord(l=184.557, b=-5.784, unit="deg", frame="galactic")
        star = Star.from_skycoord(galactic)
        assert (math.degrees(star.ra), math.degrees(star.dec)) == pytest.approx((83.633, 22.0145), abs=2e-3)

    def test_motion_distance_and_obstime_are_taken_over(self):
        from astropy import units as u
        from astropy.coordinates import SkyCoord
        from astropy.time import Time

        coord = SkyCoord(
            ra=269.45 * u.deg,
            dec=4.69 * u.deg,
            distance=1.8266 * u.pc,
            pm_ra_cosdec=-801.6 * u.mas / u.yr,
            pm_dec=10362.4 * u.mas / u.yr,
            radial_velocity=-110.5 * u.km / u.s,
            obstime=Time("J2016"),
        )
        star = Star.from_skycoord(coord)
        assert star.pm_dec == pytest.approx(10362.4 * MAS)
        assert star.pm_ra == pytest.approx(-801.6 * MAS / math.cos(star.dec))
        assert star.parallax_arcsec == pytest.approx(1 / 1.8266)
        assert star.rv_km_s == pytest.approx(-110.5)
        assert star.epoch == pytest.approx(2016.0, abs=1e-6)
        later = coord.apply_space_motion(new_obstime=Time(FRAME.years + 2000, format="jyear"))
        moved = Star.from_skycoord(later)
        assert math.dist(star.astrometric(FRAME), moved.astrometric(FRAME)) < 2 * MAS

    def test_proper_motion_alone_needs_no_distance(self):
        from astropy import units as u
        from astropy.coordinates import SkyCoord

        rate = u.mas / u.yr
        star = Star.from_skycoord(SkyCoord(1 * u.deg, 60 * u.deg, pm_ra_cosdec=10 * rate, pm_dec=-3 * rate))
        assert star.pm_ra == pytest.approx(20 * MAS)
        assert star.pm_dec == pytest.approx(-3 * MAS)
        assert star.rv_km_s == 0.0

    def test_radial_velocity_alone_is_taken_or_left_but_no_exception(self):
        from astropy import units as u
        from astropy.coordinates import SkyCoord

        star = Star.from_skycoord(SkyCoord(1 * u.deg, 60 * u.deg, radial_velocity=10 * u.km / u.s))
        assert star.pm_ra == 0.0

    def test_several_coordinates_are_refused(self):
        from astropy.coordinates import SkyCoord

        with pytest.raises(TargetError, match="scalar"):
            Star.from_skycoord(SkyCoord([1, 2], [3, 4], unit="deg"))

    def test_a_horizontal_coordinate_without_time_is_refused(self):
        from astropy.coordinates import SkyCoord

        with pytest.raises(TargetError, match="ICRS"):
            Star.from_skycoord(SkyCoord(alt=30, az=20, unit="deg", frame="altaz"))


def test_a_fixed_altaz_place_stays_where_it_is_said():
    target = FixedAltAz(math.radians(123.0), math.radians(45.0))
    observed, rate = target.observed_with_rate(FRAME)
    assert [math.degrees(a) for a in azimuth_altitude(observed)] == pytest.approx([123.0, 45.0])
    assert rate == (0.0, 0.0, 0.0)


def test_a_fixed_hadec_place_stays_at_its_hour_angle():
    target = FixedHaDec(math.radians(-20.0), math.radians(-70.0))
    observed, rate = target.observed_with_rate(FRAME)
    angles = hour_angle_declination(horizon_to_equatorial(observed, SITE.latitude))
    assert [math.degrees(a) for a in angles] == pytest.approx([-20.0, -70.0])
    assert rate == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("kind", "values"),
    [(Star.from_degrees, (10, 90.001)), (Star, ("x", math.nan, 0)), (Star, ("x", 0, 0, math.inf)),
     (FixedAltAz, (0, 2)), (FixedAltAz, (math.nan, 0)), (FixedHaDec, (0, -1.6)), (FixedHaDec, (7, 0))],
)  # fmt: skip
def test_an_impossible_place_is_refused(kind, values):
    with pytest.raises(TargetError):
        kind(*values)


@pytest.mark.parametrize("dec_deg", [90.0, -90.0])
def test_a_star_on_the_pole_is_a_star(dec_deg):
    star = Star.from_degrees(123.0, dec_deg)
    assert star.astrometric(FRAME) == pytest.approx(from_longitude_latitude(0.0, math.radians(dec_deg)), abs=1e-15)
