"""The controllers' time: TAI seconds of the day, modulo 86400; −1 where a controller's clock is not set.

Leap seconds are those of ERFA's table, which is bundled. POSIX time stands still over a leap second, so a moment
within one is ambiguous by that second; nothing is sent for it otherwise than for its neighbours.
"""

import math
from datetime import UTC, datetime
from functools import lru_cache

DAY_S = 86400.0
NOT_SET = -1.0
LARGEST_OFFSET_S = 0.4
"""Between a controller's clock and the host's; beyond that the two disagree about what time it is."""
_NEAR_S = 2.0
_GPS_S = 19.0  # that GPS time is behind TAI


def seconds_of_day(posix: float) -> float:
    """TAI seconds of the day at a POSIX time."""
    whole = math.floor(posix)
    return (whole + _offset(int(whole // DAY_S))) % DAY_S + (posix - whole)


def posix(of_day: float, near: float) -> float:
    """The POSIX time of a TAI second of the day, of all days that nearest to a POSIX time."""
    return near + math.remainder(of_day - seconds_of_day(near), DAY_S)


def leap_seconds(posix_s: float) -> float:
    """TAI − UTC at a POSIX time, seconds."""
    return _offset(int(posix_s // DAY_S))


def wrong_scale(offset_s: float, posix_s: float) -> str:
    """What a clock seems to keep that is so many seconds off TAI; empty where it is none of the usual ones."""
    ahead = leap_seconds(posix_s)
    for name, scale in (("UTC", -ahead), ("GPS time", -_GPS_S), ("TAI of a leap second ago", -1.0)):
        if abs(math.remainder(offset_s - scale, DAY_S)) < LARGEST_OFFSET_S:
            return name
    hours = round(offset_s / 3600.0)
    if hours and abs(math.remainder(offset_s + ahead, 3600.0)) < _NEAR_S:
        return "local time"
    return ""


@lru_cache(maxsize=64)
def _offset(day: int) -> float:
    import erfa  # noqa: PLC0415 - takes a tenth of a second to load

    date = datetime.fromtimestamp(day * DAY_S, UTC)
    return float(erfa.dat(date.year, date.month, date.day, 0.0))
