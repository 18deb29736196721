"""Whatever a client does, the owner goes on and other clients are served."""

import json
import socket
import threading
import time
from multiprocessing.connection import Client, answer_challenge, deliver_challenge

import pytest
from waiting import seconds_until

from clockdrive.control_socket import MAX_CLIENTS, MAX_REQUEST_BYTES, ControlClient, ControlServer
from clockdrive.errors import ClockdriveError, OwnerGone, Refused
from mounts.errors import DriveError, Unsynchronised
from mounts.tc410.registers import RegisterError
from pointing.errors import TargetError, Unreachable

KEY = b"k" * 32


class Telescope:
    """A handler with one call of each kind."""

    def __init__(self):
        self.released = threading.Event()
        self.emitted = []

    def __call__(self, call, args, emit):
        return getattr(self, call)(args, emit)

    def echo(self, args, _emit):
        return args

    def goto(self, args, emit):
        for n in range(args["steps"]):
            emit({"step": n})
        return {"steps": args["steps"]}

    def wait(self, _args, emit):
        emit({"waiting": True})
        return self.released.wait(20.0)

    def flood(self, args, emit):
        start = time.monotonic()
        self.emitted = [emit({"n": n, "text": "x" * 20_000}) for n in range(args["events"])]
        return time.monotonic() - start

    def refuse(self, args, _emit):
        raise {
            "refused": Refused("the horizon is 15.0°", 1.8e9),
            "target": TargetError("no such name"),
            "unreachable": Unreachable("the Sun is near", 1.9e9),
            "unsynchronised": Unsynchronised("power-cycle"),
            "kind": RegisterError("no register of this name"),
            "bug": ZeroDivisionError("division by zero"),
        }[args["how"]]

    def unspeakable(self, _args, _emit):
        return object()


@pytest.fixture
def telescope():
    return Telescope()


@pytest.fixture
def server(telescope):
    server = ControlServer(telescope, KEY)
    yield server
    telescope.released.set()
    server.close()
    server.close()


@pytest.fixture
def client(server):
    return ControlClient(server.address, KEY)


def connected(server, key=KEY):
    connection = Client(server.address)
    answer_challenge(connection, key)
    deliver_challenge(connection, key)
    return connection


def test_a_call_streams_events_and_returns_its_result(client):
    events = []
    assert client.call("goto", {"steps": 5}, events.append) == {"steps": 5}
    assert events == [{"step": n} for n in range(5)]
    assert client.call("echo", {"ra": "−0°", "x": [1, 2.5, None]}) == {"ra": "−0°", "x": [1, 2.5, None]}
    assert client.call("echo") == {}


def test_a_call_takes_milliseconds(client):
    start = time.perf_counter()
    for _ in range(20):
        client.call("echo", {"n": 1})
    each = (time.perf_counter() - start) / 20
    print(f"a call on the control socket: {each * 1e3:.2f} ms")
    assert each < 0.03


def test_errors_arrive_as_they_were_raised(client, caplog):
    with pytest.raises(Refused, match="horizon") as refused:
        client.call("refuse", {"how": "refused"})
    assert (refused.value.reason, refused.value.reachable_utc) == ("the horizon is 15.0°", 1.8e9)
    with pytest.raises(Unreachable, match="Sun") as unreachable:
        client.call("refuse", {"how": "unreachable"})
    assert unreachable.value.reachable == 1.9e9
    with pytest.raises(TargetError, match="no such name"):
        client.call("refuse", {"how": "target"})
    with pytest.raises(Unsynchronised, match="power-cycle"):
        client.call("refuse", {"how": "unsynchronised"})
    with pytest.raises(DriveError, match=r"^no register of this name$"):  # of which it is a kind
        client.call("refuse", {"how": "kind"})
    assert not caplog.records
    with pytest.raises(ClockdriveError, match="failed: ZeroDivisionError"):
        client.call("refuse", {"how": "bug"})
    with pytest.raises(ClockdriveError, match="failed: TypeError"):
        client.call("unspeakable")
    assert client.call("echo") == {}


def test_a_stop_is_served_while_a_goto_waits(client, telescope):
    results = []
    waiting = threading.Event()
    thread = threading.Thread(target=lambda: results.append(client.call("wait", {}, lambda _: waiting.set())))
    thread.start()
    assert waiting.wait(10.0)
    assert client.call("echo", {"stop": 1}) == {"stop": 1}
    telescope.released.set()
    thread.join(10.0)
    assert results == [True]


def test_a_wrong_key_is_refused_and_harms_nobody(server, client):
    with pytest.raises(OwnerGone, match="does not answer"):
        ControlClient(server.address, b"w" * 32).call("echo")
    assert not ControlClient(server.address, b"").answers()
    assert client.answers()


@pytest.mark.parametrize(
    "garbage",
    [
        b"",
        b"GET / HTTP/1.1\r\n\r\n",
        b"\xff" * 1000,
        b"\x00\x00\x00\x05",
        b"\x7f\xff\xff\xff" + b"x" * 100,
        bytes(range(256)) * 16,
    ],
)
def test_garbage_before_the_handshake_harms_nobody(server, client, garbage):
    for _ in range(3):
        with socket.create_connection(server.address) as raw:
            raw.sendall(garbage)
    assert client.call("echo", {"n": 1}) == {"n": 1}


@pytest.mark.parametrize(
    "request_",
    [b"", b"not json", b"[]", b"5", b"null", b'"x"', b"{}", b'{"call": 5}', b'{"call": "echo", "args": []}',
     b"\xff\xfe",
     b"[" * 100_000],
)  # fmt: skip
def test_a_request_that_is_none_is_answered_with_an_error(server, client, request_):
    with connected(server) as connection:
        connection.send_bytes(request_)
        answer = json.loads(connection.recv_bytes())
        assert answer["error"]["type"] == "InputError"
    assert client.call("echo") == {}


def test_a_huge_request_is_cut_off(server, client):
    with connected(server) as connection, pytest.raises((EOFError, OSError)):  # noqa: PT012 - either may notice
        connection.send_bytes(b"x" * (MAX_REQUEST_BYTES + 1))
        connection.recv_bytes()
    assert client.call("echo") == {}


def test_a_client_that_vanishes_does_not_end_its_call_badly(server, client, telescope):
    connection = connected(server)
    connection.send_bytes(json.dumps({"call": "wait"}).encode())
    connection.recv_bytes()
    connection.close()
    telescope.released.set()
    assert client.call("echo") == {}


def test_a_client_that_reads_nothing_never_delays_the_telescope(server, client, telescope):
    connection = connected(server)
    connection.send_bytes(json.dumps({"call": "flood", "args": {"events": 2000}}).encode())
    deadline = time.monotonic() + 10.0
    while len(telescope.emitted) < 2000 and time.monotonic() < deadline:
        assert client.call("echo") == {}
    assert len(telescope.emitted) == 2000
    connection.close()


def test_more_clients_than_places_are_sent_away_until_one_is_free(server, client):
    stalled = [socket.create_connection(server.address, timeout=10.0) for _ in range(MAX_CLIENTS)]
    for raw in stalled:
        assert raw.recv(1)  # the challenge: it has its place
    assert not client.answers()
    for raw in stalled:
        raw.close()
    seconds_until(client.answers)
    assert client.call("echo") == {}


def test_a_client_that_stalls_in_the_handshake_is_dropped_in_time(telescope, monkeypatch):
    monkeypatch.setattr("clockdrive.control_socket._HANDSHAKE_S", 1.0)
    server = ControlServer(telescope, KEY)
    with socket.create_connection(server.address, timeout=5.0) as raw:
        start = time.monotonic()
        while raw.recv(1000):
            pass
        assert time.monotonic() - start < 4.0
    server.close()


def test_a_stranger_on_the_port_is_no_owner(monkeypatch):
    monkeypatch.setattr("clockdrive.control_socket._HANDSHAKE_S", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        assert not ControlClient(stranger.getsockname(), KEY).answers()
    with pytest.raises(OwnerGone):
        ControlClient(("127.0.0.1", 1), KEY).call("echo")


def test_a_closed_server_takes_nobody(telescope):
    server = ControlServer(telescope, KEY)
    address = server.address
    server.close()
    assert not ControlClient(address, KEY).answers()
