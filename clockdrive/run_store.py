"""Every observation of every pointing run, in one SQLite file: what a fit needs to be made again, at any time.

An observation is written together with the state of its place, in one durable transaction: a process that is killed
loses the star under way and nothing else. Kept are the counts of the drive and the mechanical angles, which do not
depend on the pointing model then in force; what was in force is written beside them.
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from clockdrive.errors import InputError, Refused
from clockdrive.process_lock import ProcessLock
from clockdrive.state_file import Kind, Store
from pointing.model.place import MountKind
from pointing.mount import Posture
from pointing.run_plan import RunPlace

FILE_NAME = "pointing_runs.sqlite3"
_SCHEMA = """
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, telescope TEXT NOT NULL, name TEXT NOT NULL, began REAL NOT NULL, mount TEXT NOT NULL,
    latitude_deg REAL NOT NULL, settings TEXT NOT NULL, UNIQUE (telescope, name));
CREATE TABLE places (
    run INTEGER NOT NULL, number INTEGER NOT NULL, azimuth_deg REAL NOT NULL, altitude_deg REAL NOT NULL,
    posture TEXT NOT NULL, star TEXT NOT NULL, state TEXT NOT NULL, reason TEXT NOT NULL, tries INTEGER NOT NULL,
    PRIMARY KEY (run, number));
CREATE TABLE observations (
    id INTEGER PRIMARY KEY, run INTEGER NOT NULL, place INTEGER, time REAL, counts1 REAL, counts2 REAL,
    axis1_deg REAL NOT NULL, axis2_deg REAL NOT NULL, posture TEXT NOT NULL, azimuth_deg REAL NOT NULL,
    altitude_deg REAL NOT NULL, sigma_arcsec REAL NOT NULL, target TEXT NOT NULL,
    weather TEXT NOT NULL, in_force TEXT NOT NULL, masked TEXT NOT NULL,
    weight REAL NOT NULL DEFAULT 1.0);
CREATE INDEX observations_by_run ON observations (run, id);
"""
_KIND = Kind(
    FILE_NAME,
    0x436C6B52,  # "ClkR"
    2,
    _SCHEMA,
    "store of pointing runs",
    "the runs in it are then not found",
    ("ALTER TABLE observations ADD COLUMN weight REAL NOT NULL DEFAULT 1.0",),
)

State = Literal["planned", "observed", "skipped"]
_MASKED = "by hand"


@dataclass(frozen=True)
class PlacedStar:
    """A place of a run, and what became of it."""

    number: int
    place: RunPlace
    state: State = "planned"
    reason: str = ""
    tries: int = 0


@dataclass(frozen=True)
class Observation:
    """One star that was seen.

    Parameters
    ----------
    time : float or None
        POSIX seconds of the exposure.
    counts : tuple of float or None
        What the drive counted then; None of a run from elsewhere.
    axes_deg : tuple of float
        Mechanical angles.
    posture : Posture
        How the telescope pointed.
    azimuth_deg, altitude_deg : float
        Where it was seen to point, observed.
    sigma_arcsec : float
        Standard deviation of that.
    target : str
        What it was sent to.
    weather : mapping
        The air.
    in_force : mapping
        Pointing model, offsets and registers with which it was sent there.
    masked : str
        Why it takes no part in fits; empty where it does.
    weight : float
        What it counts in fits besides its standard deviation, as a file has told.
    """

    time: float | None
    counts: tuple[float, float] | None
    axes_deg: tuple[float, float]
    posture: Posture
    azimuth_deg: float
    altitude_deg: float
    sigma_arcsec: float
    target: str
    weather: Mapping[str, Any] = field(default_factory=dict)
    in_force: Mapping[str, Any] = field(default_factory=dict)
    masked: str = ""
    weight: float = 1.0


@dataclass(frozen=True)
class StoredRun:
    """A run as it is kept.

    Parameters
    ----------
    name : str
        Unique for its telescope.
    began : float
        POSIX seconds.
    mount : MountKind
        What its axes measure.
    latitude_deg : float
        Of the site.
    settings : mapping
        With what it was begun.
    places : tuple of PlacedStar
        In the order in which they are visited.
    observations : tuple of Observation
        In the order in which they were made; their indices are those of a fit.
    """

    name: str
    began: float
    mount: MountKind
    latitude_deg: float
    settings: Mapping[str, Any]
    places: tuple[PlacedStar, ...]
    observations: tuple[Observation, ...]

    @property
    def pending(self) -> tuple[PlacedStar, ...]:
        """Places that are still to be visited."""
        return tuple(each for each in self.places if each.state == "planned")

    @property
    def skipped(self) -> tuple[PlacedStar, ...]:
        """Places where nothing was seen."""
        return tuple(each for each in self.places if each.state == "skipped")


def named(name: str) -> str:
    """Return a name that a run can have.

    Raises
    ------
    InputError
        It cannot be read on a line, or typed again.
    """
    if not name or name != name.strip() or not name.isprintable():
        raise InputError(f"a run named {name!r}: give printable characters on one line, without blanks at the ends")
    return name


class RunStore(Store):
    """The pointing runs of one telescope.

    Parameters
    ----------
    directory : Path
        The state directory; made when it does not exist.
    telescope : str
        Which telescope, such as `Configuration.identity`.
    patience_s : float
        How long another process that writes is waited for.

    Raises
    ------
    StateError
        Here and from every method: the file cannot be read or written; the text says what to do.
    """

    def __init__(self, directory: Path, telescope: str, patience_s: float = 10.0) -> None:
        super().__init__(directory, _KIND, telescope, patience_s)

    # Runs ------------------------------------------------------------------------------------------------------

    def begin(self, run: StoredRun) -> None:
        """Keep a new run with all that it has.

        Raises
        ------
        InputError
            There is one of this name, or none can have it.
        """
        named(run.name)
        with self._file.transaction(durable=True):
            if run.name in self.names():
                raise InputError(f"there is a pointing run {run.name!r} already: resume it, or give another name")
            made = self._file.execute(
                "INSERT INTO runs (telescope, name, began, mount, latitude_deg, settings) VALUES (?, ?, ?, ?, ?, ?)",
                (self.telescope, run.name, run.began, run.mount, run.latitude_deg, json.dumps(dict(run.settings))),
            )
            key = int(made.lastrowid or 0)
            self._add_places(key, [each.place for each in run.places])
            for observation in run.observations:
                self._add(key, None, observation)

    def names(self) -> tuple[str, ...]:
        """All runs, oldest first."""
        rows = self._file.rows("SELECT name FROM runs WHERE telescope = ? ORDER BY began, id", self.telescope)
        return tuple(name for (name,) in rows)

    def read(self, name: str | None = None) -> StoredRun:
        """The run of a name, or the newest.

        Raises
        ------
        InputError
            There is none.
        """
        name = self._named(name)
        began, mount, latitude, settings = self._file.rows(
            "SELECT began, mount, latitude_deg, settings FROM runs WHERE telescope = ? AND name = ?",
            self.telescope,
            name,
        )[0]
        key = self._key(name)
        places, observations = tuple(self._places(key)), tuple(self._observations(key))
        return StoredRun(name, began, mount, latitude, json.loads(settings), places, observations)

    def rename(self, name: str, to: str) -> None:
        """Give a run another name.

        Raises
        ------
        InputError
            There is none, one of the other name, or none can have that.
        Refused
            It is being taken.
        """
        named(to)
        with self.taking(name), self._file.transaction(durable=True):
            if to in self.names():
                raise InputError(f"there is a pointing run {to!r} already: give another name")
            self._file.execute("UPDATE runs SET name = ? WHERE id = ?", (to, self._key(name)))

    @contextmanager
    def taking(self, name: str) -> Iterator[None]:
        """Have a run for oneself, beside all processes; one that ends lets go of it.

        Raises
        ------
        Refused
            Somebody else has it.
        """
        lock = ProcessLock(self.path.with_name(f"pointing_run_{self._key(name)}.lock"))
        if not lock.acquire():
            raise Refused(f"the run {name} is being taken: `clockdrive stop` first")
        try:
            yield
        finally:
            lock.release()

    def forget(self, name: str) -> None:
        """Delete a run with its observations.

        Raises
        ------
        Refused
            It is being taken.
        """
        key = self._key(name)
        with self.taking(name), self._file.transaction(durable=True):
            for table, column in (("observations", "run"), ("places", "run"), ("runs", "id")):
                self._file.execute(f"DELETE FROM {table} WHERE {column} = ?", (key,))  # noqa: S608 - our own names

    # Places and observations -----------------------------------------------------------------------------------

    def append(self, name: str, places: Sequence[RunPlace]) -> None:
        """Add places to a run, behind those it has."""
        with self._file.transaction(durable=True):
            self._add_places(self._key(name), places)

    def observed(self, name: str, number: int, observation: Observation) -> None:
        """Keep what was seen at a place of a run."""
        key = self._key(name)
        with self._file.transaction(durable=True):
            self._add(key, number, observation)
            self._mark(key, number, "observed", "")

    def skipped(self, name: str, number: int, reason: str) -> None:
        """Keep why nothing was seen at a place."""
        with self._file.transaction(durable=True):
            self._mark(self._key(name), number, "skipped", reason)

    def mask(self, name: str, indices: Iterable[int], reason: str = _MASKED) -> None:
        """Let observations, counted from 0, take no part in fits; with an empty reason take part again.

        Raises
        ------
        InputError
            There is no such observation.
        """
        key = self._key(name)
        keys = [row[0] for row in self._file.rows("SELECT id FROM observations WHERE run = ? ORDER BY id", key)]
        wanted = list(indices)
        for index in wanted:
            if not 0 <= index < len(keys):
                raise InputError(f"observation {index}; the run {name} has {len(keys)}, counted from 0")
        with self._file.transaction(durable=True):
            for index in wanted:
                self._file.execute("UPDATE observations SET masked = ? WHERE id = ?", (reason, keys[index]))

    def _named(self, name: str | None) -> str:
        names = self.names()
        if not names:
            raise InputError("this telescope has no pointing runs: `clockdrive pointing-run` makes one")
        if name is None:
            return names[-1]
        if name not in names:
            raise InputError(f"no pointing run {name!r}: there is {', '.join(names)}")
        return name

    def _key(self, name: str | None) -> int:
        """The number of a run.

        Raises
        ------
        InputError
            There is none of this name.
        """
        rows = self._file.rows(
            "SELECT id FROM runs WHERE telescope = ? AND name = ?", self.telescope, self._named(name)
        )
        return int(rows[0][0])

    def _add_places(self, key: int, places: Sequence[RunPlace]) -> None:
        first = self._file.rows("SELECT count(*) FROM places WHERE run = ?", key)[0][0]
        for number, place in enumerate(places, start=first + 1):
            self._file.execute(
                "INSERT INTO places VALUES (?, ?, ?, ?, ?, ?, 'planned', '', 0)",
                (
                    key, number, math.degrees(place.azimuth), math.degrees(place.altitude), place.posture, place.name,
                ),
            )  # fmt: skip

    def _add(self, key: int, number: int | None, seen: Observation) -> None:
        self._file.execute(
            "INSERT INTO observations (run, place, time, counts1, counts2, axis1_deg, axis2_deg, posture, "
            "azimuth_deg, altitude_deg, sigma_arcsec, target, weather, in_force, masked, weight) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            (
                key, number, seen.time, *(seen.counts or (None, None)), *seen.axes_deg, seen.posture,
                seen.azimuth_deg, seen.altitude_deg, seen.sigma_arcsec, seen.target,
                json.dumps(dict(seen.weather)), json.dumps(dict(seen.in_force)), seen.masked, seen.weight,
            ),
        )  # fmt: skip

    def _mark(self, key: int, number: int, state: State, reason: str) -> None:
        self._file.execute(
            "UPDATE places SET state = ?, reason = ?, tries = tries + 1 WHERE run = ? AND number = ?",
            (state, reason, key, number),
        )

    def _places(self, key: int) -> Iterable[PlacedStar]:
        for number, azimuth, altitude, posture, star, state, reason, tries in self._file.rows(
            "SELECT number, azimuth_deg, altitude_deg, posture, star, state, reason, tries FROM places "
            "WHERE run = ? ORDER BY number",
            key,
        ):
            place = RunPlace(math.radians(azimuth), math.radians(altitude), posture, star)
            yield PlacedStar(number, place, state, reason, tries)

    def _observations(self, key: int) -> Iterable[Observation]:
        for time, c1, c2, a1, a2, posture, az, alt, sigma, target, weather, in_force, *told in self._file.rows(
            "SELECT time, counts1, counts2, axis1_deg, axis2_deg, posture, azimuth_deg, altitude_deg, sigma_arcsec, "
            "target, weather, in_force, masked, weight FROM observations WHERE run = ? ORDER BY id",
            key,
        ):
            counts = None if c1 is None else (c1, c2)
            yield Observation(
                time, counts, (a1, a2), posture, az, alt, sigma, target, json.loads(weather),
                json.loads(in_force), *told,
            )  # fmt: skip
