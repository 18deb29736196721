"""Sun, Moon and planets against Skyfield with the same kernel, the rates, and what stands in where none is."""

import math
import random

import numpy as np
import pytest
from skyfield.api import load, wgs84
from skyfield.jpllib import SpiceKernel
from skyfield.timelib import Timescale

from pointing.bodies import BODIES, EARTH
from pointing.instant import DAY, Instant
from pointing.kernel import bundled_kernel
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.solar_system import SolarSystemBody
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
        number = next(n for n in BODIES[name.casefold()].numbers if n in self.kernel)
        orientation = Sky(site).earth_orientation(instant)
        day, seconds = instant.utc()
        tt_utc = (instant.day - day) * DAY + instant.seconds - seconds
        scale = Timescale(lambda _: tt_utc - orientation.dut1, self.builtin.leap_dates, self.builtin.leap_offsets)
        pole = (np.full(2, angle / ARCSEC) for angle in (orientation.xp, orientation.yp))
        scale.polar_motion_table = np.array([0.0, 1e8]), *pole
        when = scale.tt_jd(2400000.5 + instant.day, instant.seconds / DAY)
        place = wgs84.latlon(math.degrees(site.latitude), math.degrees(site.longitude), elevation_m=site.height_m)
        altitude, azimuth, _ = (self.kernel[EARTH] + place).at(when).observe(self.kernel[number]).apparent().altaz()
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
