"""Where live weather comes from: a file, a program, an ASCOM Alpaca device. Each is asked once and gives what it has.

A source never guesses: what is missing is None, what is no number is refused with a `WeatherError`. File and program
give JSON or TOML with any of `pressure_hpa` (at the station, not reduced to sea level), `temperature_c` and
`relative_humidity` (0 to 1), and when it was measured as `utc` (ISO 8601) or `time` (POSIX seconds); other keys are
left alone. Whoever writes such a file writes another and renames it, so that it is never read half written.
"""

import json
import math
import os
import shlex
import signal
import stat
import subprocess
import threading
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from clockdrive.errors import WeatherError

MOST_BYTES = 65_536
_PROGRAM_S = 10.0
_UNITS = {"pressure_hpa": "hPa", "temperature_c": "°C", "relative_humidity": "0 to 1"}
_QUANTITIES = tuple(_UNITS)


@dataclass(frozen=True)
class Measured:
    """What a source measured; None where it has no such sensor.

    Parameters
    ----------
    pressure_hpa, temperature_c, relative_humidity : float or None
        Station pressure in hPa, degrees Celsius, 0 to 1.
    time : float
        When, POSIX seconds.
    """

    pressure_hpa: float | None
    temperature_c: float | None
    relative_humidity: float | None
    time: float


class WeatherSource(Protocol):
    """Something that can be asked for the weather."""

    @property
    def name(self) -> str:
        """How the configuration calls it."""
        ...

    def measure(self, now: float) -> Measured:
        """Ask once; may take seconds.

        Raises
        ------
        WeatherError
            It gives nothing usable.
        """
        ...


class FileSource:
    """A file that a weather station keeps writing.

    Parameters
    ----------
    path : Path
        JSON or TOML; without a time in it, it was measured when it was written.
    """

    def __init__(self, path: Path) -> None:
        self.name = f"file:{path}"
        self._path = path

    def measure(self, now: float) -> Measured:  # noqa: ARG002 - a file has its own time
        """Read the file."""
        try:
            about = self._path.stat()
            if not stat.S_ISREG(about.st_mode):  # a pipe would never end
                raise WeatherError(f"{self.name} is no regular file; name the file that the weather station writes")
            with self._path.open("rb") as file:
                content = file.read(MOST_BYTES + 1)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise WeatherError(
                f"{self.name} cannot be read ({reason}); check the path and that the weather station runs"
            ) from None
        return measured(self.name, content, about.st_mtime)


class CommandSource:
    """A program that prints the weather.

    Parameters
    ----------
    command : str
        Program and arguments, quoted as for a shell; no shell runs.
    timeout_s : float
        After that it is ended.

    Raises
    ------
    WeatherError
        A quote is not closed.
    """

    def __init__(self, command: str, timeout_s: float = _PROGRAM_S) -> None:
        self.name = f"command:{command}"
        self._timeout_s = timeout_s
        try:
            # Windows hands the line to the program as it is, backslashes too.
            self._arguments: str | list[str] = command if os.name == "nt" else shlex.split(command)
        except ValueError as error:
            raise WeatherError(f"{self.name}: {error}; close the quote") from None
        if not self._arguments:
            raise WeatherError(f"{self.name} names no program; give one, with its arguments")

    def measure(self, now: float) -> Measured:
        """Run the program."""
        content, code = self._run()
        if code != 0:
            raise WeatherError(f"{self.name} ended with code {code}; run it by hand to see why")
        return measured(self.name, content, now)

    def _run(self) -> tuple[bytes, int]:
        try:
            program = subprocess.Popen(  # noqa: S603 - the configuration names it
                self._arguments,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=os.name != "nt",  # so that its children end with it
            )
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise WeatherError(
                f"{self.name} cannot be started ({reason}); give the whole path of a program"
            ) from None
        expired = threading.Event()

        def expire() -> None:
            expired.set()
            _end(program)

        late = threading.Timer(self._timeout_s, expire)
        late.daemon = True
        late.start()
        try:
            assert program.stdout is not None  # noqa: S101 - as asked for
            with program.stdout:
                content = program.stdout.read(MOST_BYTES + 1)
            if len(content) > MOST_BYTES:
                _end(program)
            code = program.wait()
        finally:
            late.cancel()
        if expired.is_set():
            what = f"did not end within {self._timeout_s:g} s and was ended"
            raise WeatherError(f"{self.name} {what}; make it print at once what it has")
        return content, 0 if len(content) > MOST_BYTES else code


def measured(name: str, content: bytes, otherwise: float) -> Measured:
    """Read what a file or a program gives.

    Parameters
    ----------
    name : str
        Who gives it, for the error.
    content : bytes
        JSON or TOML, UTF-8.
    otherwise : float
        When it was measured, unless the content says so: POSIX seconds.

    Raises
    ------
    WeatherError
        It is neither, or holds no usable value.
    """
    values = _parsed(name, content)
    found = {key: quantity(name, key, values[key]) for key in _QUANTITIES if key in values}
    if not found.keys() & {"pressure_hpa", "temperature_c"}:
        there = ", ".join(map(str, values))[:200] or "nothing"
        raise WeatherError(f"{name} gives neither pressure_hpa nor temperature_c but {there}; give at least one")
    pressure, temperature, humidity = (found.get(key) for key in _QUANTITIES)
    return Measured(pressure, temperature, humidity, _time(name, values, otherwise))


def quantity(name: str, key: str, value: object) -> float:
    """Return a value that is a finite number.

    Raises
    ------
    WeatherError
        It is not.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        with suppress(OverflowError):
            if math.isfinite(value):
                return float(value)
    shown = "null" if value is None else repr(str(value)[:80])
    wanted = f" of {_UNITS[key]}" if key in _UNITS else ""
    raise WeatherError(
        f"{name}: {key} is {shown}; give a finite number{wanted} without unit, or leave it out where there is none"
    )


def _parsed(name: str, content: bytes) -> Mapping[str, object]:
    if len(content) > MOST_BYTES:
        raise WeatherError(f"{name} gives more than {MOST_BYTES} bytes; give the latest values only")
    try:
        text = content.decode("utf-8-sig")
        values = json.loads(text) if text.lstrip().startswith(("{", "[")) else tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # both parsers' errors and the decoder's are ValueErrors
        raise WeatherError(f"{name} is neither JSON nor TOML ({str(error)[:120]}); see [site.weather]") from None
    if not isinstance(values, dict):
        raise WeatherError(f'{name} gives a list; give one object: {{"pressure_hpa": …, "temperature_c": …}}')
    return values


def _time(name: str, values: Mapping[str, object], otherwise: float) -> float:
    if values.get("time") is not None:
        return quantity(name, "time", values["time"])
    given = values.get("utc")
    if given is None:
        return otherwise
    try:
        moment = given if isinstance(given, datetime) else datetime.fromisoformat(str(given))
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise WeatherError(f"{name}: utc is {str(given)[:80]!r}; write 2026-06-19T21:14:02Z") from None


def _end(program: "subprocess.Popen[bytes]") -> None:
    """End a program and its children."""
    with suppress(OSError):
        if os.name == "nt":
            program.kill()
        else:
            os.killpg(program.pid, signal.SIGKILL)
