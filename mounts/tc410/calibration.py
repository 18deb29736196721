"""What a TC410 teaches about itself: its true acceleration, its landing, its latency, its idle rule.

The law of motion in the manual is an assumption. While an axis speeds up its position gives the true acceleration;
the moment it lands gives what the end of a slew takes beyond the law; an axis that moves on after it has landed,
while the other one still slews, shows that tracking resumes axis by axis.

Every observation is an interval, because positions are whole counts and times have their jitter. What is known is
moved only as far as into the interval, so that what agrees with it is not blurred by it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import median

from mounts.tc410.interval import Interval
from mounts.tc410.settings import SlewIdle
from mounts.tc410.slew_watch import AxisWatch

_LATENCIES = 5  # starts of which the latency is the median
_SCALES = Interval(0.5, 2.0)  # what is remembered beyond these was learnt from something else, or is broken
_LANDINGS_S = Interval(0.0, 30.0)
_STARTS_S = Interval(0.0, 30.0)
_LEAST_MOVE = 200.0  # counts; shorter moves say too little of the landing


@dataclass(frozen=True)
class AxisLearnt:
    """One axis: true over nominal acceleration, and seconds from the law's landing to the true one."""

    acceleration_scale: float = 1.0
    landing_s: float = 0.0


@dataclass(frozen=True)
class Learnt:
    """All that has been learnt of one unit."""

    axes: tuple[AxisLearnt, AxisLearnt] = (AxisLearnt(), AxisLearnt())
    latencies_s: tuple[float, ...] = ()
    slew_idle: SlewIdle | None = None

    @property
    def start_latency_s(self) -> float | None:
        """Seconds from the call that starts a slew to the motion; None before the first."""
        return median(self.latencies_s) if self.latencies_s else None

    def started(self, latency_s: float) -> "Learnt":
        """What is known after one more start."""
        return replace(self, latencies_s=(*self.latencies_s, latency_s)[-_LATENCIES:])

    def landed(self, watches: tuple[AxisWatch, AxisWatch], landings: tuple[Interval, Interval]) -> "Learnt":
        """What is known after one more undisturbed slew, whose axes landed within `landings` seconds of its start."""
        one, two = (
            _taught(axis, watch, landing) for axis, watch, landing in zip(self.axes, watches, landings, strict=True)
        )
        return replace(self, axes=(one, two))

    def idled(self, watches: tuple[AxisWatch, AxisWatch]) -> "Learnt":
        """What is known of the idle rule after one more undisturbed slew."""
        seen = [watch.creeps for watch in watches if watch.creeps is not None]
        return replace(self, slew_idle="per-axis" if any(seen) else "both") if seen else self

    def as_json(self) -> dict[str, object]:
        """Return plain values for the state store."""
        return {**vars(self), "axes": [dict(vars(axis)) for axis in self.axes]}

    @classmethod
    def from_json(cls, stored: object) -> "Learnt":
        """Read what `as_json` gave; where anything is unreadable or impossible, nothing is learnt."""
        if not isinstance(stored, Mapping):
            return cls()
        try:
            one, two = (
                AxisLearnt(_in(_SCALES, axis["acceleration_scale"]), _in(_LANDINGS_S, axis["landing_s"]))
                for axis in stored["axes"]
            )
            latencies = tuple(_in(_STARTS_S, latency) for latency in stored["latencies_s"])
            idle = stored["slew_idle"]
        except (KeyError, TypeError, ValueError):
            return cls()
        return cls((one, two), latencies, idle if idle in {"both", "per-axis"} else None)


def _in(bounds: Interval, stored: object) -> float:
    """A remembered number; ValueError where it is impossible, or none."""
    value = float(str(stored))
    if not bounds.low <= value <= bounds.high:
        raise ValueError(stored)
    return value


def _taught(known: AxisLearnt, watch: AxisWatch, landing: Interval) -> AxisLearnt:
    if watch.acceleration_scale is not None:
        scale = Interval(*watch.acceleration_scale).nearest(known.acceleration_scale)
        known = replace(known, acceleration_scale=scale)
    if abs(watch.target - watch.start) > _LEAST_MOVE:
        law = replace(watch.model, acceleration_scale=known.acceleration_scale, landing_s=0.0)
        expected = law.travel(watch.start, watch.target, watch.start_rate, 0.0).duration
        late = Interval(landing.low - expected, landing.high - expected)
        known = replace(known, landing_s=max(0.0, late.nearest(known.landing_s)))
    return known
