"""The lines of the field's plain text files, and the numbers in them.

Files come from many hands: UTF-8 with or without a byte-order mark, Latin-1, lines ended in any way or not at all, a
Ctrl-Z at the end, tabs, columns run together where a sign parts them (`-29.39-35.19`). What cannot be read is refused
with file, line, column and the text itself.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from pointing.errors import PointingError

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?(?=[\s,+-]|$)", re.ASCII)
_BLANK = re.compile(r"[\s,]*")
_LINE_END = re.compile(r"\r\n?|\n")
_SHOWN = 40


@dataclass(frozen=True)
class Number:
    """A number as it stands: its text keeps the sign of −0."""

    text: str
    column: int

    @property
    def value(self) -> float:
        """What it says."""
        return float(self.text.translate(_EXPONENT))

    @property
    def negative(self) -> bool:
        """Whether a minus stands before it."""
        return self.text.startswith("-")


_EXPONENT = str.maketrans("dD", "ee")


@dataclass(frozen=True)
class Record:
    """A line, or several joined by continuation: the file's name, the line's number from 1, its text."""

    file: str
    line: int
    text: str

    def refuse(self, why: str, column: int = 1, text: str | None = None) -> NoReturn:
        """Raise `PointingError` with the place and the text found there."""
        found = self.text[column - 1 :] if text is None else text
        shown = found if len(found) <= _SHOWN else found[:_SHOWN] + "…"
        raise PointingError(f"{self.file}, line {self.line}, column {column}: {shown!r}: {why}")

    def numbers(self, wanted: str, start: int = 0, end: int | None = None) -> list[Number]:
        """Read all of a stretch of the text as numbers.

        Raises
        ------
        PointingError
            Something else stands there, or a number is too large for a float.
        """
        stop = len(self.text) if end is None else end
        found: list[Number] = []
        at = self._skip(start, stop)
        while at < stop:
            match = _NUMBER.match(self.text, at, stop)
            if match is None:
                self.refuse(f"no number; wanted are {wanted}", at + 1)
            number = Number(match.group(), at + 1)
            if not math.isfinite(number.value):
                self.refuse("too large a number", number.column, number.text)
            found.append(number)
            at = self._skip(match.end(), stop)
        return found

    def _skip(self, at: int, stop: int) -> int:
        blank = _BLANK.match(self.text, at, stop)
        return blank.end() if blank else at


def read_lines(path: str | Path) -> list[Record]:
    """Read a file's lines, blank ones included.

    Raises
    ------
    PointingError
        It cannot be read, or is no text.
    """
    file = Path(path)
    try:
        raw = file.read_bytes()
    except OSError as error:
        raise PointingError(f"{str(file)!r} cannot be read ({error.strerror}): give a text file") from None
    except ValueError as error:
        raise PointingError(f"{str(file)!r} cannot be read ({error}): give a text file") from None
    if b"\0" in raw:
        raise PointingError(f"{file.name} is no text: byte {raw.index(0) + 1} is zero; give a text file")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    lines = _LINE_END.split(text.rstrip("\x1a"))
    return [Record(file.name, number, line) for number, line in enumerate(lines, 1)]


def write_lines(path: str | Path, lines: list[str]) -> None:
    """Write lines as UTF-8, the same on every platform.

    Raises
    ------
    PointingError
        The file cannot be written.
    """
    try:
        Path(path).write_text("\n".join([*lines, ""]), encoding="utf-8", newline="\n")
    except OSError as error:
        raise PointingError(f"{str(path)!r} cannot be written ({error.strerror}): give another path") from None


def sexagesimal(record: Record, parts: list[Number], largest: float, what: str) -> float:
    """Read units, minutes and perhaps seconds into units; a minus before the first part holds for all, −0 too.

    Raises
    ------
    PointingError
        Minutes or seconds are no such, or the whole exceeds `largest`.
    """
    for part in parts[1:]:
        # Exporters round 59.9996 to 60.000.
        if part.text[0] in "+-" or part.value > 60.0:
            record.refuse(f"{what}: minutes and seconds are 0 to 60 without a sign", part.column, part.text)
    for part in parts[:-1]:
        if "." in part.text and part.value % 1.0:
            record.refuse(f"{what}: only the last part has a fraction", part.column, part.text)
    size = sum(abs(part.value) / 60.0**power for power, part in enumerate(parts))
    if size > largest:
        record.refuse(f"{what}: {size:.6g}; possible is up to {largest:g}", parts[0].column, parts[0].text)
    return math.copysign(size, -1.0 if parts[0].negative else 1.0)
