"""From the right ascensions of a pointing run to hour angle and declination as the star was observed.

Three frames occur: `icrs` (J2000), `apparent` (geocentric, true equator and equinox of date) and `observed`
(topocentric and refracted). No file says which, so the caller does. Diurnal aberration (0.32″ cos φ) is always
applied to the first two: it is part of where the star is seen, and of the chain that later uses the model; an
exporter's NODA says only that its own places do not contain it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date

import erfa
import numpy as np

from pointing.earth_orientation import EarthOrientation
from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.model.run import Array
from pointing.model.words import Places
from pointing.refraction import refract
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.vectors import (
    Vector,
    equatorial_to_horizon,
    from_hour_angle_declination,
    from_longitude_latitude,
    horizon_to_equatorial,
    hour_angle_declination,
)

YEARS = (1900, 2100)  # of runs whose places are brought to their date; 26 for 2026 is a precession of 27°
_MJD = 2400000.5
_NOON = 0.5
_ORDINAL_MJD = 678576  # the ordinal of MJD 0 in Python's calendar


@dataclass(frozen=True)
class Circumstances:
    """Where, when and under what air a run was observed.

    Parameters
    ----------
    latitude : float
        Radians.
    height_m : float
        Above the ellipsoid.
    weather : Weather or None
        The air; needed for apparent and ICRS places.
    date : date or None
        UTC day; needed for ICRS places, taken at noon: half a day changes them by 0.2″ at most.
    """

    latitude: float
    height_m: float
    weather: Weather | None
    date: date | None


def observed_places(
    places: Places, right_ascension: Array, declination: Array, sidereal_time: Array, at: Circumstances
) -> tuple[Array, Array]:
    """Observed hour angle in (−π, π] and declination, (n,) each, of places at local apparent sidereal times, (n,).

    Raises
    ------
    PointingError
        Weather or date are needed and missing, or the date is none of a run.
    """
    to_observed = _WAYS[places](at)
    seen = [to_observed(*row) for row in zip(right_ascension, declination, sidereal_time, strict=True)]
    hour_angle, dec = np.array(seen, float).reshape(-1, 2).T
    return hour_angle, dec


def dated(day: date) -> bool:
    """Whether a date is one of a telescope's run, to which places can be brought."""
    return YEARS[0] <= day.year <= YEARS[1]


_Way = Callable[[float, float, float], tuple[float, float]]


def _observed(_: Circumstances) -> _Way:
    def place(ra: float, dec: float, lst: float) -> tuple[float, float]:
        return math.pi - (math.pi - (lst - ra)) % math.tau, dec

    return place


def _apparent(at: Circumstances) -> _Way:
    sky = Sky(_site(at))

    def place(ra: float, dec: float, lst: float) -> tuple[float, float]:
        x, y, z = equatorial_to_horizon(from_hour_angle_declination(lst - ra, dec), at.latitude)
        y += sky.east_c
        n = 1.0 / math.sqrt(x * x + y * y + z * z)
        return _hour_angle_declination(refract((x * n, y * n, z * n), *sky.refraction_constants), at.latitude)

    return place


def _icrs(at: Circumstances) -> _Way:
    if at.date is None:
        raise PointingError(
            "ICRS places need the date of the run, and its run parameters have none: write year, month and day "
            "behind the latitude"
        )
    if not dated(at.date):
        raise PointingError(
            f"the run is of the year {at.date.year}, and ICRS places are brought to it: possible are {YEARS[0]} to "
            f"{YEARS[1]}; write the year with four digits"
        )
    day = at.date.toordinal() - _ORDINAL_MJD
    noon = Instant.from_utc(day, _NOON * 86400.0)
    greenwich = greenwich_sidereal_time(noon)

    def place(ra: float, dec: float, lst: float) -> tuple[float, float]:
        # The longitude is not known; the one where the sidereal time was this at noon sees the same sky.
        frame = Sky(_site(at, lst - greenwich), _unturned).at(noon)
        return _hour_angle_declination(frame.observe(from_longitude_latitude(ra, dec)), at.latitude)

    return place


_WAYS: dict[Places, Callable[[Circumstances], _Way]] = {"apparent": _apparent, "icrs": _icrs, "observed": _observed}


def greenwich_sidereal_time(instant: Instant) -> float:
    """Apparent sidereal time of Greenwich, radians, with UT1 = UTC (IAU 2006/2000A, ERFA's `gst06a`)."""
    day, seconds = instant.utc()
    return float(erfa.gst06a(_MJD + day, seconds / 86400.0, _MJD + instant.day, instant.seconds / 86400.0))


def _unturned(_: Instant) -> EarthOrientation:
    """UT1 and pole do not matter: the sidereal time is given."""
    return EarthOrientation(0.0, 0.0, 0.0)


def _site(at: Circumstances, longitude: float = 0.0) -> Site:
    if at.weather is None:
        raise PointingError(
            "the run parameters have no temperature and pressure, without which apparent and ICRS places cannot be "
            "refracted: give weather=Weather.standard(height_m), or weather=Weather(refraction=False) for no air"
        )
    return Site(at.latitude, (longitude + math.pi) % math.tau - math.pi, at.height_m, at.weather)


def _hour_angle_declination(horizon: Vector, latitude: float) -> tuple[float, float]:
    return hour_angle_declination(horizon_to_equatorial(horizon, latitude))
