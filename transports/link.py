"""What every link is: bytes out with the time they left, bytes in with a deadline.

A link never retries and never interprets. Times are those of the clock that was handed in when the link was opened:
POSIX seconds (UTC).
"""

from typing import Protocol


class Clock(Protocol):
    """The time, as the application injects it; a virtual clock runs a whole night in seconds."""

    def now(self) -> float:
        """POSIX seconds (UTC)."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let `seconds` pass."""
        ...


class Link(Protocol):
    """A connection to one device."""

    @property
    def name(self) -> str:
        """The address a person would recognise, as in the configuration."""
        ...

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left.

        Raises
        ------
        LinkError
            The connection is gone.
        """
        ...

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`.

        Raises
        ------
        LinkError
            The connection is gone.
        """
        ...

    def close(self) -> None:
        """Close; closing twice is harmless."""
        ...
