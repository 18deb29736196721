"""The driver of axis controllers at the contract: what it starts, follows, halts, refuses and remembers."""

import contextlib
import itertools
import math
from dataclasses import replace

import pytest

from clockdrive.clock import VirtualClock
from mounts.apo.axis import ControlledAxis
from mounts.apo.by_hand import risk_of
from mounts.apo.controller import AXIS_WORDS, Controller
from mounts.apo.drive import ApoDrive
from mounts.apo.line import Line
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import ApoSettings, AxisSettings
from mounts.apo.simulator import SimulatedObservatory
from mounts.apo.simulator_settings import HARDWARE, SimulatorSettings
from mounts.drive import AxisSlew
from mounts.errors import DriveRefused, Unsynchronised, WrongProtocol
from transports.errors import LinkError, TransportError
from transports.memory import MemoryLink

T0 = 1_800_000_000.0
NAMES = ("azimuth", "altitude", "rotator")


class Bench:
    """A drive on simulated controllers, and the clock between them."""

    def __init__(
        self,
        kind="apo",
        axes=2,
        memory=None,
        positions=(10.0, 45.0, 0.0),
        time=T0,
        room=32,
        timeout_s=0.5,
        **settings,
    ):
        self.clock = VirtualClock(time)
        hardware = HARDWARE[kind][:axes]
        self.device = SimulatedObservatory(kind, SimulatorSettings(**settings), time, hardware, positions[:axes])
        self.cut: set[int] = set()
        self.heard = []  # what came along the lines: when, which line, what
        self.loses = lambda *_: ""  # by line and data: "command", "answer" or nothing
        self.settings = ApoSettings(
            kind,
            tuple(
                AxisSettings(name, word, h.lowest_deg, h.highest_deg, h.velocity, h.acceleration, h.jerk)
                for name, word, h in zip(NAMES, AXIS_WORDS, hardware, strict=False)
            ),
            on_expiry=settings.get("on_expiry", "halt"),
            max_nodes=room,
            call_s=4.0 * timeout_s,
        )
        self.lines = [
            Line(lambda i=i: self.opened(i), self.clock, timeout_s=timeout_s, deadline_s=4.0 * timeout_s)
            for i in range(len(self.device.lines))
        ]
        shared = kind == "sdss"
        controllers = (
            Controller(self.lines[0 if shared else i], kind, axis.word if shared else "")
            for i, axis in enumerate(self.settings.axes)
        )
        controlled = (
            ControlledAxis(controller, axis, kind)
            for controller, axis in zip(controllers, self.settings.axes, strict=True)
        )
        self.remembered = []
        self.drive = ApoDrive(tuple(controlled), self.settings, memory or {}, self.remembered.append)

    def opened(self, i):
        if i in self.cut:
            raise LinkError(f"sim:{i + 1}: nothing is there")
        return MemoryLink(_Cuttable(self, i), self.clock, name=f"sim:{i + 1}")

    def connected(self):
        self.drive.connect(self.clock.now(), make_safe=False)
        return self

    def start(self, *targets, rates=(0.0, 0.0, 0.0)):
        slews = [AxisSlew(target, rate) for target, rate in zip(targets, rates, strict=False)]
        return self.drive.start(slews, self.clock.now())

    def run(self, seconds, step=0.25):
        """Read again and again, as a session does; return the last reading."""
        end = self.clock.now() + seconds
        while True:
            reading = self.drive.read(self.clock.now())
            if self.clock.now() >= end:
                return reading
            self.clock.sleep(step)

    def run_on_silent_lines(self, seconds):
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            with contextlib.suppress(TransportError):
                self.drive.read(self.clock.now())

    def follow(self, path, seconds, step=0.5):
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            self.drive.read(self.clock.now())
            self.drive.follow(path, self.clock.now())
            self.clock.sleep(step)

    def true(self, i):
        self.device.advance(self.clock.now())
        return self.device.true_position(i + 1)

    def speeds(self):
        self.device.advance(self.clock.now())
        return [axis.servo.velocity for axis in self.device.axes]

    def dry(self):
        return [time for axis in self.device.axes for time in axis.record.dry]


class _Cuttable:
    """A line that can be cut."""

    def __init__(self, bench, i):
        self.bench, self.i = bench, i

    def receive(self, data, t):
        self.bench.heard.append((t, self.i, data))
        lost = "command" if self.i in self.bench.cut else self.bench.loses(self.i, data)
        answer = b"" if lost == "command" else self.bench.device.lines[self.i].receive(data, t)
        return b"" if lost else answer


class Circle:
    """A path whose rates change: degrees, a sine in each axis."""

    led = False

    @property
    def axes(self):
        return len(self.centre)

    def axis_at(self, axis, time):
        return self.at(time)[axis]

    def __init__(self, centre, amplitude=2.0, period=900.0, shift=(0.0, 0.0)):
        self.centre, self.amplitude, self.w, self.shift = centre, amplitude, math.tau / period, shift

    def at(self, time):
        u = self.w * (time - T0)
        return [
            (middle + off + self.amplitude * math.sin(u + k), self.amplitude * self.w * math.cos(u + k))
            for k, (middle, off) in enumerate(zip(self.centre, self.shift, strict=True))
        ]


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_slew_to_rest_lands_on_its_target_and_stands_without_running_dry(kind):
    bench = Bench(kind).connected()
    bench.start(25.0, 60.0)
    reading = bench.run(60.0)
    assert bench.true(0) == pytest.approx(25.0, abs=1e-9)
    assert bench.true(1) == pytest.approx(60.0, abs=1e-9)
    assert not any(axis.slewing for axis in reading.axes)
    assert reading.motion == ()
    assert not bench.dry()
    assert all(not axis.servo.path.interpolated for axis in bench.device.axes)


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_limits_hold_as_sent_to_a_clock_that_gains_and_is_off(kind):
    bench = Bench(kind, clock_offset_s=0.0123, clock_drift_ppm=300.0).connected()
    bench.run(60.0, step=1.0)
    over = [0.0] * 3
    for step in (3.0, 1e-2, 1e-4, 1e-6):
        for axis in bench.device.axes:
            axis.record.clear()
        bench.start(bench.true(0) + step, bench.true(1) + step)
        bench.run(30.0, step=1.0)
        for axis in bench.device.axes:
            record, limits = axis.record, axis.hardware
            found = (record.velocity, record.acceleration, record.jerk)
            most = (0.999 * each for each in (limits.velocity, limits.acceleration, limits.jerk))
            over = [max(o, f / m - 1.0) for o, f, m in zip(over, found, most, strict=True)]
            assert record.nodes > 3
    print(f"{kind}: at most {over} of velocity, acceleration and jerk over 0.999 of the limits")
    assert max(over) < 1e-4


def test_a_path_is_met_from_rest_and_followed_to_a_milliarcsecond():
    bench = Bench().connected()
    path = Circle((14.0, 50.0))
    bench.follow(path, 40.0)
    worst = 0.0
    for _ in range(300):
        bench.follow(path, 1.0)
        worst = max(worst, *(abs(bench.true(i) - path.at(bench.clock.now())[i][0]) for i in (0, 1)))
    print(f"worst of 300 looks: {worst * 3.6e6:.3f} mas")
    assert worst * 3.6e6 < 1.0
    assert not bench.dry()


@pytest.mark.parametrize("arcsec", [0.01, 5.0, 29.0, 31.0, 600.0])
def test_a_path_displaced_is_followed_within_seconds(arcsec):
    bench = Bench().connected()
    bench.follow(Circle((14.0, 50.0)), 60.0)
    displaced = Circle((14.0, 50.0), shift=(arcsec / 3600.0, -arcsec / 3600.0))
    bench.follow(displaced, 6.0, step=1.0)
    off = max(abs(bench.true(i) - displaced.at(bench.clock.now())[i][0]) for i in (0, 1)) * 3600.0
    bench.follow(displaced, 20.0)
    later = max(abs(bench.true(i) - displaced.at(bench.clock.now())[i][0]) for i in (0, 1)) * 3600.0
    print(f"{arcsec}″: {off:.4f}″ off after 6 s, {later:.4f}″ after 26 s")
    assert off < 0.02
    assert later < 0.001
    assert not bench.dry()


@pytest.mark.parametrize("late_s", [-0.001, 0.0, 0.3])
def test_a_path_that_ran_dry_is_met_anew_and_not_gone_on_with(late_s):
    bench = Bench().connected()
    path = Circle((14.0, 50.0))
    bench.follow(path, 30.0)
    bench.clock.sleep(max(axis.queue.ends for axis in bench.drive.axes) + late_s - bench.clock.now())
    bench.heard.clear()
    bench.drive.follow(path, bench.clock.now())
    assert [next(data for _, line, data in bench.heard if line == i) for i in (0, 1)] == [b"DRIFT\r"] * 2
    bench.follow(path, 20.0)
    off = max(abs(bench.true(i) - path.at(bench.clock.now())[i][0]) for i in (0, 1)) * 3600.0
    print(f"{late_s} s late: {off:.4f}″ off 20 s later")
    assert off < 0.001


def test_an_axis_that_meets_its_path_has_a_node_beyond_while_another_is_slow_to():
    bench = Bench().connected()
    bench.follow(Circle((14.0, 50.0)), 30.0)
    bench.loses = lambda i, data: "command" if i == 1 and data.startswith(b"DRIFT") else ""
    bench.heard.clear()
    bench.drive.follow(Circle((14.0, 50.0), shift=(0.02, 0.02)), bench.clock.now())
    asked = min(t for t, i, data in bench.heard if i == 1 and data.startswith(b"DRIFT"))
    given = [
        float(data.split()[3]) for t, i, data in bench.heard if i == 0 and data.startswith(b"MOVE ") and t < asked
    ]
    ahead = max(given) - (asked + 37.0) % 86400.0  # TAI seconds of the day
    print(f"{ahead:.1f} s of nodes when the other axis is begun with, which may take four time-outs and more")
    assert ahead > 4.0


def test_the_buffer_holds_ten_seconds_and_no_two_nodes_are_more_than_five_apart():
    bench = Bench().connected()
    path = Circle((14.0, 50.0), period=20_000.0)
    bench.follow(path, 30.0)
    for axis in bench.drive._axes:
        times = [node.time for node in axis.queue.ahead(bench.clock.now())]
        assert times[-1] >= bench.clock.now() + 9.0
        assert max(b - a for a, b in itertools.pairwise(times)) <= 5.0 + 1e-6


def test_stop_ends_a_slew_on_every_axis():
    bench = Bench(axes=3).connected()
    bench.start(40.0, 70.0, 20.0)
    bench.run(12.0)
    assert max(map(abs, bench.speeds())) > 0.5
    bench.drive.stop(bench.clock.now())
    bench.run(40.0)
    assert max(map(abs, bench.speeds())) == 0.0
    assert not bench.dry()


def test_a_silent_axis_halts_the_others_and_is_named():
    bench = Bench().connected()
    bench.start(60.0, 70.0)
    bench.run(8.0)
    bench.cut.add(1)
    with pytest.raises(DriveRefused, match=r"altitude: no answer for \d.*MOVE halted all axes that answer"):
        bench.run_on_silent_lines(20.0)
    bench.clock.sleep(60.0)
    assert bench.speeds()[0] == 0.0


def test_axes_that_answer_are_given_nodes_while_another_is_silent():
    bench = Bench("sdss").connected()
    path = Circle((14.0, 50.0), period=20_000.0)
    bench.follow(path, 30.0)
    bench.loses = lambda _, data: "command" if data.startswith(b"ALT") else ""
    for _ in range(2):
        with pytest.raises(TransportError, match="altitude"):
            bench.drive.read(bench.clock.now())
    ahead = bench.drive.axes[0].queue.ends - bench.clock.now()
    print(f"{ahead:.1f} s ahead after two looks at a silent axis")
    assert ahead > 7.0
    assert bench.drive.axes[1].queue.ends - bench.clock.now() < ahead


def test_an_absent_axis_is_named_when_connecting():
    bench = Bench(axes=3)
    bench.cut.add(2)
    with pytest.raises(LinkError, match="rotator: sim:3"):
        bench.connected()


@pytest.mark.parametrize("follows", [False, True])
@pytest.mark.parametrize("number", ["position", "velocity", "time"])
@pytest.mark.parametrize("digit", [1e-3, 1e-2, 0.07, 1.0])
def test_a_digit_garbled_in_one_answer_is_never_believed(number, digit, follows, monkeypatch):
    bench = Bench().connected()
    path = Circle((14.0, 50.0), period=20_000.0)
    for _ in range(20):
        if follows:
            bench.follow(path, 1.0)
        bench.run(1.0)
    honest, column, garbled = _Cuttable.receive, ("position", "velocity", "time").index(number), []

    def receive(self, data, t):
        answer = honest(self, data, t)
        if b"STATUS" in answer and self.i == 0 and not garbled:
            words = answer.split(b"\r\n")[1].split()
            before, decimals = words[column], len(words[column].split(b".")[1])
            garbled.append(b"%.*f" % (decimals, float(before) + digit))
            return answer.replace(before, garbled[0], 1)
        return answer

    monkeypatch.setattr(_Cuttable, "receive", receive)
    for seconds in (0.5, 1.0, 2.0):
        garbled.clear()
        bench.clock.sleep(seconds)
        reading = bench.drive.read(bench.clock.now())
        axis = reading.axes[0]
        late = bench.clock.now() - reading.time
        off = 3600.0 * abs(axis.counts + axis.rate * late - bench.true(0))
        unsure = 3600.0 * axis.uncertainty_counts
        print(f"{number} {digit:g} after {seconds} s: {off:.3f}″ off, ± {unsure:.3f}″ stated")
        assert garbled
        assert off <= unsure
        assert unsure < 0.2
        assert not reading.unsynchronised


def test_earlier_answers_that_follow_from_each_other_are_not_believed(monkeypatch):
    bench = Bench().connected()
    bench.start(60.0, 70.0)
    honest, kept, stale = _Cuttable.receive, [], []

    def receive(self, data, t):
        answer = honest(self, data, t)
        if b"STATUS" not in answer or self.i:
            return answer
        kept.append(answer)
        return stale.pop(0) if stale else answer

    monkeypatch.setattr(_Cuttable, "receive", receive)
    bench.run(12.0)
    bench.drive.stop(bench.clock.now())
    bench.run(14.0, step=2.0)
    stale += [kept[20], kept[21], kept[-2]]
    bench.clock.sleep(2.0)
    with pytest.raises(TransportError, match="3 positions that do not follow from each other"):
        bench.drive.read(bench.clock.now())
    assert abs(bench.run(0.0).axes[0].counts - bench.true(0)) < 1e-3


@pytest.mark.parametrize("ppm", [50.0, -50.0, 300.0])
def test_a_target_is_followed_by_a_clock_that_gains_as_by_one_that_is_right(ppm):
    bench = Bench(clock_drift_ppm=ppm).connected()
    path = Circle((14.0, 50.0), amplitude=2.0, period=3_000.0)  # 15″/s
    bench.follow(path, 60.0)
    worst = 0.0
    for _ in range(30):
        bench.follow(path, 1.0)
        worst = max(worst, *(abs(bench.true(i) - path.at(bench.clock.now())[i][0]) for i in (0, 1)))
    print(f"{ppm:+g} ppm: worst {3600.0 * worst:.4f}″ after a minute")
    assert 3600.0 * worst < 0.02
    assert not bench.dry()


@pytest.mark.parametrize("silent", ["DRIFT", "MOVE"])
@pytest.mark.parametrize("timeout_s", [0.1, 0.5, 1.5, 2.0])
def test_a_short_slew_of_one_axis_does_not_end_while_another_is_waited_for(silent, timeout_s):
    bench = Bench(timeout_s=timeout_s).connected()
    path = Circle((14.0, 50.0), period=20_000.0)
    bench.follow(path, 30.0)
    bench.loses = lambda i, data: "command" if i == 1 and data.startswith(silent.encode()) else ""
    arrival = bench.clock.now() + bench.drive.start_latency + bench.settings.shortest_slew_s
    slews = [AxisSlew(*state, arrival=arrival) for state in path.at(arrival)]
    with pytest.raises(TransportError, match="altitude"):
        bench.drive.start(slews, bench.clock.now())
    bench.clock.sleep(20.0)
    assert bench.speeds()[0] == 0.0
    assert not bench.device.axes[0].record.dry


def test_an_axis_that_was_to_set_out_later_is_halted_when_its_semaphore_is_given_back():
    bench = Bench("sdss").connected()
    now = bench.clock.now()
    bench.drive.start([AxisSlew(25.0, arrival=now + 60.0), AxisSlew(60.0, arrival=now + 60.0)], now)
    bench.device.axes[0].fail("semaphore_taken")
    bench.run(0.5)
    bench.drive.stop(bench.clock.now())
    bench.run(2.0)
    bench.device.axes[0].repair("semaphore_taken")
    bench.run(60.0)
    assert [bench.true(i) for i in (0, 1)] == [10.0, 45.0]
    assert not bench.dry()
    bench.start(25.0, 60.0)
    bench.run(60.0)
    assert [bench.true(i) for i in (0, 1)] == pytest.approx([25.0, 60.0], abs=1e-9)


def test_a_taken_semaphore_is_told_with_its_axis_and_nothing_moves():
    bench = Bench("sdss").connected()
    bench.device.axes[0].fail("semaphore_taken")
    with pytest.raises(DriveRefused, match="azimuth semaphore taken"):
        bench.start(20.0, 50.0)
    bench.clock.sleep(30.0)
    assert bench.speeds() == [0.0, 0.0]


def test_a_target_beyond_the_travel_is_refused_with_axis_value_and_bound():
    bench = Bench().connected()
    with pytest.raises(DriveRefused, match=r"altitude: the way leads to 88\.0000°, outside 6° to 85°"):
        bench.start(20.0, 88.0)
    bench.clock.sleep(30.0)
    assert bench.speeds() == [0.0, 0.0]


def test_a_path_that_leaves_the_travel_is_refused_while_the_axis_can_still_stop():
    bench = Bench(positions=(10.0, 79.0)).connected()
    path = Circle((14.0, 82.0), amplitude=-4.0, period=400.0)
    with pytest.raises(DriveRefused, match=r"altitude: the path leads to 8\d\.\d+°.* 85°"):
        bench.follow(path, 400.0)
    bench.run(30.0)
    assert bench.true(1) <= 85.0
    assert bench.speeds() == [0.0, 0.0]


def test_a_position_declared_while_tracking_halts_the_axes_and_is_read_back():
    bench = Bench().connected()
    path = Circle((14.0, 50.0), period=20_000.0)
    bench.follow(path, 40.0)
    now = bench.clock.now()
    wanted = [position + 0.25 for position, _ in path.at(now)]
    bench.drive.sync(wanted, now)
    reading = bench.drive.read(bench.clock.now())
    moved = [axis.counts - bench.true(i) for i, axis in enumerate(reading.axes)]
    assert moved == pytest.approx([0.25, 0.25], abs=2e-5)
    assert not reading.unsynchronised


def test_direct_speed_ramps_goes_on_and_stops():
    bench = Bench().connected()
    for _ in range(80):
        bench.drive.move_at((0.3, -0.2), bench.clock.now())
        bench.drive.read(bench.clock.now())
        bench.clock.sleep(0.1)
    assert bench.speeds() == pytest.approx([0.3, -0.2], abs=1e-6)
    bench.drive.move_at((0.0, 0.0), bench.clock.now())
    bench.run(15.0)
    assert bench.speeds() == [0.0, 0.0]
    assert not bench.dry()


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_direct_speed_ends_at_rest_when_the_host_dies_whatever_a_controller_does_at_the_end_of_its_path(kind):
    for on_expiry in ("halt", "extrapolate"):
        bench, speeds = Bench(kind, on_expiry=on_expiry).connected(), []
        for k in range(250):
            bench.drive.move_at((0.3, 0.0), bench.clock.now())
            bench.drive.read(bench.clock.now())
            speeds += [bench.speeds()] if k > 80 else []
            bench.clock.sleep(0.1)
        assert max(abs(one - 0.3) for one, _ in speeds) < 1e-4
        assert max(abs(two) for _, two in speeds) == 0.0
        assert not bench.dry()
        here = bench.true(0)
        bench.clock.sleep(30.0)
        print(f"{kind}, {on_expiry}: {bench.true(0) - here:.3f}° after the host died")
        assert bench.speeds() == [0.0, 0.0]
        assert bench.true(0) - here < 0.3 * 8.0


def test_power_is_refused():
    with pytest.raises(DriveRefused, match="cannot switch their motors on"):
        Bench().drive.power(on=True)


@pytest.mark.parametrize("lost", [None, 0, 1])
def test_once_left_every_axis_stands_though_another_cannot_be_told(lost):
    bench = Bench().connected()
    bench.follow(Circle((14.0, 50.0), period=20_000.0), 40.0)
    bench.loses = lambda i, _: "command" if i == lost else ""
    with contextlib.nullcontext() if lost is None else pytest.raises(TransportError, match=NAMES[lost]):
        bench.drive.close(bench.clock.now(), keep_tracking=True)
    bench.clock.sleep(30.0)
    assert bench.speeds() == [0.0, 0.0]
    assert not [time for i, axis in enumerate(bench.device.axes) if i != lost for time in axis.record.dry]


def test_a_controller_restarted_at_rest_keeps_its_position_and_one_that_moved_does_not():
    still = Bench().connected()
    still.run(2.0)
    still.device.axes[0].restart(still.clock.now())
    still.clock.sleep(8.0)
    with pytest.raises(DriveRefused, match="azimuth: the controller has restarted"):
        still.run(1.0)
    assert not still.run(2.0).unsynchronised
    moving = Bench().connected()
    moving.start(60.0, 70.0)
    moving.run(8.0)
    moving.device.axes[0].restart(moving.clock.now())
    moving.clock.sleep(8.0)
    with pytest.raises(Unsynchronised, match=r"azimuth: .*restarted while the axis moved; `sync`"):
        moving.run(1.0)
    assert "restarted while the axis moved" in moving.remembered[-1]["unsynchronised"]
    with pytest.raises(Unsynchronised, match=r"azimuth: .*restarted while the axis moved; `sync`"):
        moving.start(20.0, 50.0)


def test_what_was_remembered_tells_a_position_lost_while_nobody_looked():
    bench = Bench().connected()
    bench.run(2.0)
    memory = bench.drive.memory
    again = Bench(memory=memory)
    again.device.axes[1].restart(T0, loses_position=True)
    again.clock.sleep(10.0)
    assert (
        "altitude: its controller has restarted at 0.0000°, 45.0000° from"
        in again.connected().run(1.0).unsynchronised
    )


@pytest.mark.parametrize(("seconds", "is_lost"), [(1.0, True), (600.0, False)])
def test_an_axis_that_is_found_farther_away_than_it_can_have_come_is_unsynchronised(seconds, is_lost):
    bench = Bench().connected()
    bench.run(2.0)
    again = Bench(memory=bench.drive.memory, positions=(10.0, 57.0, 0.0), time=bench.clock.now() + seconds)
    why = again.connected().run(1.0).unsynchronised
    assert ("altitude: its controller says 57.0000°, 12.0000° from where" in why) is is_lost
    assert bool(why) is is_lost


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_position_that_a_restart_has_lost_is_told_at_the_first_answer_and_once(kind):
    bench = Bench(kind).connected()
    bench.run(3.0)
    bench.device.axes[1].restart(bench.clock.now(), loses_position=True)
    bench.clock.sleep(10.0)
    with pytest.raises(Unsynchronised, match=r"altitude: .*restarted at 0\.0000°, 45\.0000° from"):
        bench.run(1.0)
    assert "restarted at 0.0000°" in bench.run(5.0).unsynchronised


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_restart_of_an_axis_that_was_about_to_move_leaves_its_position_unknown(kind):
    bench = Bench(kind).connected()
    bench.start(40.0, 70.0)
    bench.run(0.5)
    assert bench.speeds() == [0.0, 0.0]
    bench.clock.sleep(1.5)  # it has begun, and nobody has seen it
    bench.device.axes[1].restart(bench.clock.now(), loses_position=True)
    bench.device.axes[1].believe(45.0)  # and says that it is where it was seen last
    bench.clock.sleep(10.0)
    with pytest.raises(Unsynchronised, match="altitude: its controller has restarted while the axis moved"):
        bench.run(1.0)


@pytest.mark.parametrize("is_lost", [True, False])
def test_a_position_is_unknown_where_the_news_of_a_restart_may_have_been_lost_with_an_answer(is_lost):
    bench = Bench("sdss").connected()
    bench.start(60.0, 45.0)
    bench.run(10.0)
    restarted = bench.clock.now()
    if is_lost:
        bench.device.axes[0].restart(restarted, loses_position=True)
    bench.loses = lambda _, data: "answer" if b"STATUS" in data and bench.clock.now() < restarted + 8.0 else ""
    if is_lost:
        with pytest.raises(Unsynchronised, match="azimuth: its controller may have restarted while the axis moved"):
            bench.run_on_silent_lines(20.0)
        assert bench.drive.read(bench.clock.now()).unsynchronised
    else:
        bench.run_on_silent_lines(8.0)
        assert not bench.run(20.0).unsynchronised
        assert bench.run(0.0).axes[0].counts == pytest.approx(bench.device.true_position(1), abs=1e-3)


def test_a_position_that_a_restart_may_have_lost_by_little_is_stated_no_finer_until_a_sync():
    bench = Bench(positions=(8e-5, 45.0, 0.0)).connected()
    bench.run(2.0)
    bench.device.axes[0].restart(bench.clock.now(), loses_position=True)
    bench.clock.sleep(10.0)
    with pytest.raises(DriveRefused, match="azimuth: the controller has restarted"):
        bench.run(1.0)
    reading = bench.run(2.0)
    assert not reading.unsynchronised
    off = abs(bench.device.true_position(1) - reading.axes[0].counts)
    assert 7e-5 < off <= reading.axes[0].uncertainty_counts < 2e-4
    bench.drive.sync((0.0, 45.0), bench.clock.now())
    assert bench.run(1.0).axes[0].uncertainty_counts < 1e-5


def test_settings_that_differ_are_noted_with_both_values():
    bench = Bench()
    bench.device.axes[0].servo.limits.velocity = 1.0
    bench.device.axes[1].servo.limits.highest = 80.0
    notes = bench.connected().drive.notes
    assert any("azimuth: the controller's MAXV is 1 deg/s, configured 1.75 deg/s; it clips" in note for note in notes)
    assert any("altitude: the controller's upper soft limit is 80 deg, configured 85 deg" in note for note in notes)


def test_all_that_the_controllers_tell_can_be_shown():
    told = Bench("sdss").connected().drive.registers()
    assert told["azimuth position"] == "10.0000000°"
    assert told["altitude soft limits"] == "18.2° to 90°"
    assert told["azimuth status"] == "buffer_empty"
    assert told["altitude output limit"] == "100 %"
    assert "axis code" in told["azimuth identity"]


def test_a_node_in_the_past_is_told_with_its_axis_and_by_how_much():
    bench = Bench().connected()
    axis = bench.drive._axes[1]
    line = axis.drift()
    with pytest.raises(DriveRefused, match=r"altitude: .*the time of the node passed 2\.0\d+ s ago.*max_nodes"):
        axis.send(PathNode(line.time - 2.0, line.position, 0.0))
    assert axis.queue.last == line


def test_a_small_buffer_is_given_the_slew_as_there_is_room():
    bench = Bench(max_nodes=3, room=3).connected()
    bench.start(80.0, 70.0)
    assert any(axis.waiting for axis in bench.drive.axes)
    bench.run(70.0)
    assert [bench.true(i) for i in (0, 1)] == pytest.approx([80.0, 70.0], abs=1e-9)
    assert not bench.dry()
    assert not [text for axis in bench.device.axes for _, text in axis.record.refused]


@pytest.mark.parametrize("lost", ["command", "answer"])
def test_a_waiting_node_that_is_lost_is_not_sent_again_but_its_way_planned_anew(lost):
    bench = Bench(max_nodes=32, room=4).connected()
    bench.start(60.0, 70.0)
    assert all(axis.waiting for axis in bench.drive.axes)
    once = iter([lost])
    bench.loses = lambda i, data: next(once, "") if i == 0 and data.startswith(b"MOVE ") else ""
    bench.run(60.0)
    nodes = [data for _, i, data in bench.heard if i == 0 and data.startswith(b"MOVE ")]
    assert next(once, None) is None
    assert len(nodes) == len(set(nodes))
    assert [bench.true(i) for i in (0, 1)] == pytest.approx([60.0, 70.0], abs=1e-9)
    assert not bench.dry()
    assert not [text for axis in bench.device.axes for _, text in axis.record.refused]


def test_waiting_nodes_that_cannot_be_given_halt_all_axes():
    bench = Bench(max_nodes=32, room=4).connected()
    bench.start(60.0, 70.0)
    bench.loses = lambda i, data: "command" if i == 0 and data.startswith(b"MOVE ") else ""
    with pytest.raises(TransportError, match="azimuth"):
        bench.run(60.0)
    assert not any(axis.queue.last for axis in bench.drive.axes)
    bench.clock.sleep(60.0)
    assert bench.speeds() == [0.0, 0.0]


@pytest.mark.parametrize("silent", [0, 1, 2])
def test_axes_that_answer_are_halted_before_one_that_is_silent(silent):
    bench = Bench(axes=3).connected()
    bench.start(60.0, 70.0, 60.0)
    bench.run(9.0)
    bench.loses = lambda i, _: "command" if i == silent else ""
    with pytest.raises(DriveRefused, match=f"{NAMES[silent]}: no answer"):
        bench.run_on_silent_lines(30.0)
    first = {}
    for time, i, data in bench.heard:
        if data.strip() == b"MOVE":
            first.setdefault(i, time)
    print({NAMES[i]: round(time - min(first.values()), 2) for i, time in first.items()})
    answering = [time for i, time in first.items() if i != silent]
    assert len(first) == 3
    assert max(answering) - min(first.values()) < 0.1
    assert first[silent] >= max(answering)


def test_a_position_that_jumps_while_another_axis_is_silent_halts_the_telescope_at_once():
    bench = Bench().connected()
    bench.start(60.0, 70.0)
    bench.run(9.0)
    bench.cut.add(0)
    bench.device.axes[1].servo.declare(bench.true(1) + 9.0)
    with pytest.raises(Unsynchronised, match="altitude: its position has jumped"):
        bench.drive.read(bench.clock.now())


def test_a_command_by_hand_is_answered_and_one_that_sets_the_position_unsynchronises_it():
    bench = Bench().connected()
    assert bench.drive.by_hand("azimuth", "STATUS").reply.lines
    assert bench.drive.by_hand("altitude", "MS.DUMP").fiducials == ()
    bench.drive.by_hand("azimuth", "SET.POSITION 11.0")
    reading = bench.run(1.0)
    assert "azimuth: its position was changed by hand" in reading.unsynchronised
    with pytest.raises(DriveRefused, match="no axis 'dome'; there is azimuth, altitude"):
        bench.drive.by_hand("dome", "STATUS")


@pytest.mark.parametrize(
    ("text", "risky"),
    [("STATUS", False), ("MS.DUMP", False), ("MAXV", False), ("SET.LIMITS", False), ("STEP 0.1", False),
     ("MAXV 1.0", True), ("SET.LIMITS 10.0 20.0", True), ("+", True), ("MOVE 3.0", True), ("P", True), ("ZERO", True),
     ("RESET", True), ("CORRECT", True), ("MOVE", False), ("INIT", False), ("LOG hello", False)],
)  # fmt: skip
def test_what_a_person_must_confirm_is_what_moves_or_cannot_be_taken_back(text, risky):
    assert bool(risk_of(text)) is risky


def test_exchanged_links_are_refused_before_anything_moves():
    bench = Bench(axes=3)
    opened = bench.opened
    bench.opened = lambda i: opened({0: 1, 1: 0}.get(i, i))
    with pytest.raises(WrongProtocol, match="azimuth: its controller has lower soft limit 6 deg, configured -180"):
        bench.connected()
    assert not any(b"MOVE" in line or b"INIT" in line for _, _, line in bench.heard)


def test_an_answer_that_a_busy_host_saw_late_makes_no_jump_of_the_next(monkeypatch):
    bench = Bench().connected()
    bench.start(100.0, 60.0)
    bench.run(25.0)
    axis = bench.drive.axes[0]
    assert abs(bench.speeds()[0]) > 1.5
    asked, late = axis.controller.status, iter((0.03, *[0.0] * 6))

    def status():
        timed = asked()
        return replace(timed, received=timed.received + next(late))

    monkeypatch.setattr(axis.controller, "status", status)
    axis.look()
    bench.clock.sleep(0.25)
    bench.device.axes[0].clock.set(bench.clock.now(), 0.05)  # so that it is not where it was foreseen
    axis.look()
    assert axis.confirming.jumped_deg == 0.0
