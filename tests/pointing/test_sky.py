"""The whole chain against ERFA, its exact inverse, its derivative, and its speed."""

import csv
import itertools
import math
import random
import time
import warnings

import erfa
import numpy as np
import pytest
from rate_oracle import share_of_allowed

from pointing.earth_orientation import EarthOrientation, earth_orientation
from pointing.instant import DAY, Instant
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.targets import Star
from pointing.vectors import azimuth_altitude, from_azimuth_altitude, horizon_to_equatorial, hour_angle_declination

MAS = math.pi / 648000e3
ARCSEC = math.pi / 648000
AIR = ("pressure_hpa", "temperature_c", "relative_humidity", "wavelength_um")
START, END = 631152000, 2871763200  # 1990 to the end of 2060


def random_site(rng):
    weather = Weather(
        refraction=rng.random() < 0.8,
        pressure_hpa=rng.uniform(500, 1040),
        temperature_c=rng.uniform(-20, 35),
        relative_humidity=rng.random(),
        wavelength_um=rng.choice([0.4, 0.55, 0.8, 2.2, 200.0]),
    )
    return Site.from_degrees(rng.uniform(-89.9, 89.9), rng.uniform(-180, 180), rng.uniform(0, 4500), weather)


def random_star(rng):
    return Star(
        "",
        rng.uniform(0, math.tau),
        math.asin(rng.uniform(-1, 1)),
        rng.gauss(0, 300 * MAS),
        rng.gauss(0, 300 * MAS),
        rng.choice([0.0, rng.uniform(0, 0.5)]),
        rng.gauss(0, 40),
    )


def utc_pair(instant):
    """ERFA's quasi-JD: the day of a leap second is a second longer."""
    day, seconds = instant.utc()
    year, month, dom, _ = erfa.jd2cal(2400000.5, day)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        following = erfa.jd2cal(2400000.5, day + 1)
        leap = erfa.dat(*following[:3], 0.0) - erfa.dat(year, month, dom, 0.0)
    return 2400000.5 + day, seconds / (DAY + float(leap))


def atco13(*arguments):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)  # dubious years
        return erfa.atco13(*arguments)


def erfas(star, site, instant, orientation):
    """ERFA's observed vector."""
    air = site.weather
    azimuth, zenith_distance, *_ = atco13(
        *(star.ra, star.dec, star.pm_ra, star.pm_dec, star.parallax_arcsec, star.rv_km_s),
        *(*utc_pair(instant), orientation.dut1, site.longitude, site.latitude, site.height_m),
        *(orientation.xp, orientation.yp, air.pressure_hpa if air.refraction else 0.0),
        *(air.temperature_c, air.relative_humidity, air.wavelength_um),
    )
    return from_azimuth_altitude(float(azimuth), math.pi / 2 - float(zenith_distance))


def apco13(site, instant, orientation):
    """What ERFA prepares of a moment."""
    air = site.weather
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)  # dubious years
        astrom, _ = erfa.apco13(
            *(*utc_pair(instant), orientation.dut1, site.longitude, site.latitude, site.height_m),
            *(orientation.xp, orientation.yp, air.pressure_hpa if air.refraction else 0.0),
            *(air.temperature_c, air.relative_humidity, air.wavelength_um),
        )
    return astrom


def test_agrees_with_the_reference_table(shared):
    worst = 0.0
    with (shared / "data" / "erfa_observed.csv").open(encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    for row in rows:
        values = [float(value) for value in row]
        mjd, dut1, longitude, latitude, height_m, xp, yp = values[6:13]
        azimuth, zenith_distance, hour_angle, declination = values[17:]
        site = Site(
            latitude, longitude, height_m, Weather(refraction=True, **dict(zip(AIR, values[13:17], strict=True)))
        )
        orientation = EarthOrientation(dut1, xp, yp)
        sky = Sky(site, earth_orientation=lambda _, orientation=orientation: orientation)
        observed = Star("", *values[:6]).observed(sky.at(Instant.from_utc(int(mjd), mjd % 1 * DAY)))
        worst = max(worst, math.dist(observed, from_azimuth_altitude(azimuth, math.pi / 2 - zenith_distance)))
        h, d = hour_angle_declination(horizon_to_equatorial(observed, latitude))
        assert abs(d - declination) < 0.1 * MAS
        assert abs(math.remainder(h - hour_angle, math.tau)) * math.cos(d) < 0.1 * MAS
    print(f"{len(rows)} places of erfa_observed.csv: worst {worst / MAS:.4f} mas")
    assert len(rows) == 400
    assert worst < 0.1 * MAS


def test_agrees_with_erfa_at_a_hundred_thousand_random_places():
    """ERFA's `atco13` step by step: `apco13` once a moment, `atciq` and `atioq` for each place."""
    rng = random.Random(11)  # noqa: S311 - nothing secret
    frames, stars = 500, 200
    errors = []
    for _ in range(frames):
        site = random_site(rng)
        instant = Instant.from_posix(rng.uniform(START, END))
        frame = Sky(site).at(instant)
        astrom = apco13(site, instant, frame.earth_orientation)
        places = [random_star(rng) for _ in range(stars)]
        ours = np.array([star.observed(frame) for star in places])
        catalogue = np.array(
            [(star.ra, star.dec, star.pm_ra, star.pm_dec, star.parallax_arcsec, star.rv_km_s) for star in places]
        )
        azimuth, zenith_distance, *_ = erfa.atioq(*erfa.atciq(*catalogue.T, astrom), astrom)
        level = np.sin(zenith_distance)
        theirs = np.column_stack([-level * np.cos(azimuth), level * np.sin(azimuth), np.cos(zenith_distance)])
        errors.extend(np.linalg.norm(ours - theirs, axis=1) / MAS)
    print(f"{len(errors)} random places, {frames} moments: worst {max(errors):.1e} mas")
    assert len(errors) == 100_000
    assert max(errors) < 0.1


def test_agrees_with_erfa_beside_the_sun():
    rng = random.Random(12)  # noqa: S311 - nothing secret
    worst = 0.0
    for _ in range(200):
        site = random_site(rng)
        instant = Instant.from_posix(rng.uniform(START, END))
        frame = Sky(site).at(instant)
        x, y, z = (-c for c in frame._from_sun)
        ra, dec = math.atan2(y, x), math.asin(z)
        radius, angle = 10 ** rng.uniform(-4, -0.5), rng.uniform(0, math.tau)
        star = Star("", ra + radius * math.cos(angle) / math.cos(dec), dec + radius * math.sin(angle))
        reference = erfas(star, site, instant, frame.earth_orientation)
        worst = max(worst, math.dist(star.observed(frame), reference))
    print(f"beside the Sun: worst {worst / MAS:.1e} mas")
    assert worst < 0.1 * MAS


def deflected(frame, direction, from_sun):
    """ERFA's deflection by the Sun of the light of a body at a finite distance, then what the rest of the chain does.

    The zero vector tells the frame to bend no light, so that only the deflection is under test.
    """
    sun_au = frame._sun_au
    limit = 1e-6 / max(sun_au * sun_au, 1.0)
    bent = erfa.ld(1.0, direction, from_sun, frame._from_sun, sun_au, limit)
    return frame.observe(tuple(np.asarray(bent).tolist()), (0.0, 0.0, 0.0))


def near_the_sun(rng, frame):
    """Directions of a body, and of it from the Sun: at half to twice the Sun's distance, some degrees beside it."""
    ex, ey, ez = frame._from_sun
    sun_au = frame._sun_au
    radius = 10 ** rng.uniform(-2.3, -1)
    towards = unit((-ex + rng.gauss(0, radius), -ey + rng.gauss(0, radius), -ez + rng.gauss(0, radius)))
    distance = sun_au * rng.uniform(0.5, 2.0)
    return towards, unit(tuple(distance * a + sun_au * e for a, e in zip(towards, frame._from_sun, strict=True)))


def unit(vector):
    size = math.hypot(*vector)
    return tuple(c / size for c in vector)


def test_the_light_of_what_is_near_is_bent_as_erfa_bends_it():
    rng = random.Random(17)  # noqa: S311 - nothing secret
    worst = most = 0.0
    for _ in range(500):
        frame = Sky(random_site(rng)).at(Instant.from_posix(rng.uniform(START, END)))
        direction, from_sun = near_the_sun(rng, frame)
        ours = frame.observe(direction, from_sun)
        worst = max(worst, math.dist(ours, deflected(frame, direction, from_sun)))
        most = max(most, math.dist(ours, frame.observe(direction)))
    print(f"finite distances: worst {worst / MAS:.1e} mas; taken for a star it would be off by {most / MAS:.0f} mas")
    assert worst < 0.1 * MAS
    assert most > 100 * MAS


def test_the_rate_of_what_is_near_is_the_derivative_of_the_whole_chain():
    rng = random.Random(18)  # noqa: S311 - nothing secret
    worst = 0.0
    for _ in range(200):
        sky, instant = Sky(random_site(rng)), Instant.from_posix(rng.uniform(START, END))
        body = Passing(instant, *near_the_sun(rng, sky.at(instant)), rng)
        if abs(body.observed(sky.at(instant))[2] - 0.05) > 0.005:
            worst = max(worst, share_of_allowed(body, sky, instant))
    print(f"rates beside the Sun: worst {worst:.2f} of 1e-9 deg/s + 1e-8 of the rate")
    assert worst < 1.0


class Passing:
    """A body that passes the Sun at a degree an hour or so, its two directions on great circles."""

    def __init__(self, instant, direction, from_sun, rng):
        self.begin = instant
        self.circles = [(v, across(v, rng), rng.uniform(-5e-6, 5e-6)) for v in (direction, from_sun)]

    def places(self, frame):
        since = frame.instant.since(self.begin)
        for v, w, rate in self.circles:
            s, c = math.sin(rate * since), math.cos(rate * since)
            pairs = list(zip(v, w, strict=True))
            yield tuple(c * a + s * b for a, b in pairs), tuple(rate * (c * b - s * a) for a, b in pairs)

    def observed(self, frame):
        (direction, _), (from_sun, _) = self.places(frame)
        return frame.observe(direction, from_sun)

    def observed_with_rate(self, frame):
        (direction, rate), from_sun = self.places(frame)
        return frame.observe_with_rate(direction, rate, from_sun)


def across(vector, rng):
    """A unit vector at right angles to another."""
    other = [rng.gauss(0, 1) for _ in range(3)]
    along = sum(a * b for a, b in zip(vector, other, strict=True))
    return unit(tuple(b - along * a for a, b in zip(vector, other, strict=True)))


def test_the_inverse_closes_to_a_microarcsecond_everywhere():
    rng = random.Random(13)  # noqa: S311 - nothing secret
    worst = 0.0
    minute = math.radians(1 / 60)
    for _ in range(1500):
        site = random_site(rng)
        frame = Sky(site).at(Instant.from_posix(rng.uniform(START, END)))
        pole = math.copysign(site.latitude, 1.0)
        places = [
            (rng.uniform(0, math.tau), rng.uniform(math.radians(5), math.pi / 2)),
            (rng.uniform(0, math.tau), math.pi / 2 - minute),
            (rng.uniform(0, math.tau), math.radians(5)),
            (0.0 if site.latitude > 0 else math.pi, min(abs(pole) + minute, math.pi / 2)),
        ]
        for place in places:
            observed = from_azimuth_altitude(*place)
            direction = frame.astrometric(observed)
            worst = max(worst, math.dist(frame.observe(direction), observed))
            worst = max(worst, math.dist(frame.astrometric(frame.observe(direction)), direction))
    print(f"round trips: worst {worst / ARCSEC:.1e}″")
    assert worst < 1e-6 * ARCSEC


def test_the_inverse_closes_beside_the_sun_and_below_the_horizon():
    rng = random.Random(14)  # noqa: S311 - nothing secret
    for _ in range(200):
        frame = Sky(random_site(rng)).at(Instant.from_posix(rng.uniform(START, END)))
        x, y, z = (-c for c in frame._from_sun)
        radius = 10 ** rng.uniform(-6, -1)
        x, y, z = x + rng.gauss(0, radius), y + rng.gauss(0, radius), z + rng.gauss(0, radius)
        n = math.hypot(x, y, z)
        direction = x / n, y / n, z / n
        assert math.dist(frame.astrometric(frame.observe(direction)), direction) < 1e-6 * ARCSEC


def test_the_rate_is_the_derivative_of_the_whole_chain():
    rng = random.Random(15)  # noqa: S311 - nothing secret
    worst = 0.0
    for _ in range(400):
        sky, star = Sky(random_site(rng)), random_star(rng)
        instant = Instant.from_posix(rng.uniform(START, END))
        if abs(star.observed(sky.at(instant))[2] - 0.05) < 0.005:
            continue  # ERFA's refraction has a kink there, where differences mean nothing
        worst = max(worst, share_of_allowed(star, sky, instant))
    print(f"rates: worst {worst:.2f} of 1e-9 deg/s + 1e-8 of the rate")
    assert worst < 1.0


def test_the_suns_place_is_good_to_a_hundredth_of_a_degree():
    from astropy import units
    from astropy.coordinates import AltAz, get_sun
    from astropy.time import Time
    from astropy.utils import iers

    rng = random.Random(16)  # noqa: S311 - nothing secret
    with iers.conf.set_temp("auto_download", value=False), iers.conf.set_temp("auto_max_age", None):
        for _ in range(5):
            site = Site.from_degrees(rng.uniform(-80, 80), rng.uniform(-180, 180), 100.0, Weather(refraction=False))
            posix = rng.uniform(START, 1_780_000_000)
            when = Time(posix, format="unix")
            frame = AltAz(obstime=when, location=site.earth_location(), pressure=0 * units.hPa)
            reference = get_sun(when).transform_to(frame)
            azimuth, altitude = azimuth_altitude(Sky(site).at(Instant.from_posix(posix)).sun())
            assert math.degrees(altitude) == pytest.approx(reference.alt.deg, abs=0.01)
            off = math.remainder(azimuth - reference.az.rad, math.tau) * math.cos(altitude)
            assert math.degrees(off) == pytest.approx(0.0, abs=0.01)


def test_refraction_off_is_no_air():
    site = Site.from_degrees(10, 20, 0, Weather(refraction=False))
    sky, instant = Sky(site), Instant.from_posix(1.8e9)
    reference = erfas(Star("", 1.0, 0.5), site, instant, earth_orientation(instant))
    assert sky.refraction(0.2) == 0.0
    assert math.dist(Star("", 1.0, 0.5).observed(sky.at(instant)), reference) < 1e-3 * MAS


def test_refraction_lifts_by_an_arcminute_at_half_height():
    assert Sky(Site.from_degrees(45, 0)).refraction(math.radians(45)) == pytest.approx(57 * ARCSEC, rel=0.02)


@pytest.mark.parametrize("latitude_deg", [-90, 0, 90])
def test_the_poles_and_the_equator_are_places_like_others(latitude_deg):
    frame = Sky(Site.from_degrees(latitude_deg, 0)).at(Instant.from_posix(1.8e9))
    for direction in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)):
        assert math.dist(frame.astrometric(frame.observe(direction)), direction) < 1e-6 * ARCSEC


def test_dates_far_away_are_no_exception():
    sky = Sky(Site.from_degrees(-42.4, 173.7))
    for year in (1950, 1989, 1990, 2060, 2061, 2150):
        frame = sky.at(Instant.from_utc_iso(f"{year}-01-01T00:00:00Z"))
        observed, rate = frame.observe_with_rate((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        assert math.hypot(*observed) == pytest.approx(1.0)
        assert 0 <= math.hypot(*rate) < 8e-5


def best_us(call, count=400, repeats=9):
    best = math.inf
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(count):
            call()
        best = min(best, time.perf_counter() - begin)
    return best / count * 1e6


def test_a_frame_and_a_star_cost_less_than_one_transform_of_erfa():
    site = Site.from_degrees(-42.4, 173.7, 30.0)
    sky, star, instant = Sky(site), Star.from_degrees(83.633, 22.0145, parallax_mas=5), Instant.from_posix(1.79e9)
    frame, seconds = sky.at(instant), itertools.count()  # each frame is a new one: those of late are kept
    reference = best_us(
        lambda: erfa.atco13(1.4, 0.4, 0, 0, 0.1, 0, 2461000.5, 0.3, 0.1, 3.0, -0.7, 30, 0, 0, 1000, 10, 0.5, 0.55)
    )
    new, again = best_us(lambda: sky.at(instant.plus(next(seconds)))), best_us(lambda: star.observed(frame))
    rate, inverse = (
        best_us(lambda: star.observed_with_rate(frame)),
        best_us(lambda: frame.astrometric((0.6, 0.0, 0.8))),
    )
    print(
        f"frame {new:.1f} µs, star {again:.1f} µs, with rate {rate:.1f} µs, inverse {inverse:.1f} µs;"
        f" erfa.atco13 {reference:.1f} µs"
    )
    assert new + again < reference
