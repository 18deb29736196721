"""A target that drifts by rates of one's own on top of its own motion: what no ephemeris knows yet.

The displacement is that of `offset`, growing with the time since a moment: it is zero then, and goes on for as long
as the target is followed.
"""

import math
from dataclasses import dataclass

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.offset import displaced
from pointing.sky import SkyFrame
from pointing.targets import ARCSEC, Target, notes_of
from pointing.vectors import Vector

LARGEST_RATE = math.radians(10.0)  # per second; the fastest satellites go at 2°


@dataclass(frozen=True)
class RateOffsetTarget:
    """`base`, drifting on the observed sky.

    Parameters
    ----------
    base : Target
        What drifts.
    east_rate, north_rate : float
        Radians per second along the directions of increasing right ascension (a great-circle rate, the one of right
        ascension times cos Dec) and declination at the target.
    since : Instant
        When the drift was or will be zero.

    Raises
    ------
    TargetError
        A rate is no number, or both together are more than 10° a second.
    """

    base: Target
    east_rate: float
    north_rate: float
    since: Instant

    def __post_init__(self) -> None:
        if not math.hypot(self.east_rate, self.north_rate) <= LARGEST_RATE:
            said = f"{self._rates()}: together at most {LARGEST_RATE / ARCSEC:.0f}″/s"
            raise TargetError(f"{self.base.name}: rates of {said}; give arcseconds a second")

    @property
    def name(self) -> str:
        """The name of what drifts."""
        return self.base.name

    def note_at(self, instant: Instant) -> str:
        """Say how it drifts and how far it has come, after what its base has to say."""
        told = "".join(notes_of(self.base, instant))
        seconds = instant.since(self.since)
        drift = math.hypot(self.east_rate, self.north_rate) * abs(seconds) / ARCSEC
        mine = f"drifts by {self._rates()} since {self.since.utc_iso(0)}, {drift:.1f}″ by now"
        return f"{told}; it {mine}" if told else f"{self.name}: {mine}"

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        return self.observed_with_rate(frame)[0]

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        seconds = frame.instant.since(self.since)
        offset = self.east_rate * seconds, self.north_rate * seconds
        v, rate = self.base.observed_with_rate(frame)
        return displaced(v, rate, offset, frame.sky.site.latitude, (self.east_rate, self.north_rate))

    def _rates(self) -> str:
        return f"{self.east_rate / ARCSEC:+.7g}″/s east, {self.north_rate / ARCSEC:+.7g}″/s north"
