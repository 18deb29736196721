"""The Earth's way and the pole's, tabulated: all of astrometry that depends on time alone and varies slowly.

ERFA's series for these take 99 % of a transform. Here they are evaluated at eight Chebyshev nodes of a two-day
segment, whose polynomial of degree 7 then gives every moment in it to 2e-5 mas. Segments are made when first
asked for (about 1 ms) and the most recent are kept.
"""

import warnings
from functools import lru_cache
from typing import NamedTuple

import erfa
import numpy as np

from pointing.instant import DAY, Instant

_DEGREE = 7
_DAYS = 2  # a segment's length; it begins on an even MJD
_NODES = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
_SECONDS_PER_UNIT = DAY * _DAYS / 2

Powers = tuple[float, float, float, float, float, float, float, float]


class Ephemeris(NamedTuple):
    """The Earth and its pole at one moment, in the BCRS and GCRS."""

    x: float
    """Barycentric position of the Earth, au."""
    y: float
    z: float
    vx: float
    """Barycentric velocity of the Earth, au a day."""
    vy: float
    vz: float
    hx: float
    """Heliocentric position of the Earth, au."""
    hy: float
    hz: float
    pole_x: float
    """The celestial intermediate pole, IAU 2006/2000A."""
    pole_y: float
    cio: float
    """The CIO locator s, radians."""


def ephemeris(instant: Instant) -> tuple[float, ...]:
    """Evaluate the fields of `Ephemeris` at a moment, as a plain tuple; TT serves as TDB, as ERFA does itself."""
    day, seconds = instant
    u = seconds / _SECONDS_PER_UNIT + (day % _DAYS - _DAYS / 2)
    return tuple(
        [
            ((((((c7 * u + c6) * u + c5) * u + c4) * u + c3) * u + c2) * u + c1) * u + c0
            for c0, c1, c2, c3, c4, c5, c6, c7 in segment(day // _DAYS)
        ]
    )


def pole_rate(instant: Instant) -> tuple[float, float]:
    """Rate of the celestial intermediate pole's x and y, per second."""
    day, seconds = instant
    u = seconds / _SECONDS_PER_UNIT + (day % _DAYS - _DAYS / 2)
    x, y = (
        (((((7 * c7 * u + 6 * c6) * u + 5 * c5) * u + 4 * c4) * u + 3 * c3) * u + 2 * c2) * u + c1
        for _, c1, c2, c3, c4, c5, c6, c7 in segment(day // _DAYS)[9:11]
    )
    return x / _SECONDS_PER_UNIT, y / _SECONDS_PER_UNIT


@lru_cache(maxsize=512)
def segment(index: int) -> tuple[Powers, ...]:
    """Power series in u ∈ [−1, 1] of every field of `Ephemeris`, over the days from MJD 2·index on."""
    start, days = erfa.DJM0 + index * _DAYS, (_NODES + 1.0) * (_DAYS / 2)
    with warnings.catch_warnings():
        # ERFA calls the Earth's series dubious outside 1900 to 2100; they stay useful well beyond.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        heliocentric, barycentric = erfa.epv00(start, days)
        pole_x, pole_y, cio = erfa.xys06a(start, days)
    values = np.column_stack([barycentric["p"], barycentric["v"], heliocentric["p"], pole_x, pole_y, cio])
    return tuple(tuple(column) for column in (_TO_POWERS @ values).T.tolist())
