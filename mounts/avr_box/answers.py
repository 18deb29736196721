"""The answers of the box: two signed numbers of five digits, parted by a tab, ended by a carriage return.

Total on any bytes: what is no answer is passed over up to the next carriage return.
"""

import re
from typing import NamedTuple

LENGTH = 14
MOST_COUNTS = 99_999
"""That five digits can say."""
_FORM = re.compile(rb"([+-]\d{5})\t([+-]\d{5})\r")
_MOST_HELD = 256


class Pair(NamedTuple):
    """The two numbers of an answer."""

    one: int
    two: int

    @property
    def text(self) -> bytes:
        """As the box sends it."""
        return b"%+06d\t%+06d\r" % self


class AnswerDecoder:
    """Bytes in, pairs out."""

    def __init__(self) -> None:
        self._held = b""

    def feed(self, data: bytes) -> list[Pair]:
        """Take what has come; return the answers that it completes."""
        *lines, self._held = (self._held + data).split(b"\r")
        self._held = self._held[-_MOST_HELD:]
        found = (_FORM.fullmatch(line + b"\r") for line in lines)
        return [Pair(int(each[1]), int(each[2])) for each in found if each is not None]
