"""The computer's clock is set while a box goes on by its own.

The moves are timed by a clock that nobody sets; where there is none, the ticks of the box tell.
"""

import json
from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, T0, Bench, Line, like

from clockdrive.clock import SystemClock, VirtualClock
from clockdrive.configuration import load
from clockdrive.drives.avr_box.kind import drive
from mounts.avr_box.memory import at_park
from mounts.avr_box.reasons import STEPPED
from mounts.drive import AxisSlew
from mounts.steady import SteadyClock
from transports.memory import MemoryLink

BLIND = replace(SETTINGS, encoder_counts_per_turn=0)
PROVED = {**at_park((0, 0), T0, ""), "proved": True}


def blind(memory=PROVED):
    bench = Bench(BLIND, like(encoder_counts_per_turn=0), memory)
    bench.connect()
    return bench


def tracked(bench, seconds, rate=1.0):
    bench.follow(Line((bench.read().axes[0].counts, 0.0), (rate * SIDEREAL, 0.0), bench.clock.now()), seconds)
    return bench.read()


@pytest.mark.parametrize("step_s", [3.0, 10.0, 25.0])
@pytest.mark.parametrize("index", [False, True], ids=["switched on", "an index pulse"])
def test_a_clock_that_is_set_while_the_bin_is_small_is_taken_for_no_index_pulse(index, step_s):
    bench = blind()
    if index:
        bench.box.bin = 200
        bench.drive._ticks.forget()
        bench.box._missed[0] = shift = bench.box._worm_steps - 10.0 * SIDEREAL
        bench.box.motors[0].position += round(shift)
        assert not tracked(bench, 15.0).unsynchronised
        assert bench.box.bin < 20
    else:
        tracked(bench, 5.0)
    bench.box._t0 += step_s
    bench.clock.sleep(step_s)
    reading = tracked(bench, 8.0)
    off = abs(reading.axes[0].counts - bench.box.true_position(1))
    print(
        f"\n{off:.0f} microsteps off, stated {reading.axes[0].uncertainty_counts:.0f}; {reading.unsynchronised[:50]}"
    )
    assert reading.unsynchronised == STEPPED


class Settable:
    """A clock that somebody sets."""

    def __init__(self, running):
        self.running, self.off = running, 0.0

    def now(self):
        return self.running.now() + self.off

    def sleep(self, seconds):
        self.running.sleep(seconds)


class SetBench(Bench):
    """A bench whose session goes by a clock that may be set, and whose box and link by one that nobody sets."""

    def __init__(self, counts, memory=None, box=None, running=None):
        self.running = running or VirtualClock(T0)
        settings = replace(SETTINGS, encoder_counts_per_turn=counts)
        super().__init__(settings, like(encoder_counts_per_turn=counts), memory, box=box, clock=self.running)
        self.clock = Settable(self.running)
        steady = SteadyClock(self.clock, self.running.now)
        self.drive._box._clock = steady
        self.drive._box._kept._open = lambda: MemoryLink(self.box, steady, baud=9600)
        self.met, self.begin, self.box._begin = [], self.box._begin, self.noted

    def noted(self, axis, *move):
        if self.box.motors[axis].slew is not None:
            self.met.append(self.box.motors[axis].slew.counter)
        self.begin(axis, *move)

    def true(self):
        self.box.advance(self.running.now())
        return self.box.true_position(1), self.box.true_position(2)

    def off(self):
        """What is read now, and by how many microsteps it is off at most."""
        reading, true = self.read(), self.true()
        return reading, max(abs(axis.counts - here) for axis, here in zip(reading.axes, true, strict=True))


@pytest.mark.parametrize("step_s", [20.0, 3600.0, -20.0])
@pytest.mark.parametrize("counts", [20000, 0], ids=["encoders", "blind"])
def test_a_clock_that_is_set_in_a_slew_sends_nothing_into_a_move_and_keeps_the_position(counts, step_s):
    bench, worst, looks, slewing = SetBench(counts, dict(PROVED)), 0.0, 0, True
    bench.connect()
    bench.drive.start([AxisSlew(600_000.0, SIDEREAL), AxisSlew(-300_000.0)], bench.clock.now())
    while slewing:
        bench.clock.sleep(0.25)
        bench.clock.off = step_s if looks >= 40 else 0.0
        reading, off = bench.off()
        slewing = any(axis.slewing for axis in reading.axes)
        worst, looks = max(worst, off), looks + 1
    assert looks > 80
    closed = 0 if counts else 2  # letters begin four times anew
    print(f"\n{step_s:+} s: {looks} readings, {worst:.2f} microsteps off at worst")
    assert max(bench.met, default=0) <= closed
    assert worst < 2.0
    assert reading.unsynchronised == ""
    assert reading.time == pytest.approx(bench.clock.now(), abs=0.3)
    assert bench.true()[1] == pytest.approx(-300_000.0, abs=1.0)
    assert "ran where it was not sent" not in str(bench.drive.notes)


@pytest.mark.parametrize("step_s", [-40.0, 7.3])
def test_after_the_clock_was_set_the_path_is_that_of_the_clock_and_so_is_what_is_remembered(step_s):
    bench = SetBench(20000)
    bench.connect()
    bench.clock.off = step_s
    path = Line((0.0, 0.0), (SIDEREAL, 1.0), bench.clock.now() - 1.0)
    bench.follow(path, 40.0)
    ahead = [
        here - place for here, place in zip(bench.true(), [c for c, _ in path.at(bench.clock.now())], strict=True)
    ]
    print(f"\n{step_s:+} s: {ahead[0]:.1f} and {ahead[1]:.1f} microsteps from the path")
    assert max(map(abs, ahead)) < 10.0
    began = bench.drive.start([AxisSlew(60_000.0, SIDEREAL), AxisSlew(9_000.0)], bench.clock.now())
    assert began == pytest.approx(bench.clock.now(), abs=0.2)
    bench.clock.sleep(1.0)
    kept = json.loads(json.dumps(bench.drive.memory))
    assert kept["axes"][0]["moves"][0]["begin"] == pytest.approx(began, abs=0.1)
    assert kept["time"] == pytest.approx(began, abs=0.1)


def test_moves_of_a_box_are_timed_by_a_clock_that_nobody_sets(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text('[drive]\nkind = "avr-box"\nlink = "tcp://127.0.0.1:9"\n')
    box, _ = drive(load(path), SystemClock(), (), {}, lambda _: None)
    assert isinstance(box._box._clock, SteadyClock)
    assert abs(box._box.behind) < 1e-2
