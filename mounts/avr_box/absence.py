"""While no program looked: axis 1 tracked on, how far, and how surely."""

import math

from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.guiding import GuideRates
from mounts.avr_box.settings import AvrSettings

UNATTENDED = 3e-3
"""Of the way that is tracked: a divisor, or a PEC, that nobody set."""
_GUIDED_S = 118.0  # for which guiding goes on at most when its host is gone
_TOLD_DEG = 0.1


def tracked_on(axis: BoxAxis, settings: AvrSettings, rates: GuideRates, seen: float, time: float) -> tuple[str, ...]:
    """Widen what axis 1 is stated to be known to since it was `seen`; a note where it went far."""
    away = time - seen
    if not math.isfinite(away):
        return ()
    unsure = UNATTENDED if settings.encoder_counts_per_turn else 1.0  # it may have been switched off
    doubt = away * rates.own * unsure + min(away, _GUIDED_S) * (rates.faster - rates.own)
    here = axis.at(time)
    axis.known(here.counts, time, here.uncertainty + max(0.0, doubt))
    degrees = away * rates.own / settings.steps_per_turn[0] * 360.0
    if degrees <= _TOLD_DEG:
        return ()
    arcmin = doubt / settings.steps_per_turn[0] * 21600.0
    return (f"axis 1 tracked on for {away:.0f} s while no program looked, {degrees:.2f}° ± {arcmin:.1f}′",)
