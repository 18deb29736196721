"""What is remembered between commands: one SQLite file in the state directory, kept apart by telescope.

Each record is one transaction, so that a process killed at any moment leaves the last complete record behind. What
decides whether a position may be trusted (synchronisation, park, activity) is on the disk before the call returns;
the frequent positions and events may lose their last second to a power cut, but never to the end of a process.
Each event is also a line of the event log. Times are POSIX seconds, given by the caller.
"""

import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from clockdrive.event_log import EventLog
from clockdrive.state_file import Kind, Store

FILE_NAME = "state.sqlite3"
_SCHEMA = """
CREATE TABLE positions (
    telescope TEXT PRIMARY KEY, time REAL NOT NULL, counts1 REAL NOT NULL, counts2 REAL NOT NULL,
    uncertainty1 REAL NOT NULL, uncertainty2 REAL NOT NULL, unsynchronised TEXT NOT NULL);
CREATE TABLE synchronisations (
    id INTEGER PRIMARY KEY, telescope TEXT NOT NULL, time REAL NOT NULL, counts1 REAL NOT NULL, counts2 REAL NOT NULL,
    uncertainty_arcsec REAL NOT NULL, origin TEXT NOT NULL);
CREATE TABLE corrections (
    telescope TEXT NOT NULL, name TEXT NOT NULL, value REAL NOT NULL, unit TEXT NOT NULL, origin TEXT NOT NULL,
    time REAL NOT NULL, PRIMARY KEY (telescope, name));
CREATE TABLE notes (
    telescope TEXT NOT NULL, name TEXT NOT NULL, json TEXT NOT NULL, time REAL NOT NULL,
    PRIMARY KEY (telescope, name));
CREATE TABLE events (
    id INTEGER PRIMARY KEY, telescope TEXT NOT NULL, time REAL NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
    json TEXT NOT NULL);
CREATE INDEX synchronisations_by_telescope ON synchronisations (telescope, id);
CREATE INDEX events_by_telescope ON events (telescope, id);
"""
_KIND = Kind(
    FILE_NAME,
    0x436C6B44,  # "ClkD"
    1,
    _SCHEMA,
    "state store",
    "the telescope is then unsynchronised until `clockdrive sync`",
)
_KEPT_EVENTS = 10_000


@dataclass(frozen=True)
class Position:
    """Where the axes were last seen, in counts; `unsynchronised` says why that cannot be trusted, if so."""

    time: float
    counts: tuple[float, float]
    uncertainty_counts: tuple[float, float] = (0.0, 0.0)
    unsynchronised: str = ""


@dataclass(frozen=True)
class Synchronisation:
    """The position was declared to be `counts`; `origin` says by whom and on what."""

    time: float
    counts: tuple[float, float]
    uncertainty_arcsec: float
    origin: str


@dataclass(frozen=True)
class Zero:
    """What axis angles are counted from.

    Parameters
    ----------
    lost : int
        How often the position was lost and declared anew: across that, angles have nothing to do with each other.
    moved_deg : tuple of float
        By how much syncs have moved both axes since: an older reading says this much less for the same place.
    """

    lost: int = 0
    moved_deg: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Correction:
    """A named correction in force."""

    name: str
    value: float
    unit: str
    origin: str
    time: float


@dataclass(frozen=True)
class Activity:
    """What the telescope is doing; one that is still there at a start was cut short."""

    kind: str  # "slewing", "tracking", "jogging", …
    since: float
    until: float | None = None
    from_counts: tuple[float, float] | None = None
    to_counts: tuple[float, float] | None = None
    detail: str = ""


@dataclass(frozen=True)
class Event:
    """Something that happened."""

    time: float
    kind: str
    text: str
    data: Mapping[str, object] = field(default_factory=dict)


class StateStore(Store):
    """The memory of one telescope; safe to use from several threads and processes.

    Parameters
    ----------
    directory : Path
        The state directory; made when it does not exist.
    telescope : str
        Which telescope, such as `Configuration.identity`.

    Raises
    ------
    StateError
        Here and from every method: the file cannot be read or written; the text says what to do.
    """

    def __init__(self, directory: Path, telescope: str) -> None:
        super().__init__(directory, _KIND, telescope)
        self.log = EventLog(directory, telescope)
        try:
            self._forget_old_events()
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Close; closing twice is harmless."""
        self.log.close()
        super().close()

    def together(self) -> AbstractContextManager[None]:
        """Let the frequent records of one moment be one transaction: all of them or none, and a third of the work."""
        return self._file.transaction(durable=False)

    # Positions and what makes them trustworthy

    def record_position(self, position: Position) -> None:
        """Remember where the axes are."""
        self._file.write(
            "INSERT OR REPLACE INTO positions VALUES (?, ?, ?, ?, ?, ?, ?)",
            (self.telescope, position.time, *position.counts, *position.uncertainty_counts, position.unsynchronised),
            durable=False,
        )

    def last_position(self) -> Position | None:
        """The last recorded position; None when there never was one."""
        for _, time, c1, c2, u1, u2, why in self._file.rows(
            "SELECT * FROM positions WHERE telescope = ?", self.telescope
        ):
            return Position(time, (c1, c2), (u1, u2), why)
        return None

    def record_synchronisation(
        self, synchronisation: Synchronisation, moved_deg: tuple[float, float] | None = None
    ) -> None:
        """Add to the history of synchronisations; it becomes the last position, synchronised.

        `moved_deg` is by how much it moves the angles of both axes; None where the position was not known before.
        """
        counts, time = synchronisation.counts, synchronisation.time
        before = self.zero()
        zero = (
            Zero(before.lost + 1)
            if moved_deg is None
            else Zero(before.lost, (before.moved_deg[0] + moved_deg[0], before.moved_deg[1] + moved_deg[1]))
        )
        with self._file.transaction(durable=True):
            self._file.execute(
                "INSERT INTO synchronisations (telescope, time, counts1, counts2, uncertainty_arcsec, origin) "
                "VALUES (?, ?, ?, ?, ?, ?)",
                (self.telescope, time, *counts, synchronisation.uncertainty_arcsec, synchronisation.origin),
            )
            self._file.execute(
                "INSERT OR REPLACE INTO positions VALUES (?, ?, ?, ?, 0, 0, '')", (self.telescope, time, *counts)
            )
            self._put_note("zero", vars(zero), time)

    def zero(self) -> Zero:
        """What axis angles are counted from now."""
        row = self._noted("zero")
        if not isinstance(row, dict):
            return Zero()
        one, two = row["moved_deg"]
        return Zero(int(row["lost"]), (float(one), float(two)))

    def synchronisations(self, limit: int = 20) -> tuple[Synchronisation, ...]:
        """The last synchronisations, newest first."""
        rows = self._file.rows(
            "SELECT time, counts1, counts2, uncertainty_arcsec, origin FROM synchronisations "
            "WHERE telescope = ? ORDER BY id DESC LIMIT ?",
            self.telescope,
            limit,
        )
        return tuple(Synchronisation(time, (c1, c2), arcsec, origin) for time, c1, c2, arcsec, origin in rows)

    def record_parked(self, parked: bool, time: float) -> None:
        """Remember that the telescope is parked, or no longer."""
        self._note("parked", parked, time, durable=True)

    def parked(self) -> bool:
        """Whether it was parked last."""
        return self._noted("parked") is True

    # Activity: what was going on if this process should die

    def begin(self, activity: Activity) -> None:
        """Remember, before it begins, what the telescope is about to do; supersedes the activity before."""
        row = {k: v for k, v in vars(activity).items() if v is not None}
        self._note("activity", row, activity.since, durable=True)

    def end_activity(self) -> None:
        """The activity came to its proper end."""
        self._file.write(
            "DELETE FROM notes WHERE telescope = ? AND name = 'activity'", (self.telescope,), durable=True
        )

    def activity(self) -> Activity | None:
        """What is going on; at a start: what was cut short. None when nothing."""
        row = self._noted("activity")
        if not isinstance(row, dict):
            return None
        pairs = {name: tuple(row[name]) for name in ("from_counts", "to_counts") if name in row}
        try:
            return Activity(**{**row, **pairs})
        except TypeError as error:
            raise self._file.unusable(f"the note of its activity is {row}") from error

    # Corrections, each by its name

    def set_correction(self, correction: Correction) -> None:
        """Put a correction in force; replaces the one of the same name."""
        self._file.write(
            "INSERT OR REPLACE INTO corrections VALUES (?, ?, ?, ?, ?, ?)",
            (self.telescope, *(getattr(correction, name) for name in ("name", "value", "unit", "origin", "time"))),
            durable=True,
        )

    def clear_correction(self, name: str) -> bool:
        """Remove a correction; whether there was one."""
        with self._file.transaction(durable=True):
            done = self._file.execute(
                "DELETE FROM corrections WHERE telescope = ? AND name = ?", (self.telescope, name)
            )
            return done.rowcount > 0

    def corrections(self) -> tuple[Correction, ...]:
        """All corrections in force, by name."""
        rows = self._file.rows(
            "SELECT name, value, unit, origin, time FROM corrections WHERE telescope = ? ORDER BY name",
            self.telescope,
        )
        return tuple(Correction(*row) for row in rows)

    # Which pointing origin is in force

    def record_instrument(self, name: str, time: float) -> None:
        """Remember on which instrument targets are put."""
        self._note("instrument", name, time, durable=True)

    def instrument(self) -> str | None:
        """The instrument that was taken last; None when none ever was."""
        name = self._noted("instrument")
        return name if isinstance(name, str) else None

    # Which pointing model was put in force by hand

    def record_model(self, which: str, time: float) -> None:
        """Remember that a pointing model was put in force: `kept`, the one in its file, or `none`."""
        self._note("pointing model", which, time, durable=True)

    def model(self) -> str | None:
        """What was put in force in place of the configured pointing model; None where that is in force."""
        which = self._noted("pointing model")
        return which if isinstance(which, str) else None

    def clear_model(self) -> None:
        """Let the configured pointing model be in force again."""
        self._file.write(
            "DELETE FROM notes WHERE telescope = ? AND name = 'pointing model'", (self.telescope,), durable=True
        )

    # What was learnt of the drive, and the simulator's own memory

    def learn(self, name: str, values: Mapping[str, object], time: float) -> None:
        """Remember what was learnt of the drive under `name`."""
        self._note(f"learnt {name}", dict(values), time, durable=False)

    def learnt(self, name: str) -> dict[str, object]:
        """What was learnt under `name`; empty when nothing."""
        values = self._noted(f"learnt {name}")
        return values if isinstance(values, dict) else {}

    def record_simulator(self, snapshot: Mapping[str, object], time: float) -> None:
        """Remember the embedded simulator, so that it goes on from there with the next command."""
        self._note("simulator", dict(snapshot), time, durable=False)

    def simulator(self) -> tuple[dict[str, object], float] | None:
        """The embedded simulator's snapshot and its time; None when there never was one."""
        rows = self._file.rows("SELECT time FROM notes WHERE telescope = ? AND name = 'simulator'", self.telescope)
        snapshot = self._noted("simulator")
        return (snapshot, float(rows[0][0])) if rows and isinstance(snapshot, dict) else None

    # History

    def record_event(self, event: Event) -> None:
        """Add to the history and to the event log."""
        self.log.add(event.time, event.kind, event.text)
        self._file.write(
            "INSERT INTO events (telescope, time, kind, text, json) VALUES (?, ?, ?, ?, ?)",
            (self.telescope, event.time, event.kind, event.text, json.dumps(dict(event.data))),
            durable=False,
        )

    def events(self, kind: str | None = None, limit: int = 100) -> tuple[Event, ...]:
        """The last events, of one kind or all, newest first."""
        rows = self._file.rows(
            "SELECT time, kind, text, json FROM events WHERE telescope = ? AND kind = coalesce(?, kind) "
            "ORDER BY id DESC LIMIT ?",
            self.telescope,
            kind,
            limit,
        )
        return tuple(Event(time, what, text, self._parsed(data)) for time, what, text, data in rows)

    def _forget_old_events(self) -> None:
        self._file.write(
            "DELETE FROM events WHERE telescope = ? AND id <= (SELECT id FROM events WHERE telescope = ? "
            "ORDER BY id DESC LIMIT 1 OFFSET ?)",
            (self.telescope, self.telescope, _KEPT_EVENTS),
            durable=False,
        )

    def _note(self, name: str, value: object, time: float, *, durable: bool) -> None:
        with self._file.transaction(durable=durable):
            self._put_note(name, value, time)

    def _put_note(self, name: str, value: object, time: float) -> None:
        """Write a note within a transaction."""
        self._file.execute(
            "INSERT OR REPLACE INTO notes VALUES (?, ?, ?, ?)", (self.telescope, name, json.dumps(value), time)
        )

    def _noted(self, name: str) -> object:
        for (text,) in self._file.rows(
            "SELECT json FROM notes WHERE telescope = ? AND name = ?", self.telescope, name
        ):
            return self._parsed(text)
        return None

    def _parsed(self, text: str) -> Any:  # noqa: ANN401 - JSON
        try:
            return json.loads(text)
        except ValueError as error:
            raise self._file.unusable(f"a record of it reads {text[:40]!r}") from error
