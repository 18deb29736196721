"""The Earth's way and the pole's, tabulated: all of astrometry that depends on time alone and varies slowly.

ERFA's series for these take 99 % of a transform. Here they are evaluated at eight Chebyshev nodes of a two-day
segment, whose polynomial of degree 7 then gives every moment in it to 1e-6 mas. Segments are made when first
asked for (about 1 ms) and the most recent are kept.
"""

import warnings
from functools import lru_cache

import erfa
import numpy as np

from pointing.instant import DAY, Instant
from pointing.vectors import Vector

_DEGREE = 7
_DAYS = 2  # a segment's length; it begins on an even MJD
_NODES = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
_FROM_BARYCENTRE, _FROM_SUN, _POLE = slice(3), slice(6, 9), slice(9, 11)  # of the values
_SECONDS_PER_UNIT = DAY * _DAYS / 2

Powers = tuple[float, float, float, float, float, float, float, float]


def ephemeris(instant: Instant) -> tuple[float, ...]:
    """Where the Earth and its pole are at a moment; TT serves as TDB, as it does in ERFA's `apco13`.

    Returns
    -------
    tuple of 12 float
        The Earth's barycentric position (x, y, z; au) and velocity (au a day), its heliocentric position (au), BCRS
        axes (epv00); the celestial intermediate pole's X and Y and the CIO locator s in radians (xys06a, IAU
        2006/2000A).
    """
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
        for _, c1, c2, c3, c4, c5, c6, c7 in segment(day // _DAYS)[_POLE]
    )
    return x / _SECONDS_PER_UNIT, y / _SECONDS_PER_UNIT


def sun(instant: Instant) -> tuple[Vector, Vector]:
    """Barycentric position of the Sun, au, and velocity, au a second, BCRS axes: what Earth and Sun differ by."""
    day, seconds = instant
    u = seconds / _SECONDS_PER_UNIT + (day % _DAYS - _DAYS / 2)
    (x, vx), (y, vy), (z, vz) = (
        (
            ((((((c7 * u + c6) * u + c5) * u + c4) * u + c3) * u + c2) * u + c1) * u + c0,
            ((((((7 * c7 * u + 6 * c6) * u + 5 * c5) * u + 4 * c4) * u + 3 * c3) * u + 2 * c2) * u + c1)
            / _SECONDS_PER_UNIT,
        )
        for c0, c1, c2, c3, c4, c5, c6, c7 in _sun_segment(day // _DAYS)
    )
    return (x, y, z), (vx, vy, vz)


@lru_cache(maxsize=64)
def _sun_segment(index: int) -> tuple[tuple[float, ...], ...]:
    """Power series of the Sun's barycentric position, au."""
    series = segment(index)
    return tuple(
        tuple(from_barycentre - from_sun for from_barycentre, from_sun in zip(*pair, strict=True))
        for pair in zip(series[_FROM_BARYCENTRE], series[_FROM_SUN], strict=True)
    )


@lru_cache(maxsize=512)
def segment(index: int) -> tuple[Powers, ...]:
    """Power series in u ∈ [−1, 1] of each value of `ephemeris`, for the two days from MJD 2·index on."""
    start, days = erfa.DJM0 + index * _DAYS, (_NODES + 1.0) * (_DAYS / 2)
    with warnings.catch_warnings():
        # ERFA calls the Earth's series dubious outside 1900 to 2100; they stay useful well beyond.
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        heliocentric, barycentric = erfa.epv00(start, days)
        pole_x, pole_y, cio = erfa.xys06a(start, days)
    values = np.column_stack([barycentric["p"], barycentric["v"], heliocentric["p"], pole_x, pole_y, cio])
    return tuple(tuple(column) for column in (_TO_POWERS @ values).T.tolist())
