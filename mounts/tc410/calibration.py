"""What a TC410 teaches about itself with every slew: its true acceleration, its landing, its latency, its idle rule.

The law of motion in the manual is an assumption. While an axis speeds up its position gives the true acceleration;
the moment it lands gives what the end of a slew takes beyond the law; an axis that moves on after it has landed,
while the other one still slews, shows that tracking resumes axis by axis.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace

from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.settings import SlewIdle
from mounts.tc410.slew import TICK_S, Tc410SlewModel
from pointing.slew import Travel

_RATE_PER_RAMP = 0x100 * COUNTS_PER_SECOND / TICK_S  # counts/s² for 1 in the acceleration register
_LEAST_RAMP_S = 0.4  # shorter ramps say too little of the acceleration
_LEAST_MOVE = 200.0  # counts; shorter moves say too little of the landing
_MEMORY = 0.5  # weight of a new slew once a few have been seen
_CREPT = 3.0  # counts an axis must have moved on after landing to count as tracking again


@dataclass(frozen=True)
class AxisLearnt:
    """One axis: true over nominal acceleration, seconds from the law's landing to the true one, slews seen."""

    acceleration_scale: float = 1.0
    landing_s: float = 0.0
    ramps: int = 0
    landings: int = 0


@dataclass(frozen=True)
class Learnt:
    """All that has been learnt of one unit."""

    axes: tuple[AxisLearnt, AxisLearnt] = field(default=(AxisLearnt(), AxisLearnt()))
    start_latency_s: float | None = None
    slew_idle: SlewIdle | None = None

    def as_json(self) -> dict[str, object]:
        """Return plain values for the state store."""
        return asdict(self)

    @classmethod
    def from_json(cls, stored: Mapping[str, object]) -> "Learnt":
        """Read what `as_json` gave; anything unreadable counts as not learnt."""
        try:
            one, two = (AxisLearnt(**axis) for axis in stored["axes"])  # type: ignore[attr-defined]
            latency, idle = stored["start_latency_s"], stored["slew_idle"]
        except (KeyError, TypeError, ValueError):
            return cls()
        return cls(
            (one, two),
            float(latency) if isinstance(latency, int | float) else None,
            idle if idle in {"both", "per-axis"} else None,
        )


@dataclass
class AxisWatch:
    """One axis during one slew."""

    model: Tc410SlewModel
    start: float
    start_rate: float
    target: int
    travel: Travel
    rate_after: float
    began: float
    landed_after: float | None = None  # seconds from the start
    acceleration_scale: float | None = None
    creeps: bool | None = None
    _still_slewing_at: float = 0.0

    def see(self, counts: float, time: float, *, slewing: bool, other_slewing: bool) -> None:
        """Take one reading of this axis."""
        elapsed = time - self.began
        if slewing:
            self._still_slewing_at = elapsed
            self._see_ramp(counts, elapsed)
            return
        if self.landed_after is None and elapsed > 0.0:
            self.landed_after = (self._still_slewing_at + elapsed) / 2.0 if self._still_slewing_at else None
        if other_slewing and abs(self.rate_after) > 0.0 and self.landed_after is not None:
            self._see_creep(counts, elapsed)

    def _see_ramp(self, counts: float, elapsed: float) -> None:
        """A = 2(x − v₀t)/t², the tick-wise sum being n(n + 1)/2 steps."""
        nominal = self.model.acceleration * _RATE_PER_RAMP
        sign = 1.0 if self.target >= self.start else -1.0
        full_speed_after = (self.model.max_rate - sign * self.start_rate) / nominal
        ramp_s = min(full_speed_after, self.travel.duration / 3.0)
        if not _LEAST_RAMP_S < elapsed < 0.9 * ramp_s or sign * self.start_rate < 0.0:
            return
        gained = sign * (counts + 0.5 - self.start - self.start_rate * elapsed)
        self.acceleration_scale = 2.0 * gained / (elapsed * (elapsed + TICK_S)) / nominal

    def _see_creep(self, counts: float, elapsed: float) -> None:
        assert self.landed_after is not None  # noqa: S101 - checked by the caller
        expected = self.rate_after * (elapsed - self.landed_after)
        if abs(expected) > _CREPT:
            self.creeps = abs(counts + 0.5 - self.target) > abs(expected) / 2.0


def learn(known: Learnt, watches: tuple[AxisWatch, AxisWatch]) -> Learnt:
    """Return what is known after one more undisturbed slew."""
    axes = tuple(_learn_axis(axis, watch) for axis, watch in zip(known.axes, watches, strict=True))
    seen = [watch.creeps for watch in watches if watch.creeps is not None]
    idle: SlewIdle | None = known.slew_idle if not seen else ("per-axis" if any(seen) else "both")
    return replace(known, axes=(axes[0], axes[1]), slew_idle=idle)


def _learn_axis(known: AxisLearnt, watch: AxisWatch) -> AxisLearnt:
    learnt = known
    if watch.acceleration_scale is not None:
        learnt = replace(
            learnt,
            acceleration_scale=_blend(known.acceleration_scale, watch.acceleration_scale, known.ramps),
            ramps=known.ramps + 1,
        )
    if watch.landed_after is not None and abs(watch.target - watch.start) > _LEAST_MOVE:
        law = replace(watch.model, acceleration_scale=learnt.acceleration_scale, landing_s=0.0)
        late = watch.landed_after - law.travel(watch.start, watch.target, watch.start_rate, 0.0).duration
        learnt = replace(
            learnt,
            landing_s=max(0.0, _blend(known.landing_s, late, known.landings)),
            landings=known.landings + 1,
        )
    return learnt


def _blend(known: float, seen: float, times: int) -> float:
    return known + (seen - known) * max(_MEMORY, 1.0 / (times + 1))
