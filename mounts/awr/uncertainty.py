"""How well it is known how far a press moved an axis.

A press and its release are carried out each at its time give or take `press_s`, and the events that tell of the
axis's motion are stamped give or take `stamp_s`; both are normal, and no two depend on each other. What was planned
and what the events say are two measurements of one duration, and are weighted as such. At the speed p at which it is
released the way grows by p for each second that the motion lasts longer.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from mounts.awr.ramps import Key

TWO_SIDED_95 = 1.959964
"""Standard deviations to either side of the mean between which a normal error is in 95 of 100 cases."""
_ASTRAY = 5.0  # standard deviations from the plan, beyond which the plan says nothing: the host was held up


class Way(NamedTuple):
    """How far an axis was moved: steps, signed, and their standard deviation."""

    steps: float
    sigma: float


@dataclass(frozen=True)
class Jitter:
    """By how much times are off.

    Parameters
    ----------
    press_s : float
        RMS of the time at which a key is pressed or released, seconds, from when it was meant to be.
    stamp_s : float
        RMS of the time by which an event is stamped.
    """

    press_s: float = 5e-3
    stamp_s: float = 1e-4

    @property
    def hold_s(self) -> float:
        """RMS of the time for which a key is held."""
        return math.sqrt(2.0) * self.press_s

    @property
    def known_s(self) -> float:
        """RMS of that time once the events have come, of a press that reached full speed."""
        return self._known(self.hold_s)

    @property
    def surprise_s(self) -> float:
        """RMS of what the events tell of that time: the part of its jitter that can be made up for."""
        return math.sqrt(self.hold_s**2 - self.known_s**2)

    def planned(self, key: Key, hold: float) -> Way:
        """The way of a press before anything was heard of it, or when its events are lost."""
        return Way(key.way(hold), key.way_per_hold(hold) * self.hold_s)

    def measured(self, key: Key, hold: float, duration: float) -> Way:
        """The way of a press that was to last `hold` and moved its axis for `duration`, by its two events."""
        planned, before, stamped = key.duration(hold), self._sent(key, hold), math.sqrt(2.0) * self.stamp_s
        weight = before**2 / (before**2 + stamped**2) if before or stamped else 1.0
        after = self._known(before)
        if abs(duration - planned) > _ASTRAY * math.hypot(before, stamped):
            weight, after = 1.0, stamped
        held = key.held(planned + weight * (duration - planned))
        return Way(key.way(held), key.peak(held) * after)

    def late_s(self, key: Key, hold: float) -> float:
        """RMS, seconds, by which the events say otherwise of a motion than the hold that was sent."""
        return math.hypot(self._sent(key, hold), math.sqrt(2.0) * self.stamp_s)

    def _sent(self, key: Key, hold: float) -> float:
        """RMS of a motion's duration, which grows twice as fast as its hold before full speed."""
        return self.hold_s * (2.0 if hold < key.climb_s else 1.0)

    def _known(self, before: float) -> float:
        stamped = math.sqrt(2.0) * self.stamp_s
        either = math.hypot(before, stamped)
        return before * stamped / either if either else 0.0
