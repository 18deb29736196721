"""What a plan is made of and what it is: frozen values.

Angles are radians, times POSIX seconds, rates per second; `counts` are the drive's own units.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

from pointing.errors import PointingError
from pointing.gearing import Gearing
from pointing.limits import Check
from pointing.mount import Posture
from pointing.profile import Ramps
from pointing.slew import SlewModel, Travel
from pointing.vectors import Vector

if TYPE_CHECKING:
    from pointing.rotator import Hold
    from pointing.trajectory import Trajectory


Units = Literal["counts", "degrees", "microsteps", "steps"]
"""What a drive counts in; all but degrees are whole."""

_SETTLED_DEG = 1e-9  # 3.6 µas
_LANDED_DEG = 1.0 / 3600.0


class Trims(NamedTuple):
    """How the tracking of an axis that goes on by itself can be trimmed: by commands that each last some ticks."""

    slower: float  # counts per second
    own: float
    faster: float
    every_s: float  # from one command to the next
    tick_s: float

    def reached(self, counts_s: float) -> float:
        """The rate nearest to one that is wanted; its own where it is to rest."""
        return min(max(counts_s, min(self[:3])), max(self[:3])) if counts_s else self.own

    def duty(self, counts_s: float) -> float:
        """The part of the time for which it is made faster, or slower where negative."""
        more = self.reached(counts_s) - self.own
        quicker = more / (self.faster - self.own)
        return quicker if quicker >= 0.0 else -more / (self.slower - self.own)

    def ticks(self, counts_s: float) -> int:
        """Ticks of each command, negative where it makes the axis slower."""
        return round(self.duty(counts_s) * self.every_s / self.tick_s)


class ShortMoves(NamedTuple):
    """What an axis can be held to by moves that end by themselves, beside its own rate as trimmed."""

    most: float  # radians per second
    lag_s: float  # for which it is off its way at most, of what they make a second


class Words(Protocol):
    """What the drive of an axis is told, in its own words: plain values by name."""

    def of_rate(self, axis: "Axis", rate: float) -> dict[str, Any]:
        """What makes a rate, radians per second."""
        ...

    def of_slew(self, axis: "Axis", plan: "AxisPlan") -> dict[str, Any]:
        """What makes a slew."""
        ...


class Unsaid:
    """Nothing but counts and rates, which every axis has."""

    def of_rate(self, axis: "Axis", rate: float) -> dict[str, Any]:  # noqa: ARG002 - as `Words` has it
        """Nothing."""
        return {}

    def of_slew(self, axis: "Axis", plan: "AxisPlan") -> dict[str, Any]:  # noqa: ARG002 - likewise
        """Nothing."""
        return {}


@dataclass(frozen=True)
class Axis:
    """One axis: its gearing, the travel it is allowed, radians, and what its drive counts in."""

    name: str
    gearing: Gearing
    minimum: float
    maximum: float
    units: Units = "counts"
    fastest: float = math.inf  # radians per second at which its drive can follow; what is led has limits of its own
    trims: Trims | None = None
    """How its tracking can be trimmed; None for a free rate."""
    short_moves: ShortMoves | None = None
    """What beside that is made by short moves; None for a free rate."""
    words: Words = field(default=Unsaid(), repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.minimum) and math.isfinite(self.maximum)):
            raise PointingError(f"{self.name}: limits of {self.minimum} to {self.maximum} rad; give finite angles")

    def nearest(self, angle: float) -> float:
        """The counts nearest to an angle, radians, to which the drive can be sent."""
        counts = self.gearing.counts(angle)
        return counts if self.units == "degrees" else round(counts)

    def beside(self, rate: float) -> float:
        """What short moves must make of a rate, radians per second, beside its own as trimmed; never negative."""
        per_radian = self.gearing.counts_per_radian
        trimmed = 0.0 if self.trims is None else self.trims.reached(rate * per_radian) / per_radian
        return abs(rate - trimmed)

    @property
    def settled(self) -> float:
        """By how many counts a target may still change and stands."""
        return _SETTLED_DEG if self.units == "degrees" else 0.0

    @property
    def flicker(self) -> float:
        """By how many counts a target may go on changing, tick by tick; a move of microsteps is an even number."""
        return _SETTLED_DEG if self.units == "degrees" else 2.0 if self.units == "microsteps" else 1.0

    @property
    def straight_s(self) -> float:
        """For how long, seconds, a target's rates may be taken as constant: 0.2°/s² make 0.4 mas in 1 ms."""
        return 0.001 if self.units == "degrees" else 0.05

    @property
    def landed(self) -> float:
        """By how many counts it may be off its target and has landed."""
        return _LANDED_DEG if self.units == "degrees" else 2.0

    def windings(self, angle: float, slack: float = 0.0) -> Iterator[float]:
        """Every angle within the limits, or `slack` radians outside, that is the same direction as `angle`."""
        wound = angle + math.tau * math.ceil((self.minimum - slack - angle) / math.tau)
        while wound <= self.maximum + slack:
            yield wound
            wound += math.tau


@dataclass(frozen=True)
class Start:
    """Where the axes are when the plan is made: counts, and counts per second; both of a rotator, if there is one."""

    time: float
    counts: tuple[float, float]
    rates: tuple[float, float] = (0.0, 0.0)
    rotator: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.counts, *self.rates))):
            raise PointingError(f"a start at {self.counts} counts, {self.rates} counts/s: give finite numbers")


@dataclass(frozen=True)
class Leading:
    """How a drive can be led along a way, position by position: speed and acceleration of each axis.

    `delay_s` is how long after it was decided the motion can begin, `period_s` how often a position is given and the
    limits are looked at.
    """

    ramps: tuple[Ramps, Ramps]
    delay_s: float = 0.0
    period_s: float = 0.1

    @property
    def notice_s(self) -> float:
        """Seconds that may pass until a stop is in force."""
        return 2.0 * self.period_s

    def rest(self, counts: tuple[float, float], rates: tuple[float, float]) -> tuple[float, float]:
        """Counts at which both axes would come to rest if they were stopped now, the notice included."""
        one, two = (
            here + rate * self.notice_s + ramps.stopping(rate)
            for here, rate, ramps in zip(counts, rates, self.ramps, strict=True)
        )
        return one, two


@dataclass(frozen=True)
class Timing:
    """How the drive moves, with all that has been learnt of it.

    Parameters
    ----------
    slew : tuple of SlewModel
        The law of each axis.
    latency : float
        Seconds from the command to the motion.
    together : bool
        Tracking resumes on both axes only when the later one has landed; of a drive that meets what moves the other
        one begins as much later.
    leading : Leading, optional
        How it can be led to a target that is too fast to be met at rest.
    rotator : SlewModel, optional
        The law of the instrument rotator, of a telescope that has one.
    """

    slew: tuple[SlewModel, SlewModel]
    latency: float = 0.0
    together: bool = True
    leading: Leading | None = None
    rotator: SlewModel | None = None


@dataclass(frozen=True)
class AxisPlan:
    """What one axis does: radians, counts, seconds.

    Angle and rate are those of the plan's arrival; target and rate in counts those of the axis's own landing.
    """

    name: str
    angle: float
    rate: float
    from_counts: float
    target_counts: float
    rate_counts: float
    travel: Travel


@dataclass(frozen=True)
class RotatorPlan:
    """What the rotator does.

    Parameters
    ----------
    hold : Hold
        What it is to hold.
    axis : AxisPlan
        Its way; angle and rate are those of its own arrival.
    arrival : float
        POSIX seconds at which it holds it, not before the axes arrive.
    limit : (float, Check), optional
        When following the target brings it to its limit, POSIX seconds, if that is within two hours.
    """

    hold: "Hold"
    axis: AxisPlan
    arrival: float
    limit: tuple[float, Check] | None = None


@dataclass(frozen=True)
class Plan:
    """A slew that ends on the target.

    Parameters
    ----------
    target : str
        The target's name.
    start, arrival : float
        POSIX seconds; `arrival` is when both axes are on the target, and the rotator holds what it is to hold.
    posture : Posture
        How the mount stands on arrival.
    observed : Vector
        The target's observed direction at arrival, horizon frame.
    axes : tuple of AxisPlan
        Angles, counts and rates at arrival.
    checks : tuple of Check
        All that was asked; every one is ok.
    trajectory : Trajectory, optional
        The way along which the drive must be led, for a target too fast to be met at rest.
    via : Plan, optional
        The first of two legs, where the straight way is forbidden; the counts and travels are those of the second.
    rotator : RotatorPlan, optional
        What the instrument rotator does meanwhile.
    axes_arrival : float, optional
        POSIX seconds at which both axes are on the target, where the rotator arrives after them.
    """

    target: str
    start: float
    arrival: float
    posture: Posture
    observed: Vector
    axes: tuple[AxisPlan, AxisPlan]
    checks: tuple[Check, ...]
    trajectory: "Trajectory | None" = field(default=None, repr=False, compare=False)
    via: "Plan | None" = field(default=None, repr=False)
    rotator: RotatorPlan | None = None
    axes_arrival: float | None = None

    @property
    def eta(self) -> float:
        """Seconds from the start to the arrival, latency included."""
        return self.arrival - self.start

    @property
    def landings(self) -> tuple[float, float]:
        """POSIX seconds at which each axis has landed by itself, the later one when both are on the target."""
        one, two = (axis.travel.duration for axis in self.axes)
        begin = (self.arrival if self.axes_arrival is None else self.axes_arrival) - max(one, two)
        return begin + one, begin + two


AxisState = tuple[tuple[float, float], tuple[float, float]]
