"""What a stepper box is told of a rate: how its own tracking is trimmed, and the short moves beside that."""

import math
from typing import Any

from pointing.plan import Axis, Trims, Unsaid


class AvrBoxWords(Unsaid):
    """Guide commands and single steps."""

    def of_rate(self, axis: Axis, rate: float) -> dict[str, Any]:
        """Return the trims or the single steps that make a rate, radians per second."""
        counts = rate * axis.gearing.counts_per_radian
        if axis.trims is not None:
            return _trimmed(axis.trims, counts) | _lagging(axis, rate)
        if not counts:
            return {}
        return {"single_step_every_s": round(1.0 / abs(counts), 4)} | _lagging(axis, rate)


def _lagging(axis: Axis, rate: float) -> dict[str, Any]:
    """How far it is off its way by what short moves make of a rate; None where they do not hold it to that."""
    if axis.short_moves is None or not rate:
        return {}
    beside, moves = axis.beside(rate), axis.short_moves
    held = beside <= moves.most
    return {"lag_arcsec": round(math.degrees(beside * moves.lag_s) * 3600.0, 2) if held else None}


def _trimmed(trims: Trims, counts_s: float) -> dict[str, Any]:
    """How its own rate is trimmed, by which commands, and what short moves must add."""
    ticks = trims.ticks(counts_s)
    return {
        "guide_duty": round(trims.duty(counts_s), 4),
        "guide_command": "+" if ticks > 0 else "-" if ticks < 0 else None,
        "guide_ticks": abs(ticks),
        "guide_every_s": trims.every_s,
        "short_moves_counts_s": round(counts_s - trims.reached(counts_s), 4),
    }
