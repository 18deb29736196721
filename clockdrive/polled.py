"""A question that may take long, asked on a thread of its own, so that whoever wants the answer never waits.

The answer that is there is given at once; when it has become old, it is asked again meanwhile. Time comes from the
caller. The question is never asked twice at once: one that hangs is seen by `waiting_s`.
"""

import math
import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
Start = Callable[[Callable[[], None]], None]


def on_a_thread(work: Callable[[], None]) -> None:
    """Begin `work` on a daemon thread."""
    threading.Thread(target=work, name="polled", daemon=True).start()


def at_once(work: Callable[[], None]) -> None:
    """Do `work` in the call: for a virtual clock, where nobody waits."""
    work()


class Polled(Generic[T]):
    """The last answer to a question.

    Parameters
    ----------
    ask : callable
        Answers, given the time of asking; raises nothing.
    every_s : float
        An answer older than that is asked again.
    start : callable
        Begins the asking: `on_a_thread` or `at_once`.
    """

    def __init__(self, ask: Callable[[float], T], every_s: float, start: Start = on_a_thread) -> None:
        self._ask = ask
        self._every_s = every_s
        self._start = start
        self._lock = threading.Lock()
        self._idle = threading.Event()
        self._idle.set()
        self._asked = -math.inf
        self._answer: T | None = None

    def at(self, now: float) -> T | None:
        """The last answer, None before the first; begins to ask when it is old. Never waits for the answer."""
        # A clock that was set back must not keep an answer for ever.
        if not 0.0 <= now - self._asked < self._every_s:
            self._begin(now)
        return self._answer

    def fresh(self, now: float, within_s: float) -> T | None:
        """Ask now and wait for the answer, at most `within_s` of real time; the last answer if none came."""
        self._begin(now)
        self._idle.wait(within_s)
        return self._answer

    def waiting_s(self, now: float) -> float:
        """For how long an answer has been waited for; 0 when none is."""
        return 0.0 if self._idle.is_set() else max(0.0, now - self._asked)

    def _begin(self, now: float) -> None:
        with self._lock:
            if not self._idle.is_set():
                return
            self._idle.clear()
            self._asked = now

        def work() -> None:
            try:
                self._answer = self._ask(now)
            finally:
                self._idle.set()

        try:
            self._start(work)
        except RuntimeError:  # no further thread can be made, or the interpreter is ending
            self._idle.set()
