"""A link over TCP: small messages leave at once, and a peer that is gone is noticed.

Every error of the socket leaves this file as `LinkError`, with the address and what to do.
"""

import socket

from transports.errors import LinkError
from transports.link import Clock

WRITE_TIMEOUT_S = 2.0

# A half-open connection is given up after about ten seconds; platforms know different ones of these.
_KEEPALIVE = {
    "TCP_KEEPIDLE": 4,  # seconds of silence before the first probe
    "TCP_KEEPALIVE": 4,  # the same on macOS
    "TCP_KEEPINTVL": 2,  # seconds between probes
    "TCP_KEEPCNT": 3,  # probes unanswered
    "TCP_USER_TIMEOUT": 10_000,  # milliseconds that sent bytes may stay unacknowledged
}


class TcpLink:
    """A connection to `host`:`port`, opened on construction.

    Parameters
    ----------
    host, port : str, int
        The peer.
    clock : Clock
        Stamps the times of what was sent.
    timeout_s : float
        How long connecting may take.

    Raises
    ------
    LinkError
        Nothing accepts the connection.
    """

    def __init__(self, host: str, port: int, clock: Clock, *, timeout_s: float = 2.0) -> None:
        self._clock = clock
        self._name = f"tcp://[{host}]:{port}" if ":" in host else f"tcp://{host}:{port}"
        try:
            self._socket = socket.create_connection((host, port), timeout_s)
            _watch(self._socket)
        except OSError as error:
            raise LinkError(
                f"{self._name}: cannot connect ({error}); check address, power and network, and that no other "
                "program is connected"
            ) from error

    @property
    def name(self) -> str:
        """The address, as `tcp://host:port`."""
        return self._name

    def fileno(self) -> int:
        """The descriptor of the connection; −1 when closed."""
        return self._socket.fileno()

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time from which on the far end can have had it.

        A busy host may go on long after the network has taken it, and be answered before it does.
        """
        begun = self._clock.now()
        try:
            self._socket.settimeout(WRITE_TIMEOUT_S)
            self._socket.sendall(data)
        except OSError as error:
            raise self._lost(error) from error
        return begun

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come, at least one byte; empty when nothing came within `timeout_s`."""
        try:
            self._socket.settimeout(max(timeout_s, 0.0))
            data = self._socket.recv(max_bytes)
        except (TimeoutError, BlockingIOError):
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._lost("closed by the other end")
        return data

    def close(self) -> None:
        """Close; closing twice is harmless."""
        self._socket.close()

    def _lost(self, reason: object) -> LinkError:
        self.close()
        return LinkError(f"{self._name}: the connection is lost ({reason}); connect again")


def _watch(connection: socket.socket) -> None:
    """Have small messages sent at once, and a peer that is gone noticed."""
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in _KEEPALIVE.items():
        if hasattr(socket, option):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
