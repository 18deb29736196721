"""One zip file with what is needed to help: versions, configuration, status, history. It holds no keys."""

import json
import platform
import sys
import zipfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from clockdrive.configuration import Configuration, load
from clockdrive.drives.kind import DEAD_MAN_LOG
from clockdrive.errors import ClockdriveError
from clockdrive.owner import attach
from clockdrive.state import StateStore
from clockdrive.utc import utc
from mounts.errors import DriveError
from pointing.errors import PointingError
from transports.errors import TransportError

_PACKAGES = ("clockdrive", "numpy", "pyerfa", "astropy", "astropy-iers-data", "pymodbus", "pyserial", "pyongc")


def write_report(path: Path, configuration_path: str | None) -> Path:
    """Write the report; what cannot be had is named in it, never a reason to fail.

    Raises
    ------
    ClockdriveError
        The file cannot be written.
    """
    try:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, text in _parts(configuration_path):
                archive.writestr(name, text)
    except OSError as error:
        raise ClockdriveError(f"{path} cannot be written: {error.strerror}; give another --output") from error
    return path


def _parts(configuration_path: str | None) -> Iterator[tuple[str, str]]:
    yield "versions.txt", "\n".join([f"Python {sys.version}", platform.platform(), *map(_version, _PACKAGES)])
    if configuration_path is not None and Path(configuration_path).is_file():
        yield "configuration.toml", Path(configuration_path).read_text(encoding="utf-8", errors="replace")
    try:
        configuration = load(configuration_path)
    except ClockdriveError as error:
        yield "configuration-problems.txt", str(error)
        return
    values = {key: [str(value), configuration.origins[key]] for key, value in configuration.values.items()}
    yield "configuration.json", json.dumps(values, indent=1)
    try:
        yield from _history(configuration)
    except (ClockdriveError, PointingError, DriveError, TransportError) as error:
        yield "state-problems.txt", str(error)


def _history(configuration: Configuration) -> Iterator[tuple[str, str]]:
    client = attach(configuration.state_directory, configuration.identity)
    if client is not None:
        yield "status.json", json.dumps(client.call("status"), indent=1)
    with StateStore(configuration.state_directory, configuration.identity) as store:
        yield "drive.json", json.dumps(store.learnt("drive"), indent=1)
        yield "last-position.txt", repr(store.last_position())
        yield "events.txt", "\n".join(f"{utc(event.time)} {event.kind}: {event.text}" for event in store.events())
        yield "event.log", store.log.text()
    dead_man = configuration.state_directory / DEAD_MAN_LOG
    if dead_man.is_file():
        yield DEAD_MAN_LOG, dead_man.read_text(encoding="utf-8", errors="replace")


def _version(package: str) -> str:
    try:
        return f"{package} {metadata.version(package)}"
    except metadata.PackageNotFoundError:
        return f"{package} not found"
