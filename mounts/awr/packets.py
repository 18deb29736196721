"""Packets out of a stream: `:body`, CR LF and `#`, with whatever debug output stands between them.

Firmware before 0.72 leaves the `#` out, so a packet ends with its line, and the `#` behind it is passed over. A `:`
always begins a packet, blanks in one are typography. Any bytes are taken: what is no packet is kept as debug output.
"""

from collections import deque
from typing import NamedTuple

START, STOP = ord(":"), ord("#")
_CR, _LF, _BLANK = ord("\r"), ord("\n"), ord(" ")
_LONGEST = 16  # characters of a body; the longest that there is has 7
_DEBUG_LINES, _DEBUG_CHARACTERS = 50, 200


class Packet(NamedTuple):
    """One body, when its first byte came, and for how long bytes had come without a gap before it."""

    text: str
    time: float  # POSIX seconds at which its START was there
    behind_s: float = 0.0  # it may have waited so long for the line
    unheard_s: float = 0.0  # nobody had listened for so long when its first byte was found


class Packets:
    """Takes a stream apart.

    Parameters
    ----------
    byte_s : float
        Line time of a byte; 0 for a line that takes none.
    """

    def __init__(self, byte_s: float = 0.0) -> None:
        self.byte_s = byte_s
        self.debug: deque[str] = deque(maxlen=_DEBUG_LINES)
        """The last lines that were no packets."""
        self._body: bytearray | None = None
        self._begun = self._busy_since = self._last = float("-inf")
        self._behind = self._unheard = 0.0
        self._line = bytearray()
        self._may_stop = False

    def feed(self, data: bytes, time: float, unheard_s: float = 0.0) -> list[Packet]:
        """Take bytes, the last of which was there at POSIX `time`; return the packets that are whole.

        Where nobody listened for a while before, they may have come so much earlier, with no gap to those before.
        """
        found = []
        for i, byte in enumerate(data):
            at = time - (len(data) - 1 - i) * self.byte_s
            idle = self._body is None  # within a packet a gap means that the line was held up
            if idle and at - unheard_s - self._last > 1.5 * self.byte_s:
                self._busy_since = at
            self._last = at
            packet = self._take(byte, at, unheard_s)
            if packet is not None:
                found.append(packet)
        return found

    def _take(self, byte: int, at: float, unheard_s: float) -> Packet | None:
        if byte == START and self._body is not None and not self._body:
            return None  # it came twice
        if byte == START:
            self._give_up()
            self._body, self._begun, self._behind = bytearray(), at, max(0.0, at - self._busy_since)
            self._unheard = unheard_s
        elif self._body is None:
            if not (byte == STOP and self._may_stop):
                self._outside(byte)
            self._may_stop = False
        elif byte in (_LF, STOP):
            packet = Packet(self._body.decode("latin-1"), self._begun, self._behind, self._unheard)
            self._body, self._may_stop = None, byte == _LF
            return packet
        elif byte not in (_CR, _BLANK):
            self._body.append(byte)
            if len(self._body) > _LONGEST:
                self._give_up()
        return None

    def _give_up(self) -> None:
        """What looked like a packet is none."""
        if self._body is not None:
            body, self._body = self._body, None
            for byte in b":" + bytes(body):
                self._outside(byte)
        self._may_stop = False

    def _outside(self, byte: int) -> None:
        if byte in (_CR, _LF) or len(self._line) >= _DEBUG_CHARACTERS:
            if self._line:
                self.debug.append(self._line.decode("latin-1"))
            self._line.clear()
        if byte not in (_CR, _LF):
            self._line.append(byte)
