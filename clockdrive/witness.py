"""Who tells where the telescope really points: the simulator's true sky, a plate solver, a person.

A witness of the sky gives an observed direction, horizon frame, with its standard deviation. Looking takes time, so
it is done in steps like everything that waits; a look that fails says why and what to do, and never a place.
"""

import math
import os
import queue
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from clockdrive import parse
from clockdrive.control import Steps
from clockdrive.errors import ClockdriveError
from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.planner import Planner
from pointing.targets import Target
from pointing.vectors import Vector
from transports.link import Clock

if TYPE_CHECKING:
    from clockdrive.true_sky import SimulatedSky

Ask = Callable[[str], object]  # lets a person know what is wanted
Replies = queue.SimpleQueue[str | None]
"""Lines that were typed; None where nobody types any more."""
WITNESSES = ("encoders", "simulator", "command:PROGRAM", "typed")
_PERIOD_S = 0.1
_SOLVER_ARCSEC = 10.0
_TYPED_ARCSEC = 30.0
_PATIENCE_S = 180.0  # for a plate solver
_LONG_PATIENCE_S = 3600.0  # for a person
_SHOWN = 120
_READ = 4096  # bytes at the end of what a program prints
_COORDINATES = re.compile(r"(?=.*\d)[\d\s.,:+\-−hdms°'\"′″]+", re.ASCII)


class WitnessError(ClockdriveError):
    """The witness did not say where the telescope points."""


class WitnessLeft(WitnessError):  # noqa: N818 - what happened
    """The witness will not say anything any more."""


@dataclass(frozen=True)
class Sighting:
    """Where the telescope was seen to point: observed direction in the horizon frame, when, and how well."""

    observed: Vector
    time: float
    sigma_arcsec: float


class SkyWitness(Protocol):
    """Tells where the telescope points on the sky."""

    def look(self) -> Steps[Sighting]:
        """See where it points now; the telescope is at rest.

        Raises
        ------
        WitnessError
            It cannot be told; says why.
        """
        ...


class CommandWitness:
    """A program that takes an image, solves it and prints the centre: RA and Dec, and the exposure's UTC if it can.

    Parameters
    ----------
    command : str
        The program with its arguments.
    planner : Planner
        Its sky turns the place into a direction.
    clock : Clock
        The time; the program's end is taken as the exposure's when it prints none.
    sigma_arcsec : float
        Standard deviation of a place.
    patience_s : float
        After which the program is ended.
    """

    def __init__(
        self,
        command: str,
        planner: Planner,
        clock: Clock,
        sigma_arcsec: float = _SOLVER_ARCSEC,
        patience_s: float = _PATIENCE_S,
    ) -> None:
        _require_program(command)
        self._command, self._planner, self._clock = command, planner, clock
        self._sigma, self._patience = sigma_arcsec, patience_s

    def look(self) -> Steps[Sighting]:
        """Run the program and read what it prints."""
        with tempfile.TemporaryFile() as out:
            try:
                process = subprocess.Popen(  # noqa: S603 - the person's own program
                    shlex.split(self._command), stdout=out, stdin=subprocess.DEVNULL, start_new_session=True
                )
            except (OSError, ValueError) as error:
                raise WitnessError(f"the witness {self._command!r} cannot be run: {error}; check its path") from error
            try:
                yield from self._ended(process)
            finally:
                if process.poll() is None:
                    _kill(process)
                process.wait()
            out.seek(max(0, out.seek(0, os.SEEK_END) - _READ))
            text = out.read(_READ).decode(errors="replace").strip()
        if process.returncode:
            raise WitnessError(
                f"the witness {self._command!r} failed with exit code {process.returncode}; run it by hand"
            )
        return sighted(text, self._planner, self._clock.now(), self._sigma)

    def _ended(self, process: "subprocess.Popen[bytes]") -> Steps[None]:
        waited = 0.0
        while process.poll() is None:
            if waited > self._patience:
                raise WitnessError(
                    f"the witness {self._command!r} said nothing for {self._patience:g} s; it was ended"
                )
            yield _PERIOD_S
            waited += _PERIOD_S


def _require_program(command: str) -> None:
    """Refuse a command whose program is not there, before anything moves.

    Raises
    ------
    WitnessError
        So it is.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise WitnessError(f"the witness {command!r} cannot be run: {error}; check its quotes") from error
    if not words:
        raise WitnessError("name a program: command:PROGRAM")
    if shutil.which(words[0]) is None:
        raise WitnessError(f"the witness {command!r} cannot be run: no program {words[0]!r} is found; check its path")


def _kill(process: "subprocess.Popen[bytes]") -> None:
    """End a program with all that it has started, where the system has groups of processes."""
    if sys.platform == "win32":
        process.kill()
    else:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


class TypedWitness:
    """A person who types where the telescope points, whenever `ask` asks.

    Parameters
    ----------
    planner, clock
        As for `CommandWitness`.
    replies : queue.SimpleQueue
        Where the typed lines arrive, and None at the end of them.
    ask : callable
        Lets the person know.
    """

    def __init__(self, planner: Planner, clock: Clock, replies: Replies, ask: Ask) -> None:
        self._planner, self._clock, self._replies, self._ask = planner, clock, replies, ask

    def look(self) -> Steps[Sighting]:
        """Ask, and wait for a line; what was typed before nobody has asked for."""
        with suppress(queue.Empty):
            while True:
                self._replies.get_nowait()
        self._ask("RA and Dec of the centre of the field (ICRS), and the UTC of the exposure if not now")
        waited = 0.0
        while True:
            try:
                text = self._replies.get_nowait()
            except queue.Empty:
                if waited > _LONG_PATIENCE_S:
                    raise WitnessError(f"nothing was typed for {_LONG_PATIENCE_S:.0f} s") from None
                yield _PERIOD_S
                waited += _PERIOD_S
            else:
                if text is None:
                    raise WitnessLeft("nobody types any more")
                return sighted(text, self._planner, self._clock.now(), _TYPED_ARCSEC)


def sighted(text: str, planner: Planner, now: float, sigma_arcsec: float) -> Sighting:
    """Read a place on the last line of a text: RA and Dec, in degrees or sexagesimal, perhaps with a UTC.

    Raises
    ------
    WitnessError
        There is none.
    """
    words = text.splitlines()[-1].split() if text else []
    time = now
    if words and "T" in words[-1]:
        time = _utc(words.pop(), now)
    target = _place(" ".join(words), text)
    frame = planner.sky.at(Instant.from_posix(time))
    return Sighting(target.observed(frame), time, sigma_arcsec)


def _utc(word: str, now: float) -> float:
    try:
        return parse.utc(word, now)
    except ClockdriveError as error:
        raise WitnessError(f"the witness says {_shown(word)}: it ends with no UTC as 2027-01-15T08:00:00Z") from error


def _place(words: str, text: str) -> Target:
    said = f"the last line of the witness says {_shown((text.splitlines() or [''])[-1])}"
    if not _COORDINATES.fullmatch(words):
        raise WitnessError(f"{said}: print RA and Dec there, in degrees or as 05:34:32 +22:00:52")
    try:
        return parse.place(words)
    except TargetError as error:
        raise WitnessError(f"{said}: {error}") from error


def _shown(text: str) -> str:
    """A text of others, without control characters, and not too long."""
    return repr(text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…")


def witness_of(
    name: str,
    planner: Planner,
    clock: Clock,
    sky: "SimulatedSky | None",
    replies: Replies,
    ask: Ask,
    *,
    encoders: bool = True,
) -> SkyWitness | None:
    """The witness of a name; None for the encoders, which see no sky.

    With `encoders` false they are not among those that are offered.

    Raises
    ------
    WitnessError
        There is no such witness here.
    """
    kind, _, program = name.partition(":")
    if kind == "encoders" and not program:
        return None
    if kind == "simulator" and not program:
        if sky is None:
            raise WitnessError(
                "the witness `simulator` is there for the link sim: only; use command:PROGRAM or typed"
            )
        if planner.mount.origin_distance:
            raise WitnessError(
                f"the simulator sees along the tube, and targets are put "
                f"{math.degrees(planner.mount.origin_distance):.3f}° beside it: choose an instrument at 0, 0 first"
            )
        return sky
    if kind == "command":
        return CommandWitness(program, planner, clock)
    if kind == "typed" and not program:
        return TypedWitness(planner, clock, replies, ask)
    raise WitnessError(f"no witness {name!r}; there is {', '.join(WITNESSES[not encoders :])}")
