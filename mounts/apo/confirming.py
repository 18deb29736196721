"""Which answers of a controller are believed: those that were foreseen, or that another one confirms.

A line has no checksum, and an earlier answer has the same echo as this one.
"""

import math
from collections.abc import Callable
from typing import TypeVar

from mounts.apo import tai
from mounts.apo.clock_offset import ClockOffset
from mounts.apo.controller import Timed
from mounts.apo.errors import MalformedReply
from mounts.apo.node_queue import NodeQueue
from mounts.apo.readings import Drift, continues
from transports.errors import WrongAnswer

_D = TypeVar("_D", bound=Drift)
_ASKED_AGAIN = 3  # times, for an answer that cannot be: one digit garbled passes for another
_FORESEEN = 3e-5  # degrees, or degrees per second, by which an answer may be elsewhere and is not asked for again
_JOLTS = 20.0  # times the configured acceleration, between two answers: a servo changes its velocity in steps
_LATE_S = 0.01
_STAND_DEG = 0.002
_PRINTED_DEG_S = 5e-6  # of a velocity, which a drift goes on at
_PRINTED_S = 0.001


class Confirming:
    """Asks one controller until it can be believed.

    Parameters
    ----------
    queue : NodeQueue
        Where its axis is meant to be.
    offset : ClockOffset
        What is known of its clock.
    acceleration_deg_s2 : float
        That of the axis.

    Attributes
    ----------
    off_deg : float
        Degrees by which the last answer was not where it was foreseen.
    foreseen : bool
        Whether that was where it was foreseen, and no other answer had to confirm it.
    jumped_deg : float
        How far the position has jumped, which no motion explains: it was lost, or somebody set it.
    """

    def __init__(self, queue: NodeQueue, offset: ClockOffset, acceleration_deg_s2: float) -> None:
        self.off_deg = self.jumped_deg = 0.0
        self.foreseen = False
        self._queue = queue
        self._offset = offset
        self._acceleration = acceleration_deg_s2
        self._last: Drift | None = None  # the answer that was believed last
        self._last_at = 0.0  # POSIX seconds before which it was not given

    @property
    def clock_is_unset(self) -> bool:
        """Whether the controller says that nobody has set its clock."""
        return self._last is not None and not self._last.clock_is_set

    def forget(self) -> None:
        """Foresee nothing: the position was set, or the axis was moved by somebody else."""
        self._last = None

    def asked(self, ask: Callable[[], Timed[_D]]) -> Timed[_D]:
        """Ask until an answer is what was foreseen, or another on its heels follows from it.

        A digit that noise has made into another is no error that a line without checksums shows.

        Raises
        ------
        MalformedReply, TransportError
            No answer is one, or none follows from another; what `ask` raises.
        """
        before: Timed[_D] | None = None
        for attempt in range(_ASKED_AGAIN):
            try:
                timed = ask()
            except MalformedReply:
                if attempt == _ASKED_AGAIN - 1:
                    raise
                continue
            confirmed = before is not None and self._confirms(before, timed, is_last=attempt == _ASKED_AGAIN - 1)
            off = 0.0 if confirmed else self._unforeseen(timed)
            if off is not None:
                self.off_deg, self.foreseen = off, not confirmed
                if confirmed and self._last is not None:
                    self._judge_jump(self._last, timed)
                self._last, self._last_at = timed.value, timed.sent
                return timed
            before = timed
        raise WrongAnswer(
            f"{_ASKED_AGAIN} positions that do not follow from each other, the last "
            f"{before.value.position_deg if before else 0.0:.7f}°; check cable and baud rate"
        )

    def _confirms(self, before: Timed[_D], timed: Timed[_D], *, is_last: bool) -> bool:
        """Whether an answer follows from the one before, and is of its own time: an earlier one echoes the same."""
        in_time = self._is_in_time(timed) or (is_last and _keep_step(before, timed))
        return in_time and continues(before.value, timed.value, self._acceleration * _JOLTS)

    def _unforeseen(self, timed: Timed[_D]) -> float | None:
        """Degrees by which an answer is off the path, or, without one, off the line of the answer before.

        None where that, or the velocity, is so much that it must be confirmed.
        """
        told, before, clock = timed.value, self._last, self._offset.line
        if before is None or not (told.clock_is_set and before.clock_is_set and self._is_in_time(timed)):
            return None
        elapsed = math.remainder(told.time_tai_s - before.time_tai_s, tai.DAY_S)
        position = before.position_deg + before.velocity_deg_s * elapsed
        time = tai.posix(told.time_tai_s, timed.received) - clock.at(timed.received)
        position, velocity = self._queue.at(time) or (position, before.velocity_deg_s * (1.0 + clock.gain))
        unsure = _PRINTED_S + self._offset.uncertainty_s
        off, gained = abs(told.position_deg - position), abs(told.velocity_deg_s * (1.0 + clock.gain) - velocity)
        by_the_clock = abs(velocity) * unsure, self._acceleration * unsure
        drifted = self._queue.drifted_s(time) * _PRINTED_DEG_S
        return off if max(off - by_the_clock[0] - drifted, gained - by_the_clock[1]) <= _FORESEEN else None

    def _is_in_time(self, timed: Timed[_D]) -> bool:
        """Whether an answer tells a time at which it can have been given, as far as the clock is known."""
        if not self._offset.known or not timed.value.clock_is_set:
            return True
        told = tai.posix(timed.value.time_tai_s, timed.received) - self._offset.value
        unsure = self._offset.uncertainty_s + _LATE_S
        return timed.sent - unsure <= told <= timed.received + unsure

    def _judge_jump(self, before: Drift, timed: Timed[_D]) -> None:
        """Note how far the position is from where the axis can have come since the last one, by the host's time.

        From the request of that to the end of this answer it has had the longest time: either may have been under way
        for as long as the host was busy.
        """
        seconds = timed.received - self._last_at
        fastest = max(abs(before.velocity_deg_s), abs(timed.value.velocity_deg_s))
        reach = (fastest + self._acceleration * seconds) * seconds + _STAND_DEG
        moved = abs(timed.value.position_deg - before.position_deg)
        if moved > reach:
            self.jumped_deg = moved


def _keep_step(one: Timed[_D], two: Timed[_D]) -> bool:
    """Whether a clock that is set wrong can have told two times: as far apart as the answers are."""
    told = math.remainder(two.value.time_tai_s - one.value.time_tai_s, tai.DAY_S)
    under_way = (one.received - one.sent) + (two.received - two.sent)
    return abs(told - (two.received - one.received)) <= under_way + _LATE_S
