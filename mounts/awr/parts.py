"""What the driver of a unit is made of: its words, keys, drives, axes, and what is known of them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Attended
from mounts.awr.drive_rates import DriveRates
from mounts.awr.holding import Holding
from mounts.awr.memory import Kept
from mounts.awr.pace import Pace
from mounts.awr.proof import Proof
from mounts.awr.settings import AwrSettings
from mounts.awr.supervision import Supervision
from mounts.awr.unit import Unit
from mounts.awr.words import Words
from mounts.beside import Guardian

_COUNTED = frozenset({"guide", "centre"})  # speeds that are rates: of the motor, or beyond its drive


@dataclass(frozen=True)
class Parts:
    """One unit as its driver knows it, each part by the name of what it is."""

    unit: Unit
    settings: AwrSettings
    kept: Kept
    """What was remembered when the driver was made."""
    axes: tuple[AwrAxis, AwrAxis]
    words: Words
    supervision: Supervision
    beside: Attended
    keys: Holding
    drives: DriveRates
    pace: Pace
    proof: Proof
    remember: Callable[[], None]
    """Keeps what the driver wants to be given back."""

    @classmethod
    def of(
        cls,
        unit: Unit,
        settings: AwrSettings,
        memory: Mapping[str, object],
        remember: Callable[[], None],
        guardian: Guardian | None,
    ) -> "Parts":
        """Put them together, as a driver was that gave `memory`."""
        kept = Kept.of(memory, settings.meaning)
        axes = one, _ = _axes(kept, unit.now())
        words = Words(unit, settings)
        words.ram = dict(kept.ram)
        supervision = Supervision(
            kept.unsynchronised, lambda time: one.at(time).counts, lambda: words.undivided, kept.index
        )
        beside, proof = Attended(unit, guardian), Proof(settings, kept)
        keys = Holding(unit, beside, axes, settings.jitter, supervision.lose)
        if kept.delay_s is not None:
            keys.remember_delay(kept.delay_s)
        one.unsure = lambda: 0.0 if proof.referenced or keys.speed not in _COUNTED else abs(one.rate)
        for axis in axes:
            axis.led = partial(proof.led, axis.index)
        supervision.lost = lambda: _forget_sides(axes)
        return cls(
            unit=unit,
            settings=settings,
            kept=kept,
            axes=axes,
            words=words,
            supervision=supervision,
            beside=beside,
            keys=keys,
            drives=DriveRates(unit, words, axes, beside, proof),
            pace=Pace(unit, words, settings),
            proof=proof,
            remember=remember,
        )


def _forget_sides(axes: tuple[AwrAxis, AwrAxis]) -> None:
    for axis in axes:
        axis.forget_side()


def _axes(kept: Kept, now: float) -> tuple[AwrAxis, AwrAxis]:
    """Where they were, and going on as they did."""
    seen = kept.time if math.isfinite(kept.time) else now
    one, two = (AwrAxis(i, axis.counts, seen, axis.uncertainty, axis.side) for i, axis in enumerate(kept.axes))
    for axis, was in zip((one, two), kept.axes, strict=True):
        axis.drives_at(was.rate, seen)
    return one, two
