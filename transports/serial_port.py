"""A link over a serial port, eight data bits, no parity, one stop bit, on any platform pyserial knows.

Every foreign error leaves this file as `LinkError`, with the port and what to do.
"""

import sys

import serial

from transports.errors import LinkError
from transports.link import Clock

WRITE_TIMEOUT_S = 5.0
BITS_PER_BYTE = 10  # start bit, 8 data bits, stop bit


def _failures() -> tuple[type[Exception], ...]:
    """Return what a port can raise: pyserial's error is an OSError, that of POSIX terminals is not."""
    if sys.platform == "win32":
        return (OSError,)
    from termios import error  # noqa: PLC0415 - Windows has none

    return (OSError, error)


_FAILURES = _failures()
_FAILURES_TO_OPEN: tuple[type[Exception], ...] = (*_failures(), ValueError)


class SerialLink:
    """The serial port `port`, opened on construction and to nobody else.

    Parameters
    ----------
    port : str
        `COM3`, `/dev/ttyUSB0` ...
    baud : int
        Bits per second.
    clock : Clock
        Stamps the times of what was sent.

    Raises
    ------
    LinkError
        The port does not exist, is in use, or does not take this rate.
    """

    def __init__(self, port: str, baud: int, clock: Clock) -> None:
        self._clock = clock
        self._byte_time = BITS_PER_BYTE / baud
        self._name = f"serial://{port}?baud={baud}"
        try:
            self._port = serial.Serial(port, baud, timeout=0, write_timeout=WRITE_TIMEOUT_S, exclusive=True)
        except _FAILURES_TO_OPEN as error:
            raise LinkError(
                f"{self._name}: cannot open ({error}); check the cable, the name of the port, the right to use it, "
                "and that no other program has it"
            ) from error

    @property
    def name(self) -> str:
        """The address, as `serial://port?baud=rate`."""
        return self._name

    def fileno(self) -> int:
        """The descriptor of the port, where the system has one; −1 when closed."""
        return int(self._port.fileno()) if self._port.is_open else -1

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left.

        That is when the port says so, or the line time after the start where it says so late.
        """
        begun = self._clock.now()
        try:
            self._port.write(data)
            self._port.flush()
        except _FAILURES as error:
            raise self._lost(error) from error
        return min(self._clock.now(), begun + len(data) * self._byte_time)

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        try:
            self._port.timeout = max(timeout_s, 0.0)
            first = self._port.read(1)
            more = min(self._port.in_waiting, max_bytes - 1) if first else 0
            return first + self._port.read(more) if more else first
        except _FAILURES as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Close; closing twice is harmless."""
        self._port.close()

    def _lost(self, reason: object) -> LinkError:
        self.close()
        return LinkError(f"{self._name}: the port is lost ({reason}); check the cable and open it again")
