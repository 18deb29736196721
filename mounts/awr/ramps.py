"""A key held for a time: how far it moves an axis, and how long that takes.

All is counted from the axis's own drive, which goes on below: an axis that tracks and is moved back ends where it
would be, less the way. The speed rises evenly with the acceleration a to the key's v, or until the release, and falls
as it rose. With the hold h the peak is p = min(v, a h), and

    way = p h,        duration = h + p / a.

Steps, seconds.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Key:
    """One key of one axis at one speed.

    Parameters
    ----------
    rate : float
        Steps a second that it adds to the drive's own rate, signed, not 0.
    acceleration : float
        Steps/s², above 0.
    """

    rate: float
    acceleration: float

    @property
    def climb_s(self) -> float:
        """Seconds from rest to full speed."""
        return abs(self.rate) / self.acceleration

    def peak(self, hold: float) -> float:
        """The largest speed of a press, steps a second."""
        return min(abs(self.rate), self.acceleration * max(0.0, hold))

    def way(self, hold: float) -> float:
        """Steps, signed, of a press of so many seconds; inverse of `hold`."""
        return math.copysign(self.peak(hold) * max(0.0, hold), self.rate)

    def hold(self, way: float) -> float:
        """Seconds that a press lasts which makes so many steps; those of its own sign, others are none."""
        steps = math.copysign(1.0, self.rate) * way
        if steps <= 0.0:
            return 0.0
        return max(steps / abs(self.rate), math.sqrt(steps / self.acceleration))

    def duration(self, hold: float) -> float:
        """Seconds from the press until the axis goes with its drive again; inverse of `held`."""
        return hold + self.peak(hold) / self.acceleration

    def held(self, duration: float) -> float:
        """Seconds for which a key was held that moved its axis for so long."""
        return max(duration - self.climb_s, duration / 2.0, 0.0)

    def made(self, hold: float, elapsed: float) -> float:
        """Steps, signed, so many seconds after a press of `hold` began."""
        peak = self.peak(hold)
        climb = peak / self.acceleration
        rising = min(max(elapsed, 0.0), climb)
        even = min(max(elapsed - climb, 0.0), hold - climb) if hold > climb else 0.0
        falling = min(max(elapsed - hold, 0.0), climb)
        steps = (rising**2 - falling**2) * self.acceleration / 2.0 + peak * (even + falling)
        return math.copysign(steps, self.rate)

    def way_per_hold(self, hold: float) -> float:
        """Steps a second, without sign, by which the way grows with the hold: twice the peak while that grows too."""
        return self.peak(hold) * (2.0 if hold < self.climb_s else 1.0)
