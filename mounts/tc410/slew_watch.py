"""A slew under way: what each axis should be doing, what it is seen to do, and when it is over.

A slew is over when its flags were seen set and are clear, or when both axes stand within one count of their targets,
or when it should have ended and was never seen to run. One that goes on long after is stuck.
"""

from dataclasses import dataclass

from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import TICK_S, Tc410SlewModel, Tc410Travel
from mounts.tc410.unit import Values

GRACE_S = 0.5  # by which a slew that was never seen to run counts as over
TIMEOUT_S = 5.0  # by which a slew that goes on has failed
_RATE_PER_RAMP = 0x100 * COUNTS_PER_SECOND / TICK_S  # counts/s² for 1 in the acceleration register
_LEAST_RAMP_S = 0.4  # shorter ramps say too little of the acceleration
_CREPT = 3.0  # counts an axis must have moved on after landing to count as tracking again
TELLING_RATE = 1.0  # counts/s; a slower axis does not show whether it stood still
STEEPER = 1.25  # real ramps over nominal ones, at most
WAIT_S = 2.0 * TICK_S  # by which a start waits for its tick
_EPSILON_S = TICK_S / 2.0


@dataclass
class AxisWatch:
    """One axis during one slew.

    Attributes
    ----------
    landing : tuple of float
        Seconds from the start between which it landed.
    acceleration_scale : tuple of float, optional
        True over nominal acceleration, between these.
    creeps : bool, optional
        Whether it went on tracking while the other axis still slewed.
    """

    model: Tc410SlewModel
    start: float
    start_rate: float
    target: int
    travel: Tc410Travel
    rate_after: float
    began: float
    landing: tuple[float, float] = (0.0, float("inf"))
    acceleration_scale: tuple[float, float] | None = None
    creeps: bool | None = None

    def see(self, counts: float, at: Values, flags_at: Values, *, slewing: bool, other_slewing: bool) -> None:
        """Take one reading of this axis, and of the flags a little later."""
        flags_elapsed = flags_at.time - self.began
        earliest, latest = self.landing
        if slewing:
            self.landing = (max(earliest, flags_elapsed), float("inf"))
            self._see_ramp(counts, at)
            return
        self.landing = (earliest, min(latest, flags_elapsed + flags_at.late_s))
        if other_slewing and self.rate_after:
            self._see_creep(counts, at.time - self.began)

    def position(self, time: float) -> float:
        """Where the law has the axis, counts."""
        return self.travel.position(time - self.began)

    def rate(self, time: float) -> float:
        """How fast the law has it, counts per second."""
        return (self.position(time + _EPSILON_S) - self.position(time - _EPSILON_S)) / (2.0 * _EPSILON_S)

    def astray(self, counts: float, at: Values) -> float:
        """By how many counts a reading contradicts the law."""
        return max(0.0, abs(counts + 0.5 - self.position(at.time)) - 0.5)

    def keeps_to_law(self, counts: float, at: Values) -> bool:
        """Whether a reading is as far from the law as a start that waits for its tick explains."""
        return self.astray(counts, at) <= abs(self.rate(at.time)) * WAIT_S + 1.0

    def has_landed_near(self, counts: float, at: Values) -> bool:
        """Whether the axis stands where an undisturbed slew leaves it, tracking since then included."""
        gone = abs(self.rate_after) * (at.time - self.began - self.landing[0])
        return abs(counts - self.target) <= gone + 1.0

    def may_have_arrived(self, counts: float, at: Values, flags_at: Values) -> bool:
        """Whether the axis may have covered what was left in the time from its reading to that of the flags."""
        between = flags_at.time + flags_at.late_s - at.time
        landing = 0.5 * self.model.deceleration * self.model.acceleration_scale * _RATE_PER_RAMP * between * between
        gone = abs(self.rate_after) * (flags_at.time + flags_at.late_s - self.began - self.landing[0])
        return abs(counts - self.target) <= 1.1 * landing + gone + 2.0

    def has_tracked(self, counts: float, at: Values, landed: float) -> bool:
        """Whether the axis is where it tracks to when it landed so many seconds from the start, give or take one."""
        tracked = self.rate_after * (at.time - self.began - landed)
        return abs(counts + 0.5 - self.target - tracked) <= abs(self.rate_after) + 1.0

    def _see_ramp(self, counts: float, at: Values) -> None:
        """A = 2(x − v₀t)/t², the tick-wise sum being n(n + 1)/2 steps.

        The start waits up to a tick, and tracking the other way takes one more to end.
        """
        elapsed = at.time - self.began
        nominal = self.model.acceleration * _RATE_PER_RAMP
        sign = 1.0 if self.target >= self.start else -1.0
        full_speed_after = (self.model.max_rate - sign * self.start_rate) / nominal
        ramp_s = min(full_speed_after, self.travel.move.ticks * TICK_S / 3.0)  # a slow landing is no part of it
        if not _LEAST_RAMP_S < elapsed < 0.9 * ramp_s or sign * self.start_rate < 0.0:
            return
        gained = sign * (counts + 0.5 - self.start - self.start_rate * elapsed)
        longest = elapsed + at.late_s
        shortest = elapsed - 2.0 * TICK_S
        self.acceleration_scale = (
            2.0 * (gained - 1.0) / (longest * (longest + TICK_S)) / nominal,
            2.0 * (gained + 1.0) / (shortest * (shortest + TICK_S)) / nominal,
        )

    def _see_creep(self, counts: float, elapsed: float) -> None:
        least = abs(self.rate_after) * (elapsed - self.landing[1])  # below zero: read before it may have landed
        if least > _CREPT:
            self.creeps = abs(counts + 0.5 - self.target) > least / 2.0


@dataclass
class SlewWatch:
    """Both axes during one slew."""

    axes: tuple[AxisWatch, AxisWatch]
    disturbed: bool = False
    _seen_slewing: bool = False

    @property
    def due(self) -> float:
        """POSIX seconds at which both should have landed."""
        return self.axes[0].began + max(axis.travel.duration for axis in self.axes)

    @property
    def targets(self) -> tuple[int, int]:
        """Where it goes, counts."""
        return self.axes[0].target, self.axes[1].target

    def see(
        self, counts: tuple[float, float], at: tuple[Values, Values], flags_at: Values, slewing: tuple[bool, bool]
    ) -> None:
        """Take one reading of both axes."""
        for i, axis in enumerate(self.axes):
            axis.see(counts[i], at[i], flags_at, slewing=slewing[i], other_slewing=slewing[1 - i])
        self._seen_slewing |= any(slewing)

    def is_over(self, counts: tuple[float, float], time: float, slewing: tuple[bool, bool]) -> bool:
        """Whether both axes have ended their slew."""
        on_target = all(abs(here - axis.target) <= 1.0 for here, axis in zip(counts, self.axes, strict=True))
        return not any(slewing) and (self._seen_slewing or on_target or time > self.due + GRACE_S)

    def is_as_planned(self, counts: tuple[float, float], at: tuple[Values, Values]) -> bool:
        """Whether both axes are where the law has them, or track as they would since it had them land."""
        seen = list(zip(self.axes, counts, at, strict=True))
        if all(when.time < self.due for _, _, when in seen):
            return all(axis.keeps_to_law(here, when) for axis, here, when in seen)
        return max(abs(axis.rate_after) for axis in self.axes) > TELLING_RATE and any(
            all(axis.has_tracked(here, when, together or axis.travel.duration) for axis, here, when in seen)
            for together in (self.due - self.axes[0].began, 0.0)
        )

    def is_undisturbed(self, counts: tuple[float, float], at: tuple[Values, Values]) -> bool:
        """Whether it ended as slews do, so that it may teach."""
        near = all(axis.has_landed_near(here, when) for axis, here, when in zip(self.axes, counts, at, strict=True))
        return near and not self.disturbed

    def may_have_arrived(self, counts: tuple[float, float], at: tuple[Values, Values], flags_at: Values) -> bool:
        """Whether positions read just before the flags allow that both axes are on their targets by now."""
        return all(
            axis.may_have_arrived(here, when, flags_at)
            for axis, here, when in zip(self.axes, counts, at, strict=True)
        )
