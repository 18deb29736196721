"""JPL's ephemerides: barycentric places of solar-system bodies from an SPK kernel file.

A file is opened, read and closed at once: its table of contents when the kernel is made, then the record of a moment
when it is asked for; the most recent records are kept. Bodies have NAIF's numbers. The time is TDB, as an `Instant`
whose day and seconds count in TDB. What is read are Chebyshev series of positions in ICRF axes (SPK types 2 and 3),
which is all that JPL's planetary ephemerides hold; velocities are their derivative. Layout: NAIF, "SPK Required
Reading" and "DAF Required Reading".
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pointing.chebyshev import Record, State, record_of_series, state_of
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.sky import AU_M

if TYPE_CHECKING:
    from jplephem.daf import DAF

EXTRA = "pip install 'clockdrive[planets]'"
_AU_KM = AU_M / 1e3
_J2000_DAY = 51544  # and half a day
_WORD = 8
_COMPONENTS = {2: 3, 3: 6}  # by SPK type; in type 3 velocities follow the positions
_ICRF = 1  # NAIF's number of the frame
_SUMMARY_SIZES = (struct.pack("<II", 2, 6), struct.pack(">II", 2, 6))  # floats and integers in an SPK's summaries
_MOST_PARTS = 1000  # of a table of contents, of up to 25 segments each
_FARTHEST_KM = 1e11  # beyond all that is known by such files
_LONGEST_CHAIN = 8
_LIGHT_S = DAY  # a kernel is used from a day after its beginning, so that it holds what the light left behind
_DAMAGED = "copy the file again, or take another in [targets] kernel"


@dataclass(frozen=True, eq=False)
class Segment:
    """The path of one body as seen from another.

    Parameters
    ----------
    path : Path
        The file.
    order : str
        Byte order, `<` or `>`.
    centre : int
        The body from which it is counted.
    start, end : float
        What it covers, seconds of TDB since J2000.
    first : int
        Byte at which its records begin.
    initial, length : float
        Where the first record begins, and how long each is, seconds.
    words, records : int
        Numbers in a record, and how many records there are.
    components : int
        Series in a record.
    """

    path: Path
    order: str
    centre: int
    start: float
    end: float
    first: int
    initial: float
    length: float
    words: int
    records: int
    components: int

    def state(self, instant: Instant) -> State:
        """Place in au and velocity in au a second; a little outside the span the outermost record goes on."""
        begin = (instant.day - _J2000_DAY) * DAY - DAY / 2 - self.initial  # whole seconds, and exact
        index = min(max(int((begin + instant.seconds) // self.length), 0), self.records - 1)
        u_per_s = 2.0 / self.length
        u = (begin - index * self.length + instant.seconds) * u_per_s - 1.0
        return state_of(_record(self, index), u, u_per_s)


class Kernel:
    """One SPK file; made by `kernel`.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    TargetError
        It cannot be read, or is damaged; the reader of kernels is not installed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._segments = _segments(path)

    def span(self, body: int) -> tuple[float, float] | None:
        """From when to when a body's place is known, seconds of TDB since J2000; None when it never is."""
        low, high = -math.inf, math.inf
        for _ in range(_LONGEST_CHAIN):
            if body == 0:
                return low + _LIGHT_S, high
            segments = self._segments.get(body)
            if segments is None:
                return None
            low = max(low, min(segment.start for segment in segments))
            high = min(high, max(segment.end for segment in segments))
            body = segments[0].centre
        return None

    def state(self, body: int, instant: Instant) -> State:
        """Barycentric place of a body in au and its velocity in au a second, ICRF axes.

        Raises
        ------
        TargetError
            The file is damaged, or does not hold the body then.
        """
        (x, y, z), (vx, vy, vz) = (segment := self._segment(body, instant)).state(instant)
        while segment.centre:
            segment = self._segment(segment.centre, instant)
            (px, py, pz), (ux, uy, uz) = segment.state(instant)
            x, y, z, vx, vy, vz = x + px, y + py, z + pz, vx + ux, vy + uy, vz + uz
        return (x, y, z), (vx, vy, vz)

    def _segment(self, body: int, instant: Instant) -> Segment:
        segments = self._segments.get(body, ())
        if len(segments) == 1:
            return segments[0]
        seconds = since_j2000(instant)
        for segment in segments:
            if segment.start - _LIGHT_S <= seconds <= segment.end:
                return segment
        raise TargetError(f"kernel {self.path}: body {body} is not in it at MJD {instant.day}; {_DAMAGED}")


def since_j2000(instant: Instant) -> float:
    """Seconds since J2000, to a microsecond."""
    return (instant.day - _J2000_DAY) * DAY - DAY / 2 + instant.seconds


@lru_cache(maxsize=8)
def kernel(path: Path) -> Kernel:
    """Return the kernel of a file; its table of contents is read once."""
    return Kernel(path)


@lru_cache(maxsize=1)
def bundled_kernel() -> Path | None:
    """DE421, 1899 to 2053, of the package skyfield-data; None where the extra is not installed.

    The package is located and not imported: on import it warns of what else is in it.
    """
    found = find_spec("skyfield_data") if find_spec("jplephem") else None
    for folder in (found and found.submodule_search_locations) or ():
        path = Path(folder) / "data" / "de421.bsp"
        if path.is_file():
            return path
    return None


def _segments(path: Path) -> dict[int, tuple[Segment, ...]]:
    """What a file holds, by body; of two segments for a moment the later in the file counts."""
    try:
        from jplephem.daf import DAF  # noqa: PLC0415 - an extra, and only its users pay
    except ImportError:
        raise TargetError(f"kernel {path}: the reader of kernels is not installed; {EXTRA}") from None
    found: dict[int, tuple[Segment, ...]] = {}
    try:
        with path.open("rb") as file:
            if file.read(16)[8:] not in _SUMMARY_SIZES:
                raise ValueError("it does not begin as such files do")  # noqa: TRY301 - one sentence for all damage
            daf = DAF(file)
            for summary in _summaries(daf):
                if summary.kind in _COMPONENTS and summary.frame == _ICRF:
                    made = _segment(path, daf, summary)
                    found[summary.body] = (made, *found.get(summary.body, ()))
    except OSError as error:
        raise TargetError(f"kernel {path}: {error.strerror}; check the path in [targets] kernel") from None
    except (ValueError, TypeError, OverflowError, IndexError, struct.error) as error:
        raise TargetError(f"kernel {path} is no SPK file, or damaged: {error}; {_DAMAGED}") from None
    if not found:
        raise TargetError(f"kernel {path} holds no body as Chebyshev series (SPK types 2 and 3); {_DAMAGED}")
    return found


class _Summary(NamedTuple):
    """What the table of contents says of a segment; `first` and `last` count words from 1."""

    start: float
    end: float
    body: int
    centre: int
    frame: int
    kind: int
    first: int
    last: int


def _summaries(daf: "DAF") -> Iterator[_Summary]:
    """Read the table of contents, whose parts are chained; a damaged chain may be a circle."""
    for _, count, data in islice(daf.summary_records(), _MOST_PARTS):
        for i in range(int(count)):
            begin = daf.summary_control_struct.size + i * daf.summary_step
            yield _Summary(*daf.summary_struct.unpack(data[begin : begin + daf.summary_length]))


def _segment(path: Path, daf: "DAF", summary: _Summary) -> Segment:
    """A segment ends with where its records begin, their length, their size in words, and how many there are."""
    start, end, _, centre, _, kind, first, last = summary
    if not 0 < first < last <= path.stat().st_size // _WORD:
        raise ValueError(f"it ends before the place of body {summary.body} does")
    initial, length, size, count = directory = daf.read_array(last - 3, last).tolist()
    whole = all(map(math.isfinite, (*directory, start, end))) and length > 0.0 and count >= 1.0
    components = _COMPONENTS[kind]
    if not whole or first + size * count + 3 != last or size < 2 + components or (size - 2) % components:
        raise ValueError(f"the records of body {summary.body} do not fit into their place")
    begin = (first - 1) * _WORD
    return Segment(path, daf.endian, centre, start, end, begin, initial, length, int(size), int(count), components)


@lru_cache(maxsize=1024)
def _record(segment: Segment, index: int) -> Record:
    """Read a record: its middle and half its length, then the series of x, y, z, km."""
    size = segment.words * _WORD
    try:
        with segment.path.open("rb") as file:
            file.seek(segment.first + index * size)
            numbers = np.frombuffer(file.read(size), segment.order + "f8").astype(float)
    except (OSError, ValueError) as error:
        raise TargetError(f"kernel {segment.path} cannot be read any more: {error}; {_DAMAGED}") from None
    middle = segment.initial + (index + 0.5) * segment.length
    whole = len(numbers) == segment.words and (np.abs(numbers) < _FARTHEST_KM).all()
    if not whole or abs(numbers[0] - middle) > 1.0:
        raise TargetError(f"kernel {segment.path}: record {index} of a segment is damaged; {_DAMAGED}")
    terms = (segment.words - 2) // segment.components
    return record_of_series(numbers[2 : 2 + 3 * terms].reshape(3, terms) / _AU_KM)
