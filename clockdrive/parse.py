"""What people type: targets, moments, durations, counts.

A target is all words of a command line that are no options. Coordinates are recognised by their characters, prefixed
forms by their prefix; all else is a name. Right ascension counts in hours where it is written with colons, blanks or
`h`, in degrees with `d` and in the form `83.633,22.0145`. A minus sign may be a hyphen or U+2212.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from clockdrive.errors import InputError, TargetFormError
from pointing import catalogue
from pointing.targets import FixedAltAz, FixedHaDec, Star, Target

MAX_DURATION_S = 366 * 86400.0
_SHOWN = 60
_FORMS = (
    "give a name, 05:34:31.9 +22:00:52, 83.633,22.0145 in degrees, altaz:AZ,ALT, hadec:H,D, tle:FILE#NAME, "
    "mpc:FILE#NAME, ephem:FILE, or best"
)
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
_PAIR = re.compile(rf"\s*({_NUMBER})\s*,\s*({_NUMBER})\s*", re.ASCII)
_PREFIXED = re.compile(r"\s*([A-Za-z]+)\s*:(.*)", re.ASCII | re.DOTALL)
_COORDINATES = re.compile(r"[+-]?[\d.][\d.+\-:hdms°'\"′″,\s]*", re.ASCII | re.IGNORECASE)
_ANGLE = re.compile(
    r"""\s*(?P<sign>[+-]?)\s*
    (?P<first>\d+\.?\d*)  (?:\s*(?P<unit>[:hd°])\s*|\s+|\s*$)
    (?:(?P<minutes>\d+\.?\d*)  (?:\s*[:m'′]\s*|\s+|\s*$)
    (?:(?P<seconds>\d+\.?\d*|\.\d+)  \s*(?:s|"|″|'')?\s*)?)?""",
    re.VERBOSE | re.ASCII | re.IGNORECASE,
)
_DURATION = re.compile(
    r"(?:(?P<h>\d+\.?\d*)\s*h)?\s*(?:(?P<m>\d+\.?\d*)\s*m(?:in)?)?\s*(?:(?P<s>\d+\.?\d*|\.\d+)\s*s?)?",
    re.ASCII | re.IGNORECASE,
)


@dataclass(frozen=True)
class Sources:
    """The files from which targets come, as configured.

    Parameters
    ----------
    kernel : Path, optional
        JPL's ephemeris of the solar system; by default the bundled one.
    """

    kernel: Path | None = None


@dataclass(frozen=True)
class Best:
    """The best-placed bright object, whichever that is at the time."""

    name: str = "best"


_BUNDLED = Sources()


def target(words: str | Sequence[str], sources: Sources = _BUNDLED) -> Target | Best:
    """What to point at.

    Parameters
    ----------
    words : str or sequence of str
        As typed, split anywhere between words.
    sources : Sources, optional
        Files from which targets come; the bundled ones by default.

    Raises
    ------
    TargetError
        It is no target; the text says what is wrong with it. `TargetFormError` where it is not written as one.
    """
    text = " ".join([words] if isinstance(words, str) else words).replace("−", "-").strip()
    if not text:
        raise TargetFormError(f"no target: {_FORMS}")
    if text.casefold() == "best":
        return Best()
    if prefix(text):
        return _PREFIXES[prefix(text)](text, text.partition(":")[2])
    pair = _PAIR.fullmatch(text)
    if pair:
        ra = _within("right ascension", float(pair[1]), 0.0, 360.0)
        return Star.from_degrees(ra, _within("declination", float(pair[2]), -90.0, 90.0), text)
    if _COORDINATES.fullmatch(text):
        return _sexagesimal(text)
    return catalogue.find(text, sources.kernel)


def place(text: str) -> Star:
    """Where an image is on the sky: right ascension and declination in any form of a target, or two plain degrees.

    Raises
    ------
    TargetFormError
        It is no such place.
    """
    numbers = text.replace("−", "-").replace(",", " ").split()
    degrees = len(numbers) == 2 and all(re.fullmatch(_NUMBER, number, re.ASCII) for number in numbers)
    found = target(",".join(numbers) if degrees else text)
    if not isinstance(found, Star):
        raise TargetFormError(
            f"{_short(text)} is no place of an image: give right ascension and declination, ICRS, as 83.633 22.0145 "
            "in degrees or 05:34:31.9 +22:00:52"
        )
    return found


def prefix(text: str) -> str:
    """What a target begins with, in small letters, if that says what it is: altaz, tle and so on; else nothing."""
    prefixed = _PREFIXED.fullmatch(text)
    return prefixed[1].lower() if prefixed and prefixed[1].lower() in _PREFIXES else ""


def anchored(text: str, folder: Path) -> str:
    """A target whose file, if it is of one, is named from the root: another process may stand in another folder."""
    kind = prefix(text)
    if kind not in _OF_FILES:
        return text
    rest = text.partition(":")[2].strip()
    if kind == "ephem":
        return f"{kind}:{folder / _home(rest)}" if rest else text
    file, mark, wanted = _split(rest, folder)
    return f"{kind}:{folder / file}{mark}{wanted}" if file else text


def _sexagesimal(text: str) -> Star:
    first, second = _halves(text)
    ra, unit = _angle(text, first, "right ascension")
    hours = unit != "d"
    _within("right ascension", ra, 0.0, 24.0 if hours else 360.0, "h" if hours else "°")
    dec, unit = _angle(text, second, "declination")
    if unit == "h":
        raise TargetFormError(
            f"{_short(text)}: a declination is in degrees, not in hours; write 5h34m31.9s +22d00m52s"
        )
    return Star.from_degrees(ra * 15.0 if hours else ra, _within("declination", dec, -90.0, 90.0), text)


def _halves(text: str) -> tuple[str, str]:
    """Right ascension and declination: at the only gap, at the sign of the declination, or in the middle."""
    words = [word for word in re.split(r"[\s,]+", text) if word]
    signed = [i for i, word in enumerate(words) if i and word[0] in "+-"]
    joined = re.fullmatch(r"(.*[\d.hms\"″'′])([+-].*)", words[0], re.IGNORECASE) if len(words) == 1 else None
    if joined:
        return joined[1], joined[2]
    split = signed[0] if len(signed) == 1 else len(words) // 2
    if len(words) < 2 or len(signed) > 1 or (not signed and len(words) % 2):
        raise TargetFormError(f"{_short(text)} is no right ascension with a declination: {_FORMS}")
    return " ".join(words[:split]), " ".join(words[split:])


def _angle(text: str, half: str, what: str) -> tuple[float, str]:
    """The angle in its own unit, and that unit when it is written: h or d."""
    match = _ANGLE.fullmatch(half)
    if match is None or match["minutes"] is None or any("." in (match[n] or "") for n in _inner(match)):
        advice = "write 05:34:31.9 +22:00:52, or degrees as 83.633,22.0145"
        raise TargetFormError(f"{_short(text)}: {what} {_short(half)} is no hours or degrees with minutes; {advice}")
    minutes, seconds = float(match["minutes"]), float(match["seconds"] or 0.0)
    for name, value in (("minutes", minutes), ("seconds", seconds)):
        if value >= 60.0:
            raise TargetFormError(f"{what} {_short(half)}: {value:g} {name}; they are below 60: check the target")
    value = float(match["first"]) + minutes / 60.0 + seconds / 3600.0
    unit = {"h": "h", "d": "d", "°": "d"}.get((match["unit"] or "").lower(), "")
    return -value if match["sign"] == "-" else value, unit


def _inner(match: re.Match[str]) -> tuple[str, ...]:
    """Fields before the last, which are whole."""
    return ("first", "minutes") if match["seconds"] else ("first",)


def _fixed(
    name: str, make: Callable[[float, float, str], Target], first: str, second: str
) -> Callable[[str, str], Target]:
    def parse(text: str, rest: str) -> Target:
        pair = _PAIR.fullmatch(rest)
        if pair is None:
            raise TargetFormError(
                f"{_short(text)}: write {name}:{first.upper()},{second.upper()} in degrees, such as {name}:30,45"
            )
        one = _within(first, float(pair[1]), -360.0, 360.0)
        two = _within(second, float(pair[2]), -90.0, 90.0)
        return make(math.radians(one), math.radians(two), text)

    return parse


def _satellite(text: str, rest: str) -> Target:
    from pointing.satellite import Satellite  # noqa: PLC0415 - only its users pay

    file, wanted = _file(text, rest)
    return Satellite.read(Path(file), wanted)


def _minor_body(text: str, rest: str) -> Target:
    from pointing.minor_body import MinorBody  # noqa: PLC0415 - what points at stars starts without

    file, name = _file(text, rest)
    return MinorBody.from_file(file, name)


def _table(text: str, rest: str) -> Target:
    from pointing.ephemeris_table import EphemerisTable  # noqa: PLC0415 - as above

    if not rest.strip():
        raise TargetFormError(f"{_short(text)}: write ephem:FILE, an ECSV table")
    return EphemerisTable.from_file(_home(rest.strip()))


def _file(text: str, rest: str) -> tuple[str, str]:
    """FILE and NAME of FILE#NAME; a file of one body needs no name."""
    file, _, name = _split(rest, Path())
    if not file:
        raise TargetFormError(f"{_short(text)}: write {text.partition(':')[0].strip()}:FILE#NAME")
    return file, name


def _split(rest: str, folder: Path) -> tuple[str, str, str]:
    """FILE, # and NAME of FILE#NAME: the longest file that there is, for its name may contain # itself."""
    marks = [match.start() for match in re.finditer("#", rest)]
    for end in (len(rest), *reversed(marks)):
        file = _home(rest[:end].strip())
        if file and _is_file(folder / file):
            return file, rest[end : end + 1], rest[end + 1 :].strip()
    file, mark, name = rest.partition("#")
    return _home(file.strip()), mark, name.strip()


def _home(file: str) -> str:
    """The path with a person's home in place of ~, which a shell leaves alone behind `tle:`."""
    try:
        return str(Path(file).expanduser()) if file.startswith("~") else file
    except RuntimeError:  # nobody knows that home
        return file


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # the name is too long for one, or contains what no name can
        return False


_OF_FILES = frozenset({"tle", "mpc", "ephem"})
_PREFIXES: dict[str, Callable[[str, str], Target]] = {
    "altaz": _fixed("altaz", FixedAltAz, "azimuth", "altitude"),
    "hadec": _fixed("hadec", FixedHaDec, "hour angle", "declination"),
    "tle": _satellite,
    "mpc": _minor_body,
    "ephem": _table,
}


def _within(what: str, value: float, low: float, high: float, unit: str = "°") -> float:
    if not low <= value <= high:
        bounds = f"{low:g} to {high:g}".replace("-", "−")
        raise TargetFormError(f"{what} {value:.10g}{unit}: allowed are {bounds}{unit}; check the target")
    return value


def _short(text: str) -> str:
    return repr(text if len(text) <= _SHOWN else f"{text[: _SHOWN - 1]}…")


def utc(text: str, now: float) -> float:
    """POSIX seconds of a moment such as `2026-11-22T03:04:05Z`, with or without the Z, or `now`.

    Raises
    ------
    InputError
        It is no such moment.
    """
    if text.strip().casefold() == "now":
        return now
    try:
        moment = datetime.fromisoformat(text.strip())
        return (moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment).timestamp()
    except (ValueError, OverflowError):
        advice = "write 2026-11-22T03:04:05Z or now"
        raise InputError(f"{_short(text)} is no moment in UTC that the calendar has: {advice}") from None


def rate(text: str) -> tuple[float, float]:
    """Rates of one's own from `EAST,NORTH`, arcseconds a second.

    Raises
    ------
    InputError
        They are not two numbers.
    """
    pair = _PAIR.fullmatch(text.replace("−", "-"))
    if pair is None:
        raise InputError(f"{_short(text)} is not EAST,NORTH, two numbers in arcseconds a second: write 0.5,-0.25")
    return float(pair[1]), float(pair[2])


def duration(text: str) -> float:
    """Seconds of a duration such as `90`, `30s`, `2m`, `1h` or `1h30m`.

    Raises
    ------
    InputError
        It is no duration, or longer than a year.
    """
    match = _DURATION.fullmatch(text.strip())
    fields = {unit: value for unit, value in match.groupdict().items() if value} if match else {}
    seconds = sum(float(value) * {"h": 3600.0, "m": 60.0, "s": 1.0}[unit] for unit, value in fields.items())
    if not fields or seconds > MAX_DURATION_S:
        raise InputError(f"{_short(text)} is no duration up to 366 days: write 90, 30s, 2m, 1h or 1h30m")
    return seconds


def counts(text: str, low: int = 0, high: int = 0xFFFFFF) -> tuple[int, int]:
    """Counts of both axes from `C1,C2`, decimal or 0x….

    Raises
    ------
    InputError
        They are not two whole numbers from `low` to `high`.
    """
    fields = text.replace("−", "-").split(",")
    try:
        first, second = (int(field.strip(), 0) for field in fields)
    except ValueError:
        first, second = low - 1, low - 1
    if not (low <= first <= high and low <= second <= high):
        middle = (low + high + 1) // 2
        raise InputError(
            f"{_short(text)} is not C1,C2, two whole numbers from {low} to {high}: "
            f"write {middle},{middle} or 0x{middle:x},0x{middle:x}"
        )
    return first, second
