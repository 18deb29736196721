"""Packed numbers, designations and dates of the Minor Planet Center, and what people write for them.

Rules: https://minorplanetcenter.net/iau/info/PackedDes.html, …/PackedDates.html. A packed text that keeps to none of
them stands for itself.
"""

import re
import string
from datetime import date

_BASE62 = string.digits + string.ascii_uppercase + string.ascii_lowercase
_CENTURIES = {"I": 1800, "J": 1900, "K": 2000, "L": 2100}
_HALF_MONTH_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ".replace("I", "")  # of the second letter of a designation
_ORDINAL_MJD = 678576  # the ordinal of MJD 0 in Python's calendar
_FIRST_EXTENDED = 620  # cycles; more do not fit into the older form
_FIRST_TILDE = 620_000  # numbers; likewise
_PROVISIONAL = re.compile(r"([IJK])(\d\d)([A-HJ-Y])([0-9A-Za-z])(\d)([A-HJ-Z])", re.ASCII)
_EXTENDED = re.compile(r"_([0-9A-Za-z])([A-HJ-Y])([0-9A-Za-z]{4})", re.ASCII)
_SURVEY = re.compile(r"(PL|T1|T2|T3)S(\d{4})", re.ASCII)
_NUMBER = re.compile(r"([0-9A-Za-z])(\d{4})", re.ASCII)
_LONG_NUMBER = re.compile(r"~([0-9A-Za-z]{4})", re.ASCII)
_COMET_NUMBER = re.compile(r"(\d{4})([PDIAX])\s*([a-z]{0,2})", re.ASCII)
_COMET = re.compile(r"([PCDXIA])?\s*([A-Za-z_~0-9]{7})", re.ASCII)
_COMET_PROVISIONAL = re.compile(r"([IJK])(\d\d)([A-HJ-Y])([0-9A-Za-z])(\d)([0a-z])", re.ASCII)
_DATE = re.compile(r"([IJKL])(\d\d)([1-9A-C])([1-9A-V])", re.ASCII)


class _Counting(dict[int, str]):
    """What becomes of a character in a `key`, found out when first met: a catalogue has a million names."""

    def __missing__(self, code: int) -> str:
        character = chr(code)
        self[code] = character if character.isalnum() or character in "~_" else ""
        return self[code]


_COUNTING = _Counting()


def key(name: str) -> str:
    """Reduce a name to what counts in a comparison: letters, digits and the signs that packed texts use."""
    return name.casefold().translate(_COUNTING)


def packed_day(text: str) -> int | None:
    """MJD of a packed date such as K25BL, 2025 November 21; None when it is none."""
    match = _DATE.fullmatch(text)
    if match is None:
        return None
    century, year, month, day = match.groups()
    try:
        found = date(_CENTURIES[century] + int(year), _BASE62.index(month), _BASE62.index(day))
    except ValueError:
        return None
    return found.toordinal() - _ORDINAL_MJD


def unpacked(packed: str) -> str:
    """Write a packed number or designation as people do: (1), 2007 TA418, 2040 P-L, 73P-B, C/1995 O1."""
    for form in (_number, _asteroid, _comet):
        found = form(packed)
        if found:
            return found
    return packed


def _number(packed: str) -> str:
    if match := _NUMBER.fullmatch(packed):
        return f"({_BASE62.index(match[1]) * 10_000 + int(match[2])})"
    if match := _LONG_NUMBER.fullmatch(packed):
        return f"({_FIRST_TILDE + _from_base62(match[1])})"
    return ""


def _asteroid(packed: str) -> str:
    if match := _PROVISIONAL.fullmatch(packed):
        century, year, half, tens, unit, letter = match.groups()
        cycle = _BASE62.index(tens) * 10 + int(unit)
        return f"{_CENTURIES[century] + int(year)} {half}{letter}{cycle or ''}"
    if match := _EXTENDED.fullmatch(packed):
        year, half, count = match.groups()
        cycle, letter_index = divmod(_from_base62(count), len(_HALF_MONTH_LETTERS))
        letter = _HALF_MONTH_LETTERS[letter_index]
        return f"{2000 + _BASE62.index(year)} {half}{letter}{_FIRST_EXTENDED + cycle}"
    if match := _SURVEY.fullmatch(packed):
        survey = match[1]
        return f"{match[2]} {survey[0]}-{survey[1]}"
    return ""


def _comet(packed: str) -> str:
    if match := _COMET_NUMBER.fullmatch(packed):
        number, kind, fragment = match.groups()
        return f"{int(number)}{kind}{_fragment(fragment)}"
    match = _COMET.fullmatch(packed)
    if match is None:
        return ""
    prefix = f"{match[1]}/" if match[1] else ""
    if provisional := _COMET_PROVISIONAL.fullmatch(match[2]):
        century, year, half, tens, unit, fragment = provisional.groups()
        count = _BASE62.index(tens) * 10 + int(unit)
        return f"{prefix}{_CENTURIES[century] + int(year)} {half}{count}{_fragment(fragment.strip('0'))}"
    designation = _asteroid(match[2])
    return prefix + designation if designation else ""


def _fragment(letters: str) -> str:
    return f"-{letters.upper()}" if letters else ""


def _from_base62(text: str) -> int:
    value = 0
    for digit in text:
        value = value * 62 + _BASE62.index(digit)
    return value
