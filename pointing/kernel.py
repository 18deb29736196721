"""JPL's ephemerides: barycentric places of solar-system bodies from an SPK kernel file.

A file is opened, read and closed at once: its table of contents when the kernel is made, then the record of a moment
when it is asked for; the most recent records are kept. Bodies have NAIF's numbers. The time is TDB, as an `Instant`
whose day and seconds count in TDB. What is read are Chebyshev series of positions in ICRF axes (SPK types 2 and 3),
which is all that JPL's planetary ephemerides hold; velocities are their derivative. Layout: NAIF, "SPK Required
Reading" and "DAF Required Reading".
"""

import struct
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from itertools import islice
from pathlib import Path

import numpy as np

from pointing.chebyshev import Record, State, record_of_series, state_of
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.sky import AU_M

EXTRA = "pip install 'clockdrive[planets]'"
_AU_KM = AU_M / 1e3
_J2000_DAY = 51544  # and half a day
_WORD = 8
_COMPONENTS = {2: 3, 3: 6}  # by SPK type; in type 3 velocities follow the positions
_ICRF = 1  # NAIF's number of the frame
_MOST_SEGMENTS = 10_000
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
        low, high = -float("inf"), float("inf")
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
            The file is damaged, or has a gap there.
        """
        (x, y, z), (vx, vy, vz) = (segment := self._segment(body, instant)).state(instant)
        while segment.centre:
            segment = self._segment(segment.centre, instant)
            (px, py, pz), (ux, uy, uz) = segment.state(instant)
            x, y, z, vx, vy, vz = x + px, y + py, z + pz, vx + ux, vy + uy, vz + uz
        return (x, y, z), (vx, vy, vz)

    def _segment(self, body: int, instant: Instant) -> Segment:
        segments = self._segments[body]
        if len(segments) == 1:
            return segments[0]
        seconds = (instant.day - _J2000_DAY) * DAY - DAY / 2 + instant.seconds
        for segment in segments:
            if segment.start - _LIGHT_S <= seconds <= segment.end:
                return segment
        raise TargetError(f"kernel {self.path}: body {body} has a gap at MJD {instant.day}; {_DAMAGED}")


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
            daf, size = DAF(file), path.stat().st_size
            for count, (_, summary) in enumerate(islice(daf.summaries(), _MOST_SEGMENTS)):
                start, end, body, centre, frame, kind, first, last = summary
                if kind in _COMPONENTS and frame == _ICRF:
                    if not 0 < first < last <= size // _WORD:
                        raise ValueError(f"segment {count} is beyond the end of the file")  # noqa: TRY301
                    directory = daf.read_array(last - 3, last).tolist()
                    span = (float(start), float(end))
                    made = _segment(path, daf.endian, int(centre), span, (first, last), directory, _COMPONENTS[kind])
                    found[int(body)] = (made, *found.get(int(body), ()))
    except OSError as error:
        raise TargetError(f"kernel {path}: {error.strerror}; check the path in [targets] kernel") from None
    except (ValueError, TypeError, OverflowError, IndexError, struct.error) as error:
        raise TargetError(f"kernel {path} is no SPK file, or damaged: {error}; {_DAMAGED}") from None
    if not found:
        raise TargetError(f"kernel {path} holds no body as Chebyshev series (SPK types 2 and 3); {_DAMAGED}")
    return found


def _segment(
    path: Path,
    order: str,
    centre: int,
    span: tuple[float, float],
    words: tuple[int, int],
    directory: list[float],
    components: int,
) -> Segment:
    initial, length, size, count = directory
    whole = all(map(np.isfinite, (*directory, *span))) and length > 0 and count >= 1
    if not whole or words[0] + size * count + 3 != words[1] or size < 2 + components or (size - 2) % components:
        raise ValueError(f"a segment of {words[1] - words[0]} words says of itself {directory}")
    first = (words[0] - 1) * _WORD
    return Segment(path, order, centre, *span, first, initial, length, int(size), int(count), components)


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
    if len(numbers) != segment.words or not np.isfinite(numbers).all() or abs(numbers[0] - middle) > 1.0:
        raise TargetError(f"kernel {segment.path}: record {index} of a segment is damaged; {_DAMAGED}")
    terms = (segment.words - 2) // segment.components
    return record_of_series(numbers[2 : 2 + 3 * terms].reshape(3, terms) / _AU_KM)
