"""One moment as a pair (day, seconds of day) in Terrestrial Time.

One float64 MJD resolves 0.6 µs, too coarse for rates; the pair resolves 15 ps. Wall times enter and leave as POSIX
seconds or ISO 8601 in UTC, through the leap seconds bundled with ERFA, which are read once and never fetched. Before
1972 UTC is taken as TAI − 10 s, after the table's end as what its last row says.
"""

import math
import re
from bisect import bisect_right
from datetime import date
from functools import cache
from typing import NamedTuple

import erfa

from pointing.errors import PointingError

DAY = 86400.0
_POSIX_MJD = 40587  # 1970 January 1
_ORDINAL_MJD = 678576  # the ordinal of MJD 0 in Python's calendar
_TT_TAI = 32.184
_ISO = re.compile(r"(\d{4})-(\d\d)-(\d\d)(?:[T ](\d\d):(\d\d)(?::(\d\d(?:\.\d*)?))?)?\s*(?:Z|\+00:00)?", re.ASCII)


class Instant(NamedTuple):
    """A moment.

    Parameters
    ----------
    day : int
        Modified Julian Day in TT.
    seconds : float
        Seconds of that day, in [0, 86400).
    """

    day: int
    seconds: float

    @classmethod
    def from_posix(cls, posix: float) -> "Instant":
        """Read POSIX seconds (UTC without its leap seconds).

        Raises
        ------
        PointingError
            The time is not finite.
        """
        try:
            day, seconds = divmod(posix, DAY)
            return cls.from_utc(_POSIX_MJD + int(day), seconds)
        except (ValueError, OverflowError):
            raise PointingError(f"the time {posix} is not a finite number of POSIX seconds: give one") from None

    @classmethod
    def from_utc(cls, day: int, seconds: float) -> "Instant":
        """Read a UTC day (MJD) and seconds of day, which exceed 86400 within a leap second only."""
        starts, offsets, _ = _leap_seconds()
        seconds += offsets[bisect_right(starts, day)]
        if seconds >= DAY:
            return cls(day + 1, seconds - DAY)
        return cls(day, seconds)

    @classmethod
    def from_utc_iso(cls, text: str) -> "Instant":
        """Read ISO 8601 in UTC: `2026-03-01T12:00:00.5Z`; the Z, the seconds and the time may be left out.

        Raises
        ------
        PointingError
            The text is no such time.
        """
        match = _ISO.fullmatch(text.strip())
        try:
            if match is None:
                raise ValueError  # noqa: TRY301 - every way of being no time ends in the same sentence
            year, month, day, hour, minute, second = match.groups(default="0")
            midnight = date(int(year), int(month), int(day)).toordinal() - _ORDINAL_MJD
            h, m, s = int(hour), int(minute), float(second)
            last = 61.0 if (h, m) == (23, 59) and midnight + 1 in _leap_seconds()[0][1:] else 60.0
            if h > 23 or m > 59 or s >= last:
                raise ValueError  # noqa: TRY301 - as above
        except ValueError:
            raise PointingError(f"{text!r} is no UTC time: write it like 2026-03-01T12:00:00Z") from None
        return cls.from_utc(midnight, h * 3600.0 + m * 60.0 + s)

    def utc(self) -> tuple[int, float]:
        """UTC day (MJD) and seconds of day, in [0, 86401): from 86400 on within a leap second."""
        _, offsets, ends = _leap_seconds()
        i = bisect_right(ends, self)
        day, seconds = self.day, self.seconds - offsets[i]
        if seconds < 0.0:
            day, seconds = day - 1, seconds + DAY
        if i < len(ends) and day == ends[i].day:
            # Past midnight by the old offset, but the new day has not begun: the leap second itself.
            return day - 1, seconds + DAY
        return day, seconds

    def posix(self) -> float:
        """POSIX seconds; a leap second has those of the second after it."""
        day, seconds = self.utc()
        return (day - _POSIX_MJD) * DAY + seconds

    def utc_iso(self, digits: int = 3) -> str:
        """ISO 8601 in UTC, rounded to `digits` decimals of a second, with a Z."""
        day, seconds = self.plus(0.5 * 10.0**-digits).utc()
        whole = int(seconds)
        minutes = min(whole // 60, 1439)
        ticks = int((seconds - minutes * 60) * 10**digits)
        second = f"{ticks // 10**digits:02d}" + (f".{ticks % 10**digits:0{digits}d}" if digits else "")
        calendar = date.fromordinal(day + _ORDINAL_MJD).isoformat()
        return f"{calendar}T{minutes // 60:02d}:{minutes % 60:02d}:{second}Z"

    def plus(self, seconds: float) -> "Instant":
        """Return the moment `seconds` later."""
        moved = self.seconds + seconds
        if 0.0 <= moved < DAY:
            return Instant(self.day, moved)
        days = math.floor(moved / DAY)
        rest = moved - days * DAY
        return Instant(self.day + days, rest) if rest < DAY else Instant(self.day + days + 1, 0.0)

    def since(self, other: "Instant") -> float:
        """Seconds from another moment to this one."""
        return (self.day - other.day) * DAY + (self.seconds - other.seconds)


@cache
def _leap_seconds() -> tuple[list[int], list[float], list[Instant]]:
    """UTC days from which TT − UTC changes, TT − UTC before the first and from each on, and those days as TT."""
    rows = [row for row in erfa.leap_seconds.get() if row["year"] >= 1972]
    starts = [date(int(row["year"]), int(row["month"]), 1).toordinal() - _ORDINAL_MJD for row in rows][1:]
    offsets = [float(row["tai_utc"]) + _TT_TAI for row in rows]
    ends = [Instant(day, offset) for day, offset in zip(starts, offsets[1:], strict=True)]
    return starts, offsets, ends
