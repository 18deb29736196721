"""The replies of an axis controller as a pure function of the bytes that came, however they were cut.

A reply is the echo of the command, then lines of data, then `OK`: alone on a line, or behind a blank at the end of
the last line, which may be the echo. Any run of CR and LF ends a line, blanks around it mean nothing, and what starts
with `ERR:` is the controller's reason for refusing. The line end behind `OK` ends the reply: without it `OK` may be
the beginning of a longer word. A line of data that itself ends in ` OK` would end the reply too early; what follows
it then belongs to no command, and the line is in doubt.
"""

import re
from dataclasses import dataclass, field

from mounts.apo.errors import MalformedReply

MAX_REPLY = 16_384  # bytes; the longest, HELP and MS.DUMP, have a few thousand
_LINE_END = re.compile(rb"[\r\n]+")
_OK = re.compile(r"(?:^|(?<=\s))OK$")
_ERROR = re.compile(r"(?:^|(?<=\s))ERR:(.*)$")


@dataclass(frozen=True)
class Reply:
    """One whole reply.

    Attributes
    ----------
    echo : str
        The command as the controller understood it; empty where not even that came before `OK`.
    lines : tuple of str
        The data, without blanks at the ends, without the error.
    error : str
        What stood behind `ERR:`; empty where the command was accepted.
    size : int
        Bytes that came for it, line ends included; what is compared is what it says, not this.
    """

    echo: str
    lines: tuple[str, ...] = ()
    error: str = ""
    size: int = field(default=0, compare=False)

    @property
    def ok(self) -> bool:
        """Whether the command was accepted."""
        return not self.error


class ReplyDecoder:
    """Finds the replies in a stream of bytes; holds at most one unfinished reply of `MAX_REPLY` bytes."""

    def __init__(self) -> None:
        self._tail = b""  # of the line under way
        self._lines: list[str] = []
        self._held = 0
        self._size = 0  # bytes of it with its line ends

    @property
    def begun(self) -> str:
        """What has come of a reply that has not ended; empty between replies."""
        return "\n".join((*self._lines, self._tail.decode("latin-1"))).strip()

    def feed(self, data: bytes) -> list[Reply]:
        """Take the next bytes; return the replies they complete, in order.

        Raises
        ------
        MalformedReply
            More came without an `OK` than any reply has; all of it is forgotten.
        """
        data, begin, replies = self._tail + data, 0, []
        for end in _LINE_END.finditer(data):
            self._size += end.end() - begin
            if reply := self._take(data[begin : end.start()].decode("latin-1").strip()):
                replies.append(reply)
            begin = end.end()
        self._tail = tail = data[begin:]
        if self._held + len(tail) > MAX_REPLY:
            self._tail = b""
            self._reset()
            raise MalformedReply(f"more than {MAX_REPLY} bytes came without an OK; check cable and baud rate")
        return replies

    def _take(self, line: str) -> Reply | None:
        """Take a whole line; return the reply that it ends."""
        ends = _OK.search(line)
        text = line[: ends.start()].rstrip() if ends else line
        if text:
            self._lines.append(text)
            self._held += len(text) + 1
        if not ends:
            return None
        reply = _reply(self._lines, self._size)
        self._reset()
        return reply

    def _reset(self) -> None:
        self._lines, self._held, self._size = [], 0, 0


def _reply(lines: list[str], size: int) -> Reply:
    """Return the reply of these lines; the first of several errors is the reason."""
    kept, errors = [], []
    for line in lines:
        error = _ERROR.search(line)
        if error:
            errors.append(error[1].strip() or "no reason given")
        if rest := (line[: error.start()].rstrip() if error else line):
            kept.append(rest)
    echo, *data = kept or [""]
    return Reply(echo, tuple(data), errors[0] if errors else "", size)
