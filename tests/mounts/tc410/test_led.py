"""Axes led by direct speed control: on their path to arcseconds, and never with nobody beside them."""

import itertools
import math
from dataclasses import dataclass

import pytest
from tc410_bench import STEP_ARCSEC, Beside, Straight, bench_beside

from mounts.drive import AxisSlew
from mounts.errors import DriveRefused
from mounts.tc410.registers import CENTRE, by_name
from transports.errors import TransportError

REMOTE, TRACK = (by_name("velocity_control").mask(name) for name in ("remote_control", "tracking"))


@dataclass
class Swing:
    """Axes that swing by 20 000 counts, at most 1°/s and 0.05°/s², as a satellite's do."""

    since: float
    led: bool = True

    def at(self, time):
        w, t = 0.2, time - self.since
        here = 20_000.0 * (1.0 - math.cos(w * t)), 20_000.0 * w * math.sin(w * t)
        return (CENTRE + here[0], here[1]), (CENTRE - here[0], -here[1])


def led(bench, path, seconds):
    """Follow as often as the driver asks for; return the errors between the commands, counts."""
    errors, end = [], bench.now + seconds
    while bench.now < end:
        began = bench.now
        bench.drive.read(bench.now)
        due = began + bench.drive.follow(path, bench.now)
        bench.wait(max(0.0, due - bench.now) / 2.0)
        errors.append(bench.errors(path))
        bench.wait(max(0.0, due - bench.now))
    return errors


@pytest.mark.parametrize(("link", "most_arcsec"), [({}, 5.0), ({"simulator__baud": 9600}, 60.0)])
def test_a_swing_of_a_degree_a_second_is_followed(link, most_arcsec):
    bench = bench_beside(Beside(), **link)
    errors = led(bench, Swing(bench.now), 60.0)
    worst = max(math.hypot(*pair) for pair in errors[20:]) * STEP_ARCSEC
    rms = math.sqrt(sum(x * x + y * y for x, y in errors[20:]) / len(errors[20:])) * STEP_ARCSEC
    print(f"{link or '1 ms'}: {len(errors) / 60:.1f} commands a second, RMS {rms:.2f}″, worst {worst:.2f}″")
    assert worst < most_arcsec


def test_the_dead_man_process_stands_beside_from_before_the_first_motion_until_after_the_stop():
    guardian = Beside()
    bench = bench_beside(guardian)
    seen = []
    bench.line.before = lambda _: seen.append((bool(bench.control & REMOTE), list(guardian.diary)))
    led(bench, Swing(bench.now), 5.0)
    assert all(diary[:2] == ["start", "arm"] for moving, diary in seen if moving)
    assert bench.control & REMOTE
    assert not bench.control & TRACK
    bench.drive.stop(bench.now)
    assert guardian.diary == ["start", "arm", "disarm", "close"]
    assert not bench.control & (REMOTE | TRACK)
    bench.wait(3.0)
    assert (bench.velocity(0), bench.velocity(1)) == (0.0, 0.0)


def test_without_a_dead_man_process_nothing_is_led():
    bench = bench_beside(None)
    with pytest.raises(DriveRefused, match="needs a dead-man process"):
        bench.drive.follow(Swing(bench.now), bench.now)
    bench.wait(1.0)
    assert (bench.velocity(0), bench.velocity(1)) == (0.0, 0.0)


def test_the_end_of_the_dead_man_process_ends_the_motion():
    guardian = Beside()
    bench = bench_beside(guardian)
    led(bench, Swing(bench.now), 5.0)
    guardian.fate = "the dead-man process ended by itself (status 9)"
    with pytest.raises(DriveRefused, match="ended by itself"):
        bench.drive.read(bench.now)
    bench.wait(3.0)
    assert (bench.velocity(0), bench.velocity(1)) == (0.0, 0.0)


def test_velocities_do_not_step_when_the_source_changes():
    guardian = Beside()
    bench = bench_beside(guardian)
    path = Straight((CENTRE + 300.0, CENTRE - 200.0), (150.0, -80.0), bench.now)
    bench.tracked(path, 20.0)
    velocities = []
    for is_led in (True, False):
        path.led = is_led
        for _ in range(12):
            bench.drive.read(bench.now)
            bench.drive.follow(path, bench.now)
            for _ in range(10):
                velocities.append((bench.velocity(0), bench.velocity(1)))
                bench.wait(0.01)
        assert bool(bench.control & REMOTE) == is_led
        assert bool(bench.control & TRACK) != is_led
    steps = [max(abs(a - b) for a, b in zip(one, two, strict=True)) for one, two in itertools.pairwise(velocities)]
    print(f"largest step of velocity {max(steps):.3f} counts/s over two changes of the source")
    assert max(steps) < 2.0
    assert max(map(abs, bench.errors(path))) < 0.5
    assert guardian.diary == ["start", "arm", "disarm", "close"]


def test_a_slew_takes_over_an_axis_that_is_led():
    guardian = Beside()
    bench = bench_beside(guardian)
    led(bench, Swing(bench.now), 8.0)
    assert abs(bench.velocity(0)) > 1000.0
    bench.slew(AxisSlew(CENTRE + 50_000), AxisSlew(CENTRE - 50_000))
    assert guardian.diary[-2:] == ["disarm", "close"]
    assert not bench.control & REMOTE
    landed = bench.polled_until_landed()
    assert [axis.counts for axis in landed.axes] == pytest.approx([CENTRE + 50_000, CENTRE - 50_000], abs=1.0)


def test_a_top_speed_that_was_borrowed_is_given_back_first():
    bench = bench_beside(Beside())
    full = bench.unit.memory.raw("axis1_max_speed")
    bench.drive.borrow({"axis1_max_speed": by_name("axis1_max_speed").decode((full // 4,))})
    bench.drive.read(bench.now)
    assert bench.unit.memory.raw("axis1_max_speed") < full
    led(bench, Swing(bench.now), 1.0)
    assert bench.unit.memory.raw("axis1_max_speed") == full


def test_lost_polls_are_survived_on_the_path():
    bench = bench_beside(Beside())
    path = Swing(bench.now)
    led(bench, path, 10.0)
    bench.line.dead = True
    with pytest.raises(TransportError):
        bench.drive.read(bench.now)
    bench.line.dead = False
    errors = led(bench, path, 10.0)
    assert math.hypot(*errors[-1]) * STEP_ARCSEC < 5.0


def test_it_is_not_left_going_when_the_driver_is_closed():
    guardian = Beside()
    bench = bench_beside(guardian)
    led(bench, Swing(bench.now), 6.0)
    bench.drive.close(bench.now, keep_tracking=True)
    bench.wait(3.0)
    assert (bench.velocity(0), bench.velocity(1)) == (0.0, 0.0)
    assert guardian.diary[-2:] == ["disarm", "close"]


@pytest.mark.parametrize("is_led", [True, False])
@pytest.mark.parametrize("clears", [True, False])
def test_a_change_of_source_after_a_slew_begins_no_other_slew(clears, is_led):
    """Some units clear the slew bit by themselves when a slew ends; written once more it would begin the next."""
    bench = bench_beside(Beside(), simulator__slew_bit_clears=clears)
    rates = (0.0, 0.0) if not is_led else (16.5, -3.0)
    bench.slew(AxisSlew(CENTRE + 5_000, rates[0]), AxisSlew(CENTRE - 5_000, rates[1]))
    bench.polled_until_landed()
    here = bench.true(0), bench.true(1)
    path = Straight(here, (150.0, -80.0), bench.now, led=is_led)
    for _ in range(20):
        led(bench, path, 1.0)
        assert "slewing" not in bench.drive.read(bench.now).motion
    assert max(map(abs, bench.errors(path))) < 0.5
