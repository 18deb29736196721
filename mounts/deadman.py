"""The dead-man process, as its owner holds it: a small process beside a motion that would go on without its host.

The drive's connection is shared with the process (on POSIX), so that it gets through even where the unit serves one
client at a time and the owner, frozen, still holds that place. For that the links are opened through `sharing`.
Where nothing can be shared, on Windows or with a link that has no descriptor, the process opens the link itself: it
then gets through when the owner is dead, but to such a unit, or to a serial port, not while a frozen owner holds it.

The drive is told to be safe by one fixed sequence of frames, each with its own answer. What the process does with
them stands in `deadman_process`.
"""

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from mounts.deadman_process import (
    ARM,
    BEAT,
    DISARM,
    EASE,
    FAILED,
    HASTEN,
    READY,
    SAFE,
    SHARE,
    WITHDRAW,
    Orders,
    SafeFrame,
    release,
)
from mounts.errors import DriveError
from transports.errors import LinkError
from transports.link import Link
from transports.running import Running

START_S = 5.0  # to be ready, on a computer that is very busy
END_S = 1.0  # to end when it is not needed any more


class DeadManError(DriveError):
    """There is no dead-man process beside a motion that needs one."""


@runtime_checkable
class Described(Protocol):
    """A link that has a descriptor of the system's."""

    def fileno(self) -> int:
        """The descriptor; −1 when closed."""
        ...


class DeadMan(Running):
    """A dead-man process for one drive, from `start` to `close`, or while it is a context manager.

    Leaving the context armed, as an exception does, lets the process make the drive safe.

    Parameters
    ----------
    url : str
        The drive's link, as `transports.open_link` takes it.
    frames : sequence of SafeFrame
        What makes the drive safe, in this order.
    program : str
        The module that calls `deadman_process.run` with its only argument and the system's clock.
    silence_s : float
        How long an armed owner may be silent. Longer than any one exchange with the drive may take.
    hasty_s, easy_s : float, optional
        Likewise from `hasten` and from `ease` on.
    log : Path, optional
        A file to which the process adds a line when it has acted; stderr where there is none.

    Raises
    ------
    DeadManError
        There are no frames, or `silence_s` is not positive.
    """

    def __init__(
        self,
        url: str,
        frames: Sequence[SafeFrame],
        *,
        program: str,
        silence_s: float = 0.4,
        hasty_s: float | None = None,
        easy_s: float | None = None,
        log: Path | None = None,
    ) -> None:
        if not frames:
            raise DeadManError("a dead-man process without frames would save nobody; give it the drive's safe frames")
        if not silence_s > 0.0:
            raise DeadManError(f"the dead-man's silence of {silence_s:g} s must be above 0; 0.4 s is usual")
        self._orders = Orders(
            url,
            tuple(frames),
            silence_s,
            str(log.absolute()) if log else "",
            silence_s if hasty_s is None else hasty_s,
            silence_s if easy_s is None else easy_s,
        )
        self._program = program
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None
        self._shared: int | None = None
        self._armed = False
        self._silence_s = silence_s  # allowed now

    @property
    def alive(self) -> bool:
        """Whether the process runs and listens."""
        return self._channel is not None and self._process is not None and self._process.poll() is None

    @property
    def fate(self) -> str:
        """What became of the process, for a person; empty while it is alive."""
        if self.alive:
            return ""
        if self._process is None:
            return "the dead-man process is not started"
        match self._process.poll():
            case None:
                return "the dead-man process does not listen any more: it is making the drive safe, or hangs"
            case code if code == SAFE:
                return (
                    f"the dead-man process stopped the drive, having heard nothing for {self._silence_s:g} s; "
                    "read the drive's state before moving again"
                )
            case code if code == FAILED:
                return "the dead-man process could not reach the drive; stop it by hand or switch its power off"
            case code:
                return f"the dead-man process ended by itself (status {code}); stop the motion and start again"

    def start(self) -> None:
        """Start the process, unarmed, and wait until it listens.

        Raises
        ------
        DeadManError
            It did not start.
        """
        self.close()
        ours, theirs = socket.socketpair()
        try:
            with theirs:
                self._process = _started(self._program, self._orders, theirs)
                ours.settimeout(START_S)
                ready = ours.recv(1) == bytes((READY,))
        except OSError:
            ready = False
        if not ready:
            ours.close()
            self._kill()
            raise DeadManError(
                f"the dead-man process `{self._program}` did not start within {START_S:g} s; "
                "nothing may be moved that would go on without its host: see what it printed, and install anew"
            )
        ours.settimeout(0.0)
        self._channel = ours
        if self._shared is not None:
            self._tell(SHARE, self._shared)

    def arm(self) -> None:
        """From now on the process acts when this one is gone or silent; called before the motion begins.

        Raises
        ------
        DeadManError
            There is no process to arm; nothing may be moved.
        """
        self._armed, self._silence_s = True, self._orders.silence_s
        self._tell(ARM)
        if not self.alive:
            raise DeadManError(self.fate)

    def hasten(self) -> None:
        """A motion must end soon: the process waits only `hasty_s` from now on, until `arm` or `disarm`."""
        self._silence_s = self._orders.hasty_s
        self._tell(HASTEN)

    def ease(self) -> None:
        """What moves is slow: the process waits `easy_s` from now on, until `arm`, `hasten` or `disarm`."""
        self._silence_s = self._orders.easy_s
        self._tell(EASE)

    def beat(self) -> bool:
        """Say that the owner lives; return whether the process still does.

        It takes microseconds and never waits. Beat before each order to the drive, and give none when it is False.
        """
        self._tell(BEAT)
        return self.alive

    def disarm(self) -> None:
        """The motion has ended well: from now on the process does nothing, and sends nothing."""
        self._armed = False
        self._tell(DISARM)

    def share(self, descriptor: int) -> None:
        """Let the process act on this connection, instead of one shared before."""
        self._shared = descriptor
        self._tell(SHARE, descriptor)

    def withdraw(self) -> None:
        """The connection shared last is ended; without one the process opens the link itself."""
        self._shared = None
        self._tell(WITHDRAW)

    def sharing(self, open_link: Callable[[], Link]) -> Callable[[], Link]:
        """Return what opens links like `open_link`, each shared with the process while it is open."""
        return lambda: _SharedLink(open_link(), self)

    def close(self) -> None:
        """End the process, or leave it alone with the drive when it is armed; closing twice is harmless."""
        if self._channel is not None:
            self._channel.close()
            self._channel = None
        process, self._process = self._process, None
        if process is None:
            return
        if self._armed:  # its end is awaited, so that no zombie is left, but not here
            self._armed = False
            threading.Thread(target=process.wait, name="dead-man process", daemon=True).start()
            return
        try:
            process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process = process
            self._kill()

    def _tell(self, message: int, descriptor: int | None = None) -> None:
        """Send one message. Where it cannot be sent nobody listens: neither then nor later."""
        if self._channel is None:
            return
        try:
            if sys.platform == "win32" or descriptor is None:
                self._channel.send(bytes((message,)))
            else:
                socket.send_fds(self._channel, [bytes((message,))], [descriptor])
        except OSError:
            self._channel.close()
            self._channel = None

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


class _SharedLink:
    """A link whose connection the dead-man process may use while it is open."""

    def __init__(self, link: Link, dead_man: DeadMan) -> None:
        self._link = link
        self._dead_man = dead_man
        self._copy: int | None = None
        if sys.platform != "win32" and isinstance(link, Described):
            self._copy = os.dup(link.fileno())
            dead_man.share(self._copy)

    @property
    def name(self) -> str:
        """The name of the link shared."""
        return self._link.name

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left."""
        try:
            return self._link.write(data)
        except LinkError:
            self.close()
            raise

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        try:
            return self._link.read(max_bytes, timeout_s)
        except LinkError:
            self.close()
            raise

    def close(self) -> None:
        """Close, for the dead-man process as well, so that the unit sees it and the port is free."""
        if self._copy is not None:
            self._dead_man.withdraw()
            release(self._copy)
            self._copy = None
        self._link.close()


def _started(program: str, orders: Orders, channel: socket.socket) -> "subprocess.Popen[bytes]":
    """Start the process, which imports what this one can; a Ctrl-C at the terminal does not reach it."""
    command = [sys.executable, "-P", "-m", program, orders.as_text()]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    if sys.platform == "win32":
        process = subprocess.Popen(  # noqa: S603 - our own program
            command,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            creationflags=subprocess.CREATE_NEW_PROCESS_GROUP,
        )
        if process.stdin is not None:
            with process.stdin as description:
                description.write(channel.share(process.pid))
        return process
    process = subprocess.Popen(  # noqa: S603 - likewise
        command, env=environment, stdin=channel.fileno(), stdout=subprocess.DEVNULL, start_new_session=True
    )
    channel.close()  # so that its end is seen when the process dies at once
    return process
