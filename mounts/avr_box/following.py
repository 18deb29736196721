"""What keeps an axis of the box on its path: which command next, and when to look again.

Within the reach of `+` and `-` axis 1 is trimmed by them. Beyond it, and to hold a place against tracking that cannot
be switched off, it makes short moves; then it runs to and fro, on a path evenly on both sides, at rest only short of
the place, for that may be a limit.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from mounts.avr_box.commands import harmless_up_to
from mounts.avr_box.guiding import GuideRates

HELD_EVERY_S = 20.0  # from one move to the next, at rest: 5′ to and fro
_SHORT_OF_IT_S = 2.0  # of tracking before its place, at rest, that are left for the next look and its line
_MOVED_EVERY_S = 3.0  # likewise on a path beyond the reach of guiding
_MOVED_ALONE_EVERY_S = 1.5
_FAR = 24.0  # microsteps off the path, 1.3″, that guiding would take too long to close
_LEAST = 4.0  # microsteps to either side that are worth a move
_SLACK = 8.0  # microsteps by which a move may end beyond its goal
_FINE = 60.0  # microsteps of axis 2 that are made one by one, within half a second
_BYTE = 255  # microsteps, at most, of one command
_ROUNDS = 12
MOST_BESIDE_ARCSEC_S = 30.0
"""By which the rate of a path may be beyond what guiding reaches."""
LAGS_S = (1.6, 1.1)
"""For which each axis is off at most by what is beyond that: half the time between its moves, and what they last."""


@dataclass(frozen=True)
class Band:
    """How far ahead of its path an axis may run, microsteps, and to where a move brings it back."""

    low: float
    high: float
    goal: float


def band_of(wanted: float, rates: GuideRates, *, alone: bool = False) -> Band:
    """The band of axis 1 on a path of a rate, microsteps a second, both counted with its own tracking.

    Moves that are `alone` have no guiding beside them, so that there is one every few seconds.
    """
    if wanted == 0.0:
        back = -rates.own * HELD_EVERY_S
        return Band(1.5 * back, -rates.own * _SHORT_OF_IT_S, back)
    left = (rates.own if alone else min(max(wanted, rates.slower), rates.faster)) - wanted
    if left == 0.0:
        return Band(-_FAR, _FAR, 0.0)
    half = max(abs(left) * (_MOVED_ALONE_EVERY_S if alone else _MOVED_EVERY_S) / 2.0, _LEAST)
    wide = half + _SLACK
    return Band(-wide, half, -half) if left > 0.0 else Band(-half, wide, half)


def leaves_in(ahead: float, drift: float, band: Band) -> float:
    """Seconds until an axis that drifts is at the end of its band."""
    if drift == 0.0:
        return math.inf
    return max(0.0, ((band.high if drift > 0.0 else band.low) - ahead) / drift)


def move_back(ahead: float, wanted: float, band: Band, duration: Callable[[int], float]) -> int:
    """Half of the microsteps, signed, that bring an axis to the goal of its band; the path goes on meanwhile."""
    steps = band.goal - ahead
    for _ in range(_ROUNDS):  # halfway each time: the slowest microsteps last as long as those of tracking
        steps += (band.goal - ahead + wanted * duration(round(abs(steps) / 2.0)) - steps) / 2.0
    return round(steps / 2.0)


def single_steps(ahead: float, most: float = _FINE) -> int:
    """Microsteps of axis 2, signed, to be made one by one; 0 where a move is quicker or nothing is to be done."""
    steps = -round(ahead)
    made = harmless_up_to(min(abs(steps), _BYTE)) if 1 <= abs(steps) <= most else 0
    return int(math.copysign(made, steps))
