"""Ways whose phases are all long enough to be sent, next to one in which some are not.

A phase that is too short gets the least duration, and its jerk becomes free; of the others, durations are. They must
lead to three things: acceleration nought, the velocity and the place of the end. Of all solutions the one nearest to
the old way is found, by Newton's method: once with only the short phases, what they border on, and those of constant
acceleration or velocity giving way, so that what is at a limit elsewhere stays there; once with all.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_ROUNDS = 25
_SOLVED = 4e-15  # of what the end is made of; a float's last digits are left
_LEAST = 1e-3  # of degrees, degrees per second and per second², below which what is missed is not magnified

_Numbers = NDArray[np.float64]


class Phase(NamedTuple):
    """Seconds of one jerk, degrees per second³."""

    duration: float
    jerk: float


class End(NamedTuple):
    """Where a way from place 0 leads, and its velocity there; the acceleration is nought."""

    distance: float
    rate: float


def stretched(
    phases: Sequence[Phase], start_rate: float, end: End, shortest: float, most_jerk: float
) -> Iterator[tuple[Phase, ...]]:
    """Ways without phases shorter than `shortest`, whatever their velocities and accelerations.

    Parameters
    ----------
    phases : sequence of Phase
        A way from place 0, without acceleration, to `end`.
    start_rate : float
        Degrees per second.
    end : End
        Its end, which remains.
    shortest : float
        Seconds.
    most_jerk : float
        The limit; it scales how far jerks change compared with durations.
    """
    short = np.array([phase.duration < shortest for phase in phases])
    times = np.array([max(phase.duration, shortest) for phase in phases])
    jerks = np.array([phase.jerk * phase.duration for phase in phases]) / times
    beside = np.convolve(short, (1, 1, 1), "same") > 0
    for free in (beside | (jerks == 0.0), np.ones_like(short)):
        found = _solved(times, jerks, short, free * np.where(short, most_jerk / shortest, 1.0), start_rate, end)
        if found is None:
            continue
        if found[0].min() >= shortest * (1.0 - 1e-9) and np.abs(found[1]).max() <= most_jerk * (1.0 + 1e-12):
            yield tuple(Phase(float(time), float(jerk)) for time, jerk in zip(*found, strict=True))


def _solved(
    times: _Numbers, jerks: _Numbers, short: NDArray[np.bool_], weights: _Numbers, start_rate: float, end: End
) -> tuple[_Numbers, _Numbers] | None:
    """Durations and jerks that lead to the end, or none; `weights` say how far each free number may change."""
    wanted = np.array([end.distance, end.rate, 0.0])
    for _ in range(_ROUNDS):
        reached, change, size = _reached(times, jerks, start_rate, short)
        scale = np.maximum(_LEAST, size)
        missed = (reached - wanted) / scale
        if np.abs(missed).max() <= _SOLVED:
            return times, jerks
        step = -np.linalg.lstsq(change * weights / scale[:, None], missed, rcond=None)[0] * weights
        times, jerks = np.where(short, times, times + step), np.where(short, jerks + step, jerks)
        if times.min() <= 0.0:
            return None
    return None


def _reached(
    times: _Numbers, jerks: _Numbers, start_rate: float, short: NDArray[np.bool_]
) -> tuple[_Numbers, _Numbers, _Numbers]:
    """Place, velocity and acceleration of the end, how they change with each free number, their largest on the way.

    Their shapes are (3,), (3, phases) and (3,).
    """
    x, v, a = 0.0, start_rate, 0.0
    states = np.empty((3, len(times)))
    after = np.sum(times) - np.cumsum(times)
    change = np.empty((3, len(times)))
    for i, (t, jerk) in enumerate(zip(times, jerks, strict=True)):
        x, v, a = x + t * (v + t * (a / 2.0 + t * jerk / 6.0)), v + t * (a + t * jerk / 2.0), a + t * jerk
        states[:, i] = x, v, a
        dx, dv, da = (t**3 / 6.0, t * t / 2.0, t) if short[i] else (v, a, jerk)
        rest = after[i]
        change[:, i] = dx + rest * (dv + rest * da / 2.0), dv + rest * da, da
    return states[:, -1], change, np.abs(states).max(axis=1)
