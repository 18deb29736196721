"""The known faults of a Modbus-ASCII line, byte for byte on a real socket: recovered from or told, never a value.

The server plays a script: for each request the pieces it sends and the pauses before them. Every one of these is
taken for a good answer, or for none, by a client in wide use.
"""

import contextlib
import socket
import threading
import time

import pytest
from waiting import PATIENCE_S, seconds_until

from transports.ascii_frame import encode_frame
from transports.errors import ExceptionReply, LinkError, NoAnswer, WrongAnswer
from transports.modbus_ascii import ModbusAscii
from transports.tcp import TcpLink

TIMEOUT_S = 0.15
REQUEST = b":FF0300500002AC\r\n"
RIGHT = b":FF0304008000007A\r\n"
OLDER = encode_frame(0xFF, bytes.fromhex("03 04 DEAD BEEF"))
MARKER_REQUEST = b":FF0300500001AD\r\n"
MARKER = encode_frame(0xFF, bytes.fromhex("03 02 0080"))
VALUES = (0x0080, 0x0000)
HANG_UP = object()


class ScriptedServer:
    """Answers the requests in turn with lists of bytes, pauses in seconds, events to wait for, or `HANG_UP`."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.requests = []
        self.connections = 0
        self.played = 0
        """How many of the answers have been given to their end."""
        self._client = None
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._listener.shutdown(socket.SHUT_RDWR)
        if self._client:
            with contextlib.suppress(OSError):
                self._client.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._listener.close()

    def _run(self):
        while True:
            try:
                client, _ = self._listener.accept()
                self._client = client
            except OSError:
                return
            self.connections += 1
            with client:
                self._serve(client)

    def _serve(self, client):
        try:
            while request := client.recv(4096):
                self.requests.append(request)
                for step in self.answers.pop(0) if self.answers else []:
                    if isinstance(step, threading.Event):
                        step.wait(PATIENCE_S)
                    elif isinstance(step, float):
                        time.sleep(step)
                    elif step is HANG_UP:
                        client.shutdown(socket.SHUT_RDWR)
                    else:
                        client.sendall(step)
                self.played += 1
        except OSError:
            return


def master(server, clock):
    return ModbusAscii(lambda: TcpLink("127.0.0.1", server.port, clock), clock, timeout_s=TIMEOUT_S, deadline_s=1.0)


RECOVERED = {
    "whole": [[RIGHT]],
    "byte by byte": [[piece for byte in RIGHT for piece in (bytes((byte,)), 0.001)]],
    "noise before": [[b"\x00\xfe\x80noise" + RIGHT]],
    "noise with a colon before": [[b"?:12" + RIGHT]],
    "a broken frame before": [[b":FF030400" + RIGHT]],
    "a frame with a wrong LRC before": [[b":FF0304008000007B\r\n" + RIGHT]],
    "bytes that are no hexadecimal": [[b":FF03zz\r\n" + RIGHT]],
    "a stray line end before": [[b"\r\n\r\n" + RIGHT]],
    "CR alone": [[RIGHT[:-1]]],
    "CR, then LF late": [[RIGHT[:-1], 0.03, b"\n"]],
    "lower case": [[RIGHT.lower()]],
    "the request echoed, then the answer": [[REQUEST + RIGHT]],
    "another function, then the answer": [[encode_frame(0xFF, bytes.fromhex("04 04 DEAD BEEF")) + RIGHT]],
    "another unit, then the answer": [[encode_frame(0x01, bytes.fromhex("03 04 DEAD BEEF")) + RIGHT]],
    "too few registers, then the answer": [[encode_frame(0xFF, bytes.fromhex("03 02 DEAD")) + RIGHT]],
    "another's refusal, then the answer": [[encode_frame(0xFF, b"\x84\x02") + RIGHT]],
    "lost": [[], [MARKER], [RIGHT]],
    "wrong LRC": [[b":FF0304008000007B\r\n"], [MARKER], [RIGHT]],
    "wrong function": [[encode_frame(0xFF, bytes.fromhex("04 04 DEAD BEEF"))], [MARKER], [RIGHT]],
    "wrong function, a write": [[encode_frame(0xFF, bytes.fromhex("10 0050 0002"))], [MARKER], [RIGHT]],
    "wrong count": [[encode_frame(0xFF, bytes.fromhex("03 06 DEAD BEEF 0000"))], [MARKER], [RIGHT]],
    "byte count that lies": [[encode_frame(0xFF, bytes.fromhex("03 04 DEAD"))], [MARKER], [RIGHT]],
    "only the request echoed": [[REQUEST], [MARKER_REQUEST + MARKER], [RIGHT]],
    "two answers": [[OLDER + RIGHT], [MARKER], [RIGHT]],
    "too late": [[2 * TIMEOUT_S, OLDER], [MARKER], [RIGHT]],
    "too late, through a bridge that keeps it": [[], [OLDER + MARKER], [RIGHT]],
    "hung up": [[HANG_UP], [MARKER], [RIGHT]],
    "hung up within the answer": [[RIGHT[:9], HANG_UP], [MARKER], [RIGHT]],
}


@pytest.mark.parametrize("script", RECOVERED.values(), ids=RECOVERED)
def test_recovers_the_right_value(script, real_clock):
    with ScriptedServer(*script) as server:
        modbus = master(server, real_clock)
        values = read_until_answered(modbus)
        modbus.close()
    assert values == VALUES
    assert set(server.requests) <= {REQUEST, MARKER_REQUEST}


def read_until_answered(modbus):
    """Read as a session does: at the next poll again, when this one failed."""
    for _ in range(3):
        try:
            return modbus.read_holding_registers(0x50, 2).values
        except (NoAnswer, WrongAnswer):
            continue
    return None


TOLD = {
    "silence": ([[], []], NoAnswer, "did not answer within 0.15 s"),
    "noise alone": ([[b"\xff" * 100], [b"zz:zz\r\n"]], NoAnswer, "did not answer"),
    "another unit": (
        [[encode_frame(1, b"\3\4\0\0\0\0")], [encode_frame(1, b"\3\2\0\0")]],
        WrongAnswer,
        "by unit 1 with",
    ),
    "a refusal": ([[encode_frame(0xFF, b"\x83\2")]], ExceptionReply, "exception 2, illegal address"),
    "hung up each time": ([[HANG_UP], [HANG_UP], [HANG_UP], [HANG_UP]] * 5, LinkError, "connection is lost"),
}


@pytest.mark.parametrize(("script", "error", "text"), TOLD.values(), ids=TOLD)
def test_tells_what_happened_within_the_deadline(script, error, text, real_clock):
    with ScriptedServer(*script) as server:
        modbus = master(server, real_clock)
        begun = time.monotonic()
        with pytest.raises(error, match=text):
            modbus.read_holding_registers(0x50, 2)
        lasted = time.monotonic() - begun
        modbus.close()
    assert lasted < 1.0 + TIMEOUT_S + 0.5


@pytest.mark.parametrize("echo", [b":FF060070000289\r\n", b":FF060071000189\r\n", b":FF10007000018F\r\n"])
def test_a_write_is_believed_only_with_its_own_echo(echo, real_clock):
    with ScriptedServer([echo]) as server:
        modbus = master(server, real_clock)
        with pytest.raises((WrongAnswer, NoAnswer)):
            modbus.write_register(0x70, 1)
        modbus.close()
    assert len(server.requests) == 1


def test_an_answer_is_never_one_behind(real_clock):
    """The late answer to the first poll must not become the answer to the second, nor the second's the third's."""
    late = [TIMEOUT_S + 0.02, OLDER]
    with ScriptedServer([RIGHT], late, [MARKER], [RIGHT], [RIGHT]) as server:
        modbus = master(server, real_clock)
        for _ in range(3):
            assert modbus.read_holding_registers(0x50, 2).values == VALUES
        modbus.close()


def test_a_frame_nobody_asked_for_is_not_the_next_answer(real_clock):
    read = threading.Event()
    with ScriptedServer([RIGHT, read, OLDER], [MARKER], [RIGHT]) as server:
        modbus = master(server, real_clock)
        assert modbus.read_holding_registers(0x50, 2).values == VALUES
        read.set()
        seconds_until(lambda: server.played == 1)
        assert modbus.read_holding_registers(0x50, 2).values == VALUES
        modbus.close()
    assert server.requests == [REQUEST, MARKER_REQUEST, REQUEST]


def test_waits_for_a_session_that_lingers(real_clock):
    """The unit serves one client at a time; the last one's connection ends only after a while."""
    with ScriptedServer([RIGHT]) as server:
        lingering = TcpLink("127.0.0.1", server.port, real_clock)
        threading.Timer(0.2, lingering.close).start()
        modbus = master(server, real_clock)
        assert read_until_answered(modbus) == VALUES
        modbus.close()


def test_refused_is_told_with_what_to_do(real_clock):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    modbus = ModbusAscii(lambda: TcpLink("127.0.0.1", port, real_clock), real_clock, timeout_s=0.1, deadline_s=0.5)
    with pytest.raises(
        LinkError, match=rf"tcp://127.0.0.1:{port}: cannot connect .*check address.*one client at a time"
    ):
        modbus.read_coils(0, 1)


def test_a_connection_closed_between_requests_is_opened_again_before_a_write(real_clock):
    echo = b":FF050000FF00FD\r\n"
    read = threading.Event()
    with ScriptedServer([RIGHT, read, HANG_UP], [echo]) as server:
        modbus = master(server, real_clock)
        assert modbus.read_holding_registers(0x50, 2).values == VALUES
        read.set()
        seconds_until(lambda: server.played == 1)
        assert modbus.write_coil(0, value=True).values == (1,)
        modbus.close()
    assert server.requests == [REQUEST, echo]
    assert server.connections == 2
