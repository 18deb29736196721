"""The controllers' time: TAI seconds of the day, modulo 86400; −1 where a controller's clock is not set.

Leap seconds are those of `pointing.instant`, bundled. POSIX time has no leap second, it repeats
the second before it, while TAI goes on counting. Whole seconds and fractions are kept apart, so that a node's time
arrives with all its digits.
"""

import math
from functools import lru_cache

from pointing.instant import Instant

DAY_S = 86400.0
LARGEST_OFFSET_S = 0.4
"""Between a controller's clock and the host's; beyond that the two disagree about what time it is."""
_TT_AHEAD_S = 32.184  # of TAI
_NEAR_S = 2.0
_GPS_S = 19.0  # that GPS time is behind TAI


def seconds_of_day(posix: float) -> float:
    """TAI seconds of the day at a POSIX time."""
    whole = math.floor(posix)
    return (whole + _offset(int(whole // DAY_S))) % DAY_S + (posix - whole)


def posix(of_day: float, near: float) -> float:
    """The POSIX time of a TAI second of the day, of all days that nearest to a POSIX time.

    A moment within a leap second, 23:59:60, is that of the second before it.
    """
    found = near + math.remainder(of_day - seconds_of_day(near), DAY_S)
    before, after = leap_seconds(found - _NEAR_S), leap_seconds(found + _NEAR_S)
    found += leap_seconds(near) - before
    return found if leap_seconds(found) == before else found + before - after


def leap_seconds(posix_s: float) -> int:
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
def _offset(day: int) -> int:
    """TAI − UTC on a day, counted from 1970."""
    return round((Instant.from_posix(day * DAY_S).seconds - _TT_AHEAD_S) % DAY_S)
