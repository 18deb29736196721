"""A link that tells all it carries: for transcripts of a session, kept or printed as it goes."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

from transports.link import Clock, Link


@dataclass(frozen=True)
class Passage:
    """Bytes that passed, one way, at one moment."""

    time: float  # POSIX seconds
    direction: Literal[">", "<"]  # to the device, from the device
    data: bytes

    def __str__(self) -> str:
        stamp = datetime.fromtimestamp(self.time, UTC).isoformat(timespec="milliseconds")
        text = "".join(_legible(byte) for byte in self.data)
        return f"{stamp.removesuffix('+00:00')}Z {self.direction} {text}"


class RecordingLink:
    """`link`, with every passage handed to `note`: a list's `append` keeps them, `print` prints them.

    Parameters
    ----------
    link : Link
        What carries the bytes.
    clock : Clock
        Stamps what comes in; what goes out is stamped by the link.
    note : callable
        Takes each `Passage`, whose text is one line with time and direction.
    """

    def __init__(self, link: Link, clock: Clock, note: Callable[[Passage], object]) -> None:
        self._link = link
        self._clock = clock
        self._note = note

    @property
    def name(self) -> str:
        """The name of the link recorded."""
        return self._link.name

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left."""
        sent = self._link.write(data)
        self._note(Passage(sent, ">", data))
        return sent

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        data = self._link.read(max_bytes, timeout_s)
        if data:
            self._note(Passage(self._clock.now(), "<", data))
        return data

    def close(self) -> None:
        """Close the link recorded."""
        self._link.close()


def _legible(byte: int) -> str:
    return chr(byte) if 0x20 <= byte < 0x7F and byte != ord("\\") else f"\\x{byte:02x}"
