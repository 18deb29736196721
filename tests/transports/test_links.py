"""TCP and serial links, what opens them, what records them, and what hosts a device for them."""

import os
import socket
import sys
import time

import pytest

from transports.errors import LinkError
from transports.memory import MemoryLink
from transports.modbus_ascii import ModbusAscii
from transports.open_link import open_link
from transports.recording import RecordingLink
from transports.serve import serve

READ = b":FF0300500002AC\r\n"

posix = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are a matter of POSIX")
LISTENS = ["tcp://127.0.0.1:0", pytest.param("pty:", marks=posix)]


@pytest.mark.parametrize("listen", LISTENS)
def test_a_hosted_unit_answers(listen, unit, real_clock):
    with serve(unit, real_clock, listen) as server:
        modbus = ModbusAscii(lambda: open_link(server.address, real_clock), real_clock)
        first = modbus.read_holding_registers(0x50, 2)
        begun = time.perf_counter()
        for call in range(2, 102):
            answer = modbus.read_holding_registers(0x60, 2)
            assert answer.values == (call << 8 | 0x60, call << 8 | 0x61)
            assert answer.sent <= answer.received
        print(f"{listen} {1e1 * (time.perf_counter() - begun):.2f} ms a request")
        modbus.close()
    assert first.values == (0x150, 0x151)


@pytest.mark.parametrize("listen", LISTENS)
def test_a_link_reads_with_a_deadline_and_stamps_what_it_sends(listen, unit, real_clock):
    with serve(unit, real_clock, listen) as server:
        link = open_link(server.address, real_clock)
        begun = time.monotonic()
        assert link.read(100, 0.05) == b""
        assert 0.045 < time.monotonic() - begun < 0.3
        assert link.read(100, 0.0) == b""
        before = time.time()
        assert before <= link.write(READ) <= time.time()
        come = b""
        while len(come) < 19:
            come += link.read(5, 1.0)
        assert come.startswith(b":FF030401500151")
        link.close()
        link.close()
        with pytest.raises(LinkError, match=r"again"):
            link.read(1, 0.0)
        with pytest.raises(LinkError, match=r"again"):
            link.write(READ)


@pytest.mark.parametrize("listen", LISTENS)
def test_pacing_takes_the_line_time(listen, unit, real_clock):
    with serve(unit, real_clock, listen, baud=9600) as server:
        modbus = ModbusAscii(lambda: open_link(server.address, real_clock), real_clock)
        modbus.read_coils(0, 1)
        begun = time.perf_counter()
        modbus.read_holding_registers(0x50, 2)
        lasted = time.perf_counter() - begun
        modbus.close()
    print(f"{listen} paced to 9600 baud: {1e3 * lasted:.1f} ms for 37.5 ms of line")
    assert 0.0375 <= lasted < 0.15


def test_a_second_client_is_turned_away_until_the_first_is_gone(unit, real_clock):
    with serve(unit, real_clock, "tcp://127.0.0.1:0") as server:
        first = open_link(server.address, real_clock)
        first.write(READ)
        assert first.read(100, 1.0)
        second = open_link(server.address, real_clock)
        with pytest.raises(LinkError, match="closed by the other end"):
            second.read(1, 1.0)
        first.close()
        third = open_link(server.address, real_clock)
        third.write(READ)
        assert third.read(100, 1.0)
        third.close()


def test_what_a_device_drops_is_a_lost_connection(real_clock):
    class Dropping:
        def receive(self, _data, _t):
            raise LinkError("dropped")

    with serve(Dropping(), real_clock, "tcp://127.0.0.1:0") as server:
        link = open_link(server.address, real_clock)
        link.write(READ)
        with pytest.raises(LinkError, match="connection is lost"):
            link.read(1, 1.0)


def test_a_port_in_use_is_told(unit, real_clock):
    with (
        serve(unit, real_clock, "tcp://127.0.0.1:0") as server,
        pytest.raises(LinkError, match="choose another port"),
    ):
        serve(unit, real_clock, server.address)


@posix
def test_a_terminal_gets_the_name_wanted_and_gives_it_back(unit, real_clock, tmp_path):
    wanted = tmp_path / "ttyTC410"
    wanted.symlink_to("/nowhere")
    with serve(unit, real_clock, f"pty:{wanted}") as server:
        assert server.address == f"serial://{wanted}"
        modbus = ModbusAscii(lambda: open_link(f"serial://{wanted}?baud=9600", real_clock), real_clock)
        assert modbus.read_holding_registers(0x50, 1).values == (0x150,)
        modbus.close()
    assert not os.path.lexists(wanted)


@posix
def test_a_file_in_the_way_of_a_terminal_is_left_alone(unit, real_clock, tmp_path):
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(LinkError, match="name a path that is free"):
        serve(unit, real_clock, f"pty:{tmp_path / 'notes'}")
    assert (tmp_path / "notes").read_text() == "mine"


@posix
def test_a_serial_port_has_one_owner(unit, real_clock):
    with serve(unit, real_clock, "pty:") as server:
        link = open_link(server.address, real_clock)
        with pytest.raises(LinkError, match="no other program has it"):
            open_link(server.address, real_clock)
        link.close()


@posix
def test_a_serial_port_pulled_out_is_lost(unit, real_clock):
    server = serve(unit, real_clock, "pty:")
    server.start()
    link = open_link(server.address, real_clock)
    server.close()
    with pytest.raises(LinkError, match="port is lost"):
        link.read(1, 0.2)


@pytest.mark.parametrize(
    "url",
    [
        "",
        "telescope",
        "http://127.0.0.1:80",
        "tcp://127.0.0.1",
        "tcp://:10001",
        "tcp://127.0.0.1:notaport",
        "tcp://127.0.0.1:70000",
        "tcp://127.0.0.1:10001/path",
        "tcp://[::1:10001",
        "serial:///dev/ttyUSB0?speed=9600",
        "serial:///dev/ttyUSB0?baud=fast",
        "serial:///dev/ttyUSB0?baud=-1",
    ],
)
def test_a_malformed_address_is_refused_with_what_is_allowed(url, real_clock):
    with pytest.raises(LinkError, match=r"allowed are tcp://HOST:PORT, serial://") as refusal:
        open_link(url, real_clock)
    assert repr(url) in str(refusal.value)


@pytest.mark.parametrize("url", ["COM93", "serial://COM93?baud=9600", "/dev/ttyNOWHERE", "serial:///dev/ttyNOWHERE"])
def test_a_serial_port_that_is_not_there_is_told(url, real_clock):
    with pytest.raises(LinkError, match=r"(COM93|/dev/ttyNOWHERE)\?baud=9600: cannot open .*check the cable"):
        open_link(url, real_clock)


@pytest.mark.parametrize("url", ["tcp://nowhere.invalid:10001", "tcp://127.0.0.1:1"])
def test_a_host_that_is_not_there_is_told(url, real_clock):
    with pytest.raises(LinkError, match=rf"{url}: cannot connect .*check address, power"):
        open_link(url, real_clock)


@pytest.mark.parametrize("listen", ["", "tcp://127.0.0.1", "udp://127.0.0.1:1", "tcp://127.0.0.1:x"])
def test_a_malformed_address_to_listen_at_is_refused(listen, unit, real_clock):
    with pytest.raises(LinkError, match=r"allowed are tcp://127.0.0.1:10001"):
        serve(unit, real_clock, listen)


def test_a_tcp_link_sends_small_messages_at_once_and_watches_its_peer(unit, real_clock):
    with serve(unit, real_clock, "tcp://127.0.0.1:0") as server:
        link = open_link(server.address, real_clock)
        assert link._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert link._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        link.close()


def test_what_a_busy_host_sends_is_stamped_before_the_far_end_can_have_it(unit, real_clock):
    with serve(unit, real_clock, "tcp://127.0.0.1:0") as server:
        stalled = real_clock.__class__()
        link = open_link(server.address, stalled)
        times = iter((100.0, 100.5))  # half a second is lost between the network and the stamp
        stalled.now = lambda: next(times)
        assert link.write(READ) == 100.0
        link.close()


def test_a_recording_tells_all_that_passed(clock, unit):
    passages = []
    link = RecordingLink(MemoryLink(unit, clock, latency_s=0.25), clock, passages.append)
    link.write(READ)
    assert link.read(100, 0.0) == b""
    link.read(100, 1.0)
    assert link.name == "sim:"
    link.close()
    assert [str(passage) for passage in passages] == [
        "2027-01-15T08:00:00.000Z > :FF0300500002AC\\x0d\\x0a",
        f"2027-01-15T08:00:00.500Z < {passages[1].data.decode().strip()}\\x0d\\x0a",
    ]
