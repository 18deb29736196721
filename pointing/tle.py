"""Two-line element sets: the satellites of a file, and one of them by its name or catalogue number.

A set is two lines of 69 columns, with or without a line before them that names the satellite (which may begin with
`0 `); blank lines and lines that begin with # do not count. Every column is held against the table below and every
checksum against its line, so that a damaged line never becomes an orbit. What is refused is told with file, line and
column.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import InitVar, dataclass
from datetime import date
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from pointing.errors import TargetError
from pointing.instant import DAY, Instant

_COLUMNS = 69
_MOST_BYTES = 64_000_000  # all that is in orbit is 6 MB
_SHOWN = 8
_ORDINAL_MJD = 678576  # the ordinal of MJD 0 in Python's calendar
_ELEMENT_LINE = re.compile(r"[12] ( *\d|[A-HJ-NP-Z]\d)", re.ASCII)
_NUMBER = r" *\d+|[A-HJ-NP-Z]\d{4}"  # from 100000 on the first digit is a letter without I and O ("Alpha-5")
_POWER = r"[ +-][ \d]{5}[ +-]\d"  # a decimal point before the digits, then the power of ten
_GIVE = "give a file with two-line elements"
_FROM_THE_SOURCE = "take the file from its source again"


class _Field(NamedTuple):
    """What stands in columns `first` to `last`, counted from 1; a number from `low` to `high` if these are given."""

    what: str
    first: int
    last: int
    pattern: str
    low: float | None = None
    high: float | None = None


def _blanks(*columns: int) -> tuple[_Field, ...]:
    return tuple(_Field("the gap", column, column, " ") for column in columns)


_FIELDS: dict[str, tuple[_Field, ...]] = {
    "1": (
        *_blanks(2, 9, 18, 33, 44, 53, 62, 64),
        _Field("the catalogue number", 3, 7, _NUMBER),
        _Field("the classification", 8, 8, "[A-Z ]"),
        _Field("the international designator", 10, 17, "[ -~]+"),
        _Field("the year of the epoch", 19, 20, r"[ \d]\d"),
        _Field("the day of the epoch", 21, 32, r" *\d+\.\d+", 1.0, 367.0),
        _Field("the first derivative of the mean motion", 34, 43, r"[ +-][ \d]?\.\d+"),
        _Field("the second derivative of the mean motion", 45, 52, _POWER),
        _Field("B*", 54, 61, _POWER),
        _Field("the kind of the elements", 63, 63, r"[ \d]"),
        _Field("the number of the set", 65, 68, r" *\d*"),
        _Field("the checksum", 69, 69, r"\d"),
    ),
    "2": (
        *_blanks(2, 8, 17, 26, 34, 43, 52),
        _Field("the catalogue number", 3, 7, _NUMBER),
        _Field("the inclination", 9, 16, r" *\d+\.\d+", 0.0, 180.0),
        _Field("the right ascension of the node", 18, 25, r" *\d+\.\d+", 0.0, 360.0),
        _Field("the eccentricity", 27, 33, r"\d+"),
        _Field("the argument of the perigee", 35, 42, r" *\d+\.\d+", 0.0, 360.0),
        _Field("the mean anomaly", 44, 51, r" *\d+\.\d+", 0.0, 360.0),
        _Field("the mean motion", 53, 63, r" *\d+\.\d+", 1e-8, 20.0),
        _Field("the revolution", 64, 68, r" *\d*"),
        _Field("the checksum", 69, 69, r"\d"),
    ),
}


@dataclass(frozen=True)
class Tle:
    """One element set, every column verified.

    Parameters
    ----------
    line1, line2 : str
        69 columns each.
    name : str
        What people call the satellite; by default its catalogue number.
    places : tuple of str
        What to call the two lines in errors.

    Raises
    ------
    TargetError
        A line is damaged; the text names line and columns.
    """

    line1: str
    line2: str
    name: str = ""
    places: InitVar[tuple[str, str]] = ("line 1 of the elements", "line 2 of the elements")

    def __post_init__(self, places: tuple[str, str]) -> None:
        _verify("1", self.line1, places[0])
        _verify("2", self.line2, places[1])
        one, two = self.line1[2:7].strip(), self.line2[2:7].strip()
        if one != two:
            raise TargetError(f"{places[1]}, columns 3 to 7: satellite {two} after one of {one}; {_FROM_THE_SOURCE}")
        object.__setattr__(self, "name", self.name.strip() or self.number)

    @property
    def number(self) -> str:
        """The catalogue number as it is written, without leading zeros."""
        return self.line1[2:7].strip().lstrip("0") or "0"

    @cached_property
    def epoch(self) -> Instant:
        """The moment that the elements are of; years from 57 on are of the twentieth century."""
        year = int(self.line1[18:20])
        whole, fraction = self.line1[20:32].split(".")
        new_year = date(year + (1900 if year >= 57 else 2000), 1, 1).toordinal() - _ORDINAL_MJD
        return Instant.from_utc(new_year + int(whole) - 1, float(f"0.{fraction}") * DAY)

    @property
    def revolutions_a_day(self) -> float:
        """The mean motion."""
        return float(self.line2[52:63])

    def __str__(self) -> str:
        number = "" if self.name == self.number else f"{self.number}, "
        return f"{self.name} ({number}of {self.epoch.utc_iso(0)})"


def read_tle(path: Path) -> tuple[Tle, ...]:
    """Read the element sets of a file, in its order; sets that stand in it twice are read once.

    Raises
    ------
    TargetError
        The file cannot be read, is of another kind, or is damaged; the text names file, line and columns.
    """
    sets = tuple(dict.fromkeys(_sets(_text(path), f"TLE file {path}")))
    if not sets:
        raise TargetError(f"TLE file {path} holds no element set: {_GIVE}")
    return sets


def choose(sets: Sequence[Tle], wanted: str, where: str) -> Tle:
    """Return the set of a satellite by its name, capitals or not, or its catalogue number.

    Parameters
    ----------
    sets : sequence of Tle
        Where to look.
    wanted : str
        Name or number; empty for the only one there is.
    where : str
        What the sets are of, for people.

    Raises
    ------
    TargetError
        None, or more than one: with those that are near, or all that match.
    """
    key = wanted.strip().casefold()
    found = [each for each in sets if key in {"", each.name.casefold(), each.number.casefold()} or _same(key, each)]
    if len(found) == 1:
        return found[0]
    if not key:
        raise TargetError(f"{where} has {len(sets)} satellites: add #NAME or #NUMBER, such as {_listed(sets)}")
    if found:
        raise TargetError(f"{where} has {len(found)} sets for {wanted.strip()!r}: {_listed(found)}; leave one in it")
    raise TargetError(f"{where} has no satellite {wanted.strip()!r}: {_advice(sets, key)}")


def _same(key: str, elements: Tle) -> bool:
    """Whether a key is the catalogue number with leading zeros."""
    return key.isascii() and key.isdigit() and key.lstrip("0") == elements.number


def _advice(sets: Sequence[Tle], key: str) -> str:
    names = {each.name.casefold(): each for each in sets}
    near = [names[name] for name in names if key in name]
    near += [names[name] for name in get_close_matches(key, names, 3) if names[name] not in near]
    return f"did you mean {_listed(near)}?" if near else f"it has {_listed(sets)}"


def _listed(sets: Sequence[Tle]) -> str:
    more = f" and {len(sets) - _SHOWN} more" if len(sets) > _SHOWN else ""
    return ", ".join(str(each) for each in sets[:_SHOWN]) + more


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise TargetError(f"TLE file {path}: it is a folder; give a file in it")
        if not path.is_file():
            raise TargetError(f"TLE file {path}: there is no such file; check the path")
        if path.stat().st_size > _MOST_BYTES:
            raise TargetError(
                f"TLE file {path} has {path.stat().st_size} bytes, over {_MOST_BYTES}: it is no TLE file"
            )
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise TargetError(f"TLE file {path} cannot be read: {error.strerror}; check its permissions") from None
    except ValueError:  # of which that the bytes are no UTF-8 is one
        raise TargetError(f"TLE file {path} is no text: {_GIVE}") from None


def _sets(text: str, source: str) -> Iterator[Tle]:
    """Every set of a text; `source` is for the errors."""
    name = first = place = ""
    for number, raw in enumerate(text.split("\n"), 1):
        line = raw.rstrip()
        if not line or line.startswith("#"):
            continue
        before, place = place, f"{source}, line {number}"
        kind = line[0] if _ELEMENT_LINE.match(line) else "name"
        if kind not in _due(name, first):
            raise TargetError(f"{place}, {_short(line)}: {_expected(name, first)}; {_GIVE}")
        if kind == "2":
            yield Tle(first, line, name, (before, place))
            name = first = ""
        elif kind == "1":
            first = line
        else:
            name = _named(line, place)
    if name or first:
        raise TargetError(f"{place}: the file ends here, and {_expected(name, first)}; {_FROM_THE_SOURCE}")


def _due(name: str, first: str) -> tuple[str, ...]:
    """Which kinds of line may come next."""
    if first:
        return ("2",)
    return ("1",) if name else ("1", "name")


def _expected(name: str, first: str) -> str:
    if first:
        return f"line 2 of satellite {first[2:7].strip()} was due"
    return f"line 1 of {name!r} was due" if name else "line 1 of a satellite was due"


def _named(line: str, place: str) -> str:
    name = line.removeprefix("0 ").strip()
    if not name.isprintable() or len(name) > _COLUMNS:
        raise TargetError(
            f"{place}, {_short(line)}, is neither a name nor elements: give a file with two-line elements"
        )
    return name


def _verify(kind: str, line: str, where: str) -> None:
    """Refuse a damaged line."""
    if len(line) < _COLUMNS:
        raise TargetError(f"{where} ends in column {len(line)}; elements have {_COLUMNS} columns: {_FROM_THE_SOURCE}")
    if len(line) > _COLUMNS:
        raise TargetError(f"{where} goes on behind column {_COLUMNS}: {_short(line[_COLUMNS:])}; {_FROM_THE_SOURCE}")
    if line[0] != kind:
        raise TargetError(f"{where} begins with {line[0]!r}, not with {kind}: give the two lines in their order")
    for field in _FIELDS[kind]:
        _verify_field(field, line[field.first - 1 : field.last], where)
    checksum = sum(int(c) if c.isdigit() else c == "-" for c in line[: _COLUMNS - 1]) % 10
    if int(line[-1]) != checksum:
        raise TargetError(
            f"{where}, column {_COLUMNS}: checksum {line[-1]}, but the line adds up to {checksum}: {_FROM_THE_SOURCE}"
        )


def _verify_field(field: _Field, text: str, where: str) -> None:
    place = f"column {field.first}" if field.first == field.last else f"columns {field.first} to {field.last}"
    if not re.fullmatch(field.pattern, text, re.ASCII):
        raise TargetError(f"{where}, {place}: {text!r} is not {field.what}; {_FROM_THE_SOURCE}")
    if field.low is not None and field.high is not None and not field.low <= float(text) <= field.high:
        raise TargetError(
            f"{where}, {place}: {field.what} is {float(text):g}, possible are {field.low:g} to {field.high:g};"
            f" {_FROM_THE_SOURCE}"
        )


def _short(line: str) -> str:
    return repr(line if len(line) <= 40 else f"{line[:39]}…")
