"""Hosting a device for other programs: on a TCP port, or on a pseudo-terminal that looks like a serial port.

One client at a time, as small units do: a second one is turned away while the first is there. The device is called
from the server's own thread, and from no other.
"""

import os
import select
import socket
import threading
from abc import abstractmethod
from pathlib import Path
from urllib.parse import urlsplit

from transports.errors import LinkError
from transports.link import Clock
from transports.memory import BITS_PER_BYTE, Device, talks
from transports.open_link import host_and_port
from transports.running import Running

CHUNK = 4096
_LISTEN_S = 0.001  # from one look to the next whether a device says something unasked
ALLOWED = "tcp://127.0.0.1:10001 (port 0 takes a free one), pty: or pty:PATH"


class Server(Running):
    """A device being served."""

    def __init__(self, device: Device, clock: Clock, baud: int | None) -> None:
        self._device = device
        self._clock = clock
        self._byte_time = BITS_PER_BYTE / baud if baud else 0.0
        self._wake, self._waker = socket.socketpair()
        self._thread = threading.Thread(target=self._run, name=f"serving {self.address}", daemon=True)

    @property
    @abstractmethod
    def address(self) -> str:
        """What a client opens."""

    @abstractmethod
    def _run(self) -> None:
        """Serve until woken."""

    @abstractmethod
    def _release(self) -> None:
        """Give back what was taken of the system."""

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def close(self) -> None:
        """Stop answering and give up the address; closing twice is harmless."""
        if self._waker.fileno() < 0:
            return
        self._waker.close()
        if self._thread.ident is not None:
            self._thread.join()
        self._wake.close()
        self._release()

    @property
    def _patience_s(self) -> float | None:
        """How long clients may be waited for."""
        return _LISTEN_S if talks(self._device) else None

    def _said(self) -> bytes:
        """What the device says unasked, in its line time."""
        said = b""
        while talks(self._device) and (more := self._device.says(self._clock.now())) is not None:
            self._pace(more[1])
            said += more[1]
        return said

    def _answer(self, data: bytes) -> bytes:
        """Return the device's answer, each way taking its line time."""
        self._pace(data)
        answer = self._device.receive(data, self._clock.now())
        self._pace(answer)
        return answer

    def _pace(self, data: bytes) -> None:
        if self._byte_time:
            self._clock.sleep(len(data) * self._byte_time)


class TcpServer(Server):
    """A device on a TCP port."""

    def __init__(self, device: Device, clock: Clock, host: str, port: int, baud: int | None) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._listener = socket.create_server((host, port), family=family)
        except OSError as error:
            raise LinkError(f"tcp://{host}:{port}: cannot listen ({error}); choose another port") from error
        self._host = f"[{host}]" if ":" in host else host
        self._client: socket.socket | None = None
        super().__init__(device, clock, baud)

    @property
    def address(self) -> str:
        """What a client opens, with the port actually taken."""
        return f"tcp://{self._host}:{self._listener.getsockname()[1]}"

    def _run(self) -> None:
        while True:
            waiting = [self._wake, self._listener, *([self._client] if self._client else [])]
            ready, _, _ = select.select(waiting, [], [], self._patience_s)
            if self._wake in ready:
                return
            self._tell(self._said())
            if self._client in ready and self._client is not None:
                self._serve_client(self._client)
            if self._listener in ready:
                self._receive_client()

    def _tell(self, said: bytes) -> None:
        """What is said unasked is lost where nobody listens."""
        if said and self._client is not None:
            try:
                self._client.sendall(said)
            except OSError:
                self._client.close()
                self._client = None

    def _serve_client(self, client: socket.socket) -> None:
        try:
            data = client.recv(CHUNK)
            if data:
                client.sendall(self._answer(data))
                return
        except (OSError, LinkError):
            pass  # the client went, or the device dropped it: either way it is gone
        client.close()
        self._client = None

    def _receive_client(self) -> None:
        client, _ = self._listener.accept()
        if self._client is None:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
        else:
            client.close()

    def _release(self) -> None:
        self._listener.close()
        if self._client:
            self._client.close()


class PtyServer(Server):
    """A device on a pseudo-terminal, with a symbolic link to it at `path` where one is wanted."""

    def __init__(self, device: Device, clock: Clock, path: str, baud: int | None) -> None:
        self._controller, self._terminal = _raw_terminal()
        self._link = _symbolic_link(Path(path), os.ttyname(self._terminal)) if path else None
        super().__init__(device, clock, baud)

    @property
    def address(self) -> str:
        """What a client opens."""
        return f"serial://{self._link or os.ttyname(self._terminal)}"

    def _run(self) -> None:
        while True:
            ready, _, _ = select.select([self._wake.fileno(), self._controller], [], [], self._patience_s)
            if self._wake.fileno() in ready:
                return
            said = self._said()
            if said and select.select([], [self._controller], [], 0.0)[1]:  # else nobody has listened for long
                os.write(self._controller, said)
            if self._controller not in ready:
                continue
            try:
                os.write(self._controller, self._answer(os.read(self._controller, CHUNK)))
            except LinkError:
                continue  # a serial line cannot be dropped; the answer is lost

    def _release(self) -> None:
        os.close(self._controller)
        os.close(self._terminal)
        if self._link:
            self._link.unlink(missing_ok=True)


def serve(device: Device, clock: Clock, listen: str, *, baud: int | None = None) -> Server:
    """Return a server of `device` at `listen`, not started yet.

    Parameters
    ----------
    device : Device
        What answers.
    clock : Clock
        Stamps what arrives, and paces.
    listen : str
        `tcp://HOST:PORT`, `pty:` or `pty:PATH`.
    baud : int, optional
        Pace the answers as a line of this rate would; none answers at once.

    Raises
    ------
    LinkError
        The address is malformed or taken.
    """
    if listen.startswith("pty:"):
        return PtyServer(device, clock, listen.removeprefix("pty:"), baud)
    try:
        parts = urlsplit(listen)
        if parts.scheme == "tcp":
            return TcpServer(device, clock, *host_and_port(parts), baud)
    except ValueError as error:
        raise LinkError(f"cannot listen at {listen!r}: {error}; allowed are {ALLOWED}") from error
    raise LinkError(f"cannot listen at {listen!r}; allowed are {ALLOWED}")


def addresses(listen: str, count: int) -> list[str]:
    """Where to listen with several lines: on the ports that follow, each on a free one, or at names with a number.

    Raises
    ------
    LinkError
        The address is malformed.
    """
    if listen.startswith("pty:"):
        path = listen.removeprefix("pty:")
        return [listen, *(f"{listen}-{number}" if path else listen for number in range(2, count + 1))]
    try:
        parts = urlsplit(listen)
        host, port = host_and_port(parts)
    except ValueError as error:
        raise LinkError(f"cannot listen at {listen!r}: {error}; allowed are {ALLOWED}") from error
    named = f"[{host}]" if ":" in host else host
    return [f"{parts.scheme}://{named}:{port + number if port else 0}" for number in range(count)]


def _raw_terminal() -> tuple[int, int]:
    """Return controller and terminal of a new pseudo-terminal that changes no byte.

    The terminal is held open too: a client may come and go.
    """
    try:
        import tty  # noqa: PLC0415 - only POSIX has it

        controller, terminal = os.openpty()
    except (ImportError, AttributeError, OSError) as error:
        raise LinkError(f"pty: no pseudo-terminal to be had here ({error}); listen at tcp:// instead") from error
    tty.setraw(terminal)
    return controller, terminal


def _symbolic_link(path: Path, target: str) -> Path:
    """Return the absolute `path`, now a link to `target`; an old link there is replaced, anything else is not."""
    path = path.absolute()
    if path.is_symlink():
        path.unlink()
    try:
        path.symlink_to(target)
    except OSError as error:
        raise LinkError(f"pty:{path}: cannot be made ({error}); name a path that is free") from error
    return path
