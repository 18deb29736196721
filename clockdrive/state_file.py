"""The SQLite files in the state directory: opened with care, every error of SQLite a sentence with the remedy.

A write-ahead log keeps the last complete transaction whatever ends the process; `durable` transactions are also on
the disk when they end, which costs a few milliseconds.
"""

import sqlite3
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from clockdrive.errors import StateError

_PATIENCE_S = 10.0


@dataclass(frozen=True)
class Kind:
    """What a file is for.

    Parameters
    ----------
    file_name : str
        In the state directory.
    application, version : int
        In the header of the file.
    schema : str
        Statements that make an empty one, parted by `;` and a line end.
    name : str
        What people call it.
    loss : str
        What it means to go on without it.
    upgrades : tuple of str
        Statements that make a file of version 1 one of version 2, and so on.
    """

    file_name: str
    application: int
    version: int
    schema: str
    name: str
    loss: str
    upgrades: tuple[str, ...] = ()


class StateFile:
    """One open database; safe to use from several threads, beside other processes.

    Parameters
    ----------
    directory : Path
        The state directory; made when it does not exist.
    kind : Kind
        What the file is for.
    patience_s : float
        How long another process that writes is waited for.

    Raises
    ------
    StateError
        Here and from every method: the file cannot be read or written; the text says what to do.
    """

    def __init__(self, directory: Path, kind: Kind, patience_s: float = _PATIENCE_S) -> None:
        self._kind, self._patience_s = kind, patience_s
        self.path = directory / kind.file_name
        self._lock = threading.RLock()
        self._durable: bool | None = None  # what the connection is set to
        try:
            directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            text = f"the state directory {directory} cannot be made: {error.strerror}; set [state] path to another"
            raise StateError(text) from error
        with self._translated():
            self._database = sqlite3.connect(
                self.path, timeout=patience_s, isolation_level=None, check_same_thread=False
            )
        try:
            self._prepare()
        except BaseException:
            self._database.close()
            raise

    def close(self) -> None:
        """Close; closing twice is harmless."""
        with self._lock:
            self._database.close()

    def _prepare(self) -> None:
        self._refuse_foreign()
        with self._translated():
            self._database.execute("PRAGMA journal_mode = WAL")
        with self.transaction(durable=True):
            version = self._pragma("user_version")
            if version < self._kind.version:
                new = self._kind.schema.split(";\n")
                for statement in self._kind.upgrades[version - 1 :] if version else new:
                    self.execute(statement)
                self.execute(f"PRAGMA application_id = {self._kind.application}")
                self.execute(f"PRAGMA user_version = {self._kind.version}")

    def _refuse_foreign(self) -> None:
        tables = self.rows("SELECT count(*) FROM sqlite_master")[0][0]
        application, version = self._pragma("application_id"), self._pragma("user_version")
        if application != self._kind.application and (tables or version or application):
            raise self.unusable("it belongs to another program")
        known = self._kind.version
        if version > known:
            text = f"{self.path} is of version {version}, and this Clockdrive knows {known}: update Clockdrive"
            raise StateError(text)
        with self._translated():
            found = self._database.execute("PRAGMA quick_check(1)").fetchone()[0]
        if found != "ok":
            raise self.unusable(str(found).splitlines()[0])

    def _pragma(self, name: str) -> int:
        return int(self.rows(f"PRAGMA {name}")[0][0])

    def write(self, sql: str, values: Sequence[object], *, durable: bool) -> None:
        """One statement, which is a transaction by itself or part of the one under way."""
        with self._lock:
            self._set_durable(durable)
            self.execute(sql, values)

    def rows(self, sql: str, *values: object) -> list[tuple[Any, ...]]:
        """What a query finds."""
        with self._lock, self._translated():
            return self._database.execute(sql, values).fetchall()

    def execute(self, sql: str, values: Sequence[object] = ()) -> sqlite3.Cursor:
        """One statement of a transaction."""
        with self._translated():
            return self._database.execute(sql, tuple(values))

    @contextmanager
    def transaction(self, *, durable: bool) -> Iterator[None]:
        """All or nothing; when `durable`, on the disk when it ends. Within another it is part of that."""
        with self._lock:
            if self._under_way:
                yield
                return
            self._set_durable(durable)
            self.execute("BEGIN IMMEDIATE")
            try:
                yield
                self.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._database.execute("ROLLBACK")
                raise

    @property
    def _under_way(self) -> bool:
        with self._translated():
            return self._database.in_transaction

    def _set_durable(self, durable: bool) -> None:
        """Let what begins now end on the disk, or not; what is under way ends as it began."""
        if durable is not self._durable and not self._under_way:
            self.execute(f"PRAGMA synchronous = {'FULL' if durable else 'NORMAL'}")
            self._durable = durable

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """SQLite's errors as a sentence with the remedy."""
        try:
            yield
        except sqlite3.IntegrityError as error:
            raise StateError(
                f"a record for {self.path} is incomplete: {error}; every number in it must be finite"
            ) from error
        except sqlite3.ProgrammingError as error:
            raise StateError(f"the {self._kind.name} {self.path} is closed: open it again") from error
        except sqlite3.OperationalError as error:
            text = (
                f"the {self._kind.name} {self.path} cannot be used: {error}; {_remedy(str(error), self._patience_s)}"
            )
            raise StateError(text) from error
        except sqlite3.DatabaseError as error:
            raise self.unusable(str(error)) from error

    def unusable(self, why: str) -> StateError:
        """The error of a file that must be moved away."""
        return StateError(
            f"{self.path} is not a {self._kind.name} that can be used: {why}. Move it away (a new one is made; "
            f"{self._kind.loss}), or set [state] path to another folder"
        )


class Store:
    """What is kept of one telescope in one file, open until it is closed or its block ends.

    Parameters
    ----------
    directory, kind, patience_s
        As for `StateFile`.
    telescope : str
        Which telescope, such as `Configuration.identity`.
    """

    def __init__(self, directory: Path, kind: Kind, telescope: str, patience_s: float = _PATIENCE_S) -> None:
        self.telescope = telescope
        self._file = StateFile(directory, kind, patience_s)

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    def close(self) -> None:
        """Close; closing twice is harmless."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _remedy(error: str, patience_s: float) -> str:
    if "full" in error:
        return "free some space on its disk"
    if "locked" in error:
        return f"another process has held it for {patience_s:g} s: end that one"
    return "check that its folder exists and can be written, or set [state] path to another"
