"""A satellite on a circle round the Earth's centre, in the horizon frame: a fast target that owes nothing to TLEs."""

import math
from dataclasses import dataclass

EARTH_KM = 6371.0
GM_KM3_S2 = 398600.4418


@dataclass(frozen=True)
class Overhead:
    """A circular orbit that passes the zenith's neighbourhood at `culmination`.

    Parameters
    ----------
    culmination : float
        POSIX seconds at which it is highest.
    azimuth : float
        Direction in which it flies, radians.
    miss : float
        Angle at the Earth's centre by which it passes the zenith to the right of that direction.
    height_km : float
        Above the ground.
    """

    culmination: float
    azimuth: float
    miss: float = 0.0
    height_km: float = 400.0
    name: str = "satellite"

    @property
    def rate(self):
        """Angular rate at the Earth's centre, rad/s."""
        return math.sqrt(GM_KM3_S2 / (EARTH_KM + self.height_km) ** 3)

    def observed(self, frame):
        return self.observed_with_rate(frame)[0]

    def observed_with_rate(self, frame):
        radius, w = EARTH_KM + self.height_km, self.rate
        angle = w * (frame.instant.posix() - self.culmination)
        ahead = (-math.cos(self.azimuth), math.sin(self.azimuth), 0.0)
        right = (math.sin(self.azimuth), math.cos(self.azimuth), 0.0)
        top = (*(math.sin(self.miss) * r for r in right[:2]), math.cos(self.miss))
        place = [radius * (math.cos(angle) * t + math.sin(angle) * a) for t, a in zip(top, ahead, strict=True)]
        speed = [radius * w * (math.cos(angle) * a - math.sin(angle) * t) for t, a in zip(top, ahead, strict=True)]
        place[2] -= EARTH_KM
        distance = math.hypot(*place)
        unit = [c / distance for c in place]
        along = sum(u * v for u, v in zip(unit, speed, strict=True))
        rate = tuple((v - along * u) / distance for u, v in zip(unit, speed, strict=True))
        return tuple(unit), rate
