"""When a target, or each satellite of a file, can be observed; nothing is contacted."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clockdrive import parse
from clockdrive.answers import Answer
from clockdrive.configuration import Configuration
from clockdrive.errors import InputError, finite
from clockdrive.planning import resolve, sources_of, without_a_drive
from clockdrive.utc import utc
from pointing.ephemeris_table import EphemerisTable
from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.planner import Planner
from pointing.satellite import Satellite
from pointing.targets import Target, notes_of
from pointing.tle import Tle, read_tle
from pointing.visibility import Pass, Sighting, never, passes

if TYPE_CHECKING:
    from clockdrive.planning import TargetLike

_INSIDE_S = 0.001  # by which a search stays away from the ends of a table, for roundings
_MOST_HOURS = 24.0 * 366.0
_FILES = frozenset({".tle", ".2le", ".3le", ".txt"})


def search(
    configuration: Configuration,
    given: str,
    after: float,
    hours: float,
    above_deg: float | None = None,
    progress: Callable[[float, str], object] | None = None,
) -> Answer:
    """Search for all passes of what is given.

    Parameters
    ----------
    configuration : Configuration
        Site, mount and limits.
    given : str
        A target, or the path of a TLE file.
    after : float
        POSIX seconds.
    hours : float
        For how long.
    above_deg : float, optional
        An altitude that must be exceeded besides the limits.
    progress : callable, optional
        Called with the fraction that is done and the name of what is looked at.

    Returns
    -------
    Answer
        `passes`, sorted by their rise, each with what its target has to say (of old elements, for one); `without`, a
        sentence for each target that has none or cannot be followed; `notes`.

    Raises
    ------
    InputError
        The time or the altitude is none.
    TargetError, ConfigurationError
        It is no target; the site is not known.
    """
    planner = without_a_drive(configuration, after)[0].planner
    wanted = wanted_of(given, planner, after, configuration)
    return searched(planner, wanted, after, hours, above_deg, progress)


def searched(
    planner: Planner,
    wanted: Sequence[Target | Tle],
    after: float,
    hours: float,
    above_deg: float | None = None,
    progress: Callable[[float, str], object] | None = None,
) -> Answer:
    """Search for all passes of some targets, or of satellites by their elements; otherwise as `search`."""
    if not 0.0 < finite("--hours", hours, "hours") <= _MOST_HOURS:
        raise InputError(f"--hours {hours:g}: possible are more than 0 up to {_MOST_HOURS:g}")
    if above_deg is not None and not -90.0 <= above_deg < 90.0:
        raise InputError(f"--above {above_deg:g}: possible are −90° to below 90°")
    until = after + 3600.0 * hours
    above = -math.pi / 2.0 if above_deg is None else math.radians(above_deg)
    found: list[Pass] = []
    without: list[str] = []
    notes: list[str] = []
    for i, each in enumerate(wanted):
        told = _shared(progress, i, len(wanted), each.name)
        try:
            target = Satellite(each) if isinstance(each, Tle) else each
            begin, end, note = _known(target, after, until)
            notes += [note] if note else []
            mine = len(found)
            found.extend(passes(planner, target, begin, end, above=above, progress=told))
            if len(found) == mine:
                without.append(never(planner, target, begin, end, above=above))
        except TargetError as error:
            if len(wanted) == 1:
                raise
            without.append(str(error))
        told(1.0)
    earth = planner.sky.at(Instant.from_posix(until)).earth_orientation.note
    return Answer(
        {
            "ok": True,
            "after_utc": utc(after),
            "until_utc": utc(until),
            "passes": [_row(each) for each in sorted(found, key=lambda each: each.rise.time)],
            "without": without,
            "notes": [*notes, *([earth] if earth else [])],
        }
    )


def wanted_of(
    given: "TargetLike", planner: Planner, time: float, configuration: Configuration
) -> tuple[Target | Tle, ...]:
    """Return the sets of a file if it is one, else the target.

    Raises
    ------
    TargetError
        It is no target, or the file is damaged.
    """
    if not isinstance(given, str):
        return (resolve(given, planner, time, sources_of(configuration)),)
    path = Path(given)
    if not parse.prefix(given) and (path.suffix.lower() in _FILES or _is_file(path)):
        return read_tle(path)
    file, mark, name = given.partition("#")
    if mark and not parse.prefix(given) and (Path(file).suffix.lower() in _FILES or _is_file(Path(file))):
        raise TargetError(f"{given!r} is no file and no target; for one satellite of a file write tle:{file}#{name}")
    return (resolve(given, planner, time, sources_of(configuration)),)


def _known(target: Target, after: float, until: float) -> tuple[float, float, str]:
    """Bound a search to where a table knows its target; return that, and a note where it is less.

    Raises
    ------
    TargetError
        The table knows nothing of this time.
    """
    if not isinstance(target, EphemerisTable):
        return after, until, ""
    first, last = target.first.posix() + _INSIDE_S, target.last.posix() - _INSIDE_S
    held = f"{target.name}: its table holds {target.first.utc_iso()} to {target.last.utc_iso()}"
    begin, end = max(after, first), min(until, last)
    if begin >= end:
        raise TargetError(
            f"{held}, nothing of {utc(after)} to {utc(until)}; search in that time (--at, --hours), or bring another "
            "table"
        )
    return begin, end, "" if (begin, end) == (after, until) else f"{held}; searched from {utc(begin)} to {utc(end)}"


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # the name is too long for one
        return False


def _shared(
    progress: Callable[[float, str], object] | None, done: int, count: int, name: str
) -> Callable[[float], object]:
    """Report one search as its part of all."""
    return lambda fraction: progress((done + fraction) / count, name) if progress else None


def _row(found: Pass) -> dict[str, Any]:
    return {
        "target": found.target.name,
        "rise": _sighting(found.rise),
        "culmination": _sighting(found.culmination),
        "set": _sighting(found.set),
        "duration_s": round(found.duration, 1),
        "begun": found.begun,
        "unfinished": found.unfinished,
        "note": " ".join(notes_of(found.target, Instant.from_posix(found.culmination.time))),
    }


def _sighting(seen: Sighting) -> dict[str, Any]:
    return {
        "utc": utc(round(seen.time, 1)),
        "azimuth_deg": math.degrees(seen.azimuth),
        "altitude_deg": math.degrees(seen.altitude),
    }
