"""The quickest way of one axis from drifting to where it must be with the velocity it must have, as nodes.

Velocity, acceleration and jerk are limited, so the way is made of phases of constant jerk (`ruckig` solves it), each
a cubic: nodes at their boundaries reproduce it. Planned is with limits times 0.999, which leaves room for the numbers
as they are sent.

A phase that is too short cannot be sent: its jerk would be made of the last digits of two positions. So a way with
phases under 20 ms is solved again with slightly lower limits, of those without such phases the quickest.

Times of nodes lie on a grid of 2⁻²⁰ s, because a POSIX time in a float has no finer digits that could be relied on;
positions and velocities are those of the grid's time.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise, product
from typing import TYPE_CHECKING, NamedTuple

from mounts.apo.cubic import Cubic
from mounts.apo.errors import ApoError

if TYPE_CHECKING:
    import ruckig

MARGIN = 0.999
"""Of every limit that planning uses."""
SHORTEST_S = 0.02
"""Of a phase that can be sent."""
_GRID = 2.0**20
_NOTHING_S = 1e-9  # a phase that is none
_LOWER = (1.0, 0.98, 0.95, 0.9, 0.8, 0.65, 0.5)  # of jerk and acceleration, in looking for a way that can be sent
_SLOWER = 0.7  # of all times, from try to try, where that finds none
_TRIES = 60
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
        """At the boundaries of the phases, on the grid, the first at 0."""
        times = [on_grid(begin) for begin in self._begins]
        return tuple(ProfileNode(time, *self.at(time)) for time in times)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Lowest and highest position on the way, the end included."""
        found = [phase.extremes for phase in self.phases]
        return (
            min((*(each.lowest for each in found), self.end.position)),
            max((*(each.highest for each in found), self.end.position)),
        )

    @property
    def shortest(self) -> float:
        """Seconds of its shortest phase; infinite where there is none."""
        return min((phase.duration for phase in self.phases), default=math.inf)

    @cached_property
    def _begins(self) -> tuple[float, ...]:
        return tuple(accumulate((phase.duration for phase in self.phases), initial=0.0))


def on_grid(time: float) -> float:
    """The nearest time of the grid on which nodes lie."""
    return round(time * _GRID) / _GRID


def solve(
    start: float, start_rate: float, end: float, end_rate: float, velocity: float, acceleration: float, jerk: float
) -> SlewProfile:
    """The quickest way that can be sent.

    Parameters
    ----------
    start, start_rate, end, end_rate : float
        Degrees, degrees per second; without acceleration at both ends.
    velocity, acceleration, jerk : float
        The limits of the axis.

    Raises
    ------
    ApoError
        The end moves faster than the axis may; there is no library to solve it.
    """
    found = quickest(start, start_rate, end, end_rate, Limits(velocity, acceleration, jerk))
    if found.shortest >= SHORTEST_S:
        return found
    tried = (
        quickest(start, start_rate, end, end_rate, limits)
        for limits in _lower(Limits(velocity, acceleration, jerk), (start_rate, end_rate))
    )
    best = min((each for each in tried if each.shortest >= SHORTEST_S), key=lambda each: each.duration, default=None)
    if best is not None:
        return best
    scale = 1.0
    for _ in range(_TRIES):
        scale *= _SLOWER
        slow = Limits(velocity, acceleration * scale**2, jerk * scale**3)
        found = quickest(start, start_rate, end, end_rate, slow)
        if found.shortest >= SHORTEST_S:
            break
    return found


def quickest(start: float, start_rate: float, end: float, end_rate: float, limits: Limits) -> SlewProfile:
    """The quickest way within limits times 0.999, whatever its phases.

    Raises
    ------
    ApoError
        As for `solve`.
    """
    v, a, j = (limit * MARGIN for limit in limits)
    if abs(end_rate) > limits.velocity:
        raise ApoError(
            f"the target moves at {end_rate:.6g}°/s, and the axis at up to {limits.velocity:g}°/s: it cannot be met"
        )
    if start == end and start_rate == end_rate:
        return SlewProfile((), ProfileNode(0.0, end, end_rate))
    wanted = _ruckig().InputParameter(1)
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = [0.0], [start_rate], [0.0]
    wanted.target_position, wanted.target_velocity = [end - start], [end_rate]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = [max(v, abs(end_rate))], [a], [j]
    way = _ruckig().Trajectory(1)
    result = _ruckig().Ruckig(1).calculate(wanted, way)
    if result != _ruckig().Result.Working:
        raise ApoError(
            f"no way was found from {start:.6f}° at {start_rate:.6g}°/s to {end:.6f}° at {end_rate:.6g}°/s: {result}"
        )
    phases, position, rate, total = [], start, start_rate, 0.0
    for duration, acceleration, jerk in _phases(way.profiles[0][0]):
        phase = Cubic(position, rate, acceleration, jerk, duration)
        position, rate = phase.at(duration)
        phases.append(phase)
        total += duration
    return SlewProfile(tuple(phases), ProfileNode(total, end, end_rate))


def _phases(profile: "ruckig.Profile") -> Iterator[tuple[float, float, float]]:
    """Duration, first acceleration and jerk of each phase that is one; at first what slows it to the limit."""
    brake = profile.brake
    told = (*zip(brake.t, brake.a, brake.j, strict=True), *zip(profile.t, profile.a, profile.j, strict=False))
    merged: list[tuple[float, float, float]] = []
    for duration, acceleration, jerk in told:
        if duration <= _NOTHING_S:
            continue
        if merged and merged[-1][2] == jerk:  # one phase in two
            merged[-1] = merged[-1][0] + duration, merged[-1][1], jerk
        else:
            merged.append((duration, acceleration, jerk))
    yield from merged


def _lower(limits: Limits, rates: tuple[float, float]) -> Iterator[Limits]:
    """Slightly lower limits; a top speed that is one that it has already needs no phase to reach it."""
    speeds = {limits.velocity, *(abs(rate) / MARGIN for rate in rates if 0.9 < abs(rate) / limits.velocity <= 1.0)}
    for speed, slower, lower, softer in product(sorted(speeds), (1.0, 0.97), _LOWER, _LOWER):
        yield Limits(speed * slower, limits.acceleration * lower, limits.jerk * softer)


def _ruckig() -> "ruckig":
    try:
        import ruckig  # noqa: PLC0415 - an extra; only what slews such an axis needs it
    except ImportError as error:
        raise ApoError(_EXTRA) from error
    return ruckig


def gaps(nodes: tuple[ProfileNode, ...]) -> Iterator[Cubic]:
    """The cubics that a controller makes of nodes."""
    for one, two in pairwise(nodes):
        yield Cubic.between((one.position, one.velocity), (two.position, two.velocity), two.time - one.time)
