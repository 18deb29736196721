"""One axis behind its controller: what it was told, what it answers, and how far its clock is off.

Outside, times are POSIX seconds; on the wire they are the controller's own, TAI seconds of the day and its clock's
offset, and velocities are degrees per second of its clock: one that gains g counts 1 + g of them in a second. A node
whose answer was lost is not sent again: see `line`.
"""

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from mounts.apo import tai
from mounts.apo.clock_offset import ClockLine, ClockOffset
from mounts.apo.commands import Kind, command
from mounts.apo.confirming import Confirming
from mounts.apo.controller import Controller, Timed
from mounts.apo.errors import CommandRefused, MalformedReply
from mounts.apo.node_queue import NodeQueue, PathNode
from mounts.apo.readings import Drift, Status
from mounts.apo.settings import AxisSettings
from mounts.apo.status_word import StatusWord, sticky_mask
from mounts.errors import DriveRefused
from transports.errors import LinkError, NoAnswer, TransportError, WrongAnswer

_T = TypeVar("_T")
_D = TypeVar("_D", bound=Drift)
_FORGETS = 0.8  # from answer to answer, of how late one was
_PRINTED_DEG = 5e-7
_PRINTED_S = 0.001
STANDS_DEG_S = 1e-4
"""Degrees per second, below which an axis stands."""
LIMITS = ("reverse_soft_limit", "forward_soft_limit", "reverse_limit_switch", "forward_limit_switch")
"""The status bits that say that an axis is at a limit."""
_HARMLESS = frozenset({*LIMITS, "buffer_empty"})


@dataclass(frozen=True)
class Sight:
    """An axis at one moment: degrees, degrees per second, POSIX seconds."""

    time: float
    position: float
    velocity: float
    uncertainty: float
    word: StatusWord


def halts(word: StatusWord) -> bool:
    """Whether a controller with these bits must be initialised before it moves: it has restarted, or an error."""
    return word.restarted or bool(set(word.errors) - _HARMLESS)


class ControlledAxis:
    """One axis.

    Parameters
    ----------
    controller : Controller
        At the far end of its line.
    settings : AxisSettings
        Its name and its bounds.
    kind : str
        Whose status bits it has.
    """

    def __init__(self, controller: Controller, settings: AxisSettings, kind: Kind) -> None:
        self.controller = controller
        self.settings = settings
        self.offset = ClockOffset()
        self.queue = NodeQueue()
        self.confirming = Confirming(self.queue, self.offset, settings.acceleration_deg_s2)
        self.sight: Sight | None = None
        self.latched = StatusWord(0, kind)
        """The sticky bits seen since the last INIT: on the SDSS to read them is to clear them."""
        self.must_init = False
        """Whether the controller has been seen in a state from which INIT alone frees it."""
        self.clock_stepped = False
        self.bits_lost = False
        """Whether an answer was lost that may have taken with it that the controller has restarted."""
        self.led = False
        """Whether it was given somewhere to go since it was last seen at rest."""
        self.answered = 0.0
        """POSIX seconds of the last answer to a node."""
        self._waiting: deque[PathNode] = deque()  # for room in the buffer
        self._slew_clock = ClockLine()  # by which they are timed
        self._timed_by = ClockLine()  # the last node
        self._delay_s = 0.0  # of the answers lately, besides their time on the line

    @property
    def name(self) -> str:
        """What people call it."""
        return self.settings.name

    @property
    def word(self) -> StatusWord:
        """All that stands: what is latched and what was seen last."""
        return self.latched if self.sight is None else self.latched | self.sight.word

    @property
    def is_anothers(self) -> bool:
        """Whether it was last seen with the semaphore in somebody else's hands: it takes no moves from this host."""
        return self.sight is not None and self.sight.word.has("semaphore_taken")

    # Asking ----------------------------------------------------------------------------------------------------

    def look(self) -> Sight:
        """Ask STATUS; the position is compared with the one before, and asked for again where it cannot be.

        Raises
        ------
        TransportError
            It does not answer; the text names the axis.
        """
        timed = self.asked(lambda: self.confirming.asked(self._status))
        status, posix = timed.value, self._seen(timed)
        rate = status.velocity_deg_s * (1.0 + self.offset.line.gain)
        unsure = _PRINTED_DEG + abs(rate) * (_PRINTED_S + self.offset.uncertainty_s) + self.confirming.off_deg
        self.sight = Sight(posix, status.position_deg, rate, unsure, status.word)
        self.queue.forget_before(posix)
        self.bits_lost = self.bits_lost and not self.confirming.foreseen  # had it restarted it would not be there
        restarted = self.word.restarted or self.bits_lost
        if abs(rate) < STANDS_DEG_S and not restarted and self.queue.rests_from(posix):
            self.led = False
        return self.sight

    def _status(self) -> Timed[Status]:
        """Ask once; what the answer has cleared by being read is kept, whatever becomes of the rest of it."""
        try:
            timed = self.controller.status()
        except (MalformedReply, TransportError):
            self.bits_lost |= self.latched.kind == "sdss"  # to read them is to clear them
            raise
        self.bits_lost |= timed.repeated and self.latched.kind == "sdss"
        word = timed.value.word
        self.latched |= StatusWord(word.value & sticky_mask(word.kind), word.kind)
        self.must_init |= halts(word)
        return timed

    def drift(self) -> PathNode:
        """Let the axis go on as it moves, its buffer flushed; return where and how fast."""
        timed = self.asked(lambda: self.confirming.asked(self.controller.drift))
        posix = self._seen(timed)
        rate = timed.value.velocity_deg_s * (1.0 + self.offset.line.gain)
        line = PathNode(posix, timed.value.position_deg, rate)
        self._waiting.clear()
        self.queue.begin(line)
        return line

    def _seen(self, timed: Timed[_D]) -> float:
        """Learn the line's delay and the clock's offset from an answer; return the POSIX time that it speaks of."""
        self._learn_delay(timed.began - timed.sent)
        if not timed.value.clock_is_set:
            return (timed.sent + timed.received) / 2.0
        told = tai.posix(timed.value.time_tai_s, timed.received)
        self.clock_stepped |= self.offset.see(told, timed.sent, timed.began)
        return told - self.offset.value

    def clock_trouble(self) -> str:
        """What is wrong with the controller's clock; empty where node times can be corrected for it."""
        if self.confirming.clock_is_unset:
            return f"{self.name}: the controller's clock is not set; {self._sets_it}, then INIT"
        off = self.offset.value
        if abs(off) <= tai.LARGEST_OFFSET_S:
            return ""
        kept = tai.wrong_scale(off, 0.0 if self.sight is None else self.sight.time)
        scale = f", as if it kept {kept} instead of TAI" if kept else ""
        return (
            f"{self.name}: the controller's clock is {off:+.3f} s off{scale}, more than {tai.LARGEST_OFFSET_S:g} s; "
            f"{self._sets_it}, and check the host's own clock"
        )

    @property
    def _sets_it(self) -> str:
        return "`drive set-time` sets it" if self.latched.kind == "sdss" else "set it"

    def require_clock(self) -> None:
        """Refuse a controller whose clock is too far off.

        Raises
        ------
        DriveRefused
            By how much, and what to do.
        """
        if text := self.clock_trouble():
            raise DriveRefused(text)

    # Commanding ------------------------------------------------------------------------------------------------

    def send(self, node: PathNode, clock: ClockLine | None = None) -> None:
        """Give the next node of the path.

        Parameters
        ----------
        node : PathNode
            By the host's clock.
        clock : ClockLine, optional
            How the controller's clock is off; as far as it is known now where none is given.

        Raises
        ------
        DriveRefused
            The controller does not take it.
        TransportError
            Its answer was lost; it may have been taken, and is not sent again.
        """
        clock = self.offset.line if clock is None else clock
        # Added to the second of the day: a POSIX time has digits of 0.24 µs only, which a short phase's jerk shows.
        when = (tai.seconds_of_day(node.time) + clock.at(node.time)) % tai.DAY_S
        what = command("MOVE", node.position, node.velocity / (1.0 + clock.gain), when)
        try:
            answer = self.asked(lambda: self.controller.ask(what))
        except DriveRefused as error:
            raise DriveRefused(f"{error}, and drive.max_nodes") from error
        self._learn_delay(answer.received - answer.asked - self.controller.line_time(what))
        self._timed_by, self.answered = clock, answer.received
        self.led = self.led or node.velocity != 0.0
        self.queue.append(node)

    def send_path(self, nodes: Sequence[PathNode], most: int) -> None:
        """Give the nodes of a slew, as many as the buffer holds; `feed` gives the others when there is room.

        Raises
        ------
        DriveRefused, TransportError
            As for `send`.
        """
        self._waiting = deque(nodes)
        self._slew_clock = self.offset.line  # the same for all: between two nodes 20 ms apart nothing may be learnt
        self.feed(-math.inf, most)

    def feed(self, time: float, most: int) -> None:
        """Give what waits for room in the buffer, of so many nodes, at POSIX `time`.

        Raises
        ------
        DriveRefused, TransportError
            As for `send`; nothing waits any more, as the way from there on must be planned anew.
        """
        while self._waiting and self.queue.pending(time) < most:
            node = self._waiting.popleft()
            try:
                self.send(node, self._slew_clock)
            except BaseException:
                self._waiting.clear()
                raise

    @property
    def waiting(self) -> Sequence[PathNode]:
        """Nodes for which the buffer had no room."""
        return tuple(self._waiting)

    def halt(self, *, abruptly: bool = False) -> None:
        """End the motion; the axis decelerates, or is stopped as the stop button does."""
        self.asked(lambda: self.controller.tell("STOP" if abruptly else "MOVE"))
        self._drop_nodes()

    def stow(self) -> None:
        """Let the controller drive the axis to its stow position, which it alone knows."""
        self.led = True
        self.asked(lambda: self.controller.tell("P"))
        self._drop_nodes()

    def initialise(self) -> None:
        """Halt and clear the sticky bits."""
        self.asked(lambda: self.controller.tell("INIT"))
        self._drop_nodes()
        self.forget_bits()

    def forget_bits(self) -> None:
        """Forget what was latched: INIT has cleared it."""
        self.sight, self.latched, self.must_init = None, StatusWord(0, self.latched.kind), False

    def let_expire(self) -> None:
        """Leave the axis alone with what it was given: that its path runs out is wanted."""
        self._drop_nodes()

    def _drop_nodes(self) -> None:
        """Foresee nothing of the nodes that were given, and give none of those that wait for room."""
        self._waiting.clear()
        self.queue.clear()

    def forget_path(self) -> None:
        """Forget what the axis was given and where it was: somebody else has moved it, or its zero."""
        self._drop_nodes()
        self.confirming.forget()

    def displace(self, degrees: float) -> None:
        """Offset all that the controller has been given; later nodes must contain it."""
        self.asked(lambda: self.controller.tell("+MOVE", degrees))
        self.queue.shift(degrees)
        self.confirming.forget()

    @property
    def early_s(self) -> float:
        """By how many seconds the end of the buffer comes too early, as the controller's clock is known now."""
        ends = self.queue.ends
        return self.offset.at(ends) - self._timed_by.at(ends) if self.queue.is_path else 0.0

    def come_in_time(self, rate: float, early: float) -> None:
        """Displace a buffer that comes so many seconds too early for a target of this velocity, degrees a second."""
        self.displace(-rate * early)
        self.queue.retime(-early)
        self._timed_by = replace(self._timed_by, offset=self._timed_by.offset + early)

    def set_position(self, degrees: float) -> None:
        """Declare the present position."""
        self.asked(lambda: self.controller.tell("SET.POSITION", degrees))
        self.confirming.forget()

    @property
    def exchange_s(self) -> float:
        """Seconds that a node takes with its answer: its time on the line, and the delay that answers had lately."""
        longest = command("MOVE", -self.settings.highest_deg, -self.settings.max_speed_deg_s, 86399.0)
        return self._delay_s + self.controller.line_time(longest)

    def _learn_delay(self, seconds: float) -> None:
        self._delay_s = max(seconds, _FORGETS * self._delay_s)

    def asked(self, work: Callable[[], _T]) -> _T:
        """Name the axis in whatever goes wrong."""
        try:
            return work()
        except CommandRefused as error:
            raise DriveRefused(f"{self.name}: {error}; check its status bits with `drive show`") from error
        except MalformedReply as error:
            raise WrongAnswer(f"{self.name}: {error}; check cable and baud rate") from error
        except (NoAnswer, WrongAnswer, LinkError) as error:
            raise type(error)(f"{self.name}: {error}") from error
