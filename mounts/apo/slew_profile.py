"""The quickest way of one axis from drifting to where it must be with the velocity it must have, as nodes.

Velocity, acceleration and jerk are limited, so the way is made of phases of constant jerk (`ruckig` solves it), each
a cubic: nodes at their boundaries reproduce it. Planned is with limits times 0.999, which leaves room for the numbers
as they are sent.

Times of nodes lie on a grid of 2⁻²⁰ s, because a POSIX time in a float has no finer digits that could be relied on;
positions and velocities are those of the grid's time.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

from mounts.apo.cubic import Cubic
from mounts.apo.errors import ApoError
from mounts.apo.stretching import Phase

if TYPE_CHECKING:
    import ruckig

MARGIN = 0.999
"""Of every limit that planning uses."""
SHORTEST_S = 0.02
"""Of a phase that can be sent."""
GRID_S = 2.0**-20
"""Of which the times of nodes are multiples."""
_NOTHING_S = 1e-9  # a phase that is none
_LEAST = 1e-4  # of the top speed, by which an axis can always go faster than what it meets
_EXTRA = "the quickest slews need the library ruckig: pip install 'clockdrive[apo]'"


class ProfileNode(NamedTuple):
    """Where an axis is so many seconds after a slew began, degrees and degrees per second."""

    time: float
    position: float
    velocity: float


class Limits(NamedTuple):
    """What an axis may do: degrees per second, per second², per second³."""

    velocity: float
    acceleration: float
    jerk: float


class Line(NamedTuple):
    """What moves uniformly: where it is as a slew begins, degrees, and degrees per second."""

    position: float
    rate: float


class Slew(NamedTuple):
    """What is asked of an axis: from a drift to the place of a line, with a velocity beside it; without acceleration.

    Onto a line is `onto` it with no velocity beside it. The duration of that depends steadily on the line; that of a
    slew to a place of rest that is to be passed at speed leaps.
    """

    start: float
    start_rate: float
    onto: Line
    end_rate: float = 0.0

    @classmethod
    def to(cls, start: float, start_rate: float, end: float, end_rate: float) -> "Slew":
        """To a place, passing it at a velocity."""
        return cls(start, start_rate, Line(end, 0.0), end_rate)

    @property
    def last_rate(self) -> float:
        """Degrees per second at the end."""
        return self.onto.rate + self.end_rate


@dataclass(frozen=True)
class SlewProfile:
    """A way in phases of constant jerk.

    Parameters
    ----------
    phases : tuple of Cubic
        One after the other.
    end : ProfileNode
        Where they lead; on from there it goes at the velocity that it has by then.
    """

    phases: tuple[Cubic, ...]
    end: ProfileNode

    @property
    def duration(self) -> float:
        """Seconds, exactly; nodes are on the grid."""
        return self.end.time

    def at(self, elapsed: float) -> tuple[float, float]:
        """Position and velocity so many seconds after its beginning; from the end on at the velocity of the end."""
        for begin, phase in zip(self._begins, self.phases, strict=False):
            if elapsed < begin + phase.duration:
                return phase.at(elapsed - begin)
        _, position, velocity = self.end
        return position + velocity * (elapsed - self.end.time), velocity

    @cached_property
    def nodes(self) -> tuple[ProfileNode, ...]:
        """At the boundaries of the phases, on the grid, the first at 0; the last at the velocity of the end."""
        _, position, velocity = self.end
        last = on_grid(self.duration)
        times = [on_grid(begin) for begin in self._begins[:-1]]
        return (
            *(ProfileNode(time, *self.at(time)) for time in times),
            ProfileNode(last, position + velocity * (last - self.duration), velocity),
        )

    @cached_property
    def sent(self) -> tuple[Cubic, ...]:
        """The cubics that a controller makes of the nodes."""
        return tuple(Cubic.between(one[1:], two[1:], two.time - one.time) for one, two in pairwise(self.nodes))

    @property
    def extremes(self) -> tuple[float, float]:
        """Lowest and highest position on the way as it is sent, the end included."""
        found = [cubic.extremes for cubic in self.sent]
        ends = self.nodes[-1].position
        return min((*(each.lowest for each in found), ends)), max((*(each.highest for each in found), ends))

    @property
    def shortest(self) -> float:
        """Seconds of its shortest phase; infinite where there is none."""
        return min((phase.duration for phase in self.phases), default=math.inf)

    @property
    def can_be_sent(self) -> bool:
        """Whether each of its phases is long enough to be made of the digits of two nodes."""
        return self.shortest >= SHORTEST_S

    @cached_property
    def _begins(self) -> tuple[float, ...]:
        return tuple(accumulate((phase.duration for phase in self.phases), initial=0.0))


def on_grid(time: float) -> float:
    """The nearest time of the grid on which nodes lie."""
    return round(time / GRID_S) * GRID_S


def quickest(slew: Slew, limits: Limits) -> SlewProfile:
    """The quickest way within limits times 0.999, whatever its phases.

    It is solved as the line sees it, where the end moves with `end_rate` only.

    Raises
    ------
    ApoError
        The end moves faster than 0.999 of the axis's top speed; there is no library to solve it.
    """
    fastest = limits.velocity * MARGIN
    if abs(slew.last_rate) > fastest:
        raise ApoError(too_fast(slew.last_rate, limits))
    line = slew.onto
    rate = slew.start_rate - line.rate
    if slew.start == line.position and rate == slew.end_rate:
        return SlewProfile((), ProfileNode(0.0, slew.start, slew.start_rate))
    least = fastest * _LEAST
    ruckig = _ruckig()
    wanted = ruckig.InputParameter(1)
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = [0.0], [rate], [0.0]
    wanted.target_position, wanted.target_velocity = [line.position - slew.start], [slew.end_rate]
    wanted.min_velocity, wanted.max_velocity = [min(-fastest - line.rate, -least)], [max(fastest - line.rate, least)]
    wanted.max_acceleration, wanted.max_jerk = [limits.acceleration * MARGIN], [limits.jerk * MARGIN]
    way = ruckig.Trajectory(1)
    try:
        result = ruckig.Ruckig(1).calculate(wanted, way)
    except ruckig.RuckigError:
        result = ruckig.Result.Error
    if result != ruckig.Result.Working:
        raise ApoError(
            f"no way was found from {slew.start:.6f}° at {slew.start_rate:.6g}°/s to {line.position:.6f}° at "
            f"{slew.last_rate:.6g}°/s ({result}); `stop`, then go from rest"
        )
    return profile(slew, _phases(way.profiles[0][0]))


def profile(slew: Slew, phases: Sequence[Phase]) -> SlewProfile:
    """The way that a slew's phases make."""
    made = []
    position, rate, acceleration = slew.start, slew.start_rate, 0.0
    for duration, jerk in phases:
        cubic = Cubic(position, rate, acceleration, jerk, duration)
        position, rate = cubic.at(duration)
        acceleration += jerk * duration
        made.append(cubic)
    total = math.fsum(phase.duration for phase in phases)
    return SlewProfile(tuple(made), ProfileNode(total, slew.onto.position + slew.onto.rate * total, slew.last_rate))


def too_fast(rate: float, limits: Limits) -> str:
    """That a target cannot be met."""
    return (
        f"the target moves at {rate:.6g}°/s, and the axis may be planned with {MARGIN:g} of {limits.velocity:g}°/s: "
        "it cannot be met; wait until it is slower"
    )


def _phases(way: "ruckig.Profile") -> list[Phase]:
    """The phases that are some; at first what slows an axis to its limit."""
    told = (*zip(way.brake.t, way.brake.j, strict=True), *zip(way.t, way.j, strict=True))
    merged: list[Phase] = []
    nothing = 0.0  # seconds of phases that are none; they pass in the next one, for at speed even they are a way
    for duration, jerk in told:
        if duration <= _NOTHING_S:
            nothing += duration
            continue
        if merged and merged[-1].jerk == jerk:  # one phase in two
            merged[-1] = Phase(merged[-1].duration + duration + nothing, jerk)
        else:
            merged.append(Phase(duration + nothing, jerk))
        nothing = 0.0
    if merged:
        merged[-1] = Phase(merged[-1].duration + nothing, merged[-1].jerk)
    return merged


def _ruckig() -> "ruckig":
    try:
        import ruckig  # noqa: PLC0415 - an extra; only what slews such an axis needs it
    except ImportError as error:
        raise ApoError(_EXTRA) from error
    return ruckig
