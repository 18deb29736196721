"""How long a goto by keys takes, as the planner asks: an upper estimate, met by waiting.

The first stage takes what the law of its press says; each later one what an error of 3.5 standard deviations takes,
and no less where the first press was too short for that: so the duration has no jumps, and is not exceeded in 99 of
100 gotos. One speed is in force for both axes, so the longer of two durations is that of both.

The drive goes on below the keys with the rate of what is met, which is set before; an axis that lands early goes
along with it. So this is the law of a drive that meets what moves (`pointing.slew.MeetingModel`), and no arrival has
to be sought.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from mounts.awr.cascade import Cascade, Errors
from mounts.awr.commands import Speed
from mounts.awr.ladder import Ladder
from mounts.awr.outlook import WITHIN, bound_of, overhead_of
from mounts.awr.play import Play
from mounts.awr.ramps import Key

_SIGMAS = 3.5
_HALVINGS = 60
_ERRORS = 100  # up to the bound, that are looked at
_FARTHEST_S = 1e6


class Foreseen(NamedTuple):
    """A press as it is planned: speed, seconds, and the steps that it leaves to go and unknown, RMS."""

    speed: Speed
    hold_s: float
    leaves: float
    unknown: float


@dataclass(frozen=True)
class AwrTravel:
    """One axis on its way; keeps `pointing.slew.Travel`.

    Parameters
    ----------
    start, rate : float
        Where it begins, and the rate of its drive, steps a second.
    way : float
        Steps besides those of the drive.
    duration : float
        Seconds until it is on its target, at most.
    key : Key, optional
        That of the first press; None where no key leads there.
    model : AwrSlewModel
        By which it was found.
    """

    start: float
    rate: float
    way: float
    duration: float
    key: Key | None
    model: "AwrSlewModel"

    @property
    def presses(self) -> list[Foreseen]:
        """One after the other, of this axis alone and without drift, if each leaves as much as it does RMS."""
        axis = self.model.axis
        ways = (0.0, self.way) if axis else (self.way, 0.0)
        return [
            Foreseen(stage.speed, press.hold, stage.leaves[axis], stage.known_sigmas[axis])
            for stage in Cascade(self.model.speeds(self.rate)).foreseen(Errors(ways))
            if (press := stage.presses[axis])
        ]

    @property
    def landed(self) -> float:
        """Where it is after `duration`."""
        return self.start + self.way + self.rate * self.duration

    def position(self, elapsed: float) -> float:
        """Where it is so many seconds after the beginning; `landed` from `duration` on."""
        elapsed = min(max(elapsed, 0.0), self.duration)
        made = self.key.made(self.key.hold(self.way), elapsed) if self.key else 0.0
        return self.start + self.rate * elapsed + made


@dataclass(frozen=True)
class AwrSlewModel:
    """The law of one axis; keeps `pointing.slew.MeetingModel`.

    Parameters
    ----------
    ladder : Ladder
        The speeds of both axes.
    axis : int
        0 or 1.
    resting : Ladder, optional
        The speeds where its drive is off, for targets slower than half of `tracks`.
    tracks : float
        Steps a second of the drive for which `ladder` is.
    play : float
        Motor steps of play that the unit does not take up.
    """

    ladder: Ladder
    axis: int
    resting: Ladder | None = None
    tracks: float = 0.0
    play: float = 0.0

    @property
    def max_rate(self) -> float:
        """Steps a second at the fastest speed, of its slower key."""
        return self.ladder.slew_rates[self.axis]

    def limited(self, max_rate: float) -> "AwrSlewModel":
        """The same axis with a slower slew, steps a second."""
        rates = [min(max_rate, rate) if i == self.axis else rate for i, rate in enumerate(self.ladder.slew_rates)]
        resting = self.resting and self.resting.slewing_at(rates)
        return replace(self, ladder=self.ladder.slewing_at(rates), resting=resting)

    def speeds(self, rate: float) -> Ladder:
        """The speeds for a target of a rate."""
        return self.ladder if self.resting is None or abs(rate) > abs(self.tracks) / 2.0 else self.resting

    def onto(self, start: float, start_rate: float, position: float, rate: float) -> AwrTravel:  # noqa: ARG002
        """Travel onto a line that is at `position` steps as it begins and moves with `rate`."""
        way = position - start
        duration, key = self._soonest(way, rate)
        return AwrTravel(start, rate, way, duration, key, self)

    def travel(self, start: float, end: float, start_rate: float, end_rate: float) -> AwrTravel:
        """Travel to `end` steps, reached at the duration with the drive going at `end_rate`.

        That of a target which is faster than the keys never ends; a long time is answered, which a plan refuses.
        """

        def early(duration: float) -> bool:
            return duration < self._soonest(end - end_rate * duration - start, end_rate)[0]

        low, high = 0.0, 1.0
        while early(high) and high < _FARTHEST_S:
            low, high = high, 2.0 * high
        for _ in range(_HALVINGS):
            middle = (low + high) / 2.0
            low, high = (middle, high) if early(middle) else (low, middle)
        return self.onto(start, start_rate, end - end_rate * high, end_rate)

    def _soonest(self, way: float, rate: float) -> tuple[float, Key | None]:
        """Seconds at most, and the key of the first press."""
        ladder = self.speeds(rate)
        best, chosen = math.inf, None
        for rung, tail in zip(ladder.rungs, tails(ladder), strict=True):
            key = rung.key(self.axis, way)
            if key is not None:
                seconds = key.duration(key.hold(way)) + tail
                best, chosen = (seconds, key) if seconds < best else (best, chosen)
        return best + self._taking_up(rate), chosen

    def _taking_up(self, rate: float) -> float:
        """Seconds at most in which the play is taken up: by the drive, or turning round twice in the last stages."""
        if self.play <= 0.0:
            return 0.0
        last = [abs(key.rate) for key in self.speeds(rate).rungs[1].keys[self.axis] if key]
        return self.play / abs(rate) if Play(self.play).settles(rate) else 2.0 * self.play / min(last)


@lru_cache(maxsize=32)
def tails(ladder: Ladder) -> tuple[float, ...]:
    """Seconds of each speed's stage besides its motion, and of all that follows an error at its bound."""
    bound, overhead = bound_of(ladder, _SIGMAS), overhead_of(ladder) + ladder.exchange_s
    found = []
    for rung in ladder.rungs:
        rates = [abs(key.rate) / ladder.guide_steps[axis] for axis in range(2) for key in rung.keys[axis] if key]
        left = 2.0 * max(rates) * ladder.jitter.surprise_s * _SIGMAS  # twice, as the peak grows too before it is full
        # A smaller error may take longer, where it is too small for a fast key.
        found.append(overhead + float(bound(np.geomspace(WITHIN, max(WITHIN, left), _ERRORS)).max()))
    return tuple(found)
