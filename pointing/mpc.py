"""Orbital elements in the Minor Planet Center's one-line formats: asteroids as in MPCORB, comets as in CometEls.

Each format is a table of columns, counted from 1 as the Center documents them; what is asked of a body is read by the
table, and a field that is missing or impossible is refused with file, line and columns. Only the lines that a name
selects are read as elements, so that what is odd elsewhere in a catalogue does no harm. A line with something in the
columns that its format leaves blank, or too short for its numbers, is no line of elements and stands for no body. Of
a file with a header, as MPCORB has, the bodies begin after the line of dashes; blank lines and those that begin with
`#` are passed over.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.mpc_designations import key, packed_day, unpacked
from pointing.two_body import GAUSS, Orbit

_ORDINAL_MJD = 678576  # the ordinal of MJD 0 in Python's calendar
_FIRST_YEAR = 1583  # before, the Center's dates are of the Julian calendar
_RULE = re.compile(r"-{20,}")
_COMET = re.compile(r"[ \d]{4}[ACDIPX]")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)", re.ASCII)
_READABLE_COMET = re.compile(r"\s*(?P<designation>[^(/]*(?:/[^(]*)?)\s*(?:\((?P<name>.*)\))?\s*")
_SHOWN = 5
_UNREADABLE = "\N{REPLACEMENT CHARACTER}"


class Column(NamedTuple):
    """A numeric field: first and last column, counted from 1, and its allowed values."""

    name: str
    first: int
    last: int
    low: float
    high: float
    unit: str = ""


# https://minorplanetcenter.net/iau/info/MPOrbitFormat.html
_EPOCH = (21, 25)
_MEAN_ANOMALY = Column("mean anomaly", 27, 35, -360.0, 360.0, "°")
_ARGUMENT = Column("argument of perihelion", 38, 46, -360.0, 360.0, "°")
_NODE = Column("longitude of the node", 49, 57, -360.0, 360.0, "°")
_INCLINATION = Column("inclination", 60, 68, 0.0, 180.0, "°")
_ECCENTRICITY = Column("eccentricity", 71, 79, 0.0, 100.0)
_AXIS = Column("semimajor axis", 93, 103, -1e5, 1e5, " au")
_ASTEROID_NAME = (167, 194)
_ASTEROID_GAPS = (8, 14, 20, 26, 36, 37, 47, 48, 58, 59, 69, 70, 80, 92)
# https://minorplanetcenter.net/iau/info/CometOrbitFormat.html
_YEAR = Column("year of perihelion", 15, 18, _FIRST_YEAR, 9998)
_MONTH = Column("month of perihelion", 20, 21, 1, 12)
_DAY = Column("day of perihelion", 23, 29, 1, 31.9999999)
_DISTANCE = Column("perihelion distance", 31, 39, 1e-4, 1e3, " au")
_COMET_ECCENTRICITY = Column("eccentricity", 42, 49, 0.0, 100.0)
_COMET_ARGUMENT = Column("argument of perihelion", 52, 59, -360.0, 360.0, "°")
_COMET_NODE = Column("longitude of the node", 62, 69, -360.0, 360.0, "°")
_COMET_INCLINATION = Column("inclination", 72, 79, 0.0, 180.0, "°")
_COMET_EPOCH = (82, 89)
_EPOCH_YEAR = Column("year of epoch", 82, 85, _FIRST_YEAR, 9998)
_EPOCH_MONTH = Column("month of epoch", 86, 87, 1, 12)
_EPOCH_DAY = Column("day of epoch", 88, 89, 1, 31)
_COMET_NAME = (103, 158)
_COMET_GAPS = (13, 14, 19, 22, 30, 40, 41, 50, 51, 60, 61, 70, 71)


def _layout(gaps: tuple[int, ...], last: Column) -> re.Pattern[str]:
    """What every line begins with that has nothing in its gaps and reaches as far as its last number begins."""
    return re.compile("".join(" " if column in gaps else "." for column in range(1, last.first + 1)))


_LAYOUTS = (
    (_ASTEROID_GAPS, _AXIS, _layout(_ASTEROID_GAPS, _AXIS)),
    (_COMET_GAPS, _COMET_INCLINATION, _layout(_COMET_GAPS, _COMET_INCLINATION)),
)


@dataclass(frozen=True)
class Elements:
    """A body's osculating elements.

    Parameters
    ----------
    name : str
        As the file writes it: `(1) Ceres`, `C/1995 O1 (Hale-Bopp)`.
    orbit : Orbit
        Where it moves.
    epoch : Instant or None
        When the elements osculate; of some comets the file does not say.
    """

    name: str
    orbit: Orbit
    epoch: Instant | None


@dataclass(frozen=True)
class Line:
    """A line of a file of elements."""

    file: str
    number: int
    text: str

    @property
    def is_comet(self) -> bool:
        """Whether it is laid out as a comet's: number or four blanks, then the type of the orbit."""
        return _COMET.match(self.text) is not None

    @property
    def packed(self) -> str:
        """The packed number or designation."""
        return (self.text[:12] if self.is_comet else self.text[:7]).strip()

    @property
    def name(self) -> str:
        """The readable designation, or what the packed one stands for."""
        first, last = _COMET_NAME if self.is_comet else _ASTEROID_NAME
        return _printable(self.text[first - 1 : last].strip() or unpacked(self.packed))

    @property
    def oddity(self) -> TargetError | None:
        """Why this is no line of elements; None where it is one."""
        gaps, last, layout = _LAYOUTS[self.is_comet]
        if self.text.isprintable() and layout.match(self.text):
            return None
        for column, character in enumerate(self.text, 1):
            if not character.isprintable():
                return self._odd(column, f"the character U+{ord(character):04X} cannot stand there")
            if column in gaps and character != " ":
                return self._odd(column, f"{character!r} stands where the format has a blank")
        column = len(self.text) + 1
        return self._odd(column, f"the line ends before its {last.name}, columns {last.first}–{last.last}")

    def _odd(self, column: int, why: str) -> TargetError:
        where = f"{self.file}, line {self.number}, column {column}"
        return TargetError(f"{where}: no line of MPCORB or CometEls: {why}; check the file")

    def field(self, first: int, last: int, name: str) -> str:
        """Return what stands in columns, without blanks around it.

        Raises
        ------
        TargetError
            Nothing does.
        """
        found = self.text[first - 1 : last].strip()
        if not found:
            raise self.refused(first, last, f"no {name}; the body cannot be followed without it")
        return found

    def value(self, column: Column) -> float:
        """Return the number in a column.

        Raises
        ------
        TargetError
            It is missing, no number, or outside its bounds.
        """
        name, first, last, low, high, unit = column
        text = self.field(first, last, name)
        bounds = f"{low:.7g} to {high:.7g}{unit}".replace("-", "−")
        if not (_NUMBER.fullmatch(text) and low <= float(text) <= high):
            raise self.refused(first, last, f"{name} {text!r}: possible are numbers from {bounds}")
        return float(text)

    def angle(self, column: Column) -> float:
        """Return the number of degrees in a column, as radians."""
        return math.radians(self.value(column))

    def refused(self, first: int, last: int, why: str) -> TargetError:
        """Return the refusal of what stands in columns."""
        return TargetError(f"{self.file}, line {self.number}, columns {first}–{last}: {why}; check the file")


def read_elements(path: str | Path, name: str = "") -> Elements:
    """Read the elements of one body from a file of one-line elements.

    Parameters
    ----------
    path : str or Path
        A file in the Center's formats, asteroids and comets in any mixture.
    name : str
        Name, number or designation, packed or not, upper or lower case; of the only body of a file, nothing.

    Raises
    ------
    TargetError
        The file cannot be read, nothing or more than one body in it has that name, or its elements are missing or
        impossible.
    """
    wanted = key(name) or name.strip()  # what is all punctuation is nobody's name, and not no name
    found, others = [], []
    odd: TargetError | None = None
    for line in _bodies(path):
        oddity = line.oddity
        odd = odd or oddity
        if _is_called(line, wanted) if wanted else oddity is None:
            found.append(line)
        elif oddity is None:
            others.append(line.name)
    if len(found) == 1:
        return elements(found[0])
    file = Path(path).name
    if found:
        shown = ", ".join(line.name for line in found[:_SHOWN]) + (" …" if len(found) > _SHOWN else "")
        what = f"{len(found)} bodies called {name!r}" if wanted else f"{len(found)} bodies"
        raise TargetError(f"{file} holds {what}: {shown}; say which by mpc:{file}#DESIGNATION")
    if not others and odd is not None:
        raise odd
    if not others:
        raise TargetError(f"{file} holds no body: give a file of MPCORB or CometEls lines")
    raise TargetError(f"{file} has no body called {name!r}: {_advice(wanted, others)}")


def elements(line: Line) -> Elements:
    """Read the elements on a line.

    Raises
    ------
    TargetError
        A field is missing or impossible; the text gives file, line and columns.
    """
    found = _comet(line) if line.is_comet else _asteroid(line)
    if line.oddity is not None:
        raise line.oddity
    return found


def keys(line: Line) -> frozenset[str]:
    """Return everything that a body may be called by, in the form of `key`."""
    readable, packed = line.name, line.packed
    written = unpacked(packed)
    names = {readable, packed, written}
    if line.is_comet:
        names |= {packed[-7:], *_comet_names(readable), *_comet_names(written)}
    elif readable.startswith("("):
        number, _, name = readable[1:].partition(")")
        names |= {number, name}
    return frozenset(key(each) for each in names) - {""}


def _is_called(line: Line, wanted: str) -> bool:
    """Whether a body has a name, at the price of one `key` for nearly all asteroids of a catalogue."""
    readable = line.text[_ASTEROID_NAME[0] - 1 : _ASTEROID_NAME[1]]
    if readable.strip() and not line.is_comet and wanted not in key(line.text[:8] + readable):
        return False
    return wanted in keys(line)


def _comet_names(readable: str) -> Iterator[str]:
    """`C/1995 O1 (Hale-Bopp)` → C/1995 O1, 1995 O1, Hale-Bopp; `73P-B/Schwassmann-Wachmann` → 73P-B and the name."""
    match = _READABLE_COMET.fullmatch(readable)
    if match is None:
        return
    yield from (match["designation"], match["name"] or "")
    before, _, after = match["designation"].partition("/")
    yield after
    if len(before) > 1:
        yield before


def _asteroid(line: Line) -> Elements:
    packed = line.field(*_EPOCH, "epoch")
    day = packed_day(packed)
    if day is None:
        raise line.refused(*_EPOCH, f"epoch {packed!r} is no packed date such as K25BL, 2025 November 21")
    epoch = Instant(day, 0.0)
    e, axis = line.value(_ECCENTRICITY), line.value(_AXIS)
    q = axis * (1.0 - e)
    if q < _DISTANCE.low:
        why = f"semimajor axis {axis:g} au with eccentricity {e:g}: its sign is that of 1 − e, and e is not 1"
        raise line.refused(_AXIS.first, _AXIS.last, why)
    anomaly = line.angle(_MEAN_ANOMALY)
    if e < 1.0:
        anomaly = math.remainder(anomaly, math.tau)
    days = anomaly / GAUSS * abs(axis) ** 1.5
    orbit = _orbit(line, epoch.plus(-days * DAY), q, e, (_INCLINATION, _NODE, _ARGUMENT))
    return Elements(line.name, orbit, epoch)


def _comet(line: Line) -> Elements:
    month, day = _whole(line, _MONTH), line.value(_DAY)
    perihelion = Instant(_mjd(line, _whole(line, _YEAR), month, int(day), _DAY), (day - int(day)) * DAY)
    q, e = line.value(_DISTANCE), line.value(_COMET_ECCENTRICITY)
    orbit = _orbit(line, perihelion, q, e, (_COMET_INCLINATION, _COMET_NODE, _COMET_ARGUMENT))
    epoch = None
    if line.text[_COMET_EPOCH[0] - 1 : _COMET_EPOCH[1]].strip():
        when = [_whole(line, column) for column in (_EPOCH_YEAR, _EPOCH_MONTH, _EPOCH_DAY)]
        epoch = Instant(_mjd(line, when[0], when[1], when[2], _EPOCH_DAY), 0.0)
    return Elements(line.name, orbit, epoch)


def _orbit(line: Line, perihelion: Instant, q: float, e: float, angles: tuple[Column, Column, Column]) -> Orbit:
    inclination, node, argument = (line.angle(column) for column in angles)
    try:
        return Orbit(perihelion, q, e, inclination, node, argument)
    except TargetError as error:
        raise TargetError(f"{line.file}, line {line.number}: {error}") from None


def _whole(line: Line, column: Column) -> int:
    value = line.value(column)
    if value != int(value):
        raise line.refused(column.first, column.last, f"{column.name} {value:g} is no whole number")
    return int(value)


def _mjd(line: Line, year: int, month: int, day: int, column: Column) -> int:
    try:
        return date(year, month, day).toordinal() - _ORDINAL_MJD
    except ValueError:
        why = f"the calendar has no {year}-{month:02d}-{day:02d}"
        raise line.refused(column.first, column.last, why) from None


def _bodies(path: str | Path) -> Iterator[Line]:
    """Lines that stand for bodies."""
    file = Path(path).name
    ruled = any(_RULE.match(text) for _, text in _lines(path))
    for number, text in _lines(path):
        if ruled:
            ruled = not _RULE.match(text)
        elif text.strip() and not text.startswith("#"):
            yield Line(file, number, text)


def _lines(path: str | Path) -> Iterator[tuple[int, str]]:
    try:
        with Path(path).open(encoding="utf-8", errors="replace") as file:
            for number, text in enumerate(file, 1):
                yield number, text.rstrip("\r\n")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise TargetError(f"{str(path)!r} cannot be read ({why}): give a file of MPCORB or CometEls lines") from None


def _printable(text: str) -> str:
    """The text with a sign for what a terminal must not be sent."""
    return text if text.isprintable() else "".join(each if each.isprintable() else _UNREADABLE for each in text)


def _advice(wanted: str, names: list[str]) -> str:
    """Nearest names, of those that can be near: a name among names, a designation among those of its fortnight."""
    by_key: dict[str, str] = {}
    digits = any(character.isdigit() for character in wanted)
    for name in names:
        called = re.sub(r"^\(\d+\)\s*", "", name)
        for each in (called, *_comet_names(called)):
            if key(each) and (key(each)[:4] == wanted[:4] if digits else not key(each)[0].isdigit()):
                by_key.setdefault(key(each), name)
    near = dict.fromkeys(by_key[each] for each in get_close_matches(wanted, by_key, _SHOWN))
    if near:
        return f"did you mean {', or '.join(near)}?"
    return f"it holds {', '.join(names[:_SHOWN])}{' …' if len(names) > _SHOWN else ''}"
