"""How long it takes from an error to the target, on the average or at worst, when every press is chosen well.

The worse axis counts, in guide steps. V(x) is the least, over the speeds, of the seconds of one stage and of what
follows its residual:

    V(x) = 0 for x ≤ 1,      V(x) = min over k of ( c + duration_k(x) + mean of V(σ_k(x) m) ),

where m is the larger of two standard normal numbers without sign, one an axis, or a bound on them. It is found on a
grid of errors evenly spaced in their logarithm, round by round from what a press at GUIDE speed alone takes.
"""

from collections.abc import Sequence
from functools import lru_cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from mounts.awr.ladder import Ladder, Rung
from mounts.awr.ramps import Key

WITHIN = 1.0  # guide steps of each axis, within which the target is reached
NODES = 8  # equally likely values of the larger of two errors
_FARTHEST = 1e8  # guide steps: more than any way round
_PER_DECADE = 24
_ROUNDS = 12

Array = NDArray[np.float64]


def likely(axes: int = 2, nodes: int = NODES) -> tuple[float, ...]:
    """Equally likely values of the largest of so many standard normal errors, without sign."""
    normal = NormalDist()
    return tuple(normal.inv_cdf(0.5 + 0.5 * ((i + 0.5) / nodes) ** (1.0 / axes)) for i in range(nodes))


class Outlook:
    """Seconds to the target by the worse error.

    Parameters
    ----------
    ladder : Ladder
        The speeds.
    residuals : sequence of float
        Equally likely errors after a stage, in its standard deviations: `likely()` for the mean, a single bound for
        the worst.
    """

    def __init__(self, ladder: Ladder, residuals: Sequence[float]) -> None:
        self.ladder = ladder
        self._errors: Array = np.geomspace(WITHIN, _FARTHEST, 8 * _PER_DECADE + 1)
        self._residuals = np.array(residuals)
        stages = [self._stage(rung) for rung in ladder.rungs]
        self._seconds = stages[0][0]
        for _ in range(_ROUNDS):
            ways = [seconds + self(np.outer(self._residuals, sigma)).mean(axis=0) for seconds, sigma in stages]
            self._seconds = np.minimum(self._seconds, np.min(ways, axis=0))

    def __call__(self, errors: Array) -> Array:
        """Seconds from errors, guide steps of the worse axis; of any shape."""
        found = np.interp(np.log(np.maximum(errors, WITHIN)), np.log(self._errors), self._seconds)
        return np.where(errors <= WITHIN, 0.0, found)

    def _stage(self, rung: Rung) -> tuple[Array, Array]:
        """Seconds of one press from each error of the grid, and the standard deviation of what it leaves."""
        ladder, key = self.ladder, _worst(self.ladder, rung)
        holds = np.array([key.hold(error) for error in self._errors])
        lasts = np.array([key.duration(hold) for hold in holds])
        sigma = np.array([key.way_per_hold(hold) for hold in holds]) * ladder.jitter.surprise_s
        short = (holds < ladder.shortest_s) & (rung is not ladder.rungs[0])
        return np.where(short, np.inf, overhead_of(ladder) + lasts), sigma


def overhead_of(ladder: Ladder) -> float:
    """Seconds of a stage besides its motion: speed, two keys, the events at its end."""
    return 3.0 * ladder.exchange_s + ladder.notice_s


def _worst(ladder: Ladder, rung: Rung) -> Key:
    """The slower of all keys of a speed, in guide steps."""
    steps = ladder.guide_steps
    keys = [(abs(key.rate) / steps[i], key.acceleration / steps[i]) for i in range(2) for key in rung.keys[i] if key]
    rate, acceleration = (min(values) for values in zip(*keys, strict=True))
    return Key(rate, acceleration)


@lru_cache(maxsize=32)
def bound_of(ladder: Ladder, sigmas: float) -> Outlook:
    """Seconds to the target when every stage ends off by so many standard deviations."""
    return Outlook(ladder, (sigmas,))


@lru_cache(maxsize=32)
def mean_of(ladder: Ladder) -> Outlook:
    """Seconds to the target on the average."""
    return Outlook(ladder, likely())
