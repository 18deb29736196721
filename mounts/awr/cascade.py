"""A goto out of timed presses: which speed next, and how long each key.

Stage by stage: a speed, both axes side by side, until both motions have ended. What their events say of the ways is
known then, and the next stage is planned for what is left; so only the jitter of each press counts, and a slower
speed makes it smaller. Of all speeds, and of moving both axes or the worse one, that is taken which is at the target
soonest on the average (`Outlook`). Nothing is left to do once each axis is within a guide step by all that is known.

Counted from the drives: an axis that tracks its target stands still here. `Errors` are steps that the axis still has
to go; where its drive cannot go exactly with the target they drift, and a press is made for the moment at which it
ends.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from mounts.awr.commands import Speed
from mounts.awr.errors import AwrError
from mounts.awr.ladder import Ladder, Rung
from mounts.awr.outlook import WITHIN, Array, Outlook, likely, mean_of
from mounts.awr.ramps import Key
from mounts.awr.uncertainty import TWO_SIDED_95, Jitter, Way

_ROUNDS = 6  # of solving how far a target goes while a press lasts
_FORESEEN = 12  # stages; more than any goto has
_LEAD = 1.5  # times its drift by which a key must be faster than a target that runs away
_ROOM = 0.5, 0.85  # of the shortest time between two commands, to either side of one; of an end before full speed
_LIKELY = np.array(likely(1))
Pair = tuple[float, float]


@dataclass(frozen=True)
class Press:
    """One key of one axis in a stage.

    Parameters
    ----------
    key : Key
        What it does.
    hold : float
        Seconds from the press to the release.
    begin : float
        Seconds from the first press of the stage to this one.
    """

    key: Key
    hold: float
    begin: float = 0.0

    @property
    def release(self) -> float:
        """Seconds from the first press of the stage to the release."""
        return self.begin + self.hold

    @property
    def duration(self) -> float:
        """Seconds for which its events say that the axis moves."""
        return self.key.duration(self.hold)

    @property
    def end(self) -> float:
        """Seconds from the first press of the stage until the axis goes with its drive again."""
        return self.begin + self.duration

    @property
    def sign(self) -> int:
        """1 to larger counts, -1 to smaller ones."""
        return 1 if self.key.rate > 0.0 else -1

    def made(self, elapsed: float) -> float:
        """Steps, signed, so many seconds after this press."""
        return self.key.made(self.hold, elapsed)

    def planned(self, jitter: Jitter) -> Way:
        """How far it moves the axis, before its events came or when they are lost."""
        return jitter.planned(self.key, self.hold)

    def measured(self, jitter: Jitter, duration: float, hold: float | None = None) -> Way:
        """How far it moved the axis, by its events: seconds from the one to the other.

        `hold` is from the press to the release as they were sent, where that is not as planned.
        """
        held = self.hold if hold is None else hold
        return jitter.measured(self.key, held, duration)


Presses = tuple[Press | None, Press | None]
"""Of each axis; None for one that is not moved."""


@dataclass(frozen=True)
class Stage:
    """Presses of both axes at one speed.

    Parameters
    ----------
    speed : str
        Which one.
    presses : tuple of Press, optional
        Of each axis; None for one that is not moved.
    errors : tuple of float
        What each axis had to go before it, steps.
    expected_s : float
        Seconds from its beginning until the target is reached, on the average.
    planned_sigmas : tuple of float
        Steps by which the axes will be off after it, RMS.
    known_sigmas : tuple of float
        How much of that nobody will know, RMS.
    """

    speed: Speed
    presses: Presses
    errors: Pair
    expected_s: float
    planned_sigmas: Pair
    known_sigmas: Pair

    @property
    def leaves(self) -> Pair:
        """What each axis will have to go after it, as far as its events tell, RMS; steps."""
        one, two = (
            math.sqrt(max(0.0, planned**2 - known**2)) if press else error
            for press, error, planned, known in zip(
                self.presses, self.errors, self.planned_sigmas, self.known_sigmas, strict=True
            )
        )
        return one, two

    @property
    def duration(self) -> float:
        """Seconds from its first press until both axes go with their drives again."""
        return max(press.end for press in self.presses if press)

    def __str__(self) -> str:
        """As a person reads it."""
        holds = " and ".join(f"{press.hold:.3f} s" if press else "none" for press in self.presses)
        planned, known = (
            " and ".join(f"{TWO_SIDED_95 * sigma:.1f}" for sigma in sigmas)
            for sigmas in (self.planned_sigmas, self.known_sigmas)
        )
        to_go = " and ".join(f"{error:+.1f}" for error in self.errors)
        return f"{self.speed} {holds} for {to_go} steps, to ±{planned}, known to ±{known}"

    @property
    def commands(self) -> list[tuple[float, int, bool]]:
        """Seconds from its first press, axis, and whether its key is pressed then; else it is released."""
        told = [
            (at, axis, down)
            for axis, press in enumerate(self.presses)
            if press
            for at, down in ((press.begin, True), (press.release, False))
        ]
        return sorted(told)


class Errors(NamedTuple):
    """What both axes still have to go.

    Attributes
    ----------
    steps : tuple of float
        By each axis, signed.
    drifts : tuple of float
        By which that grows, steps a second: the target's rate less the drive's.
    slacks : tuple
        Of each axis the steps that its motor goes to larger and to smaller counts before the axis follows; below 0
        where blips lead it as far.
    """

    steps: Pair
    drifts: Pair = (0.0, 0.0)
    slacks: tuple[Pair, Pair] = ((0.0, 0.0), (0.0, 0.0))

    def later(self, seconds: float) -> Pair:
        """The same so many seconds later."""
        one, two = (steps + drift * seconds for steps, drift in zip(self.steps, self.drifts, strict=True))
        return one, two


class _Hold(NamedTuple):
    """A key, and for how long it is held; none for an axis that is not moved."""

    key: Key | None = None
    seconds: float = 0.0


@dataclass(frozen=True)
class Cascade:
    """The planner of one unit.

    Parameters
    ----------
    ladder : Ladder
        Its speeds, and what is known of the line and of the times.
    """

    ladder: Ladder

    @property
    def outlook(self) -> Outlook:
        """The mean time from an error to the target."""
        return mean_of(self.ladder)

    def reached(self, errors: Sequence[float]) -> bool:
        """Whether both axes are, by all that is known, within a guide step of the target: where a goto stops."""
        return max(self._in_guide_steps(errors)) <= WITHIN

    def next(self, errors: Errors, speed: Speed | None = None) -> Stage | None:
        """The next stage, or None where the target is reached.

        Parameters
        ----------
        errors : Errors
            As they are when its first command is sent.
        speed : str, optional
            That which is in force; another one takes a command.

        Raises
        ------
        AwrError
            No key leads there: the target runs away from a drive that does not follow it.
        """
        if self.reached(errors.steps):
            return None
        stages = list(self._stages(errors, speed))
        if not stages:
            drifts = " and ".join(f"{drift:.1f}" for drift in errors.drifts)
            raise AwrError(
                f"no key reaches a target that goes {drifts} steps/s faster than the drives of the axes: see whether "
                "their rates could be set, `clockdrive drive show`"
            )
        return min(stages, key=lambda stage: stage.expected_s)

    def foreseen(self, errors: Errors) -> list[Stage]:
        """All stages, if each leaves as much as it does RMS."""
        stages = list[Stage]()
        while len(stages) < _FORESEEN and (stage := self.next(errors, stages[-1].speed if stages else None)):
            stages.append(stage)
            errors = Errors(stage.leaves, errors.drifts)
        return stages

    def _stages(self, errors: Errors, speed: Speed | None) -> Iterator[Stage]:
        """Each speed for both axes, and for the worse one alone."""
        one, two = self._in_guide_steps(errors.steps)
        for rung, moved in product(self.ladder.rungs, ((True, True), (one >= two, one < two))):
            begin = 0.0 if rung.speed == speed else self.ladder.exchange_s
            holds = [self._hold(rung, axis, errors, begin) if moved[axis] else _Hold() for axis in range(2)]
            if 0.0 < max(hold.seconds for hold in holds) < math.inf:
                yield self._stage(rung, errors, begin, holds)

    def _hold(self, rung: Rung, axis: int, errors: Errors, begin: float) -> _Hold:
        """What moves an axis to its target; for ever where this speed does not, or not for so short a way."""
        steps, drift = errors.later(begin)[axis], errors.drifts[axis]
        key = rung.key(axis, steps)
        if key is None or abs(key.rate) <= _LEAD * abs(drift):
            return _Hold(None, math.inf)
        up, down = errors.slacks[axis]
        way = steps + (up if key.rate > 0.0 else -down)
        hold = key.hold(way)
        for _ in range(_ROUNDS if drift else 0):
            hold = key.hold(way + drift * key.duration(hold))
        if rung is not self.ladder.lowest(axis, steps):
            return _Hold(key, hold) if hold >= self.ladder.shortest_s else _Hold(None, math.inf)
        if hold < self.ladder.exchange_s and abs(steps) <= WITHIN * self.ladder.guide_steps[axis]:
            return _Hold()  # it is there already
        return _Hold(key, max(hold, self.ladder.exchange_s))

    def _stage(self, rung: Rung, errors: Errors, begin: float, holds: Sequence[_Hold]) -> Stage:
        """One speed, with what it leaves and how long all that follows takes on the average."""
        jitter = self.ladder.jitter
        one, two = (Press(hold.key, hold.seconds) if hold.key else None for hold in holds)
        one, two = side_by_side((one, two), self.ladder.exchange_s)
        ends = begin + max(press.end for press in (one, two) if press)
        planned1, planned2 = (press.planned(jitter).sigma if press else 0.0 for press in (one, two))
        known1, known2 = (press.measured(jitter, press.duration).sigma if press else 0.0 for press in (one, two))
        left, guides = errors.later(ends), self.ladder.guide_steps
        after1 = _left(one, left[0], planned1, known1) / guides[0]
        after2 = _left(two, left[1], planned2, known2) / guides[1]
        follows = float(self.outlook(np.maximum.outer(after1, after2)).mean())
        expected = ends + self.ladder.notice_s + follows
        return Stage(rung.speed, (one, two), errors.steps, expected, (planned1, planned2), (known1, known2))

    def _in_guide_steps(self, errors: Sequence[float]) -> Pair:
        one, two = (abs(error) / step for error, step in zip(errors, self.ladder.guide_steps, strict=True))
        return one, two


def _left(press: Press | None, error: float, planned: float, known: float) -> Array:
    """Equally likely errors of an axis after a stage, steps, without sign: those that its events will tell."""
    if press is None:
        return np.full(1, abs(error))
    return _LIKELY * math.sqrt(max(0.0, planned**2 - known**2))


def side_by_side(presses: Presses, apart: float) -> Presses:
    """The same, each begun so that nothing of one comes closer than `apart` to anything of the other; over soonest.

    What is told of an axis while the line is taken by the other waits, and its time is not known.
    """
    one, two = presses
    if one is None or two is None:
        return presses
    ours, others = _told(one, apart), _told(two, apart)
    pairs = [(mine - other, room + its) for mine, room in ours for other, its in others]
    lasts = ours[-1][0], others[-1][0]
    laters = [between + sign * needed for between, needed in pairs for sign in (1.0, -1.0)]
    laters.sort(key=lambda later: max(lasts[0], lasts[1] + later) - min(0.0, later))
    later = next(later for later in laters if _clear(later, pairs))
    return replace(one, begin=max(0.0, -later)), replace(two, begin=max(0.0, later))


def _clear(later: float, pairs: Sequence[Pair]) -> bool:
    """Whether of things so far from one another each has its room, where the second of two is so much later."""
    return all(abs(between - later) >= 0.999 * needed for between, needed in pairs)


def _told(press: Press, apart: float) -> tuple[Pair, Pair, Pair]:
    """Seconds from a press to itself, its release and the end of its motion, and the room of each on the line.

    An end before full speed is late or early by twice as much.
    """
    usual, room = _ROOM[0] * apart, _ROOM[press.hold < press.key.climb_s] * apart
    return (0.0, usual), (press.hold, usual), (press.duration, room)
