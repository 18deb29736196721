"""The quickest motion that joins a moving place with its velocity, at constant accelerations.

In the frame that moves with the place the axis has to come to rest at the origin, so one formula serves for stars,
satellites and a place that stands still. With the distance D and the axis' velocity u in that frame it first goes the
way s = sign(D − u|u|/2a); without a bound on the speed the turning point has the velocity

    p = s √(u²/2 + s a D),        T = |p − u|/a + |p|/a.

Speeds are bounded in the frame of the Earth, |v| ≤ V, so in the moving one by V − w upwards and −V − w downwards; at
the bound the axis cruises. Counts, seconds, counts per second.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple


class Phase(NamedTuple):
    """A stretch at one acceleration; `begin` in seconds from the start of the motion."""

    begin: float
    position: float
    rate: float
    acceleration: float

    def at(self, elapsed: float) -> tuple[float, float]:
        """Position and rate `elapsed` seconds after the start of the motion."""
        t = elapsed - self.begin
        return self.position + (self.rate + self.acceleration * t / 2.0) * t, self.rate + self.acceleration * t


@dataclass(frozen=True)
class Motion:
    """One axis on its way to a moving place; keeps `pointing.slew.Travel`.

    Parameters
    ----------
    phases : tuple of Phase
        One after the other; the last one is the place's own motion.
    """

    phases: tuple[Phase, ...]

    @property
    def duration(self) -> float:
        """Seconds until the axis has joined the place."""
        return self.phases[-1].begin

    @property
    def landed(self) -> float:
        """Where it joins it, counts."""
        return self.phases[-1].position

    @property
    def extremes(self) -> tuple[float, float]:
        """The least and the largest position on the way."""
        turns = [
            phase.at(phase.begin - phase.rate / phase.acceleration)[0]
            for phase, following in pairwise(self.phases)
            if phase.acceleration and 0.0 < -phase.rate / phase.acceleration < following.begin - phase.begin
        ]
        places = [phase.position for phase in self.phases] + turns
        return min(places), max(places)

    def position(self, elapsed: float) -> float:
        """Position `elapsed` seconds after the start; `landed` from `duration` on."""
        return self.at(elapsed)[0]

    def at(self, elapsed: float) -> tuple[float, float]:
        """Position and rate `elapsed` seconds after the start, at the place from `duration` on."""
        phase = next((each for each in reversed(self.phases) if each.begin <= elapsed), self.phases[0])
        return (phase.position, phase.rate) if phase is self.phases[-1] else phase.at(elapsed)

    def ridden(self, seconds: float) -> "Motion":
        """The same motion, ended later: until then the axis goes along with the place."""
        return Motion((*self.phases, Phase(seconds, *self.phases[-1].at(seconds), 0.0)))


@dataclass(frozen=True)
class Ramps:
    """What an axis can do that is led along a way: its largest speed and its acceleration, counts and seconds."""

    max_rate: float
    acceleration: float

    def stopping(self, rate: float) -> float:
        """Counts in which it comes to rest."""
        return rate * abs(rate) / (2.0 * self.acceleration)

    def meet(self, start: float, start_rate: float, place: float, rate: float) -> Motion | None:
        """The quickest motion that joins a place which moves evenly; None when it is as fast as the axis.

        Parameters
        ----------
        start, start_rate : float
            Where the axis is as the motion begins, and how fast it moves.
        place, rate : float
            Where the place is at that moment, and how fast it moves.
        """
        if not abs(rate) < self.max_rate:
            return None
        a, distance, relative = self.acceleration, place - start, start_rate - rate
        sign = math.copysign(1.0, distance - relative * abs(relative) / (2.0 * a))
        turning = sign * math.sqrt(max(0.0, relative * relative / 2.0 + sign * a * distance))
        bound = sign * self.max_rate - rate
        cruise = 0.0
        if abs(turning) > abs(bound):
            turning = bound
            ramps = (relative + bound) * abs(bound - relative) / 2.0 + bound * abs(bound) / 2.0
            cruise = (distance - ramps / a) / bound
        steps = (
            (abs(turning - relative) / a, math.copysign(a, turning - relative)),
            (cruise, 0.0),
            (abs(turning) / a, -sign * a),
        )
        return Motion(_joined(start, start_rate, place, rate, steps))


def _joined(
    start: float, start_rate: float, place: float, rate: float, steps: tuple[tuple[float, float], ...]
) -> tuple[Phase, ...]:
    phases, begin, position, speed = [], 0.0, start, start_rate
    for seconds, acceleration in steps:
        if seconds > 0.0:
            phases.append(Phase(begin, position, speed, acceleration))
            begin += seconds
            position, speed = phases[-1].at(begin)
    return *phases, Phase(begin, place + rate * begin, rate, 0.0)
