"""One thread owns the drive; all else talks to it by calls that queue.

The loop runs *steps*: a generator that does a bit of work and yields the seconds until it wants to go on. A command
in the foreground (a slew) is such a generator; with none, the background cycle keeps polling and tracking. Calls are
done between steps, one at most while a step is overdue, so that no number of callers keeps the telescope from being
looked at; an interruption is done before all else and ends the command in the foreground.

What runs inside a step, such as the report of a slew's progress, may call as well: its calls are done at once, and
its interruption ends the command it runs in.

With the system's clock a thread runs the loop. With a virtual clock nobody waits: the loop runs inside the call that
needs it, so a test or a simulation is deterministic.
"""

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

from clockdrive.clock import VirtualClock
from clockdrive.errors import Refused
from transports.link import Clock

T = TypeVar("T")
Steps = Generator[float, None, T]
_BUSY = "another command is moving the telescope; wait for it, or `stop` first"
_CLOSED = "the telescope is closed; open it again"
_AFTER_A_FAULT_S = 1.0
_LOG = logging.getLogger(__name__)


class Control(Protocol):
    """Where the work on the drive is done."""

    def call(self, work: Callable[[], T]) -> T:
        """Do `work` between two steps; return what it returns, raise what it raises."""
        ...

    def perform(self, steps: Steps[T]) -> T:
        """Run `steps` in the foreground to their end.

        Raises
        ------
        Refused
            Another command is in the foreground, or this one was interrupted.
        """
        ...

    def interrupt(self, work: Callable[[], T], reason: str) -> T:
        """Do `work` before anything that waits, and end the command in the foreground with `reason`."""
        ...

    def let_pass(self, seconds: float) -> None:
        """Let time pass while the background cycle runs."""
        ...

    def require_open(self) -> None:
        """Refuse what is asked of a telescope that was closed.

        Raises
        ------
        Refused
            The loop has ended; so do all the calls above.
        """
        ...

    def close(self) -> None:
        """End the loop; closing twice is harmless."""
        ...


def control_for(clock: Clock, cycle: Callable[[], float]) -> Control:
    """The loop that suits a clock; `cycle` does the background work and returns the seconds to the next."""
    return InlineControl(clock, cycle) if isinstance(clock, VirtualClock) else ThreadedControl(clock, cycle)


class _Foreground:
    """The command in the foreground and who waits for it."""

    def __init__(self) -> None:
        self.steps: Steps[Any] | None = None
        self.future: Future[Any] = Future()

    def begin(self, steps: Steps[Any], future: Future[Any]) -> None:
        if self.steps is not None:
            steps.close()  # it has not begun
            future.set_exception(Refused(_BUSY))
            return
        self.steps, self.future = steps, future

    def advance(self) -> float:
        """Do one step; return the seconds to the next."""
        assert self.steps is not None  # noqa: S101 - only called with a command in the foreground
        try:
            return next(self.steps)
        except StopIteration as done:
            self._end().set_result(done.value)
        except BaseException as error:  # noqa: BLE001 - whoever waits for the command is told, whatever it is
            self._end().set_exception(error)
        return 0.0

    def abandon(self, reason: str) -> None:
        if self.steps is not None:
            steps = self.steps
            future = self._end()
            steps.close()
            future.set_exception(Refused(reason))

    def _end(self) -> Future[Any]:
        self.steps = None
        return self.future


class InlineControl:
    """The loop inside the calls, for a virtual clock."""

    def __init__(self, clock: Clock, cycle: Callable[[], float]) -> None:
        self._clock = clock
        self._cycle = cycle
        self._foreground = _Foreground()
        self._stepping = False
        self._closed = False
        self._due = clock.now()

    def call(self, work: Callable[[], T]) -> T:
        """Do `work` now."""
        self.require_open()
        return work()

    def perform(self, steps: Steps[T]) -> T:
        """Run `steps` to their end on the virtual clock."""
        self.require_open()
        future: Future[T] = Future()
        self._foreground.begin(steps, future)
        while not future.done():
            self._clock.sleep(self._advanced())
        self._due = self._clock.now()
        return future.result()

    def _advanced(self) -> float:
        self._stepping = True
        try:
            return self._foreground.advance()
        finally:
            self._stepping = False

    def interrupt(self, work: Callable[[], T], reason: str) -> T:
        """Do `work` now and end the foreground."""
        self.require_open()
        if self._stepping:
            work()
            raise Refused(reason)
        self._foreground.abandon(reason)
        return work()

    def let_pass(self, seconds: float) -> None:
        """Run the background cycle until `seconds` have passed."""
        self.require_open()
        end = self._clock.now() + seconds
        while self._due < end:
            self._clock.sleep(self._due - self._clock.now())
            began = self._clock.now()
            self._due = began + self._cycle()
        self._clock.sleep(end - self._clock.now())

    def require_open(self) -> None:
        """Refuse when closed."""
        if self._closed:
            raise Refused(_CLOSED)

    def close(self) -> None:
        """Nothing runs between calls, and nothing from now on."""
        self._closed = True


class ThreadedControl:
    """The loop in a thread of its own, for the system's clock.

    It waits by the computer's monotonic time, so that a step of the clock neither stops nor rushes it.
    """

    def __init__(self, clock: Clock, cycle: Callable[[], float]) -> None:
        self._clock = clock
        self._cycle = cycle
        self._foreground = _Foreground()
        self._urgent: deque[Callable[[], None]] = deque()
        self._calls: deque[Callable[[], None]] = deque()
        self._wake = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name="clockdrive control", daemon=True)
        self._thread.start()

    def call(self, work: Callable[[], T]) -> T:
        """Do `work` on the control thread, after the calls that came before."""
        if self._inside:
            return work()
        return self._queued(self._calls, work).result()

    def perform(self, steps: Steps[T]) -> T:
        """Run `steps` on the control thread to their end."""
        if self._inside:
            steps.close()
            raise Refused(_BUSY)
        future: Future[T] = Future()
        self.call(lambda: self._foreground.begin(steps, future))
        return future.result()

    def interrupt(self, work: Callable[[], T], reason: str) -> T:
        """Do `work` on the control thread before everything else, and end the foreground."""
        if self._inside:
            work()
            raise Refused(reason)

        def abandon_first() -> T:
            self._foreground.abandon(reason)
            return work()

        return self._queued(self._urgent, abandon_first).result()

    def let_pass(self, seconds: float) -> None:
        """Wait; the thread goes on meanwhile."""
        self.require_open()
        self._clock.sleep(seconds)

    def require_open(self) -> None:
        """Refuse when closed."""
        if self._closing:
            raise Refused(_CLOSED)

    def close(self) -> None:
        """End the thread after its present step."""
        with self._wake:
            self._closing = True
            self._wake.notify()
        if not self._inside:
            self._thread.join()

    @property
    def _inside(self) -> bool:
        return threading.current_thread() is self._thread

    def _queued(self, line: deque[Callable[[], None]], work: Callable[[], T]) -> Future[T]:
        future: Future[T] = Future()

        def done() -> None:
            try:
                future.set_result(work())
            except BaseException as error:  # noqa: BLE001 - the caller is told, whatever it is
                future.set_exception(error)

        with self._wake:
            if self._closing:
                raise Refused(_CLOSED)
            line.append(done)
            self._wake.notify()
        return future

    def _run(self) -> None:
        due = time.monotonic()
        called = False
        while True:
            work = self._next(due, overdue_first=called)
            called = work is not None
            if work is not None:
                work()
                due = min(due, time.monotonic()) if self._foreground.steps is not None else due
                continue
            if self._closing:
                self._foreground.abandon("the telescope was closed")
                return
            due = self._background() if self._foreground.steps is None else self._foreground_step()

    def _background(self) -> float:
        """Do one cycle; return when the next is due, counted from its beginning."""
        began = time.monotonic()
        try:
            return began + self._cycle()
        except Exception:  # noqa: BLE001 - the telescope must not lose its thread
            _LOG.exception("the background cycle failed")
            return began + _AFTER_A_FAULT_S

    def _foreground_step(self) -> float:
        """Do one step of the command; return when the next is due, counted from its end."""
        wait = self._foreground.advance()
        return time.monotonic() + wait

    def _next(self, due: float, *, overdue_first: bool) -> Callable[[], None] | None:
        """The next call, when one comes before `due`; with `overdue_first` none but an interruption after it."""
        with self._wake:
            while not (self._urgent or self._calls or self._closing):
                left = due - time.monotonic()
                if left <= 0.0:
                    return None
                self._wake.wait(left)
            if self._urgent:
                return self._urgent.popleft()
            if overdue_first and not self._closing and due <= time.monotonic():
                return None
            return self._calls.popleft() if self._calls else None
