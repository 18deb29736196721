"""A clock that is set while keys are held or while the drives go on, by the true positions of the simulated unit."""

import pytest
from awr_bench import SIDEREAL, T0, Bench

from clockdrive.clock import VirtualClock
from mounts.drive import AxisSlew
from mounts.errors import Unsynchronised
from mounts.steady import SteadyClock
from transports.memory import MemoryLink


class Settable:
    """A clock that is set by so many seconds at a moment."""

    def __init__(self):
        self.running, self.off, self.at, self.step = VirtualClock(T0), 0.0, float("inf"), 0.0

    def now(self):
        if self.running.now() >= self.at:
            self.off = self.step
        return self.running.now() + self.off

    def sleep(self, seconds):
        self.running.sleep(seconds)


def bench_of(clock):
    """A bench whose unit goes by the true time, and whose driver by a clock that may be set."""
    bench = Bench(clock=clock.running)
    bench.unit._clock = steady = SteadyClock(clock, clock.running.now)
    bench.unit._kept._open = lambda: Shifted(bench.line, clock.running, steady)
    bench.connect(make_safe=True)
    return bench


class Shifted:
    """A link that stamps by the driver's clock."""

    def __init__(self, device, running, clock):
        self.link, self.clock, self.name = MemoryLink(device, running, baud=9600), clock, "sim:"

    def write(self, data):
        self.link.write(data)
        return self.clock.now()

    def read(self, most, seconds):
        return self.link.read(most, seconds)

    def close(self):
        self.link.close()


@pytest.mark.parametrize("step", [-60.0, -5.0, 5.0, 3600.0])
def test_a_clock_that_is_set_holds_no_key_longer_and_ends_the_goto(step):
    clock = Settable()
    bench = bench_of(clock)
    bench.drive.start([AxisSlew(5e4, SIDEREAL), AxisSlew(5e4)], clock.now())
    clock.at, clock.step = clock.running.now() + 3.0, step
    for _ in range(16):
        reading = bench.read()
        clock.sleep(0.25)
    assert clock.off == step
    assert bench.awr.keys == [0, 0]
    assert f"was set by {step:+.1f} s" in reading.unsynchronised
    assert not any(axis.slewing for axis in reading.axes)
    assert reading.time == pytest.approx(clock.now(), abs=0.3)
    with pytest.raises(Unsynchronised):
        bench.drive.start([AxisSlew(0.0), AxisSlew(0.0)], clock.now())
    bench.drive.sync((1e3, 2e3), clock.now())
    before = bench.true()
    bench.drive.start([AxisSlew(2e3), AxisSlew(4e3)], clock.now())
    for _ in range(100):
        bench.read()
        clock.sleep(0.25)
    moved = [after - was for was, after in zip(before, bench.true(), strict=True)]
    assert moved == pytest.approx((1e3, 2e3), abs=60.0)


@pytest.mark.parametrize("step", [-60.0, 0.05, 3600.0])
def test_a_clock_that_is_set_at_rest_leaves_the_axes_where_they_are(step):
    clock = Settable()
    bench = bench_of(clock)
    bench.drive.start(
        [AxisSlew(0.0, SIDEREAL, None, clock.now()), AxisSlew(0.0, 3.0, None, clock.now())], clock.now()
    )
    for _ in range(20):
        bench.read()
        clock.sleep(0.25)
    clock.at, clock.step = clock.running.now() + 1.0, step
    for _ in range(20):
        reading = bench.read()
        clock.sleep(0.25)
    reading = bench.read()
    assert not reading.unsynchronised
    assert reading.time == pytest.approx(clock.now(), abs=1e-3)
    assert reading.counts == pytest.approx(bench.true(), abs=2.0)


def test_what_a_time_service_corrects_is_no_step():
    clock = Settable()
    steady = SteadyClock(clock, clock.running.now)
    clock.sleep(1000.0)
    clock.off = 0.4
    assert steady.step() == 0.0
    clock.off = 0.7
    assert steady.step() == pytest.approx(0.7)
    assert steady.follow() == pytest.approx(0.7)
    assert steady.step() == 0.0
