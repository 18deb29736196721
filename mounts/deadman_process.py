"""What the dead-man process does: it listens to its owner, and makes the drive safe when there is no owner any more.

- The owner's messages are single bytes on a channel. Unarmed, the process only waits. Armed, it acts when the channel
  ends, which is the owner's death, or when no message comes for `silence_s`, which is the owner frozen.
- Hastened, it waits only for `hasty_s`, and eased for `easy_s`, until it is armed anew or disarmed.
- It acts on the owner's own connection where that was shared with it: a unit that serves one client at a time takes
  orders on no other while the owner holds it. Where nothing was shared, or what was shared fails, the owner's
  connection is ended and the link opened anew, again and again: a unit may hold on to its last client for a while.
- A frame counts only when the drive has answered it; where answers are all alike, it is sent at once, and again once
  the line has been silent, and only that one counts. The frames are sent from the first again after every failure,
  so they must do no harm when repeated.
- A connection on which it acted is ended: an owner that thaws finds it lost, and what it was about to send on it does
  not arrive. (A serial line cannot be ended; there the owner's next beat tells.)
- Having acted, or when it was not needed, the process ends. Signals that ask it to end are ignored: they reach it
  when a terminal or a service is closed, and the owner may have been killed by the same.

It needs a clock like all the rest, so its program is of the application, see `mounts.deadman.DeadMan`.
"""

import json
import os
import re
import select
import signal
import socket
import stat
import sys
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime

from transports.errors import LinkError, NoAnswer, TransportError
from transports.link import Clock, Link
from transports.open_link import open_link

READY, BEAT, ARM, HASTEN, EASE, DISARM, SHARE, WITHDRAW = (
    b"RBAHEDSW"  # SHARE comes with the descriptor of the owner's connection
)
UNNEEDED, SAFE, FAILED = 0, 3, 4  # how the process ended

ANSWER_S = 0.3  # for the answer to one frame
SENDS = 2  # of one frame on one connection
QUIET_S = 0.005  # a line this long silent has nothing left over
CONNECT_S = 1.0
QUICK_ATTEMPTS, QUICK_PAUSE_S = 20, 0.05  # then, with PAUSE_S between them, up to ATTEMPTS
ATTEMPTS, PAUSE_S = 140, 0.5  # so that a drive that becomes free late is safe within a second as well
CHUNK = 4096
_DRAINS = 64  # reads at most before a frame is sent into whatever comes


@dataclass(frozen=True)
class SafeFrame:
    """Bytes that bring a drive towards safety, harmless when repeated, and what its answer to them must contain."""

    data: bytes
    answer: bytes  # a regular expression
    quiet_s: float = QUIET_S  # a line silent for so long holds back no answer to something else
    answer_s: float = ANSWER_S  # for its answer


@dataclass(frozen=True)
class Orders:
    """All that the process is told when it starts."""

    url: str
    frames: tuple[SafeFrame, ...]
    silence_s: float
    log: str  # path of a file to which a line is added; empty for stderr
    hasty_s: float = 0.0  # silence of an owner that hastened it; 0: as ever
    easy_s: float = 0.0  # likewise of one that eased it

    def as_text(self) -> str:
        """The orders as one argument of a command line; inverse of `from_text`."""
        frames = [
            (frame.data.decode("latin-1"), frame.answer.decode("latin-1"), frame.quiet_s, frame.answer_s)
            for frame in self.frames
        ]
        return json.dumps([self.url, frames, self.silence_s, self.log, self.hasty_s, self.easy_s])

    @classmethod
    def from_text(cls, text: str) -> "Orders":
        """Return what `as_text` wrote."""
        url, frames, silence_s, log, hasty_s, easy_s = json.loads(text)
        safe = (
            SafeFrame(data.encode("latin-1"), answer.encode("latin-1"), *times) for data, answer, *times in frames
        )
        return cls(url, tuple(safe), silence_s, log, hasty_s, easy_s)


def run(text: str, clock: Clock) -> int:
    """Be the dead-man process, with the channel to the owner as standard input; return the exit status.

    Parameters
    ----------
    text : str
        `Orders.as_text`.
    clock : Clock
        The system's.
    """
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    orders = Orders.from_text(text)
    with _channel() as channel:
        watch = Watch(channel, orders.silence_s, orders.hasty_s, orders.easy_s)
        with suppress(OSError):  # an owner gone already is noticed by the watch
            channel.send(bytes((READY,)))
        reason = watch.until_needed()
    if not reason:
        return UNNEEDED
    begun = clock.now()
    try:
        attempts = make_safe(orders, watch.take_shared(), clock)
    except TransportError as error:
        _tell(orders, clock, f"{reason}; THE DRIVE IS NOT SAFE, switch its power off: {error}")
        return FAILED
    _tell(orders, clock, f"{reason}; made safe in {clock.now() - begun:.3f} s, attempt {attempts}")
    return SAFE


class Watch:
    """Listens to the owner.

    Parameters
    ----------
    channel : socket
        From the owner.
    silence_s : float
        How long an armed owner may be silent.
    hasty_s, easy_s : float
        Likewise once it has hastened, or eased; 0 for the same.
    """

    def __init__(self, channel: socket.socket, silence_s: float, hasty_s: float = 0.0, easy_s: float = 0.0) -> None:
        self._channel = channel
        self._silence = silence_s
        self._silences = {
            ARM: silence_s, HASTEN: hasty_s or silence_s, EASE: easy_s or silence_s, DISARM: silence_s
        }  # fmt: skip
        self._armed = False
        self._shared: int | None = None

    def until_needed(self) -> str:
        """Return why the drive must be made safe; empty when the owner went without need for it."""
        while True:
            self._channel.settimeout(self._silence if self._armed else None)
            try:
                messages, descriptors = self._receive()
            except TimeoutError:
                return f"the owner was silent for {self._silence:g} s"
            except OSError:
                messages = b""
            if not messages:
                return "the owner is gone" if self._armed else ""
            for message in messages:
                self._obey(message, descriptors)

    def take_shared(self) -> int | None:
        """Return the descriptor of the owner's connection, now the caller's; none where there is none."""
        shared, self._shared = self._shared, None
        return shared

    def _obey(self, message: int, descriptors: list[int]) -> None:
        if message in self._silences:
            self._silence = self._silences[message]
            if message in (ARM, DISARM):
                self._armed = message == ARM
        elif message in (SHARE, WITHDRAW):
            if self._shared is not None:
                os.close(self._shared)
            self._shared = descriptors.pop(0) if message == SHARE and descriptors else None

    def _receive(self) -> tuple[bytes, list[int]]:
        if sys.platform == "win32":
            return self._channel.recv(CHUNK), []
        messages, descriptors, _, _ = socket.recv_fds(self._channel, CHUNK, 4)
        return messages, descriptors


def make_safe(orders: Orders, shared: int | None, clock: Clock) -> int:
    """Send the frames until the drive has answered each; return how many attempts it took.

    Parameters
    ----------
    orders : Orders
        Which frames, and the link.
    shared : int, optional
        Descriptor of the owner's connection; it is released.
    clock : Clock
        Measures the answers and lets pauses pass.

    Raises
    ------
    TransportError
        What failed last, after `ATTEMPTS`.
    """
    for attempt in range(1, ATTEMPTS + 1):
        try:
            link: Link = (
                open_link(orders.url, clock, timeout_s=CONNECT_S) if shared is None else Shared(shared, clock)
            )
            shared = None
            try:
                send_at_once(link, orders.frames)
                for frame in orders.frames:
                    confirm(link, frame, clock)
            finally:
                link.close()
        except TransportError as error:
            if attempt == ATTEMPTS:
                raise
            if attempt == 1:
                _tell(orders, clock, f"the drive is not safe yet, it is tried again: {error}")
            clock.sleep(QUICK_PAUSE_S if attempt < QUICK_ATTEMPTS else PAUSE_S)
        else:
            break
    return attempt


def send_at_once(link: Link, frames: tuple[SafeFrame, ...]) -> None:
    """Send those whose answers are told from others only by silence, at once and twice: one may be lost."""
    for _ in range(SENDS):
        if at_once := b"".join(frame.data for frame in frames if frame.quiet_s > QUIET_S):
            link.write(at_once)


def confirm(link: Link, frame: SafeFrame, clock: Clock) -> None:
    """Send one frame until the drive has answered it.

    Raises
    ------
    NoAnswer, LinkError
        It has not; the link was lost.
    """
    heard = b""
    for _ in range(SENDS):
        for _ in range(_DRAINS):
            if not link.read(CHUNK, frame.quiet_s):
                break
        link.write(frame.data)
        until, heard = clock.now() + frame.answer_s, b""
        while (left := until - clock.now()) > 0.0 and (data := link.read(CHUNK, left)):
            heard += data
            if re.search(frame.answer, heard):
                return
    raise NoAnswer(
        f"{link.name}: the drive did not confirm {frame.data!r} within {frame.answer_s:g} s, {SENDS} times; "
        f"last heard was {heard!r}"
    )


class Shared:
    """The owner's connection, a socket or a serial port, as a link. The flags the owner set on it stay."""

    def __init__(self, descriptor: int, clock: Clock) -> None:
        self._descriptor: int | None = descriptor
        self._clock = clock
        self.name = "the owner's connection"

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which it was handed to the system."""
        try:
            while data:
                if not select.select([], [self._open], [], ANSWER_S)[1]:
                    raise LinkError(f"{self.name} takes no bytes; open the link anew")
                data = data[os.write(self._open, data) :]
        except OSError as error:
            raise self._lost(error) from error
        return self._clock.now()

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        try:
            if not select.select([self._open], [], [], timeout_s)[0]:
                return b""
            data = os.read(self._open, max_bytes)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost("closed by the other end")
        return data

    def close(self) -> None:
        """End the connection, for the owner as well; closing twice is harmless."""
        if self._descriptor is not None:
            release(self._descriptor)
            self._descriptor = None

    @property
    def _open(self) -> int:
        if self._descriptor is None:
            raise LinkError(f"{self.name} is closed; open the link anew")
        return self._descriptor

    def _lost(self, reason: object) -> LinkError:
        return LinkError(f"{self.name} is lost ({reason}); open the link anew")


def release(descriptor: int) -> None:
    """Close a shared descriptor, and give up for all who have it what would keep others from opening the link.

    The copies of a descriptor are one connection and hold one lock: closing one of them ends neither.
    """
    with suppress(OSError):
        if stat.S_ISSOCK(os.fstat(descriptor).st_mode):
            with socket.socket(fileno=os.dup(descriptor)) as connection:
                connection.shutdown(socket.SHUT_RDWR)
        elif sys.platform != "win32":
            import fcntl  # noqa: PLC0415 - only POSIX has it

            fcntl.flock(descriptor, fcntl.LOCK_UN)
    with suppress(OSError):
        os.close(descriptor)


def _channel() -> socket.socket:
    """Return the channel to the owner: standard input itself, or on Windows what standard input describes."""
    if sys.platform == "win32":
        return socket.fromshare(sys.stdin.buffer.read())
    return socket.socket(fileno=sys.stdin.fileno())


def _tell(orders: Orders, clock: Clock, text: str) -> None:
    """Add a line to the log; a log that cannot be written is no reason to fail."""
    time = datetime.fromtimestamp(clock.now(), UTC).isoformat(timespec="milliseconds").removesuffix("+00:00")
    line = f"{time}Z dead-man process of {orders.url}: {text}\n"
    with suppress(OSError):
        if orders.log:
            with open(orders.log, "a", encoding="utf-8") as log:  # noqa: PTH123 - spares the import of pathlib
                log.write(line)
        else:
            sys.stderr.write(line)
            sys.stderr.flush()
