"""One process owns a telescope: it holds the lock, and says in the state directory who it is and where it listens.

Files in the state directory, per telescope: `owner-*.lock`, locked by the operating system while the owner lives;
`owner-*.json`, who it is, removed when it ends properly, so that one left behind under a free lock tells of an owner
that died; `owner-*.key`, mode 0600, made anew by each owner, which opens its control socket.
"""

import json
import os
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from clockdrive.errors import OwnedElsewhere, StateError
from clockdrive.process_lock import ProcessLock
from clockdrive.telescope_files import stem

if TYPE_CHECKING:
    from clockdrive.control_socket import ControlClient, ControlServer, Handler


@dataclass(frozen=True)
class OwnerInfo:
    """Who owns a telescope."""

    telescope: str  # drive and link
    name: str  # what people call it
    pid: int
    since: float  # POSIX seconds
    command: str
    address: tuple[str, int] | None = None  # of its control socket; None while it is starting

    def __str__(self) -> str:
        since = datetime.fromtimestamp(self.since, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        return f"process {self.pid} (`{self.command}`, since {since})"


class Ownership:
    """Being the one owner of a telescope, until released or the process ends.

    Attributes
    ----------
    info : OwnerInfo
        This owner.
    previous : OwnerInfo or None
        The owner before this one, when it died without letting go: make the drive safe first.

    Raises
    ------
    OwnedElsewhere
        Another process owns it; the text says which.
    StateError
        The state directory cannot be used.
    """

    def __init__(self, directory: Path, telescope: str, *, name: str, command: str, time: float) -> None:
        self._files = _Files(directory, telescope)
        self._server: ControlServer | None = None
        self._lock = ProcessLock(self._files.lock)
        self._files.make_directory()
        if not self._lock.acquire():
            raise OwnedElsewhere(_refusal(self._files.read_info(), telescope))
        self.previous = self._files.read_info()
        self.info = OwnerInfo(telescope, name, os.getpid(), time, command)
        self._files.write_info(self.info)

    @property
    def previous_owner_died(self) -> bool:
        """Whether the owner before this one ended without letting go."""
        return self.previous is not None

    def serve(self, handler: "Handler") -> "ControlServer":
        """Open the control socket and say where it is; see `ControlServer` for the handler."""
        from clockdrive.control_socket import ControlServer  # noqa: PLC0415 - as in `attach`

        key = os.urandom(32)
        self._files.write_key(key)
        self._server = ControlServer(handler, key)
        self.info = OwnerInfo(**{**asdict(self.info), "address": self._server.address})
        self._files.write_info(self.info)
        return self._server

    def release(self) -> None:
        """Let go properly; twice is harmless."""
        if self._server is not None:
            self._server.close()
            self._server = None
        if self._lock.held:
            self._files.forget()
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def owner(directory: Path, telescope: str) -> OwnerInfo | None:
    """Who owns the telescope, or owned it last and died; None when nobody does."""
    return _Files(directory, telescope).read_info()


def attach(directory: Path, telescope: str) -> "ControlClient | None":
    """A client of the running owner; None when there is none, or it does not answer."""
    files = _Files(directory, telescope)
    info, key = files.read_info(), files.read_key()
    if info is None or info.address is None or key is None:
        return None
    from clockdrive.control_socket import ControlClient  # noqa: PLC0415 - 15 ms: only where somebody is there

    client = ControlClient(info.address, key)
    return client if client.answers() else None


def unanswered(directory: Path, telescope: str) -> str:
    """Say that the owner of a telescope lives but does not answer, and what to do; empty when it only begins."""
    info = owner(directory, telescope)
    if info is None or info.address is None:
        return ""
    return (
        f"the telescope {info.name} ({info.telescope}) is owned by {info}, which does not answer: it is frozen. Let "
        f"it go on with `kill -CONT {info.pid}` where it was suspended; else end it with `kill {info.pid}`, or "
        f"`kill -9 {info.pid}`, and the next command makes the drive safe. What moves now is stopped by the drive's "
        "own switch"
    )


def _refusal(info: OwnerInfo | None, telescope: str) -> str:
    if info is None:
        return f"another process is just about to own the telescope {telescope}: try again in a second"
    return (
        f"the telescope {info.name} ({info.telescope}) is owned by {info}: `clockdrive status`, `goto` and `stop` "
        "reach it through its owner; to own it here, end that process first"
    )


class _Files:
    """The three files of one telescope's owner."""

    def __init__(self, directory: Path, telescope: str) -> None:
        self._directory = directory
        name = stem("owner", telescope)
        self.lock = directory / f"{name}.lock"
        self._info = directory / f"{name}.json"
        self._key = directory / f"{name}.key"

    def make_directory(self) -> None:
        try:
            self._directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            text = f"the state directory {self._directory} cannot be made: {error.strerror}"
            raise StateError(f"{text}; set [state] path to another") from error

    def read_info(self) -> OwnerInfo | None:
        try:
            row = json.loads(self._info.read_text(encoding="utf-8"))
            host, port = row.pop("address") or (None, 0)
            address = None if host is None else (str(host), int(port))
            return OwnerInfo(
                str(row["telescope"]), str(row["name"]), int(row["pid"]), float(row["since"]), str(row["command"]),
                address,
            )  # fmt: skip
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            return OwnerInfo("", "", 0, 0.0, "unknown")  # there was an owner, of whom nothing more can be read

    def write_info(self, info: OwnerInfo) -> None:
        self._replace(self._info, json.dumps(asdict(info)).encode())

    def read_key(self) -> bytes | None:
        try:
            return self._key.read_bytes()
        except OSError:
            return None

    def write_key(self, key: bytes) -> None:
        self._replace(self._key, key)

    def forget(self) -> None:
        for path in (self._info, self._key):
            path.unlink(missing_ok=True)

    def _replace(self, path: Path, data: bytes) -> None:
        """All of `data` or nothing of it, readable by this user only."""
        fresh = path.with_name(f"{path.name}.{os.getpid()}")
        try:
            fresh.unlink(missing_ok=True)
            descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(descriptor, "wb") as file:
                file.write(data)
            fresh.replace(path)
        except OSError as error:
            text = f"{path} cannot be written: {error.strerror}; free its disk or set [state] path to another folder"
            raise StateError(text) from error
