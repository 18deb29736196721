"""The dead-man process, with owners that are really killed and really frozen, on units really served.

The simulated unit's own velocity is the oracle of what moves, and the frames it received of what was sent.
"""

import os
import random
import signal
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager, suppress

import pytest
from faults import Fault, FaultMachine, FaultyLink, by_chance
from waiting import PATIENCE_S, seconds_until

from clockdrive.clock import SystemClock, VirtualClock
from mounts import deadman_process
from mounts.awr.dead_man_frames import safe_frames as key_releases
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings as AwrSettings
from mounts.deadman import DeadMan, DeadManError
from mounts.deadman_process import (
    ARM,
    ATTEMPTS,
    BEAT,
    DISARM,
    EASE,
    HASTEN,
    PAUSE_S,
    UNNEEDED,
    Orders,
    SafeFrame,
    Watch,
    make_safe,
)
from mounts.tc410.dead_man_frames import safe_frames
from mounts.tc410.registers import COUNTS_PER_SECOND, by_name
from mounts.tc410.simulator import SimulatedTC410
from mounts.tc410.simulator_settings import SimulatorSettings
from transports.errors import LinkError
from transports.memory import MemoryLink
from transports.open_link import open_link
from transports.serve import serve

PROGRAM = "clockdrive.dead_man"
RATE = 1000.0  # counts/s, 0.25 deg/s in the manual's gearing; from it the drive ramps down in 0.25 s
SILENCE_S = 0.4
CLOCK = SystemClock()

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals are a matter of POSIX")
LISTENS = ["tcp://127.0.0.1:0", "pty:"]

# An owner as a driver is one: it moves axis 1 under direct speed control, beating in its control loop.
OWNER = """
import sys, time
from pathlib import Path
from clockdrive.clock import SystemClock
from mounts.deadman import DeadMan
from mounts.tc410.dead_man_frames import safe_frames
from mounts.tc410.unit import Unit
from transports.modbus_ascii import ModbusAscii
from transports.memory import MemoryLink
from transports.open_link import open_link
from transports.serial_port import SerialLink
from transports.tcp import TcpLink

url, way, log, velocity, ending = sys.argv[1:]
clock = SystemClock()
if way == "reopened":
    del TcpLink.fileno, SerialLink.fileno
dead_man = DeadMan(url, safe_frames(0x02), program="clockdrive.dead_man", log=Path(log))
unit = Unit(ModbusAscii(dead_man.sharing(lambda: open_link(url, clock)), clock))
unit.read("velocity_control")
with dead_man:
    dead_man.arm()
    unit.write("axis1_target_velocity", float(velocity))
    unit.write("velocity_control", 0x02)
    print(dead_man._process.pid, flush=True)
    until = time.monotonic() + (0.5 if ending == "clean" else 30.0)
    while time.monotonic() < until and dead_man.beat():
        unit.read("axis1_velocity")
        time.sleep(0.05)
    if ending == "clean":
        unit.write("velocity_control", 0)
        dead_man.disarm()
print("gone:", dead_man.beat(), flush=True)
"""


class Watched:
    """A unit that tells what it does while a server's thread drives it."""

    def __init__(self):
        self.unit = SimulatedTC410(SimulatorSettings(), CLOCK.now())
        self.lock = threading.Lock()
        self.heard = []

    def receive(self, data, t):
        with self.lock:
            self.heard.append(data)
            return self.unit.receive(data, t)

    @property
    def velocity(self):
        with self.lock:
            self.unit.advance(CLOCK.now())
            return self.unit.axes[0].velocity

    @property
    def control(self):
        with self.lock:
            return self.unit.memory.raw("velocity_control"), self.unit.memory.raw("axis1_target_velocity")


class Answering:
    """A device that answers as it is told, and keeps what it heard."""

    def __init__(self, answers=()):
        self.answers = list(answers)
        self.heard = []

    def receive(self, data, _t):
        self.heard.append(data)
        answer = self.answers.pop(0) if self.answers else b"yes\r"
        if answer is None:
            raise LinkError("dropped")
        return answer


class Lossy:
    """A unit that does not hear every third request."""

    def __init__(self, unit, seed):
        self.unit = unit
        self.chance = random.Random(seed)  # noqa: S311 - nothing secret

    def receive(self, data, t):
        return b"" if self.chance.random() < 1.0 / 3.0 else self.unit.receive(data, t)


@contextmanager
def owner_of(device, url, way, log, ending="none"):
    command = [sys.executable, "-c", OWNER, url, way, str(log), str(RATE / COUNTS_PER_SECOND), ending]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as owner:
        try:
            child = int(owner.stdout.readline())
            seconds_until(lambda: device.velocity == round(RATE / COUNTS_PER_SECOND))
            yield owner, child
        finally:
            owner.kill()


def logged(log):
    return log.read_text(encoding="utf-8") if log.exists() else ""


def runs(pid):
    """Whether a process exists that is no zombie."""
    with suppress(FileNotFoundError, ProcessLookupError):
        state = subprocess.run(["ps", "-o", "stat=", "-p", str(pid)], capture_output=True, text=True, check=False)
        return state.stdout.strip()[:1] not in ("", "Z")
    return False


@posix
@pytest.mark.parametrize("way", ["shared", "reopened"])
@pytest.mark.parametrize("listen", LISTENS)
def test_the_axis_stops_within_a_second_of_its_owner_being_killed(listen, way, tmp_path):
    device = Watched()
    with (
        serve(device, CLOCK, listen) as server,
        owner_of(device, server.address, way, tmp_path / "log") as (owner, child),
    ):
        owner.kill()
        told = seconds_until(lambda: device.control == (0, 0))
        stopped = told + seconds_until(lambda: device.velocity == 0)
        seconds_until(lambda: not runs(child), what="the end of the process")
    print(f"{listen} killed, {way}: told after {told:.3f} s, stopped after {stopped:.3f} s")
    assert stopped < 1.0
    assert "the owner is gone; made safe in" in (tmp_path / "log").read_text()


@posix
@pytest.mark.parametrize("listen", LISTENS)
def test_the_axis_stops_within_a_second_of_its_owner_being_frozen(listen, tmp_path):
    device = Watched()
    with (
        serve(device, CLOCK, listen) as server,
        owner_of(device, server.address, "shared", tmp_path / "log") as (
            owner,
            child,
        ),
    ):
        owner.send_signal(signal.SIGSTOP)
        told = seconds_until(lambda: device.control == (0, 0))
        stopped = told + seconds_until(lambda: device.velocity == 0)
        ended_by_then = seconds_until(lambda: "silent" in logged(tmp_path / "log"))
        owner.send_signal(signal.SIGCONT)
        thawed, _ = owner.communicate(timeout=10.0)
        assert device.velocity == 0
        seconds_until(lambda: not runs(child), what="the end of the process")
    print(
        f"{listen} frozen: told after {told:.3f} s, stopped after {stopped:.3f} s, logged {ended_by_then:.3f} s later"
    )
    assert stopped < 1.0
    assert thawed.strip().endswith("gone: False") or owner.returncode != 0


@posix
@pytest.mark.parametrize("listen", LISTENS)
def test_a_frozen_owner_that_shares_nothing_is_waited_for_and_the_axis_stops_when_it_dies(listen, tmp_path):
    device = Watched()
    with (
        serve(device, CLOCK, listen) as server,
        owner_of(device, server.address, "reopened", tmp_path / "log") as (owner, child),
    ):
        owner.send_signal(signal.SIGSTOP)
        seconds_until(lambda: "not safe yet" in logged(tmp_path / "log"), what="the first attempt")
        assert device.velocity
        assert runs(child)
        owner.kill()
        stopped = seconds_until(lambda: device.velocity == 0)
        seconds_until(lambda: not runs(child), what="the end of the process")
    print(f"{listen} frozen without sharing, then killed: stopped after {stopped:.3f} s")
    assert stopped < 1.0


@posix
@pytest.mark.parametrize("listen", LISTENS)
def test_a_line_of_9600_baud_is_quick_enough(listen, tmp_path):
    device = Watched()
    with (
        serve(device, CLOCK, listen, baud=9600) as server,
        owner_of(device, server.address, "shared", tmp_path / "log") as (owner, _),
    ):
        owner.send_signal(signal.SIGSTOP)
        stopped = seconds_until(lambda: device.velocity == 0)
    print(f"{listen} at 9600 baud, frozen: stopped after {stopped:.3f} s")
    assert stopped < 1.0


@posix
@pytest.mark.parametrize("listen", LISTENS)
def test_a_clean_end_sends_nothing_and_leaves_no_process(listen, tmp_path):
    device = Watched()
    with (
        serve(device, CLOCK, listen) as server,
        owner_of(device, server.address, "shared", tmp_path / "log", "clean") as (owner, child),
    ):
        owner.communicate(timeout=10.0)
        assert owner.returncode == 0
        seconds_until(lambda: not runs(child), what="the end of the process")
        heard = b"".join(device.heard)
    assert safe_frames()[1].data not in heard
    assert heard.count(safe_frames()[0].data) == 1  # the owner's own
    assert not (tmp_path / "log").exists()


@posix
def test_a_killed_dead_man_is_noticed_at_the_next_beat_and_leaves_no_zombie():
    with DeadMan("tcp://127.0.0.1:9", safe_frames(), program=PROGRAM) as dead_man:
        dead_man.arm()
        assert dead_man.beat()
        pid = dead_man._process.pid
        dead_man._process.send_signal(signal.SIGKILL)
        begun = time.monotonic()
        while dead_man.beat():
            assert time.monotonic() - begun < 1.0
        print(f"noticed {1e3 * (time.monotonic() - begun):.1f} ms after the signal: {dead_man.fate}")
        assert "ended by itself" in dead_man.fate or "does not listen" in dead_man.fate
        dead_man._process.wait(1.0)
        assert not dead_man.alive
        with pytest.raises(DeadManError, match="start again"):
            dead_man.arm()
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    dead_man.disarm()


@posix
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_that_end_its_owner_do_not_end_it(sent):
    with DeadMan("tcp://127.0.0.1:9", safe_frames(), program=PROGRAM) as dead_man:
        assert os.getsid(dead_man._process.pid) != os.getsid(0)
        process = dead_man._process
        process.send_signal(sent)
        assert dead_man.beat()
        dead_man.disarm()
    assert process.returncode == UNNEEDED  # a signal is obeyed before the end of the channel is read


def test_it_starts_and_ends_quickly_and_a_beat_costs_microseconds():
    dead_man = DeadMan("tcp://127.0.0.1:9", safe_frames(), program=PROGRAM)
    assert "not started" in dead_man.fate
    begun = time.perf_counter()
    dead_man.start()
    started = time.perf_counter()
    dead_man.arm()
    costs = []
    for _ in range(500):
        before = time.perf_counter()
        assert dead_man.beat()
        costs.append(time.perf_counter() - before)
        time.sleep(0.0002)
    dead_man.disarm()
    process = dead_man._process
    ending = time.perf_counter()
    dead_man.close()
    dead_man.close()
    over = time.perf_counter()
    print(f"start {1e3 * (started - begun):.0f} ms, end {1e3 * (over - ending):.0f} ms")
    print(f"beat {1e6 * statistics.median(costs):.0f} µs, at most {1e6 * max(costs):.0f} µs")
    assert process.returncode == 0
    assert started - begun < 1.0
    assert not dead_man.alive


def test_it_can_be_armed_again_and_started_again():
    device = Answering()
    frames = [SafeFrame(b"halt\r", rb"yes\r")]
    with serve(device, CLOCK, "tcp://127.0.0.1:0") as server:
        dead_man = DeadMan(server.address, frames, program=PROGRAM, silence_s=0.15)
        other = DeadMan(server.address, [SafeFrame(b"other\r", rb"yes\r")], program=PROGRAM, silence_s=0.15)
        for _ in range(2):
            with dead_man, other:
                for _ in range(2):
                    dead_man.arm()
                    assert dead_man.beat()
                    dead_man.disarm()
                other.arm()
                other._process.wait(PATIENCE_S)  # armed, it acts after a silence that began after that of the first
                assert dead_man.alive
        assert device.heard == [b"other\r"] * 2
        device.heard.clear()
        with dead_man:
            dead_man.arm()
            process = dead_man._process
            process.wait(5.0)
            assert not dead_man.beat()
            assert "heard nothing for 0.15 s" in dead_man.fate
    assert device.heard == [b"halt\r"]


def test_leaving_its_context_armed_makes_the_drive_safe():
    device = Answering()
    with serve(device, CLOCK, "tcp://127.0.0.1:0") as server:
        with DeadMan(server.address, [SafeFrame(b"halt\r", b"yes")], program=PROGRAM) as dead_man:
            dead_man.arm()
            process = dead_man._process
        assert process.wait(5.0) == 3
    assert device.heard == [b"halt\r"]


@posix
def test_a_connection_reopened_by_its_owner_is_not_held_up_by_the_dead_man():
    device = Answering()
    with (
        serve(device, CLOCK, "tcp://127.0.0.1:0") as server,
        DeadMan(server.address, [SafeFrame(b"halt\r", b"yes")], program=PROGRAM, silence_s=0.2) as dead_man,
    ):
        opening = dead_man.sharing(lambda: open_link(server.address, CLOCK))
        for number in range(20):  # the unit serves one client at a time
            link = opening()
            link.write(b"%d\r" % number)
            assert link.read(100, 1.0) == b"yes\r"
            link.close()
            link.close()
        held = opening()
        held.write(b"held\r")
        assert held.read(100, 1.0)
        dead_man.arm()
        dead_man._process.wait(5.0)
        with pytest.raises(LinkError, match="lost"):
            held.read(100, 1.0)
        held.close()
    assert device.heard == [*(b"%d\r" % number for number in range(20)), b"held\r", b"halt\r"]


@pytest.mark.parametrize(
    ("answers", "heard"),
    [
        ([b"y", b"yes\r"], [b"a\r", b"a\r", b"b\r"]),
        ([b"no\r", b"no\r"], [b"a\r", b"a\r", b"a\r", b"b\r"]),
        ([b"yes\r", None], [b"a\r", b"b\r", b"a\r", b"b\r"]),
        ([None, None, None], [b"a\r", b"a\r", b"a\r", b"a\r", b"b\r"]),
    ],
    ids=["half an answer", "refused", "dropped at the second frame", "dropped"],
)
def test_frames_are_sent_until_each_is_confirmed(answers, heard):
    device = Answering(answers)
    with serve(device, CLOCK, "tcp://127.0.0.1:0") as server:
        orders = Orders(server.address, (SafeFrame(b"a\r", rb"yes\r"), SafeFrame(b"b\r", rb"yes\r")), 0.4, "")
        make_safe(orders, None, CLOCK)
    assert device.heard == heard


class Late:
    """A unit whose keys of both axes are held; the first releases are lost, and answers to others come late."""

    def __init__(self, clock, lost):
        self.unit = SimulatedAwr(AwrSettings(), clock.now())
        self.unit.press(1, 1)
        self.unit.press(2, 1)
        self.lost = lost
        for late_s in (0.02, 0.04, 0.06, 0.08):  # of commands that the owner sent before it died
            self.unit._queue.append((clock.now() + late_s, b":Y\r\n#"))

    def receive(self, data, t):
        self.unit.advance(t)
        if self.lost:
            self.lost -= 1
            return b""
        return self.unit.receive(data, t)

    def says(self, until):
        return self.unit.says(until)


@pytest.mark.parametrize("lost", [0, 1, 2, 3])
def test_late_answers_to_the_owner_confirm_no_release_of_keys(lost, monkeypatch):
    clock = VirtualClock(1_800_000_000.0)
    device = Late(clock, lost)
    monkeypatch.setattr(deadman_process, "open_link", lambda *_, **__: MemoryLink(device, clock, baud=9600))
    make_safe(Orders("", key_releases(), SILENCE_S, ""), None, clock)
    device.unit.advance(clock.now() + 0.1)
    assert device.unit.keys == [0, 0]


def test_the_first_releases_do_not_wait_for_silence(monkeypatch):
    clock = VirtualClock(1_800_000_000.0)
    device = Late(clock, 0)
    begun, act, acted = clock.now(), device.unit._act, []
    device.unit._act = lambda body: (act(body), acted.append((device.unit._now, any(device.unit.keys))))
    monkeypatch.setattr(deadman_process, "open_link", lambda *_, **__: MemoryLink(device, clock, baud=9600))
    make_safe(Orders("", key_releases(), SILENCE_S, ""), None, clock)
    released = next(time for time, held in acted if not held)
    assert released - begun < 0.05


@pytest.mark.campaign
def test_whatever_goes_wrong_on_the_line_the_unit_is_safe_when_the_work_is_done(monkeypatch):
    runs = 1000 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 100
    lasted = []
    happened = Counter()
    for seed in range(runs):
        clock = VirtualClock(1_800_000_000.0)
        unit = SimulatedTC410(SimulatorSettings(), clock.now())
        unit.memory.put(by_name("velocity_control"), (0x82,))
        unit.memory.put(by_name("axis1_target_velocity"), (0x00, 0x8000))
        unit.memory.put(by_name("axis2_tracking_velocity"), (0x00, 0x4000))
        device = Lossy(unit, seed)
        machine = FaultMachine(by_chance(seed, 0.4), seed)
        monkeypatch.setattr(
            deadman_process,
            "open_link",
            lambda _url, _clock, *, timeout_s, unit=device, clock=clock, machine=machine: (
                FaultyLink(MemoryLink(unit, clock, latency_s=0.02, baud=9600), clock, machine) if timeout_s else None
            ),
        )
        clock.sleep(1.0)
        unit.advance(begun := clock.now())
        assert unit.axes[0].velocity == 0x8000
        make_safe(Orders("", safe_frames(), SILENCE_S, ""), None, clock)
        lasted.append(clock.now() - begun)
        clock.sleep(1.0)
        unit.advance(clock.now())
        assert [axis.velocity for axis in unit.axes] == [0, 0]
        assert unit.memory.raw("velocity_control") == unit.memory.raw("axis1_target_velocity") == 0
        happened += machine.happened
    print(f"{runs} runs, {happened.total()} faults: {statistics.median(lasted):.2f} s, at most {max(lasted):.2f} s")
    assert set(happened) == set(Fault)
    assert max(lasted) < 20.0


@posix
def test_what_was_left_over_on_the_line_confirms_nothing():
    ours, theirs = socket.socketpair()
    theirs.sendall(b"yes\r")  # the answer to something the owner asked before it froze
    heard = []

    def answer():
        heard.append(theirs.recv(100))
        theirs.sendall(b"yes\r")

    thread = threading.Thread(target=answer)
    thread.start()
    orders = Orders("tcp://127.0.0.1:9", (SafeFrame(b"a\r", rb"yes\r"),), 0.4, "")
    assert make_safe(orders, ours.detach(), CLOCK) == 1
    thread.join()
    assert heard == [b"a\r"]
    assert theirs.recv(1) == b""  # the connection is ended, for whoever has it
    theirs.close()


def test_a_unit_that_never_answers_is_given_up_at_last():
    class Hasty:
        waited = 0.0

        def now(self):
            return CLOCK.now()

        def sleep(self, seconds):
            self.waited += seconds

    with socket.create_server(("127.0.0.1", 0)) as taken:
        url = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
    clock = Hasty()
    with pytest.raises(LinkError, match="cannot connect"):
        make_safe(Orders(url, (SafeFrame(b"a\r", b"yes"),), 0.4, ""), None, clock)
    assert 30.0 < clock.waited < ATTEMPTS * PAUSE_S


@pytest.mark.parametrize(
    ("messages", "reason"),
    [
        ([], ""),
        ([BEAT, BEAT], ""),
        ([ARM], "gone"),
        ([ARM, BEAT], "gone"),
        ([ARM, DISARM], ""),
        ([ARM, DISARM, ARM], "gone"),
    ],
)
def test_it_acts_on_the_end_of_the_channel_only_when_armed(messages, reason):
    ours, theirs = socket.socketpair()
    with theirs:
        ours.sendall(bytes(messages))
        ours.close()
        assert reason in (found := Watch(theirs, 5.0).until_needed())
        assert bool(found) == bool(reason)


@pytest.mark.parametrize(("message", "allowed_s"), [(EASE, 0.2), (HASTEN, 0.05), (ARM, 0.1)])
def test_an_owner_may_be_silent_for_as_long_as_it_has_said_last(message, allowed_s):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        ours.send(bytes((ARM, HASTEN, EASE, ARM, message)))
        begun = time.monotonic()
        assert Watch(theirs, 0.1, 0.05, 0.2).until_needed() == f"the owner was silent for {allowed_s:g} s"
        assert time.monotonic() - begun >= allowed_s * 0.99


def test_the_frames_of_the_tc410_clear_what_the_host_may_move_and_leave_the_rest():
    control, all_stop = safe_frames(0xBB)
    assert control.data.startswith(b":FF0600000038")
    assert all_stop.data.startswith(b":FF0600700001")
    unit = SimulatedTC410(SimulatorSettings(), 0.0)
    for t, frame in enumerate(safe_frames(), start=1):
        answer = unit.receive(frame.data, float(t))
        orders = Orders("", (frame,), 1.0, "")
        assert Orders.from_text(orders.as_text()) == orders
        assert answer == frame.data


@pytest.mark.parametrize("silence_s", [0.0, -1.0, float("nan")])
def test_a_silence_that_cannot_be_is_refused(silence_s):
    with pytest.raises(DeadManError, match="above 0"):
        DeadMan("tcp://127.0.0.1:9", safe_frames(), program=PROGRAM, silence_s=silence_s)


def test_no_frames_and_no_program_are_refused():
    with pytest.raises(DeadManError, match="frames"):
        DeadMan("tcp://127.0.0.1:9", (), program=PROGRAM)
    dead_man = DeadMan("tcp://127.0.0.1:9", safe_frames(), program="clockdrive.no_such_program")
    with pytest.raises(DeadManError, match="did not start"):
        dead_man.start()
    assert not dead_man.alive
