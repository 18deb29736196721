"""Places of the solar system without any file: ERFA's series, for when no kernel covers the moment.

`epv00` gives the Earth and the Sun, `moon98` the Moon, `plan94` the planets; Pluto has no series. They are tabulated
as `ephemeris` does it, so that rates are the derivative of the places: here the planets move fast enough for four-day
stretches and 14 nodes. TT serves as TDB.
"""

import warnings
from functools import lru_cache

import erfa
import numpy as np

from pointing.bodies import EARTH, MOON, SUN
from pointing.chebyshev import Record, State, nodes, record_of_values, state_of
from pointing.instant import DAY, Instant

_PLAN94 = {199: 1, 299: 2, 499: 4, 599: 5, 699: 6, 799: 7, 899: 8}
_DAYS = 4  # a stretch's length; it begins on an MJD that this divides
_NODES = nodes(14)
_U_PER_S = 2.0 / (_DAYS * DAY)


def state(body: int, instant: Instant) -> State:
    """Barycentric place of a body in au and its velocity in au a second, ICRS axes.

    Parameters
    ----------
    body : int
        NAIF's number of the Sun, the Earth, the Moon or a planet from Mercury to Neptune.
    instant : Instant
        The moment.
    """
    u = (instant.day % _DAYS * DAY + instant.seconds) * _U_PER_S - 1.0
    return state_of(_record(body, instant.day // _DAYS), u, _U_PER_S)


@lru_cache(maxsize=512)
def _record(body: int, index: int) -> Record:
    start, days = erfa.DJM0 + index * _DAYS, (_NODES + 1.0) * (_DAYS / 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)  # of dubious years, whose places are not exact anyway
        return record_of_values(_places(body, start, days))


def _places(body: int, start: float, days: np.ndarray) -> np.ndarray:
    """Barycentric places, shape (n, 3), au."""
    heliocentric, barycentric = erfa.epv00(start, days)
    earth = barycentric["p"]
    if body == EARTH:
        return np.asarray(earth)
    if body == MOON:
        return np.asarray(earth + erfa.moon98(start, days)["p"])
    sun = earth - heliocentric["p"]
    return np.asarray(sun if body == SUN else sun + erfa.plan94(start, days, _PLAN94[body])["p"])
