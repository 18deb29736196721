"""Is the computer's clock right? The sky turns by 15″ a second of its error, so every plan says so.

Only the computer itself is asked, never the network: chrony's daemon, the Linux kernel, the Windows time service.
Each gives what it knows, or nothing; the first that knows decides.
"""

import ctypes
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass

from clockdrive.polled import Polled, Start, on_a_thread

SKY_ARCSEC_PER_S = 15.041  # 360° in a sidereal day, at declination 0
_KEEP_S = 60.0
_PATIENCE_S = 2.0
_NOTABLE_S = 0.05  # below 1″ nobody need act
_REMEDY = "start chrony or another time service, or point at a star and `sync`"


@dataclass(frozen=True)
class HostClock:
    """What is known of the computer's clock.

    Parameters
    ----------
    synchronised : bool or None
        None: nobody here knows.
    error_s : float or None
        Bound of its error, seconds; None when none is stated.
    source : str
        Who said so.
    """

    synchronised: bool | None
    error_s: float | None
    source: str

    @property
    def text(self) -> str:
        """The sentence for a plan: what is known, what it means on the sky, what to do."""
        if self.synchronised is None:
            return f"clock not checked, {self.source}: each second of its error is 15″; {_REMEDY}"
        if not self.synchronised:
            return f"clock not synchronised: 15″ a second ({self.source}); {_REMEDY}"
        if self.error_s is None:
            return f"clock synchronised ({self.source}), its error not stated"
        arcsec = self.error_s * SKY_ARCSEC_PER_S
        known = f"clock synchronised to {_duration(self.error_s)} ({self.source}): at most {_arcsec(arcsec)}″"
        return known if self.error_s < _NOTABLE_S else f"{known}; give it a nearer time source"


def host_clock() -> HostClock:
    """Ask everyone on this computer who may know, at most a few seconds long.

    Returns
    -------
    HostClock
        By the first that knows. Raises nothing.
    """
    for ask in (_chrony, _linux_kernel, _windows_time):
        found = ask()
        if found is not None:
            return found
    return HostClock(None, None, f"nothing on this {sys.platform} system tells")


class HostClockCheck:
    """The state of the host's clock, kept for a minute and asked again without waiting.

    Parameters
    ----------
    ask : callable
        Finds it.
    start : callable
        Begins the asking; see `Polled`.
    """

    def __init__(self, ask: Callable[[], HostClock] = host_clock, start: Start = on_a_thread) -> None:
        self._polled = Polled(lambda _: ask(), _KEEP_S, start)

    def at(self, now: float) -> HostClock:
        """What was found last; only the first call waits for the answer."""
        found = self._polled.at(now) or self._polled.fresh(now, _PATIENCE_S)
        return found or HostClock(None, None, "the computer has not answered yet")


def error_bound(offset_s: float, root_delay_s: float, root_dispersion_s: float) -> float:
    """Bound of a clock's error, as chrony's manual and RFC 5905 (root distance) give it, seconds."""
    return abs(offset_s) + 0.5 * root_delay_s + root_dispersion_s


# chrony ------------------------------------------------------------------------------------------------------------

_CHRONY_FIELDS = 14  # reference, name, stratum, …, offset [4], …, root delay [10], root dispersion [11], …, leap [13]
_ITSELF = "7F7F0101"  # chrony's reference in local mode: the clock follows itself


def _chrony() -> HostClock | None:
    """What chrony's daemon knows; it alone knows when it keeps the kernel's flag out of it (no `rtcsync`)."""
    answer = _output("chronyc", "-n", "-c", "tracking")
    return None if answer is None else parse_chrony(answer)


def parse_chrony(answer: str) -> HostClock | None:
    """Read `chronyc -c tracking`; None when it is no such report."""
    fields = answer.strip().split(",")
    if len(fields) < _CHRONY_FIELDS:
        return None
    numbers = _numbers(fields[4], fields[10], fields[11])
    if numbers is None:
        return None
    if fields[0].upper() == _ITSELF:
        return _not_synchronised("chrony follows this computer itself")
    if fields[13].strip().lower().startswith("not synch"):
        return _not_synchronised("chrony has no time source")
    return _synchronised(error_bound(*numbers), "chrony")


# Linux -------------------------------------------------------------------------------------------------------------

_STA_UNSYNC, _STA_CLOCKERR = 0x0040, 0x1000
_MICRO = 1e-6


class _Timex(ctypes.Structure):
    """`struct timex` as far as it is read; adjtimex(2)."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_char * 512),
    )


def _linux_kernel() -> HostClock | None:
    """What the kernel has been told by a time service; modes = 0 only reads."""
    if not sys.platform.startswith("linux"):
        return None
    timex = _Timex()
    try:
        if ctypes.CDLL(None).adjtimex(ctypes.byref(timex)) < 0:
            return None  # forbidden, in a container
    except (OSError, AttributeError):
        return None
    return from_kernel(timex.status, timex.maxerror, timex.esterror)


def from_kernel(status: int, max_error_us: int, estimated_error_us: int) -> HostClock:
    """Judge what the kernel says; its maximum error grows by 500 ppm while nobody tells it better."""
    source = "the kernel's clock state"
    if status & (_STA_UNSYNC | _STA_CLOCKERR):
        return _not_synchronised(source)
    # systemd-timesyncd declares both errors 0: that is no bound.
    return _synchronised(max_error_us * _MICRO if estimated_error_us > 0 else None, source)


# Windows -----------------------------------------------------------------------------------------------------------

_NUMBER = re.compile(r"-?\d+(?:[.,]\d+)?")
_FREE_RUNNING = "0x4C4F434C"  # "LOCL": the computer's own clock


def _windows_time() -> HostClock | None:
    """What the Windows time service knows; it fails when the service does not run."""
    if sys.platform != "win32":
        return None
    answer = _output("w32tm", "/query", "/status")
    return None if answer is None else parse_w32tm(answer)


def parse_w32tm(answer: str) -> HostClock | None:
    """Read `w32tm /query /status` in any language: its lines are translated, their order is not."""
    values = [line.partition(":")[2] for line in answer.splitlines() if ":" in line]
    if len(values) < 6:
        return None
    found = [_NUMBER.search(values[i]) for i in (0, 1, 3, 4)]
    numbers = _numbers(*(each[0].replace(",", ".") if each else "" for each in found))
    if numbers is None:
        return None
    leap, stratum, delay, dispersion = numbers
    if leap == 3 or stratum == 0 or _FREE_RUNNING in values[5]:
        return _not_synchronised("the Windows time service has no time source")
    return _synchronised(error_bound(0.0, delay, dispersion), "the Windows time service")


# Helpers -----------------------------------------------------------------------------------------------------------


def _synchronised(error_s: float | None, source: str) -> HostClock:
    return HostClock(synchronised=True, error_s=error_s, source=source)


def _not_synchronised(source: str) -> HostClock:
    return HostClock(synchronised=False, error_s=None, source=source)


def _output(program: str, *arguments: str) -> str | None:
    """What a local program prints; None when it is not there, fails or takes too long."""
    path = shutil.which(program)
    if path is None:
        return None
    try:
        done = subprocess.run(  # noqa: S603 - the fixed commands above
            [path, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=_PATIENCE_S,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.decode("utf-8", "replace") if done.returncode == 0 else None


def _numbers(*texts: str) -> tuple[float, ...] | None:
    try:
        values = tuple(float(text) for text in texts)
    except ValueError:
        return None
    return values if all(map(math.isfinite, values)) else None


def _arcsec(value: float) -> str:
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


def _duration(seconds: float) -> str:
    for factor, unit in ((1.0, "s"), (1e3, "ms")):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs" if seconds else "0 s"
