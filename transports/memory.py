"""A link to a simulated device in the same process: exact and deterministic under a virtual clock.

A request takes its line time, travels for the latency, and reaches the device whole; the answer travels back
for the latency and its own line time, and can be read from then on. So does what a device says unasked. Waiting is
done on the clock handed in, so with a virtual clock nothing waits at all.
"""

import math
from collections import deque
from typing import Protocol, TypeGuard

from transports.errors import LinkError
from transports.link import Clock

BITS_PER_BYTE = 10  # start bit, 8 data bits, stop bit


class Device(Protocol):
    """What answers at the far end of a link; simulators are devices."""

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answer, empty when there is none.

        A device may raise `LinkError` to drop the connection.
        """
        ...


class Talking(Device, Protocol):
    """A device that says things unasked as well."""

    def says(self, until: float) -> tuple[float, bytes] | None:
        """The next thing that it says unasked up to POSIX `until`, and when; None where there is nothing.

        Its time may go on to `until`, but not beyond the moment at which it says something.
        """
        ...


def talks(device: Device) -> TypeGuard[Talking]:
    """Whether a device says things unasked."""
    return hasattr(device, "says")


class MemoryLink:
    """A link to `device`.

    Parameters
    ----------
    device : Device
        What answers.
    clock : Clock
        Stamps times and lets them pass.
    latency_s : float
        Travel time, each way.
    baud : int, optional
        Bits per second of the line, at 10 bits a byte; none for a line that takes no time.
    name : str
        The name shown in errors.
    """

    def __init__(
        self,
        device: Device,
        clock: Clock,
        *,
        latency_s: float = 0.001,
        baud: int | None = None,
        name: str = "sim:",
    ) -> None:
        self._device = device
        self._clock = clock
        self._latency = latency_s
        self._byte_time = BITS_PER_BYTE / baud if baud else 0.0
        self._name = name
        self._arriving: deque[tuple[float, bytes]] = deque()
        self._line_free = -math.inf  # when what the device said last has left it
        self._open = True

    @property
    def name(self) -> str:
        """The name handed in."""
        return self._name

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left."""
        self._require_open()
        if self._byte_time:
            self._clock.sleep(len(data) * self._byte_time)
        sent = self._clock.now()
        arrived = sent + self._latency
        try:
            self._listen(arrived)
            answer = self._device.receive(data, arrived)
        except LinkError:
            self.close()
            raise
        if answer:
            self._begins(arrived, answer)
        return sent

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        self._require_open()
        now = self._clock.now()
        due = self._due(now + timeout_s)
        if due > now + timeout_s:
            if timeout_s > 0.0:
                self._clock.sleep(timeout_s)
            return b""
        if due > now:
            self._clock.sleep(due - now)
        return self._take(max_bytes, max(due, now))

    def close(self) -> None:
        """Close; what is still on its way is lost."""
        self._open = False
        self._arriving.clear()

    def _due(self, until: float) -> float:
        """When the first of what is on its way can be read; infinity where that is after `until`."""
        if not self._arriving or self._arriving[0][0] > until:
            self._listen(until, all_of_it=False)
        return self._arriving[0][0] if self._arriving else math.inf

    def _listen(self, until: float, *, all_of_it: bool = True) -> None:
        """Hear what the device says unasked."""
        while talks(self._device) and (said := self._device.says(until)) is not None:
            self._begins(*said)
            if self._arriving and not all_of_it:  # what a bad line swallowed whole does not arrive
                break

    def _begins(self, time: float, data: bytes) -> None:
        """Something leaves the device, or waits for its line; of one that talks each byte can be read by itself."""
        begun = max(time, self._line_free)
        self._line_free = begun + len(data) * self._byte_time
        pieces = [data[i : i + 1] for i in range(len(data))] if self._byte_time and talks(self._device) else [data]
        for i, piece in enumerate(pieces, start=1):
            left = begun + (i if len(pieces) > 1 else len(data)) * self._byte_time
            self._arriving.append((left + self._latency, piece))

    def _take(self, max_bytes: int, until: float) -> bytes:
        come = b""
        while self._arriving and self._arriving[0][0] <= until:
            come += self._arriving.popleft()[1]
        if len(come) > max_bytes:
            self._arriving.appendleft((until, come[max_bytes:]))
        return come[:max_bytes]

    def _require_open(self) -> None:
        if not self._open:
            raise LinkError(f"{self._name}: the link is closed; open it again")
