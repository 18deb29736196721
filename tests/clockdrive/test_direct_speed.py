"""Direct speed control: both axes at speeds, bounded in time and by all limits, and never with nobody beside it.

What the axes truly did is asked of the simulated unit.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading

import pytest
from tc410_bench import Beside, bench_beside
from telescope_bench import ARCSEC_PER_COUNT, CENTRE, DEG_PER_COUNT, T0, telescope
from waiting import seconds_until

from clockdrive import Telescope, VirtualClock
from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.errors import InputError, Refused
from clockdrive.service import Service
from mounts.deadman import DeadManError
from mounts.drive import AxisSlew
from mounts.errors import DriveRefused
from mounts.tc410.registers import COUNTS_PER_SECOND, by_name
from pointing.errors import Unreachable
from transports.serve import serve

REMOTE = by_name("velocity_control").mask("remote_control")
FULL = round(0.5 / DEG_PER_COUNT / COUNTS_PER_SECOND)  # register units of the 0.5°/s at which owners are killed


@pytest.fixture
def scope(tmp_path):
    with telescope(tmp_path, limits__horizon_deg=0.0) as opened:
        yield opened


def at_rest(scope):
    scope.simulator.advance(scope.clock.now())
    return not any(axis.moved for axis in scope.simulator.axes)


def test_both_axes_go_at_their_speeds_and_end_at_rest(scope):
    seen = []

    def look(_):
        seen.append([axis.moved * COUNTS_PER_SECOND * DEG_PER_COUNT for axis in scope.simulator.axes])
        assert scope.simulator.moving == ("remote_control",)

    answer = scope.drive_at(0.5, -0.25, 4.0, look)
    assert seen[-1] == pytest.approx([0.5, -0.25], rel=1e-4)
    assert at_rest(scope)
    assert not scope.simulator.memory.raw("velocity_control") & REMOTE
    moved = [to - start for start, to in zip(answer["from_deg"], answer["to_deg"], strict=True)]
    assert moved == pytest.approx([2.0, -1.0], abs=0.12)
    true = [(scope.simulator.true_position(i) - CENTRE) * DEG_PER_COUNT for i in (1, 2)]
    assert true == pytest.approx(moved, abs=2 * ARCSEC_PER_COUNT / 3600.0)
    assert scope.status()["doing"] == "idle"
    assert scope.goto("altaz:90,60")["ok"]


@pytest.mark.parametrize(
    ("speeds", "seconds", "reason"),
    [
        ((9.0, 0.0), 5.0, "axis 1 goes up to ±4.5"),
        ((0.0, float("nan")), 5.0, "a speed of nan: give a finite number of degrees"),
        ((0.0, 0.0), 5.0, "moves nothing"),
        ((0.1, 0.0), 0.0, "above 0 up to 600"),
        ((0.1, 0.0), 1e9, "above 0 up to 600"),
        ((4.0, 0.0), 60.0, "axis1|soft limit|horizon"),
        ((0.0, 2.0), 60.0, "axis2|soft limit|horizon"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(speeds, seconds, reason, scope):
    before = [axis.position for axis in scope.simulator.axes]
    with pytest.raises((Refused, Unreachable), match=reason):
        scope.drive_at(*speeds, seconds)
    assert [axis.position for axis in scope.simulator.axes] == before


def test_a_motion_that_strays_is_stopped_before_it_leaves_what_is_allowed(scope, monkeypatch):
    """The path is found free, then the axis goes elsewhere: each cycle looks ahead by its stopping distance."""
    monkeypatch.setattr("clockdrive.direct_speed.check_way", lambda *_: None)
    with pytest.raises(Refused, match="before it would lead out"):
        scope.drive_at(0.0, 4.0, 120.0)
    scope.wait(10.0)
    assert at_rest(scope)
    status = scope.status()
    assert "before it would lead out" in status["trouble"]
    lowest = status["observed"]["altitude_deg"], 90.0 - abs(status["axes"][1]["angle_deg"])
    print(f"stopped at altitude {lowest[0]:.2f}°, {lowest[1]:.2f}° from the axis limit")
    assert min(lowest) > 0.0


@pytest.mark.parametrize(
    ("disturbance", "reason"),
    [
        ({"alarms": ("supply_over_current",)}, "supply_over_current"),
        ({"alarms": ("supply_shut_down",)}, "standby|alarm"),
    ],
)
def test_what_happens_meanwhile_ends_it(disturbance, reason, scope):
    def disturb(_):
        scope.simulator.disturb(**disturbance)

    with pytest.raises(Refused, match=reason):
        scope.drive_at(0.5, 0.0, 30.0, disturb)
    scope.wait(6.0)
    assert at_rest(scope)


def test_stop_ends_it_at_once(scope):
    def stop(_):
        if scope.clock.now() - began > 2.0:
            scope.stop()

    began = scope.clock.now()
    with pytest.raises(Refused, match="stopped by command"):
        scope.drive_at(0.5, 0.5, 60.0, stop)
    scope.wait(6.0)
    assert at_rest(scope)
    assert scope.clock.now() - began < 10.0


def test_it_is_one_of_the_calls_that_every_door_offers(scope):
    answer = Service(scope)("drive_at", {"deg_s": [0.1, 0.1], "seconds": 1.0}, lambda _: None)
    assert answer["ok"]
    with pytest.raises(InputError, match="needs the argument"):
        Service(scope)("drive_at", {"deg_s": [0.1, 0.1]}, lambda _: None)


# The driver --------------------------------------------------------------------------------------------------------


def test_without_a_dead_man_process_no_speed_is_given():
    bench = bench_beside(None)
    with pytest.raises(DriveRefused, match="needs a dead-man process"):
        bench.drive.move_at((100.0, 0.0), bench.now)
    bench.drive._direct._guardian = Beside(starts=False)
    with pytest.raises(DeadManError):
        bench.drive.move_at((100.0, 0.0), bench.now)
    assert not bench.control & REMOTE
    assert bench.unit.memory.velocities("target_velocity") == (0, 0)


def test_the_guardian_is_armed_before_and_let_go_after_the_unit_acknowledged_the_stop():
    guardian = Beside()
    bench = bench_beside(guardian)
    seen = []
    bench.line.before = lambda _: seen.append((bool(bench.control & REMOTE), guardian.diary[-1:]))
    bench.drive.move_at((1000.0, 0.0), bench.now)
    assert guardian.diary[:2] == ["start", "arm"]
    for _ in range(5):
        bench.wait(0.1)
        bench.drive.read(bench.now)
        bench.drive.move_at((1000.0, 0.0), bench.now)
    assert guardian.beats >= 20  # each request is a sign of life
    assert bench.velocity(0) == pytest.approx(1000.0, abs=0.01)
    bench.line.dead = True
    with contextlib.suppress(Exception):
        bench.drive.stop(bench.now)
    assert "disarm" not in guardian.diary
    bench.line.dead = False
    bench.drive.stop(bench.now)
    assert {(True, "arm")} == {(moving, *last) for moving, last in seen if moving}
    assert guardian.diary[-2:] == ["disarm", "close"]
    assert not bench.control & REMOTE


def test_a_guardian_that_is_gone_ends_the_motion():
    guardian = Beside()
    bench = bench_beside(guardian)
    bench.drive.move_at((1000.0, 0.0), bench.now)
    bench.wait(0.5)
    guardian.fate = "the dead-man process ended by itself (status 9)"
    with pytest.raises(DriveRefused, match="ended by itself"):
        bench.drive.read(bench.now)
    bench.wait(3.0)
    assert bench.velocity(0) == 0.0
    assert not bench.control & REMOTE


def test_a_slew_under_way_is_not_disturbed():
    bench = bench_beside(Beside())
    bench.slew(AxisSlew(CENTRE + 100_000), AxisSlew(CENTRE))
    with pytest.raises(DriveRefused, match="slew is under way"):
        bench.drive.move_at((100.0, 0.0), bench.now)
    assert bench.polled_until_landed().axes[0].counts == pytest.approx(CENTRE + 100_000, abs=1.0)


# The process -------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:"])
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
def test_an_owner_killed_or_frozen_during_direct_speed_is_survived_by_no_motion(listen, blow, tmp_path):
    clock = SystemClock()
    keys = {"axis1.acceleration_register": 255, "axis1.deceleration_register": 255, "axis1.max_speed_deg_s": 1.0}
    device = Watched(tc410.simulated(load(None, {}, keys), clock.now(), None), clock)
    with serve(device, clock, listen) as server:
        config = tmp_path / "telescope.toml"
        config.write_text(
            f'[site]\nlatitude_deg = -42.4\nlongitude_deg = 173.7\n[drive]\nlink = "{server.address}"\n'
            f'[limits]\nhorizon_deg = -5.0\nsun_avoidance_deg = 0.0\n[state]\npath = "{tmp_path.as_posix()}/state"\n',
            encoding="utf-8",
        )
        command = [sys.executable, "-m", "clockdrive", "-c", str(config)]
        subprocess.run([*command, "sync", "--force", "altaz:0,60"], check=True, capture_output=True, timeout=30)
        owner = subprocess.Popen([*command, "drive", "speed", "0.5", "0", "--for", "60s"], stderr=subprocess.DEVNULL)
        try:
            seconds_until(lambda: device.velocity == FULL, what="the speed asked for")
            os.kill(owner.pid, blow)
            stopped = seconds_until(lambda: device.velocity == 0, what="the stop")
        finally:
            owner.kill()
            owner.wait()
        print(f"{listen} {blow.name}: stopped after {stopped:.2f} s")
        assert stopped < (1.0 if blow is signal.SIGKILL else 1.3)
        assert not device.unit.memory.raw("velocity_control") & REMOTE
        log = (tmp_path / "state" / "dead-man.log").read_text(encoding="utf-8")
        assert re.search("made safe", log)
        answer = subprocess.run([*command, "status"], check=True, capture_output=True, timeout=30, text=True)
        assert "idle" in answer.stdout


class Watched:
    """A unit that is served to one side and looked at from the other."""

    def __init__(self, unit, clock):
        self.unit, self._clock, self._one_at_a_time = unit, clock, threading.Lock()

    def receive(self, data, t):
        with self._one_at_a_time:
            return self.unit.receive(data, t)

    @property
    def velocity(self):
        with self._one_at_a_time:
            self.unit.advance(self._clock.now())
            return self.unit.axes[0].moved


def test_axes_of_a_path_of_nodes_are_driven_at_speeds_and_stopped(tmp_path):
    """What would come to rest is foretold in degrees as in counts."""
    overrides = {"state.path": str(tmp_path), "site.latitude_deg": 32.78, "limits.sun_avoidance_deg": 0.0}
    with Telescope.simulated("apo", clock=VirtualClock(T0), overrides=overrides) as scope:
        moved = scope.drive_at(0.1, -0.05, 5.0).json
        one, two = (end - start for start, end in zip(moved["from_deg"], moved["to_deg"], strict=True))
        assert 0.3 < one <= 0.5
        assert -0.25 <= two < -0.15
        assert scope.status().json["doing"] == "idle"
