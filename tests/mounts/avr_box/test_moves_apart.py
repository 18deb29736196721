"""When commands are sent: none to an axis that may still move, each as often as it must be, all reckoned for now."""

from dataclasses import replace

import pytest
from avr_bench import COUNT, SETTINGS, SIDEREAL, T0, Bench, Line, like

from mounts.avr_box.commands import faster
from mounts.avr_box.memory import at_park
from mounts.avr_box.simulator_motor import Motor
from mounts.avr_box.timers import CRYSTAL_HZ, SLEW_GEARS
from mounts.avr_box.trust import BELIEVED
from mounts.drive import AxisSlew

APART_S = 0.05  # at least from the end of a move, by the motor's own steps, to the next command for the axis
LATE_PPM = -90.0
AGAIN_S = 0.01  # within which letters begin anew on purpose
PROVED = {**at_park((0, 0), T0, ""), "proved": True}


class Apart:
    """Measures how long after the end of a move the next command for its axis comes, by motors of its own."""

    def __init__(self, box):
        self.box, self.begin, self.heard = box, box._begin, box.receive
        self.time, self.begun, self.ends, self.gaps = 0.0, [-1.0, -1.0], [-1.0, -1.0], []
        box._begin, box.receive = self.began, self.receive

    def receive(self, data, t):
        self.time = t
        return self.heard(data, t)

    def began(self, axis, step_max, direction, slowed):
        self.begin(axis, step_max, direction, slowed)
        if self.begun[axis] > 0.0 and self.time - self.begun[axis] > AGAIN_S:
            self.gaps.append(self.time - self.ends[axis])
        motor, cycles = Motor(self.box.settings.slew_table, SLEW_GEARS[axis].low, SLEW_GEARS[axis].high), 10**12
        motor.begin(step_max, direction, slowed)
        lasts = (cycles - motor.run(cycles)) / CRYSTAL_HZ / (1.0 + self.box.settings.clock_drift_ppm * 1e-6)
        self.begun[axis], self.ends[axis] = self.time, self.time + lasts


WAYS = {
    "the Moon": (600.0, (0.965 * SIDEREAL, 12.0), 40.0),
    "held": (600.0, (0.0, 0.0), 90.0),
    "caught up": (30_000.0, (SIDEREAL, 80.0), 30.0),
}


@pytest.mark.parametrize("counts", [20000, 0], ids=["encoders", "blind"])
def test_no_command_comes_to_an_axis_that_may_still_move_though_the_crystal_is_slow(counts):
    settings = replace(SETTINGS, encoder_counts_per_turn=counts, longest_s=10.0)
    bench = Bench(settings, like(encoder_counts_per_turn=counts, clock_drift_ppm=LATE_PPM), PROVED)
    bench.connect()
    apart = Apart(bench.box)
    bench.slew(150_000.0, -80_000.0)
    for way, rates, seconds in WAYS.values():
        here = [axis.counts for axis in bench.read().axes]
        bench.follow(Line((here[0] + way, here[1] + way), rates, bench.clock.now()), seconds)
    print(f"\n{len(apart.gaps)} commands for an axis that had moved, at least {min(apart.gaps):.3f} s after it had")
    assert len(apart.gaps) > 20
    assert min(apart.gaps) > APART_S


@pytest.mark.parametrize("counts", [20000, 0], ids=["encoders", "blind"])
def test_a_path_that_is_followed_while_a_slew_goes_on_changes_nothing_of_it(counts):
    settings = replace(SETTINGS, encoder_counts_per_turn=counts, longest_s=10.0)
    heard = []
    for following in (False, True):
        bench, moves = Bench(settings, like(encoder_counts_per_turn=counts), PROVED), []
        bench.connect()
        receive = bench.box.receive
        bench.box.receive = lambda data, t, moves=moves, receive=receive: (
            (moves.append(data) if data not in (b"P", b"Q") else None) or receive(data, t)
        )
        bench.drive.start([AxisSlew(150_000.0, SIDEREAL), AxisSlew(-80_000.0)], bench.clock.now())
        path = Line((150_000.0, -80_000.0), (SIDEREAL, 0.0), bench.clock.now() + 60.0)
        while any(axis.slewing for axis in bench.read().axes):
            if following:
                bench.drive.follow(path, bench.clock.now())
            bench.clock.sleep(0.1)
        heard.append(moves)
    print(f"\n{len(heard[0])} commands of a slew")
    assert len(heard[0]) > 6
    assert heard[1] == heard[0]


@pytest.mark.parametrize("ago_s", [0.0, 4.0])
def test_a_sync_on_where_it_was_some_seconds_ago_has_tracked_on_since_then(ago_s):
    bench = Bench()
    bench.connect()
    bench.clock.sleep(10.0)
    bench.read()
    now = bench.clock.now()
    bench.drive.sync((5000.0, 7000.0), now - ago_s)
    reading = bench.read()
    found = reading.axes[0].counts - SIDEREAL * (reading.time - now)
    print(f"\nsynchronised {ago_s:.0f} s ago at 5000: now {found:.0f}")
    assert found == pytest.approx(5000.0 + ago_s * SIDEREAL, abs=4.0)
    assert reading.axes[1].counts == pytest.approx(7000.0, abs=0.1)


def test_what_guiding_may_have_made_while_no_program_looked_is_stated():
    first = Bench()
    first.connect()
    first.read()
    kept = dict(first.drive.memory)
    first.drive._box.send(faster(255))  # and the program is killed before it is remembered
    first.clock.sleep(118.0)
    second = Bench(memory=kept, box=first.box, clock=first.clock)
    second.connect()
    for _ in range(BELIEVED):
        reading = second.read()
    second.box.advance(reading.time)
    off = abs(reading.axes[0].counts - second.box.true_position(1))
    print(f"\n{off:.0f} microsteps off, stated {reading.axes[0].uncertainty_counts:.0f}")
    assert 500.0 < off <= reading.axes[0].uncertainty_counts < COUNT[0]


class Deaf:
    """A line that loses the first so many letters that end a runaway."""

    def __init__(self, device, times):
        self.device, self.times, self.sent = device, times, []

    def receive(self, data, t):
        if data[:1] in b"EWNS":
            self.sent.append(data)
            data = data if len(self.sent) > self.times else b""
        return self.device.receive(data, t) if data else b""


@pytest.mark.parametrize("times", [1, 3])
def test_a_runaway_is_ended_within_one_reading_though_so_many_letters_are_lost(times):
    lines = []
    bench = Bench(line=lambda device: lines.append(Deaf(device, times)) or lines[-1])
    bench.connect()
    bench.drive.start([AxisSlew(40_000.0, SIDEREAL), AxisSlew(-40_000.0)], bench.clock.now())
    bench.box._begin(1, 5_000_000, -1, 1)  # the move was mutilated on its way
    while not lines[0].sent:
        bench.clock.sleep(0.25)
        reading = bench.read()
    print(f"\n{times} letters were lost, {len(lines[0].sent)} sent")
    assert len(lines[0].sent) == times + 1
    assert reading.alarms == ()
    assert bench.box.moving[1] is False
    assert reading.unsynchronised == ""
