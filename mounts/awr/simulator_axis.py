"""A motor of the simulated AWR Microstep: it ramps from speed to speed, and takes up play in a blip.

Between two changes its course is a parabola or a line, so time goes on from change to change without an error of
steps. A blip is made on top of the motion.
"""

import math
from dataclasses import asdict, dataclass
from typing import Any

_ARRIVED = 1e-9  # steps a second


@dataclass
class MovingAxis:
    """One motor.

    Attributes
    ----------
    position : float
        Steps, blips among them.
    velocity, target : float
        Steps a second: now, and what it ramps to.
    acceleration : float
        Steps a second squared.
    direction : int
        Of the last motion.
    blip, blip_rate : float
        Steps that a blip has still to make, signed, and at how many a second.
    play : float
        Steps of play in the gears between the motor and the axis.
    place : float
        Where the axis is, steps; it follows once the motor has crossed the gap.
    """

    position: float
    velocity: float = 0.0
    target: float = 0.0
    acceleration: float = 1.0
    direction: int = 1
    blip: float = 0.0
    blip_rate: float = 1.0
    play: float = 0.0
    place: float = math.nan

    def __post_init__(self) -> None:
        self._pull()

    @classmethod
    def at(cls, place: float, play: float) -> "MovingAxis":
        """One that stands at a place to which its motor pushed it from below."""
        return cls(place + play / 2.0, play=play, place=place)

    @property
    def steady(self) -> bool:
        """Whether it goes at the speed that was asked of it."""
        return abs(self.velocity - self.target) <= _ARRIVED

    @property
    def change_in(self) -> float:
        """Seconds until it is at its speed, or turns round; infinity where nothing changes."""
        if self.steady:
            return math.inf
        at_speed = abs(self.target - self.velocity) / self.acceleration
        turning = abs(self.velocity) / self.acceleration if self.velocity * self.target < 0.0 else math.inf
        return min(at_speed, turning) if turning > 0.0 else at_speed

    def run(self, seconds: float) -> None:
        """Go on; not beyond the next change."""
        slope = 0.0 if self.steady else math.copysign(self.acceleration, self.target - self.velocity)
        self.position += self.velocity * seconds + slope * seconds * seconds / 2.0
        self.velocity += slope * seconds
        if slope * (self.target - self.velocity) <= _ARRIVED * abs(slope):
            self.velocity = self.target
        made = math.copysign(min(abs(self.blip), self.blip_rate * seconds), self.blip)
        self.position += made
        self.blip -= made
        self._pull()

    def _pull(self) -> None:
        """Let the axis go along with the motor, where that has crossed the gap."""
        low, high = self.position - self.play / 2.0, self.position + self.play / 2.0
        self.place = self.position if math.isnan(self.place) else min(max(self.place, low), high)

    def turned(self) -> int:
        """The sense in which it moves, where it is another than of its last motion; else 0."""
        leading = self.velocity if abs(self.velocity) > _ARRIVED else self.target
        sense = (leading > _ARRIVED) - (leading < -_ARRIVED)
        if sense in (0, self.direction):
            return 0
        self.direction = sense
        return sense

    def halt(self) -> None:
        """Stand at once."""
        self.velocity = self.target = self.blip = 0.0

    def snapshot(self) -> dict[str, Any]:
        """All of it."""
        return asdict(self)
