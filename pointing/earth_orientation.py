"""How the Earth is turned: UT1 − UTC and the pole, from the bundled IERS table finals2000A.

The table has one row of fixed width a day, so a day's two rows are read by their place in the file, not by reading
the file. Bulletin B's values are taken where they are present, else Bulletin A's, which end in a year of predictions.
Outside the table the nearest value holds and the note says how wrong it may be: never a refusal. The possible error
of UT1 after d days, 0.00025·d^0.75 s, is the IERS's own (Bulletin A); |UT1 − UTC| never exceeds 0.9 s.
"""

import math
from bisect import bisect_left
from collections.abc import Callable
from functools import cache, lru_cache
from pathlib import Path
from typing import NamedTuple

from astropy_iers_data import IERS_A_FILE

from pointing.errors import PointingError
from pointing.instant import DAY, Instant

_ARCSEC = math.pi / 648000.0
_MJD = slice(7, 15)
# Columns of x, y (arcseconds) and UT1 − UTC (seconds): Bulletin B, which wins where present, then Bulletin A.
_BULLETINS = (
    (slice(134, 144), slice(144, 154), slice(154, 165)),
    (slice(18, 27), slice(37, 46), slice(58, 68)),
)
_DUT1_ERROR = slice(68, 78)  # of Bulletin A, seconds
_WORST_S = 0.9
_ARCSEC_PER_S = 15.0


class EarthOrientation(NamedTuple):
    """The Earth's orientation at one moment.

    Parameters
    ----------
    dut1 : float
        UT1 − UTC, seconds.
    xp, yp : float
        The pole's coordinates, radians.
    note : str
        Why the values may be wrong and by how much; empty where the table covers the moment.
    dut1_error : float
        Standard deviation of UT1 − UTC, seconds: the table's own, which grows over its predictions; outside of the
        table how wrong it may be.
    """

    dut1: float
    xp: float
    yp: float
    note: str = ""
    dut1_error: float = 0.0


EarthOrientationSource = Callable[[Instant], EarthOrientation]


def earth_orientation(instant: Instant) -> EarthOrientation:
    """Earth orientation at a moment, linear between the table's days and safe over a leap second."""
    day, seconds = instant.utc()
    (dut1, xp, yp), (dut1_rate, xp_rate, yp_rate), note, error = _day(day)
    return EarthOrientation(dut1 + dut1_rate * seconds, xp + xp_rate * seconds, yp + yp_rate * seconds, note, error)


Row = tuple[float, float, float]
_STILL: Row = (0.0, 0.0, 0.0)


@lru_cache(maxsize=256)
def _day(day: int) -> tuple[Row, Row, str, float]:
    """Values at the beginning of a UTC day, their rates per second, the note, and the error of UT1 − UTC."""
    first, last = _range()
    if day < first or day >= last:
        outside = first - day if day < first else day - last
        value, error = _value(first if day < first else last), _error(first if day < first else last)
        return value, _STILL, _note(outside, last) if outside else "", max(error, _outside_s(outside))
    here, after = _value(day), _value(day + 1)
    # A leap second at the end of the day makes UT1 − UTC jump by a whole second.
    step = after[0] - here[0]
    rates = ((step - round(step)) / DAY, (after[1] - here[1]) / DAY, (after[2] - here[2]) / DAY)
    return here, rates, "", _error(day)


def _outside_s(days: int) -> float:
    return float(min(0.00025 * days**0.75, _WORST_S))


def _note(days: int, last: int) -> str:
    error_s = _outside_s(days)
    return (
        f"Earth orientation is {days} days outside its table, which ends at MJD {last}: right ascensions may be off"
        f" by {error_s * _ARCSEC_PER_S:.2g}″ ({error_s:.2g} s); upgrade the package astropy-iers-data"
    )


@cache
def _range() -> tuple[int, int]:
    """First and last day with values; the file's last rows are blank."""
    first = _origin()
    rows = Path(IERS_A_FILE).stat().st_size // len(_row(0))
    return first, first + bisect_left(range(rows), 1, key=lambda i: _parse(_row(i)) is None) - 1


@cache
def _origin() -> int:
    """The day of the file's first row."""
    return int(float(_row(0)[_MJD]))


def _value(day: int) -> Row:
    value = _parse(_row(day - _origin()))
    if value is None:
        raise PointingError(f"no Earth orientation for MJD {day} in {IERS_A_FILE}: reinstall astropy-iers-data")
    return value


def _error(day: int) -> float:
    text = _row(day - _origin())[_DUT1_ERROR]
    return float(text) if text.strip() else 0.0


def _parse(row: str) -> Row | None:
    """UT1 − UTC in seconds and the pole in radians, or None for a blank row."""
    for x, y, dut1 in _BULLETINS:
        if row[dut1].strip() and row[x].strip():
            return float(row[dut1]), float(row[x]) * _ARCSEC, float(row[y]) * _ARCSEC
    return None


def _row(index: int) -> str:
    with Path(IERS_A_FILE).open("rb") as file:
        width = len(file.readline())
        file.seek(index * width)
        return file.read(width).decode("ascii")
