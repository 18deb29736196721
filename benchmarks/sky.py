"""From a catalogue place to where it is seen, against ERFA's own call for the same."""

import math
import warnings
from functools import cache
from itertools import count

import erfa

from benchmarks.benchmark import benchmark, best_seconds
from pointing.instant import Instant
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.solar_system import SolarSystemBody
from pointing.targets import Star

MIDNIGHT = 1_800_000_000.0  # POSIX
LATITUDE, LONGITUDE, HEIGHT = -42.4, 173.7, 30.0
RA, DEC = 88.79, 7.41
WEATHER = Weather(pressure_hpa=1010.0, temperature_c=12.0)


@cache
def atco13_seconds() -> float:
    """Return the seconds of one call of ERFA from catalogue to observed place, a new time each."""
    seconds = count()
    place = (math.radians(RA), math.radians(DEC), 0.0, 0.0, 0.0, 0.0)
    day = MIDNIGHT / 86400.0 + 0.5  # from JD 2440587
    site = (0.1, math.radians(LONGITUDE), math.radians(LATITUDE), HEIGHT, 0.0, 0.0, 1010.0, 12.0, 0.5, 0.55)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)  # a date past ERFA's leap seconds is "dubious"
        return best_seconds(lambda: erfa.atco13(*place, 2440587.0, day + next(seconds) / 86400.0, *site))


def star_seconds(*, with_rate: bool) -> float:
    """Return the seconds from POSIX time to the observed place of a star, a new time each."""
    seconds = count()
    sky = Sky(Site.from_degrees(LATITUDE, LONGITUDE, HEIGHT, weather=WEATHER))
    star = Star.from_degrees(RA, DEC)
    place = star.observed_with_rate if with_rate else star.observed
    return best_seconds(lambda: place(sky.at(Instant.from_posix(MIDNIGHT + next(seconds)))))


@benchmark("observed place of a star at a new time, in calls of `erfa.atco13`", unit="", at_most=1.0)
def observed_place() -> tuple[float, str]:
    """Time, place, refraction."""
    ours, theirs = star_seconds(with_rate=False), atco13_seconds()
    return ours / theirs, f"{ours * 1e6:.0f} µs, `erfa.atco13` {theirs * 1e6:.0f} µs"


@benchmark("the same with its rate", unit="", at_most=1.5)
def observed_place_with_rate() -> tuple[float, str]:
    """Time, place, refraction, and the derivative of all of them."""
    ours, theirs = star_seconds(with_rate=True), atco13_seconds()
    return ours / theirs, f"{ours * 1e6:.0f} µs, `erfa.atco13` {theirs * 1e6:.0f} µs"


@benchmark("observed place of the Moon with its rate at a new time, in calls of `erfa.atco13`", unit="", at_most=2.0)
def observed_moon_with_rate() -> tuple[float, str]:
    """Kernel, light time, time, place, refraction, and the derivative of all of them."""
    seconds = count()
    sky = Sky(Site.from_degrees(LATITUDE, LONGITUDE, HEIGHT, weather=WEATHER))
    moon = SolarSystemBody("Moon")
    ours = best_seconds(lambda: moon.observed_with_rate(sky.at(Instant.from_posix(MIDNIGHT + next(seconds)))))
    return ours / atco13_seconds(), f"{ours * 1e6:.0f} µs, `erfa.atco13` {atco13_seconds() * 1e6:.0f} µs"
