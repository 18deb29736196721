"""Sun, Moon and planets against Skyfield with the same kernel, the rates, and what stands in where none is."""

import math
import random
import time
from contextlib import contextmanager

import erfa
import numpy as np
import pytest
from rate_oracle import share_of_allowed
from skyfield.api import load, wgs84
from skyfield.jpllib import SpiceKernel
from skyfield.timelib import Timescale

from pointing import kernel as kernels
from pointing.bodies import BODIES, EARTH, SUN
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.kernel import bundled_kernel, kernel
from pointing.offset import OffsetTarget
from pointing.site import Site, Weather
from pointing.sky import AU_M, LIGHT_M_S, Sky
from pointing.solar_system import SolarSystemBody
from pointing.targets import Star, notes_of
from pointing.vectors import from_azimuth_altitude

ARCSEC = math.pi / 648000
NAMES = [body.name for body in BODIES.values()]
START, END = Instant.from_utc_iso("1990-01-01"), Instant.from_utc_iso("2053-10-01")
AIRLESS = Weather(refraction=False)


def random_site(rng, weather=AIRLESS):
    return Site.from_degrees(rng.uniform(-89, 89), rng.uniform(-180, 180), rng.uniform(0, 4500), weather)


def random_instant(rng, start=START, end=END):
    return start.plus(rng.uniform(0, end.since(start)))


class Skyfield:
    """Skyfield with our kernel, and with our UT1 and pole at each moment."""

    def __init__(self):
        self.kernel = SpiceKernel(bundled_kernel())
        self.builtin = load.timescale(builtin=True)

    def observed(self, name, site, instant):
        orientation = Sky(site).earth_orientation(instant)
        day, seconds = instant.utc()
        tt_utc = (instant.day - day) * DAY + instant.seconds - seconds
        scale = Timescale(lambda _: tt_utc - orientation.dut1, self.builtin.leap_dates, self.builtin.leap_offsets)
        pole = (np.full(2, angle / ARCSEC) for angle in (orientation.xp, orientation.yp))
        scale.polar_motion_table = np.array([0.0, 1e8]), *pole
        when = scale.tt_jd(2400000.5 + instant.day, instant.seconds / DAY)
        place = wgs84.latlon(math.degrees(site.latitude), math.degrees(site.longitude), elevation_m=site.height_m)
        altitude, azimuth, _ = (
            (self.kernel[EARTH] + place).at(when).observe(self.kernel[number_of(name)]).apparent().altaz()
        )
        return from_azimuth_altitude(azimuth.radians, altitude.radians)


@pytest.fixture(scope="module")
def skyfield():
    made = Skyfield()
    yield made
    made.kernel.close()


@pytest.mark.parametrize("name", NAMES)
def test_every_body_is_where_skyfield_sees_it(name, skyfield):
    rng = random.Random(31)  # noqa: S311 - nothing secret
    target, worst = SolarSystemBody(name), 0.0
    for _ in range(150):
        site, instant = random_site(rng), random_instant(rng)
        ours = target.observed(Sky(site).at(instant))
        worst = max(worst, math.dist(ours, skyfield.observed(name, site, instant)))
    print(f"{name} against Skyfield, 150 moments 1990 to 2053: worst {worst / ARCSEC:.5f}″")
    assert worst < (0.1 if name == "Moon" else 0.05) * ARCSEC


@pytest.fixture(scope="module")
def days():
    """A moment of every second day; with it for each the place of Earth, and of the Sun from there."""
    rng = random.Random(32)  # noqa: S311 - nothing secret
    moments = [Instant(day, rng.uniform(0, DAY)) for day in range(START.day, END.day, 2)]
    earth = places(EARTH, moments)
    return moments, earth, places(SUN, moments) - earth


def places(number, moments):
    opened = kernel(bundled_kernel())
    return np.array([opened.state(number, instant)[0] for instant in moments])


def conjunctions(name, days, rng):
    """Sixty moments at which a body stands within 1.2° of the Sun's centre and outside its disc."""
    moments, earth, to_sun = days
    to_body = places(number_of(name), moments) - earth
    away = np.linalg.norm(np.cross(to_sun, to_body), axis=1)
    away = np.degrees(np.arctan2(away, (to_sun * to_body).sum(axis=1)))
    found = np.flatnonzero((away > 0.27) & (away < 1.2))
    return [moments[k] for k in rng.sample(list(found), min(60, len(found)))]


def number_of(name):
    """NAIF's number under which the bundled kernel holds a body."""
    opened = kernel(bundled_kernel())
    return next(number for number in BODIES[name.casefold()].numbers if opened.span(number))


@pytest.mark.parametrize("name", ["Mercury", "Venus", "Mars", "Jupiter", "Saturn"])
def test_a_planet_beside_the_sun_is_where_skyfield_sees_it(name, skyfield, days):
    rng = random.Random(32)  # noqa: S311 - nothing secret
    target = SolarSystemBody(name)
    moments = conjunctions(name, days, rng)
    worst = before = behind = 0.0
    for instant in moments:
        site = random_site(rng)
        frame = Sky(site).at(instant)
        ours, place = target.observed(frame), target.astrometric(frame)
        worst = max(worst, math.dist(ours, skyfield.observed(name, site, instant)))
        as_a_star = math.dist(ours, frame.observe(place.direction))
        if place.distance_au < 1.0:
            before = max(before, as_a_star)
        else:
            behind = max(behind, as_a_star)
    print(
        f"{name} within 1.2° of the Sun, {len(moments)} moments: worst {worst / ARCSEC:.5f}″; bent like a star's, its"
        f" light would be off by up to {before / ARCSEC:.2f}″ before the Sun, {behind / ARCSEC:.2f}″ behind it"
    )
    assert len(moments) > 10
    assert worst < 0.05 * ARCSEC
    assert max(before, behind) > 0.1 * ARCSEC  # so the difference is seen here


@pytest.mark.parametrize("name", NAMES)
def test_the_rate_of_every_body_is_the_derivative_of_its_place(name):
    rng = random.Random(33)  # noqa: S311 - nothing secret
    target, worst = SolarSystemBody(name), 0.0
    for _ in range(80):
        sky, instant = Sky(random_site(rng, Weather())), random_instant(rng)
        if abs(target.observed(sky.at(instant))[2] - 0.05) > 0.005:  # refraction has a kink between
            worst = max(worst, share_of_allowed(target, sky, instant))
    print(f"{name}: rates worst {worst:.2f} of 1e-9 deg/s + 1e-8 of the rate")
    assert worst <= 1.0


def test_light_time_and_both_of_its_ends_are_solved_to_a_microsecond():
    rng = random.Random(34)  # noqa: S311 - nothing secret
    opened, light_au_s, worst = kernel(bundled_kernel()), LIGHT_M_S / AU_M, 0.0
    for name in NAMES:
        target = SolarSystemBody(name)
        for _ in range(20):
            frame = Sky(random_site(rng)).at(random_instant(rng))
            day, seconds = frame.instant
            now = frame.instant.plus(float(erfa.dtdb(2400000.5 + day, seconds / DAY, 0, 0, 0, 0)))
            place, light_s = target.astrometric(frame), 0.0
            here = np.array(opened.state(EARTH, now)[0]) + frame.geocentric_au
            for _ in range(12):
                there = np.array(opened.state(number_of(name), now.plus(-light_s))[0]) - here
                light_s = float(np.linalg.norm(there)) / light_au_s
            worst = max(worst, abs(place.distance_au / light_au_s - light_s))
            assert math.dist(place.direction, there / np.linalg.norm(there)) < 1e-4 * ARCSEC
    print(f"light time: worst {worst * 1e9:.2f} ns")
    assert worst < 1e-6


@contextmanager
def no_extra():
    """An installation without the extra that brings a kernel."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernels, "find_spec", lambda _: None)
        bundled_kernel.cache_clear()
        try:
            yield
        finally:
            bundled_kernel.cache_clear()


def by_series(name):
    with no_extra():
        return SolarSystemBody(name)


@pytest.mark.parametrize("name", [name for name in NAMES if name != "Pluto"])
def test_the_series_are_off_by_no_more_than_their_note_says(name):
    rng = random.Random(35)  # noqa: S311 - nothing secret
    first, last = Instant.from_utc_iso("1900-01-01"), Instant.from_utc_iso("2053-10-01")
    series, true = by_series(name), SolarSystemBody(name)
    stated = BODIES[name.casefold()].series_arcsec
    worst = 0.0
    for _ in range(200):
        frame = Sky(random_site(rng)).at(random_instant(rng, first, last))
        assert series.note_at(frame.instant)
        worst = max(worst, math.dist(series.observed(frame), true.observed(frame)))
    print(f"{name}: series off by up to {worst / ARCSEC:.2f}″ of {stated:g}″ stated, 200 moments 1900 to 2053")
    assert worst <= stated * ARCSEC


@pytest.mark.parametrize("name", [name for name in NAMES if name != "Pluto"])
def test_the_rate_of_the_series_is_their_derivative(name):
    rng = random.Random(36)  # noqa: S311 - nothing secret
    target, worst = by_series(name), 0.0
    for _ in range(20):
        worst = max(worst, share_of_allowed(target, Sky(random_site(rng)), random_instant(rng)))
    print(f"{name}: rates of the series worst {worst:.2f} of what is allowed")
    assert worst <= 1.0


def test_without_the_extra_the_note_says_how_wrong_and_what_to_install():
    note = by_series("Moon").note_at(START)
    assert note.startswith("Moon: ")
    assert "20″" in note
    assert "pip install 'clockdrive[planets]'" in note


def test_pluto_without_a_kernel_is_refused_with_the_remedy():
    with pytest.raises(TargetError, match=r"Pluto.*pip install 'clockdrive\[planets\]'"):
        by_series("Pluto")


def test_pluto_outside_the_kernel_is_refused_with_its_span():
    frame = Sky(Site.from_degrees(0, 0)).at(Instant.from_utc_iso("2054-01-01"))
    with pytest.raises(TargetError, match=r"covers 1899.6 to 2053.8.*\[targets\] kernel"):
        SolarSystemBody("Pluto").observed(frame)


def test_outside_the_kernel_the_series_stand_in_and_are_told():
    body, later = SolarSystemBody("Mars"), Instant.from_utc_iso("2054-01-01")
    assert body.note_at(START) == ""
    assert "90″" in body.note_at(later)
    assert "known for 1560 to 2640 only" in body.note_at(Instant.from_utc_iso("2700-01-01"))
    before, after = (body.observed(Sky(Site.from_degrees(0, 0)).at(i)) for i in (later, later.plus(10.0)))
    assert math.dist(before, after) == pytest.approx(10.0 * math.tau / 86164.0, rel=0.3)


def test_the_note_of_what_is_displaced_is_that_of_its_target():
    late = Instant.from_utc_iso("2060-01-01")
    body = SolarSystemBody("Venus")
    assert notes_of(OffsetTarget(body, 1e-4, 0.0), late) == notes_of(body, late) == (body.note_at(late),)
    assert notes_of(OffsetTarget(body, 1e-4, 0.0), START) == notes_of(Star("x", 0.0, 0.0), late) == ()


def test_a_body_is_called_as_it_is_written():
    assert SolarSystemBody(" mOON") == SolarSystemBody("Moon")
    with pytest.raises(TargetError, match=r"'Vulcan' is no body.*Mercury"):
        SolarSystemBody("Vulcan")


def test_a_place_costs_a_small_part_of_a_plan():
    frame, best = Sky(Site.from_degrees(-42.4, 173.7)).at(START), math.inf
    bodies = [SolarSystemBody(name) for name in NAMES]
    for _ in range(30):
        begin = time.perf_counter()
        for body in bodies:
            body.observed_with_rate(frame)
        best = min(best, (time.perf_counter() - begin) / len(bodies))
    print(f"a body with its rate: {best * 1e6:.0f} µs")
    assert best < 200e-6
