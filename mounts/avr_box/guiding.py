"""Trimming the tracking of axis 1 by `+` and `-`, which change the rate until so many ticks of TIMER1 have passed.

A command that arrives a part u of a tick after the last one and counts n ticks lasts n − u ticks. It is sent in the
middle of a tick, so that what is not known of the phase changes its length by that little, and never by a tick.
"""

from dataclasses import dataclass

from mounts.avr_box.commands import harmless_up_to
from mounts.avr_box.timers import CRYSTAL_HZ, TRACKING_PRESCALER

MOST_TICKS = 255
EVERY_S = 20.0  # from one command to the next, while the rate is within reach
_EARLIEST, _LATEST = 0.25, 0.75  # of a tick


@dataclass(frozen=True)
class GuideRates:
    """The three rates of axis 1, microsteps a second."""

    slower: float
    own: float
    faster: float

    @classmethod
    def of(cls, own: float, guide_counts: int, crystal: float = 1.0) -> "GuideRates":
        """Those of a box that tracks at `own` by its nominal crystal, and changes its divisor by so many counts."""
        divisor = CRYSTAL_HZ / (2 * TRACKING_PRESCALER) / own
        low, high = (crystal * own * divisor / (divisor + sign * guide_counts) for sign in (1, -1))
        return cls(low, crystal * own, high)

    def reach(self, rate: float, part: float = 1.0) -> bool:
        """Whether the axis can be kept at a rate by a part of what they change."""
        least, most = (self.own + part * (end - self.own) for end in (self.slower, self.faster))
        return least <= rate <= most


@dataclass(frozen=True)
class Pulse:
    """One command: its sign, its ticks, and how long the rate is changed, seconds."""

    sign: int
    ticks: int
    duration: float


def pulse(ahead: float, wanted: float, rates: GuideRates, since_tick: float, tick_s: float) -> Pulse | None:
    """What keeps an axis that is `ahead` microsteps around its path until the next command; None where nothing does.

    Between commands the error runs evenly; it is led to end the interval as far on one side as it begins on the
    other.
    """
    due = (wanted - rates.own) * EVERY_S / 2.0 - ahead
    change = (rates.faster if due > 0.0 else rates.slower) - rates.own
    ticks = min(round((due / change + since_tick) / tick_s), MOST_TICKS)
    if ticks < 1:
        return None
    ticks = harmless_up_to(ticks)
    duration = ticks * tick_s - since_tick
    return Pulse(1 if change > 0.0 else -1, ticks, duration) if duration > 0.0 else None


def sent_after(since_tick: float, tick_s: float) -> float:
    """Seconds to wait until a command may be sent, so that it comes in the middle of a tick."""
    part = since_tick / tick_s
    if _EARLIEST <= part <= _LATEST:
        return 0.0
    return ((0.5 - part) % 1.0) * tick_s
