"""What a person types: one reader of the standard input, whoever waits for a line.

A line goes to who asked last. A witness that was asked and has given up does not take the line that is meant for the
next question.
"""

import sys
import threading
from collections.abc import Callable, Mapping
from queue import SimpleQueue
from typing import Any

from clockdrive.cli.backend import Backend
from clockdrive.errors import InputError

WITNESSES = "simulator | command:PROGRAM | typed"
"""Of the sky, as the command line lists them."""


class StandardInput:
    """Reads lines, on a thread of its own where the command goes on meanwhile."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._reading = False
        self._taker: Callable[[str], object] = lambda line: None  # noqa: ARG005 - nobody waits yet

    def line(self) -> str:
        """The next line; empty at the end of the input."""
        with self._lock:
            if not self._reading:
                return sys.stdin.readline()
            lines: SimpleQueue[str] = SimpleQueue()
            self._taker = lines.put
        return lines.get()

    def hand(self, taker: Callable[[str], object]) -> None:
        """Hand the next line to somebody, instead of whom it was meant for so far."""
        with self._lock:
            self._taker = taker
            if not self._reading:
                self._reading = True
                threading.Thread(target=self._read, daemon=True).start()

    def asked(self, telescope: Backend, event: Mapping[str, Any]) -> bool:
        """Ask what an event asks and reply with the next line, or that there is none; False where it asks nothing."""
        if "ask" not in event:
            return False
        print(f"{event['ask']}: ", end="", file=sys.stderr, flush=True)
        self.hand(lambda line: telescope.call("reply", text=line or None))
        return True

    def _read(self) -> None:
        line = sys.stdin.readline()
        with self._lock:
            self._reading, taker = False, self._taker
        taker(line)


def refuse_typed_elsewhere(witness: str, telescope: Backend) -> None:
    """Refuse a witness who types here where another process would ask.

    Raises
    ------
    InputError
        So it is.
    """
    if witness == "typed" and telescope.attached:
        raise InputError("the witness `typed` needs this command to own the telescope; end the running owner first")
