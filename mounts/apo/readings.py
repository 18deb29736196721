"""What the controllers answer, as values: degrees, degrees per second, and TAI seconds of the day.

Numbers are taken only as they are printed, plain decimals: what noise has made of one is refused rather than guessed
at. No reply has a checksum, so a digit that became another digit passes; who uses the values compares them with those
before.
"""

import math
import re
from dataclasses import dataclass
from typing import Literal

from mounts.apo.commands import Kind
from mounts.apo.errors import MalformedReply
from mounts.apo.replies import Reply
from mounts.apo.status_word import BITS, StatusWord

DAY_S = 86_400.0
CLOCK_NOT_SET = -1.0
_REAL = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")
_WHOLE = re.compile(r"[+-]?\d+")
_VERSIONS = re.compile(r"axis code:\s*(?P<code>.*?),?\s*axis\.ini version\s*(?P<ini>.*)", re.IGNORECASE)
_EDGES: tuple[Literal["rising", "falling"], ...] = ("rising", "falling")
_DUMP_COLUMNS = 6
TIME_DIGIT_S, _VELOCITY_DIGIT, _POSITION_DIGIT = 1e-3, 1e-5, 1e-6


@dataclass(frozen=True)
class Drift:
    """The answer to DRIFT: the line on which the axis goes on.

    Attributes
    ----------
    position_deg, velocity_deg_s : float
        At `time_tai_s`; the velocity is printed to 1e-5 deg/s.
    time_tai_s : float
        TAI seconds of the day, printed to 1 ms; −1 while the clock is not set.
    """

    position_deg: float
    velocity_deg_s: float
    time_tai_s: float

    @property
    def clock_is_set(self) -> bool:
        """Whether the controller knows the time."""
        return self.time_tai_s != CLOCK_NOT_SET


@dataclass(frozen=True)
class Status(Drift):
    """The answer to STATUS: the same, and more.

    Attributes
    ----------
    word : StatusWord
        The status bits; on the SDSS this answer has cleared the sticky ones.
    index_deg : float
        Where the index was seen last.
    """

    word: StatusWord
    index_deg: float


@dataclass(frozen=True)
class FiducialPassage:
    """One edge of a fiducial, as it was passed.

    Attributes
    ----------
    time : float
        POSIX seconds.
    position_deg, velocity_deg_s : float
        Of the axis.
    error_deg : float
        Of the position.
    edge : str
        "rising" or "falling".
    correction_deg : float
        Added to the position: the mean of the errors of both edges; 0 where no correction was made.
    """

    time: float
    position_deg: float
    velocity_deg_s: float
    error_deg: float
    edge: Literal["rising", "falling"]
    correction_deg: float


@dataclass(frozen=True)
class Identity:
    """The answer to ID."""

    code_version: str
    ini_version: str
    text: str


def parse_drift(reply: Reply) -> Drift:
    """Return the answer to DRIFT.

    Raises
    ------
    MalformedReply
        It is none. All functions here raise this.
    """
    position, velocity, time = _words(reply, 3)
    return Drift(_real(reply, position), _real(reply, velocity), _time(reply, time))


def parse_status(reply: Reply, kind: Kind) -> Status:
    """Return the answer to STATUS."""
    position, velocity, time, word, index = _words(reply, 5)
    value = int(word) if _WHOLE.fullmatch(word) else -(1 << BITS)
    if not -(1 << BITS - 1) <= value < 1 << BITS:
        raise _malformed(reply, f"a status word of {BITS} bits")
    return Status(
        _real(reply, position),
        _real(reply, velocity),
        _time(reply, time),
        StatusWord(value, kind),
        _real(reply, index),
    )


def parse_dump(reply: Reply) -> tuple[FiducialPassage, ...]:
    """Return the answer to MS.DUMP, in the controller's order; lines that do not begin with a number are headings."""
    rows = [line.split() for line in reply.lines if _REAL.fullmatch(line.split()[0])]
    return tuple(_passage(reply, row) for row in rows)


def parse_identity(reply: Reply) -> Identity:
    """Return the answer to ID; versions that are not where they are expected stay empty."""
    text = " ".join(reply.lines)
    if not text:
        raise _malformed(reply, "versions of code and axis.ini")
    found = _VERSIONS.search(text)
    return Identity(found["code"], found["ini"], text) if found else Identity("", "", text)


def parse_max_velocity(reply: Reply) -> float:
    """Return the answer to MAXV alone, degrees per second."""
    (velocity,) = _words(reply, 1)
    return _real(reply, velocity)


def parse_limits(reply: Reply) -> tuple[float, float]:
    """Return the answer to SET.LIMITS alone: lower and upper soft limit, degrees."""
    one, two = sorted(_real(reply, word) for word in _words(reply, 2))
    return one, two


def parse_output_limit(reply: Reply) -> int:
    """Return the answer to OUTPUT.LIMIT alone, percent."""
    (percent,) = _words(reply, 1)
    if not _WHOLE.fullmatch(percent) or not 0 <= int(percent) <= 100:
        raise _malformed(reply, "a whole number of percent")
    return int(percent)


def continues(earlier: Drift, later: Drift, max_acceleration: float) -> bool:
    """Whether an axis that was as `earlier` can be as `later`, at no more than this acceleration in deg/s².

    With velocities v₀ and v₁ the ends of an interval T lie within a·T²/4 of (v₀ + v₁)/2·T apart. The printed digits
    of time and velocity are allowed for. What fails has a garbled digit, or the position was set meanwhile, or a time
    before the earlier one's.
    """
    elapsed = math.remainder(later.time_tai_s - earlier.time_tai_s, DAY_S)
    if elapsed < 0.0:
        return False
    gain = abs(later.velocity_deg_s - earlier.velocity_deg_s)
    mean = (later.velocity_deg_s + earlier.velocity_deg_s) / 2.0
    fastest = max(abs(later.velocity_deg_s), abs(earlier.velocity_deg_s))
    off = abs(later.position_deg - earlier.position_deg - mean * elapsed)
    printed = TIME_DIGIT_S * fastest + _VELOCITY_DIGIT * elapsed + _POSITION_DIGIT
    return (
        gain <= max_acceleration * (elapsed + TIME_DIGIT_S) + _VELOCITY_DIGIT
        and off <= max_acceleration * elapsed**2 / 4.0 + printed
    )


def _passage(reply: Reply, row: list[str]) -> FiducialPassage:
    if len(row) != _DUMP_COLUMNS or row[4] not in {"0", "1"}:
        raise _malformed(reply, "lines of time, position, velocity, error, edge 0 or 1, correction")
    time, position, velocity, error, _, correction = (_real(reply, word) for word in row)
    return FiducialPassage(time, position, velocity, error, _EDGES[int(row[4])], correction)


def _words(reply: Reply, count: int) -> list[str]:
    """Return the words of the one line of data."""
    words = reply.lines[0].split() if len(reply.lines) == 1 else []
    if len(words) != count:
        raise _malformed(reply, f"one line of {count}")
    return words


def _real(reply: Reply, word: str) -> float:
    if not _REAL.fullmatch(word):
        raise _malformed(reply, "plain decimal numbers")
    return float(word)


def _time(reply: Reply, word: str) -> float:
    time = _real(reply, word)
    if time != CLOCK_NOT_SET and not 0.0 <= time <= DAY_S:  # rounded to 1 ms, the last moment is the day's length
        raise _malformed(reply, f"a time of 0 to {DAY_S:g} s, or {CLOCK_NOT_SET:g} where the clock is not set")
    return time


def _malformed(reply: Reply, wanted: str) -> MalformedReply:
    shown = " / ".join(reply.lines) or "nothing"
    return MalformedReply(f"{reply.echo} was answered with {shown[:120]!r}, not with {wanted}")
