"""The event log: every event of a telescope as a line of text, in files of bounded size in the state directory.

It is for people and for what collects logs; the program itself never reads it back. A line is the time in UTC, the
kind of event, and its text. When the file is full it is renamed with `.1` behind it, that with `.1` becomes `.2`, and
the oldest is forgotten. A log that cannot be written is told once and keeps nobody from moving a telescope.
"""

import logging
from datetime import UTC, datetime
from logging.handlers import RotatingFileHandler
from pathlib import Path

from clockdrive.telescope_files import stem

FILE_BYTES = 1_000_000  # some ten thousand events
OLDER_FILES = 4

_LOG = logging.getLogger(__name__)


class EventLog:
    """The log of one telescope; nothing is opened before the first event.

    Parameters
    ----------
    directory : Path
        The state directory.
    telescope : str
        Which telescope, such as `Configuration.identity`.
    """

    def __init__(self, directory: Path, telescope: str) -> None:
        self.path = directory / f"{stem('events', telescope)}.log"
        self._handler: _Handler | None = None

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files that there are, the oldest first."""
        older = [self.path.with_name(f"{self.path.name}.{i}") for i in range(OLDER_FILES, 0, -1)]
        return tuple(path for path in (*older, self.path) if path.is_file())

    def add(self, time: float, kind: str, text: str) -> None:
        """Add an event, at a time in POSIX seconds; never raises."""
        if self._handler is None:
            self._handler = _Handler(self.path)
        self._handler.handle(logging.makeLogRecord({"msg": line(time, kind, text)}))

    def text(self) -> str:
        """All that is kept, the oldest first; what cannot be read is named instead."""
        return "".join(map(_text, self.paths))

    def close(self) -> None:
        """Close; closing twice is harmless, and another event opens it again."""
        handler, self._handler = self._handler, None
        if handler is not None:
            handler.close()


def line(time: float, kind: str, text: str) -> str:
    """Return an event as one line, whatever its text contains."""
    moment = datetime.fromtimestamp(time, UTC).isoformat(timespec="milliseconds").removesuffix("+00:00")
    return f"{moment}Z {kind}: {' | '.join(text.splitlines())}"


class _Handler(RotatingFileHandler):
    """Writes the lines."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, maxBytes=FILE_BYTES, backupCount=OLDER_FILES, encoding="utf-8", delay=True)
        self._told = False

    def handleError(self, _record: logging.LogRecord) -> None:
        """Tell of a failure to write, once until the log is opened again."""
        if not self._told:
            self._told = True
            _LOG.warning("the event log %s cannot be written", self.baseFilename, exc_info=True)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        return f"{path.name} cannot be read: {error.strerror}\n"
