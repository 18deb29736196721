"""By how much an axis may be elsewhere than reckoned, as commands may have been mutilated or mean something else.

Encoders tell where an axis is to two and a half counts whatever became of a command, as of their last look. Without
them a command that is not believed may have done all that one of its kind can; and a move may have gone to the other
axis, the other way, or twice as far, until a `sync` after it has shown that it did not.
"""

import math
from collections.abc import Sequence

from mounts.avr_box.absence import UNATTENDED
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.commands import FIVE_ARCMIN
from mounts.avr_box.encoders import SEEN_COUNTS, Encoder
from mounts.avr_box.reasons import UNTRIED
from mounts.avr_box.supervision import Supervision
from mounts.avr_box.tracking import Tracker
from mounts.avr_box.trust import FLAGS, GUIDES, MOVES, STEPS, Trust

_LOOK_S = 0.02  # by which the moment of what an encoder says is uncertain
_MOST_STEPS = 2 * 255  # of `<` and `>`: as many the other way
_PROVED = 0.05  # of the way that was sent, by which a `sync` may find the axes elsewhere
_CLEAR_STEPS = 30_000  # of a way that proves something, half a degree or one


class Doubt:
    """Of the axes of one box.

    Parameters
    ----------
    axes : sequence of BoxAxis
        The axes.
    trust : Trust
        What of the commands is believed.
    supervision : Supervision
        Knows when the encoders were last seen to agree, and whether the line has shown a flaw.
    tracker : Tracker
        Knows the rates to which axis 1 is trimmed.
    proved : bool
        Whether a `sync` has shown that moves mean what is taken for it.
    """

    def __init__(
        self, axes: Sequence[BoxAxis], trust: Trust, supervision: Supervision, tracker: Tracker, *, proved: bool
    ) -> None:
        self._axes, self._trust, self._supervision, self._tracker = axes, trust, supervision, tracker
        self.proved = proved

    def of(self, axis: BoxAxis, time: float) -> float:
        """Microsteps by which an axis may be off at a time, POSIX seconds."""
        ran = 2.0 * axis.law.fastest  # one may run this way that was sent the other way
        if axis.encoder is None:
            return self._blind(axis, time, ran)
        return self._seen(axis, axis.encoder, time, ran) + self._supervision.unseen(axis)

    @property
    def untried(self) -> tuple[str, ...]:
        """That moves may lead elsewhere than is taken for it, as people read it, where nothing has shown yet."""
        one, two = self._axes
        if one.encoder is not None or self.proved or not one.unproved_steps + two.unproved_steps:
            return ()
        off = (math.degrees(math.tau * self._unproved(axis) / axis.steps_per_turn) for axis in self._axes)
        return (UNTRIED.format(*(min(each, 180.0) for each in off)),)

    def _seen(self, axis: BoxAxis, encoder: Encoder, time: float, ran: float) -> float:
        state, looked = axis.at(time), self._supervision.looked
        if self._trust.complete and not self._supervision.flawed:
            return state.uncertainty
        since = max(looked, self._trust.since(MOVES))
        most = SEEN_COUNTS * encoder.step
        loose = encoder.bound_at < looked  # it may be off by what it agrees within
        seen = state.uncertainty + most if loose else most
        return seen + abs(state.rate) * _LOOK_S + ran * max(0.0, time - since)

    def _blind(self, axis: BoxAxis, time: float, ran: float) -> float:
        state, rates, trust = axis.at(time), self._tracker.rates, self._trust
        by_moves = ran * max(0.0, time - trust.since(MOVES)) + self._unproved(axis)
        flags = max(0.0, time - trust.since(FLAGS))
        if axis.index == 0:
            guided = max(0.0, time - trust.since(GUIDES)) * (rates.faster - rates.slower)
            return state.uncertainty + by_moves + guided + flags * rates.own * UNATTENDED
        stepped = _MOST_STEPS if trust.since(STEPS) < time else 0
        return state.uncertainty + by_moves + stepped + (2 * FIVE_ARCMIN[1] if flags else 0)  # `C` is a bit from `S`

    def _unproved(self, axis: BoxAxis) -> float:
        """Microsteps that moves may have made otherwise than is taken for it: its own the other way."""
        return 0.0 if self.proved else sum(each.unproved_steps for each in self._axes) + axis.unproved_steps

    def tried(self, found: Sequence[float], time: float) -> None:
        """A person says where the axes are: whether that shows that moves mean what is taken for it."""
        one, two = self._axes
        off = found[0] - one.at(time).counts, found[1] - two.at(time).counts
        known = not self._supervision.unsynchronised
        self.proved |= known and proves((one.unproved_steps, two.unproved_steps), off)
        for axis in self._axes:
            axis.unproved_steps = 0.0


def proves(sent: tuple[float, float], off: tuple[float, float]) -> bool:
    """Whether axes that were found so far off prove that moves of so many microsteps mean what is taken for it."""
    return all(way >= _CLEAR_STEPS and abs(by) <= _PROVED * way for way, by in zip(sent, off, strict=True))
