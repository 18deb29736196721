"""How commands reach the process that owns the telescope: JSON messages on a loopback connection behind a shared key.

A call is one connection: after `multiprocessing.connection`'s challenge both ways, the client sends
`{"call": name, "args": {...}}`, the owner answers any number of `{"event": ...}` and then one `{"result": ...}` or
`{"error": {...}}`. Nothing is ever unpickled. Each client has its own threads, so one that stalls, sends garbage or
vanishes is only ever its own trouble; events that it does not take in time are dropped.
"""

import json
import logging
import queue
import socket
import struct
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener, answer_challenge, deliver_challenge
from typing import Any, final

from clockdrive.errors import (
    ArgumentError,
    ClockdriveError,
    InputError,
    OwnerGone,
    Refused,
    StateError,
    TargetFormError,
)
from mounts.errors import DriveError, DriveRefused, Unsynchronised, WrongProtocol
from pointing.errors import PointingError, TargetError, Unreachable
from transports.errors import LinkError, NoAnswer, TransportError, WrongAnswer

Emit = Callable[[Mapping[str, object]], bool]  # whether the client still listens
Handler = Callable[[str, dict[str, Any], Emit], object]

MAX_REQUEST_BYTES = 1 << 20
MAX_CLIENTS = 32
_HANDSHAKE_S = 5.0
_SEND_S = 10.0
_OUTBOX = 200  # events kept for a slow client
_LOG = logging.getLogger(__name__)

_KNOWN: dict[str, type[Exception]] = {
    error.__name__: error
    for error in (
        ClockdriveError, InputError, ArgumentError, TargetFormError, Refused, StateError,
        PointingError, TargetError, Unreachable,
        DriveError, DriveRefused, Unsynchronised, WrongProtocol,
        TransportError, LinkError, NoAnswer, WrongAnswer,
    )
}  # fmt: skip


@final
class ControlServer:
    """Answers clients until closed.

    Parameters
    ----------
    handler : callable
        `handler(call, args, emit) -> result`, called on the client's own thread; what it raises goes to the client.
        `emit` never blocks, and may be called from any thread.
    key : bytes
        Shared with the clients.
    """

    def __init__(self, handler: Handler, key: bytes) -> None:
        self._handler = handler
        self._key = key
        self._slots = threading.BoundedSemaphore(MAX_CLIENTS)
        self._closing = False
        self._listener = Listener(("127.0.0.1", 0), "AF_INET", backlog=16)
        self._thread = threading.Thread(target=self._accept, name="control socket", daemon=True)
        self._thread.start()

    @property
    def address(self) -> tuple[str, int]:
        """Host and port."""
        address = self._listener.address
        if not isinstance(address, tuple):
            raise TypeError(address)
        return str(address[0]), int(address[1])

    def close(self) -> None:
        """Accept no more clients; calls under way go on. Closing twice is harmless."""
        if self._closing:
            return
        address, self._closing = self.address, True
        with suppress(OSError), socket.create_connection(address, timeout=1.0):
            pass  # wakes the thread out of its wait
        self._thread.join(timeout=2.0)
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                connection = self._listener.accept()
            except OSError:
                if self._closing:
                    return
                continue
            if self._closing or not self._slots.acquire(blocking=False):
                connection.close()
                if self._closing:
                    return
                continue
            threading.Thread(target=self._attend, args=(connection,), name="control client", daemon=True).start()

    def _attend(self, connection: Connection) -> None:
        try:
            with connection:
                _limit(connection, _HANDSHAKE_S)
                deliver_challenge(connection, self._key)
                answer_challenge(connection, self._key)
                request = connection.recv_bytes(MAX_REQUEST_BYTES)
                outbox = _Outbox(connection)
                outbox.finish(self._answer(request, outbox.emit))
        except (AuthenticationError, EOFError, OSError, ValueError, AssertionError) as error:
            _LOG.debug("a client of the control socket went away: %r", error)
        finally:
            self._slots.release()

    def _answer(self, request: bytes, emit: Emit) -> Mapping[str, object]:
        try:
            call, args = _request(request)
            result = self._handler(call, args, emit)
            json.dumps(result)
        except Exception as error:  # noqa: BLE001 - the owner outlives whatever a call does; the client is told
            if _known(error) is None:
                _LOG.exception("a call on the control socket failed")
            return {"error": _described(error)}
        return {"result": result}


def _request(data: bytes) -> tuple[str, dict[str, Any]]:
    try:
        request = json.loads(data)
        call, args = request["call"], request.get("args", {})
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        call, args = None, None
    if not isinstance(call, str) or not isinstance(args, dict):
        raise InputError('the request is not {"call": name, "args": {...}}: use the `clockdrive` command')
    return call, args


class _Outbox:
    """Messages on their way to one client, sent by a thread of their own."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._messages: queue.Queue[Mapping[str, object] | None] = queue.Queue(_OUTBOX)
        self._gone = False
        _limit(connection, _SEND_S)
        self._thread = threading.Thread(target=self._send, name="control client outbox", daemon=True)
        self._thread.start()

    def emit(self, event: Mapping[str, object]) -> bool:
        with suppress(queue.Full):
            self._messages.put_nowait({"event": dict(event)})
        return not self._gone

    def finish(self, answer: Mapping[str, object]) -> None:
        with suppress(queue.Full):
            self._messages.put(answer, timeout=_SEND_S)
            self._messages.put(None, timeout=_SEND_S)
        self._thread.join(timeout=2 * _SEND_S)

    def _send(self) -> None:
        while (message := self._messages.get()) is not None:
            if self._gone:
                continue
            try:
                self._connection.send_bytes(json.dumps(message, default=str).encode())
            except (OSError, ValueError):
                self._gone = True


def _known(error: Exception) -> str | None:
    """The error that a client knows and this one is, or is a kind of."""
    return next((kind.__name__ for kind in type(error).__mro__ if _KNOWN.get(kind.__name__) is kind), None)


def _described(error: Exception) -> dict[str, object]:
    described: dict[str, object] = {"type": _known(error) or type(error).__name__, "message": str(error)}
    reachable = getattr(error, "reachable_utc", getattr(error, "reachable", None))
    return described if reachable is None else {**described, "reachable": reachable}


def _error(described: Mapping[str, Any]) -> Exception:
    """The error that the owner met, as this process's own."""
    kind, message = _KNOWN.get(str(described.get("type"))), str(described.get("message"))
    if kind is None:
        return ClockdriveError(f"the owner of the telescope failed: {described.get('type')}: {message}")
    if issubclass(kind, Refused | Unreachable):
        return kind(message, described.get("reachable"))
    return kind(message)


def _limit(connection: Connection, seconds: float) -> None:
    """Make no wait for the other side last longer (0: for ever), and send small messages at once."""
    pair = struct.pack("L", int(seconds * 1e3)) if sys.platform == "win32" else struct.pack("ll", int(seconds), 0)
    with socket.socket(fileno=_duplicate(connection)) as handle:
        handle.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, pair)
        handle.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, pair)
        handle.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _duplicate(connection: Connection) -> int:
    return socket.dup(connection.fileno())


@final
@dataclass(frozen=True)
class ControlClient:
    """Calls the owner of a telescope; each call is a connection of its own, so calls may overlap.

    Parameters
    ----------
    address : (str, int)
        Host and port of the owner's control socket.
    key : bytes
        Shared with the owner.
    """

    address: tuple[str, int]
    key: bytes

    def call(
        self,
        name: str,
        args: Mapping[str, object] | None = None,
        on_event: Callable[[dict[str, Any]], None] | None = None,
    ) -> Any:  # noqa: ANN401 - JSON
        """Ask the owner to do something and wait until it is done.

        Raises
        ------
        OwnerGone
            The owner cannot be reached, or ended before it answered.
        Exception
            The error that the owner met, as one of ours.
        """
        with self._connected() as connection:
            message = self._exchange(connection, name, {"call": name, "args": dict(args or {})})
            while "event" in message:
                if on_event is not None:
                    on_event(message["event"])
                message = self._exchange(connection, name)
        if "error" in message:
            raise _error(message["error"])
        return message.get("result")

    def answers(self) -> bool:
        """Whether the owner is there and knows the key."""
        try:
            self._connected().close()
        except OwnerGone:
            return False
        return True

    def _exchange(self, connection: Connection, name: str, request: object = None) -> dict[str, Any]:
        """Send `request`, when there is one, and return the next message."""
        try:
            if request is not None:
                connection.send_bytes(json.dumps(request).encode())
            message = json.loads(connection.recv_bytes())
            return message if isinstance(message, dict) else {"error": {"message": f"it answered {message}"}}
        except (EOFError, OSError, json.JSONDecodeError) as error:
            text = (
                f"the owner of the telescope ended during `{name}`: the telescope may still be moving; "
                "run `clockdrive stop`, which makes it safe"
            )
            raise OwnerGone(text) from error

    def _connected(self) -> Connection:
        connection = None
        try:
            connection = Client(self.address, "AF_INET")
            _limit(connection, _HANDSHAKE_S)
            answer_challenge(connection, self.key)
            deliver_challenge(connection, self.key)
            _limit(connection, 0.0)
        except (AuthenticationError, EOFError, OSError, ValueError, AssertionError) as error:
            if connection is not None:
                connection.close()
            host, port = self.address
            text = f"the owner of the telescope does not answer on {host}:{port} ({error or type(error).__name__})"
            raise OwnerGone(f"{text}: see `clockdrive status`, or start it again") from error
        return connection
