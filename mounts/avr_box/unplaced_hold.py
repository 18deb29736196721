"""Holding axis 1 where it stands though nobody knows where that is: by what its encoder says since.

An encoder need not be tied for that. The way back is `E`, a move of 5′ against the tracking, whatever a count of `M`,
the axis bit or the sense of an axis mean; it is made as soon as tracking has made more than a count, so that the axis
stays short of where it stood. An encoder that does not see the tracking, or the way back, is not believed.
"""

from collections.abc import Callable

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.encoders import Encoder
from mounts.avr_box.moves import Moves

_STEPS = 2 * commands.FIVE_ARCMIN[0]
_FEWEST_COUNTS = 3.0  # of the way back, to be seen
_SEEN = 0.5  # of the way back, from which on a way must be seen
_OFTEN = 2  # times that nothing is seen and it is no lost byte
_BY_HAND_COUNTS = 3.0  # beyond what it does by itself from one look to the next, that somebody else moved it
HELD = (
    "axis 1 is held by its encoder alone, up to 5′ short of where it stood, as its position is not synchronised: "
    "`sync`, or switch it off"
)


class UnplacedHold:
    """Of one box.

    Parameters
    ----------
    box : Box
        Is asked.
    axis : BoxAxis
        Axis 1.
    moves : Moves
        Sends `E`.
    forbidden : callable
        Whether nothing may be sent now.
    """

    def __init__(self, box: Box, axis: BoxAxis, moves: Moves, forbidden: Callable[[], bool]) -> None:
        self._box, self._axis, self._moves, self._forbidden = box, axis, moves, forbidden
        self._stood: Told | None = None  # where it stood
        self._last: Told | None = None
        self._back = False  # the way back was made since the last look
        self._missed = 0  # ways, one after the other, that its encoder did not see

    def end(self) -> None:
        """It is held otherwise, or not at all."""
        self._stood, self._last, self._back, self._missed = None, None, False, 0

    def hold(self) -> str:
        """Do what is due; return how it is held, as people read it, or nothing where it cannot be.

        Raises
        ------
        TransportError
            The box does not answer.
        """
        encoder = self._axis.encoder
        if encoder is None or _FEWEST_COUNTS * encoder.step > _STEPS or self._is_blind or self._forbidden():
            return ""
        if self._box.now() < self._axis.free_at:
            return HELD
        told = self._box.ask(commands.ASK_ENCODERS)
        if self._stood is None or self._last is None or self._by_hand(encoder, self._last, told):
            self._stood = self._last = told
            return HELD
        self._look(encoder, self._last, told)
        if self._is_blind:
            return ""
        if not self._back and self._made(encoder, self._stood, told) > encoder.step:
            self._last, self._back = told, True
            self._moves.send_trial(self._axis, b"E", -commands.FIVE_ARCMIN[0] * self._axis.sign)
            self._moves.prove()
        return HELD

    @property
    def _is_blind(self) -> bool:
        return self._missed >= _OFTEN

    def _made(self, encoder: Encoder, since: Told, told: Told) -> float:
        """Microsteps that it went the way of its tracking, as its encoder says."""
        return self._axis.sign * (told.pair.one - since.pair.one) * encoder.steps_per_count

    def _by_itself(self, since: Told, told: Told) -> float:
        """Microsteps that it should have gone that way."""
        tracked = abs(self._axis.own_rate) * (told.middle - since.middle)
        return tracked - _STEPS if self._back else tracked

    def _by_hand(self, encoder: Encoder, since: Told, told: Told) -> bool:
        off = self._made(encoder, since, told) - self._by_itself(since, told)
        return abs(off) > _STEPS + _BY_HAND_COUNTS * encoder.step

    def _look(self, encoder: Encoder, since: Told, told: Told) -> None:
        """See whether its encoder sees what it does, as soon as that is enough to be seen."""
        due = self._by_itself(since, told)
        if abs(due) > _SEEN * _STEPS:
            self._missed = 0 if self._made(encoder, since, told) * due > 0.0 else self._missed + 1
            self._last, self._back = told, False
