"""Slews of both axes: where each is aimed, in which pieces it goes, and each piece sent at its time.

Both axes are aimed so that they are right when the later one has landed: each then tracks on.
"""

from collections.abc import Sequence
from dataclasses import replace

from mounts.avr_box.axis import BoxAxis, Waiting
from mounts.avr_box.box import Box
from mounts.avr_box.landing import Aim, Landing, best, solved
from mounts.avr_box.moves import Moves
from mounts.avr_box.slew_model import AvrTravel, Piece, parts
from mounts.drive import AxisSlew
from mounts.errors import DriveRefused

_SOON_S = 0.5  # within which `send_due` waits for the time of a piece
_SHORT_S = 5.0  # that a move of tracking takes at most, for a slew to wait for it
_EXCHANGE_S = 0.05  # of a question and its answer
_INTERRUPTED = 0.5  # microsteps of tracking that letters interrupt, on the average
_CORRECTED = 2000  # microsteps by which the last piece of a slew makes up for what the others were off
_AHEAD_S = 5e-4  # by which the last microstep is to be made before it is due
_AS_PLANNED_S = 0.02  # from the planned arrival, by which a last piece can come sooner: the pause before it is longer
_ROUNDS = 4  # of solving where both land, each later than the one before by less


class Slews:
    """Slews the axes of one box.

    Parameters
    ----------
    box : Box
        Knows the time.
    axes : tuple of BoxAxis
        Are slewed.
    moves : Moves
        Sends the pieces.
    """

    def __init__(self, box: Box, axes: tuple[BoxAxis, BoxAxis], moves: Moves) -> None:
        self._box, self._axes, self._moves = box, axes, moves

    @property
    def free_at(self) -> float:
        """POSIX seconds from which on a slew may begin."""
        return max(*(axis.free_at for axis in self._axes), self._axes[1].guided_until)

    def begin(self, slews: Sequence[AxisSlew], time: float) -> float:
        """Begin a slew of both axes; the pieces that come later are sent by `send_due`. Return when it began.

        Raises
        ------
        DriveRefused
            The axes still move.
        """
        self._settle(time)
        self._moves.begin_way()
        began = self._box.now() + self._moves.line_s
        for axis, aim, slew in zip(self._axes, self._aims(slews, began), slews, strict=False):
            self._plan(axis, aim, slew, began)
        self._hold_back(self._axes[0])
        self._part_the_landings()
        self.send_due()
        return began

    def _settle(self, time: float) -> None:
        """Wait for a short move that is under way; nothing else may be."""
        busy = self.free_at - time
        if busy > _SHORT_S:
            raise DriveRefused(f"the axes still move for {busy:.1f} s, and no command ends that: wait for it")
        self._box.pause(self.free_at)

    def _aims(self, slews: Sequence[AxisSlew], began: float) -> list[Aim]:
        """Where each axis is to land, so that both are right when the later one does."""
        aims = [Aim(slew.target, began, began) for slew in slews[:2]]
        for _ in range(_ROUNDS):
            lands = [
                began + _travel(axis, aim, slew, began).duration - _AHEAD_S
                for axis, aim, slew in zip(self._axes, aims, slews, strict=False)
            ]
            arrival = max(lands) + _AHEAD_S
            if (planned := _planned(slews)) is not None and abs(planned - arrival) < _AS_PLANNED_S:
                arrival, lands = planned, [min(own, planned - _AHEAD_S) for own in lands]
            aims = [
                Aim(_led(axis, slew, own, arrival), own, arrival)
                for axis, slew, own in zip(self._axes, slews, lands, strict=False)
            ]
        return aims

    def _plan(self, axis: BoxAxis, aim: Aim, slew: AxisSlew, begin: float) -> None:
        travel = _travel(axis, aim, slew, begin)
        axis.abandon()
        axis.aim = aim
        axis.slew_ends = begin + travel.duration
        axis.waiting = [Waiting(piece, begin + piece.begin) for piece in travel.pieces]

    def _hold_back(self, axis: BoxAxis) -> None:
        """Let axis 1 land with axis 2 where letters end its slew: a move of axis 2 may have made it run as well.

        Until then it tracks.
        """
        if axis.aim is None or not (axis.waiting and axis.waiting[-1].piece.letters):
            return
        later = axis.aim.arrival - _AHEAD_S - axis.aim.time
        if later > 0.0:
            due = axis.aim.time + later
            axis.aim = replace(axis.aim, counts=axis.aim.counts + axis.tracks(axis.aim.time, due), time=due)
            axis.slew_ends += later
            axis.waiting[-2:] = [Waiting(each.piece, each.begin + later) for each in axis.waiting[-2:]]

    def _part_the_landings(self) -> None:
        """Let axis 2, which stands where it lands, begin its last piece earlier where others are due as well."""
        one, two = self._axes
        if not (one.waiting and two.waiting and two.aim):
            return
        for first in sorted((each.begin for each in one.waiting[-2:]), reverse=True):
            other, apart = two.waiting[-1].begin, 2.0 * self._moves.line_s
            if abs(first - other) < apart:
                sooner = apart + other - first
                two.aim = replace(two.aim, time=two.aim.time - sooner)
                two.waiting[-1] = Waiting(two.waiting[-1].piece, other - sooner)

    def send_due(self) -> None:
        """Send the pieces whose time comes before the next look, each at its time."""
        self._plan_last_anew(self._axes[0])
        while due := sorted((axis.waiting[0].begin, axis.index) for axis in self._axes if axis.waiting):
            begin, index = due[0]
            if begin > self._box.now() + _SOON_S:
                break
            if self._moves.unproved and begin > self._box.now() + _EXCHANGE_S:
                self._moves.prove()
            self._send_piece(self._axes[index])
        if self._moves.unproved:
            self._moves.prove()

    def _send_piece(self, axis: BoxAxis) -> None:
        """Send the next piece at its time; the last one for where the axis is by then."""
        if not axis.waiting:  # it was abandoned when the piece before was proved
            return
        waiting = axis.waiting[0]
        piece, half, begin = waiting.piece, waiting.piece.half * waiting.piece.sign, max(waiting.begin, axis.free_at)
        begin -= self._moves.again_s if piece.letters else 0.0
        if (aim := self._aim_of_piece(axis)) is not None and (found := self._last(axis, aim, half, piece)):
            half, begin = found.half, found.begin
        self._box.pause(begin - self._moves.line_s)
        axis.waiting.pop(0)
        if piece.letters:
            self._moves.by_letters(axis, piece.sign)
        elif half:
            self._moves.send(axis, half, slew=True)

    def _plan_last_anew(self, axis: BoxAxis) -> None:
        """Let the last move make up for what axis 1 did not track while letters moved it to and fro."""
        if not axis.led_back or not axis.waiting or any(each.piece.letters for each in axis.waiting[:-1]):
            return
        axis.led_back, axis.waiting, model = False, axis.waiting[-2:], axis.model
        planned = axis.waiting[0].piece
        if planned.letters or (aim := self._aim_of_piece(axis)) is None:
            return
        half = solved(axis, aim, axis.free_at, planned.half * planned.sign)
        ends, pieces = aim.time, list[Waiting]()
        for each in reversed(parts(abs(half), model.longest_half, model.wire_per_half, model.tail) or [0]):
            lasts = axis.duration(each)
            pieces.insert(0, Waiting(Piece(each, 1 if half > 0 else -1, 0.0, lasts), ends - lasts))
            ends -= lasts + model.pause_s
        axis.waiting[:1] = pieces

    def _aim_of_piece(self, axis: BoxAxis) -> Aim | None:
        """Where the next piece is to land that may be chosen anew: the last one, and one that letters follow.

        Letters begin anew for a moment, so that they land as much later.
        """
        aim, last = axis.aim, axis.waiting[-1].piece
        if aim is None:
            return None
        if last.letters:
            again = self._moves.again_s
            aim = replace(aim, time=aim.time - again, arrival=aim.arrival - again)
        if len(axis.waiting) == 1:
            return aim
        if len(axis.waiting) > 2 or not last.letters:
            return None
        begins = aim.time - axis.duration(last.half)
        ends = begins - axis.model.pause_s
        lost = _INTERRUPTED * axis.sign if axis.own_rate else 0.0
        return Aim(aim.counts - last.steps + lost - axis.tracks(ends, begins), ends, begins)

    def _last(self, axis: BoxAxis, aim: Aim, planned: int, piece: Piece) -> Landing | None:
        """The last piece, which leads to the aim from where the axis is when it begins; None where none does."""

        def allowed(half: int) -> bool:
            if piece.letters:
                return half == planned
            return 2 * abs(half - planned) < _CORRECTED and self._moves.may_be(half, axis)

        earliest = max(axis.free_at, self._box.now() + self._moves.line_s)
        return best(axis, aim, earliest, planned, allowed)


def _travel(axis: BoxAxis, aim: Aim, slew: AxisSlew, begin: float) -> AvrTravel:
    model = axis.model if slew.max_rate is None else axis.model.limited(slew.max_rate)
    return model.travel(axis.at(begin).counts, aim.counts, 0.0, 0.0)


def _planned(slews: Sequence[AxisSlew]) -> float | None:
    """When both axes were planned to have landed, POSIX seconds; None where nobody did."""
    arrivals = [slew.arrival for slew in slews[:2] if slew.arrival is not None]
    return max(arrivals) if len(arrivals) == 2 else None


def _led(axis: BoxAxis, slew: AxisSlew, lands: float, arrival: float) -> float:
    """Where an axis must land to be right on arrival, tracking on until then.

    Its target was given for its planned landing; from there the path goes on at `rate_after`.
    """
    planned = lands if slew.arrival is None else slew.arrival
    return slew.target + slew.rate_after * (arrival - planned) - axis.tracks(lands, arrival)
