"""The clock of a simulated controller: TAI seconds of the day, ahead or behind, gaining or not set.

The controller counts seconds since it was made, by its own crystal; all its motion is in these. What it tells is that
count plus what it was set to.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache

import erfa

DAY_S = 86_400.0


@cache
def _leap_seconds(day: int) -> float:
    """TAI − UTC on this day, counted from 1970."""
    date = datetime.fromtimestamp(day * DAY_S, UTC)
    return float(erfa.dat(date.year, date.month, date.day, 0.0))


def leap_seconds(t: float) -> float:
    """TAI − UTC at POSIX `t`, seconds, by ERFA's table."""
    return _leap_seconds(int(t // DAY_S))


@dataclass
class ControllerClock:
    """A crystal, and what it was set to.

    Attributes
    ----------
    t0 : float
        POSIX time from which it has run as now.
    gain : float
        Counted seconds for a second, minus 1.
    setting : float
        TAI seconds of the day at count 0.
    is_set : bool
        Whether it was ever set.
    counted : float
        The count at `t0`.
    """

    t0: float
    gain: float = 0.0
    setting: float = 0.0
    is_set: bool = False
    counted: float = 0.0

    def count(self, t: float) -> float:
        """Seconds counted by POSIX `t`; a leap second counts."""
        return self.counted + ((t - self.t0) + leap_seconds(t) - leap_seconds(self.t0)) * (1.0 + self.gain)

    def posix(self, count: float) -> float:
        """POSIX time of a count."""
        t = self.t0 + (count - self.counted) / (1.0 + self.gain)
        return t - leap_seconds(t) + leap_seconds(self.t0)

    def set(self, t: float, offset: float = 0.0) -> None:
        """Set it at POSIX `t`, `offset` seconds ahead of TAI."""
        right = t % DAY_S + leap_seconds(t) + offset
        self.setting = (right - self.count(t)) % DAY_S
        self.is_set = True

    def retune(self, t: float, gain: float) -> None:
        """Let it gain otherwise from POSIX `t` on."""
        self.counted, self.t0, self.gain = self.count(t), t, gain

    def reading(self, count: float) -> float:
        """TAI seconds of the day to 1 ms; −1 while it is not set."""
        return round((self.setting + count) % DAY_S, 3) % DAY_S if self.is_set else -1.0

    def count_at(self, time_tai_s: float, count: float) -> float:
        """The count at a TAI second of the day, of the day by which that is nearest to `count`."""
        ahead = (time_tai_s - self.setting - count + DAY_S / 2.0) % DAY_S - DAY_S / 2.0
        return count + ahead
