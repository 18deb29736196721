"""The path of a controller between two nodes: the cubic through position and velocity at both ends.

With v̄ = Δx/dt: a_i = (2/dt)(3v̄ − 2v_i − v_f), j = (6/dt²)(v_i + v_f − 2v̄).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple


class Extremes(NamedTuple):
    """The largest that a path does between two nodes; position both ways, all else without sign."""

    lowest: float
    highest: float
    speed: float
    acceleration: float
    jerk: float


@dataclass(frozen=True)
class Cubic:
    """One segment.

    Parameters
    ----------
    position, velocity, acceleration, jerk : float
        At its beginning; degrees and seconds.
    duration : float
        Seconds.
    """

    position: float
    velocity: float
    acceleration: float
    jerk: float
    duration: float

    @classmethod
    def between(cls, begin: tuple[float, float], end: tuple[float, float], duration: float) -> "Cubic":
        """The segment from (position, velocity) to (position, velocity)."""
        (x_i, v_i), (x_f, v_f) = begin, end
        mean = (x_f - x_i) / duration
        acceleration = 2.0 / duration * (3.0 * mean - 2.0 * v_i - v_f)
        return cls(x_i, v_i, acceleration, 6.0 / duration**2 * (v_i + v_f - 2.0 * mean), duration)

    def at(self, elapsed: float) -> tuple[float, float]:
        """Position and velocity so many seconds after its beginning."""
        t, a, j = elapsed, self.acceleration, self.jerk
        position = self.position + t * (self.velocity + t * (a / 2.0 + t * j / 6.0))
        return position, self.velocity + t * (a + t * j / 2.0)

    @property
    def extremes(self) -> Extremes:
        """What it reaches, exactly: at its ends, and where velocity or acceleration vanish."""
        a, j = self.acceleration, self.jerk
        inside = [t for t in self._standstills() if 0.0 < t < self.duration]
        places = [self.at(t)[0] for t in (0.0, *inside, self.duration)]
        turns = [-a / j] if j else []
        speeds = [self.at(t)[1] for t in (0.0, *(t for t in turns if 0.0 < t < self.duration), self.duration)]
        return Extremes(
            min(places), max(places), max(map(abs, speeds)), max(abs(a), abs(a + j * self.duration)), abs(j)
        )

    def _standstills(self) -> tuple[float, ...]:
        """When the velocity is nought."""
        v, a, half = self.velocity, self.acceleration, self.jerk / 2.0
        if half == 0.0:
            return (-v / a,) if a else ()
        root = a * a - 4.0 * half * v
        if root < 0.0:
            return ()
        q = -0.5 * (a + math.copysign(math.sqrt(root), a))
        return (q / half, *((v / q,) if q else ()))
