"""Looking at both axes through their encoders: what they say beside what is reckoned.

An encoder that agrees says nothing new, as the reckoning is finer; one that does not is looked at again, for digits
can be garbled and still be some.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.encoders import TRUST_COUNTS, Encoder
from mounts.avr_box.runaway import AGAIN_S, BOUND_COUNTS, RUNS_COUNTS
from transports.errors import NoAnswer

TIMING_S = 0.005
"""By which the moment of an answer is uncertain besides its own line time."""
_TRIES = 6


class Astray(NamedTuple):
    """An axis that is not where it was reckoned to be, twice."""

    axis: BoxAxis
    encoder: Encoder
    told: Told  # the later look
    runs: float  # counts that it made between two looks beyond what was asked of it, signed with its own
    opposite: bool  # it went as far the other way
    past: bool  # it is ahead of the move that was asked of it and is under way, as one that was mutilated is
    short: bool  # it goes the way that was asked of it, and falls behind, or stands


class Sight:
    """Of the axes of one box.

    Parameters
    ----------
    box : Box
        Is asked.
    axes : sequence of BoxAxis
        Are looked at, and held within what their encoders say.
    """

    def __init__(self, box: Box, axes: Sequence[BoxAxis]) -> None:
        self._box, self._axes = box, axes

    def tie(self, told: Told) -> None:
        """Tie each encoder that is not tied to where its axis is reckoned to be."""
        for axis, said in zip(self._axes, told.pair, strict=True):
            if axis.encoder is not None and axis.encoder.zero is None:
                axis.encoder.tie(said, axis.at(told.middle).counts)

    def beyond(self, axis: BoxAxis, told: Told) -> float:
        """By how many microsteps an axis is beyond where it is reckoned to be."""
        encoder = axis.encoder
        if encoder is None or encoder.zero is None:
            return 0.0
        state = axis.at(told.middle)
        timing = (told.latest - told.earliest) / 2.0 + TIMING_S
        return encoder.off(told.pair[axis.index], state.counts, state.uncertainty + abs(state.rate) * timing)

    def any_beyond(self, told: Told) -> bool:
        """Whether one of them is."""
        return any(self.beyond(axis, told) for axis in self._axes)

    def bound(self, told: Told, *, flawed: bool) -> None:
        """An encoder bounds what the reckoning may be off, where that is much, or commands may have been lost."""
        held = [axis for axis in self._axes if self._must_be_bound(axis, told, flawed=flawed)]
        if any(_off_counts(axis, told) > 1.0 for axis in held):
            told = self.surely_told()
        for axis in held:
            state, encoder = axis.at(told.middle), axis.encoder
            if encoder is None or state.moving:
                continue
            here = encoder.steps(told.pair[axis.index])
            nearer = min(max(state.counts, here - encoder.step), here + encoder.step)
            axis.known(nearer, told.middle, BOUND_COUNTS * encoder.step)
            encoder.bound_at = told.middle
            off = max(-axis.trimmed, min(axis.trimmed, nearer - state.counts))  # more than that something else made
            encoder.crept, axis.trimmed = 0.0 if flawed else encoder.crept + off, axis.trimmed - abs(off)

    def _must_be_bound(self, axis: BoxAxis, told: Told, *, flawed: bool) -> bool:
        encoder, state = axis.encoder, axis.at(told.middle)
        if encoder is None or encoder.zero is None or state.moving:
            return False
        crept = _off_counts(axis, told) > TRUST_COUNTS  # no farther than it was uncertain
        return flawed or crept or state.uncertainty > BOUND_COUNTS * encoder.step

    def surely_told(self) -> Told:
        """Ask until an answer and one before it can both be right: digits can be garbled and still be some.

        Raises
        ------
        NoAnswer
            No two of them can.
        """
        heard = [self._box.ask(commands.ASK_ENCODERS)]
        for _ in range(_TRIES):
            told = self._box.ask(commands.ASK_ENCODERS)
            if any(self.agree(before, told) for before in heard):
                return told
            self._box.trust.flawed()
            heard.append(told)
        raise NoAnswer(
            f"{self._box.name}: {len(heard)} answers of encoders, no two of which can be right: mend cable or port"
        )

    def agree(self, before: Told, told: Told) -> bool:
        """Whether both answers can be right, at any speed of the axes."""
        passed = told.latest - before.earliest
        return all(
            axis.encoder is None or abs(one - other) <= axis.law.fastest / axis.encoder.step * passed + 1.0
            for axis, one, other in zip(self._axes, told.pair, before.pair, strict=True)
        )

    def astray(self, told: Told) -> list[Astray]:
        """Look again after a moment at each axis that is astray, whether it runs."""
        self._box.pause(told.latest + AGAIN_S)
        again = self.surely_told()
        found = []
        for axis in self._axes:
            beyond = self.beyond(axis, again)
            if axis.encoder is not None and beyond:
                found.append(_astray(axis, axis.encoder, (told, again), beyond))
        return found


def _off_counts(axis: BoxAxis, told: Told) -> float:
    """By how many counts an axis with an encoder is from what that says."""
    encoder = axis.encoder
    if encoder is None or encoder.zero is None:
        return 0.0
    return abs(axis.at(told.middle).counts - encoder.steps(told.pair[axis.index])) / encoder.step


def _astray(axis: BoxAxis, encoder: Encoder, looks: tuple[Told, Told], beyond: float) -> Astray:
    told, again = looks
    here = axis.at(again.middle)
    asked = here.counts - axis.at(told.middle).counts
    made = encoder.steps(again.pair[axis.index]) - encoder.steps(told.pair[axis.index])
    runs = (made - asked) / encoder.step
    opposite = abs(runs) > RUNS_COUNTS and encoder.against(asked, made)
    past = here.moving and axis.unproved and asked * beyond > 0.0 and asked * runs > 0.0
    back = -math.copysign(made, made * asked)  # microsteps that it went the other way
    short = asked * runs < 0.0 and back < encoder.step
    return Astray(axis, encoder, again, runs, opposite, past, short)
