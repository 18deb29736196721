"""After a slew the telescope stays on its path to a fraction of a count, whatever the link and people do."""

import itertools
import math
import random

import pytest
from tc410_bench import STEP_ARCSEC, Bench, OnSky, Straight

from mounts.errors import DriveRefused, Unsynchronised
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND
from mounts.tc410.slew import LandingLaw
from mounts.tc410.tracking import TrackedAxis
from transports.errors import TransportError

SIDEREAL = 13873 * COUNTS_PER_SECOND
LAW = LandingLaw.from_registers(26, 26, 0xFFFFFF)


def tracking_bench(**overrides: object) -> tuple[Bench, Straight]:
    """Make a bench that has been on its path for half a minute."""
    bench = Bench(**overrides)
    path = Straight((CENTRE + 300.25, CENTRE - 200.5), (16.5371, -0.7313), bench.now)
    bench.tracked(path, 30.0)
    return bench, path


@pytest.mark.parametrize(
    ("link", "aim_arcsec"),
    [({}, 0.15), ({"simulator__baud": 9600}, 0.15), ({"simulator__clock_drift_ppm": 100.0}, 0.2)],
    ids=["1 ms", "9600 baud", "clock 100 ppm slow"],
)
@pytest.mark.parametrize("place", [(-20.0, -30.0), (40.0, -60.0)])
def test_ten_minutes_of_tracking_stay_within_half_an_arcsecond(
    link: dict[str, object], aim_arcsec: float, place: tuple[float, float]
) -> None:
    bench = Bench(**link)
    star = bench.star(*place)
    plan = bench.gone_to(star)
    path = OnSky(bench.planner, star, plan)
    bench.polled_until_landed()
    errors = bench.tracked(path, 600.0)
    settled = [math.hypot(*pair) * STEP_ARCSEC for pair in errors[15:]]
    first = [math.hypot(*pair) * STEP_ARCSEC for pair in errors[:15]]
    rms = math.sqrt(sum(error**2 for error in settled) / len(settled))
    print(f"largest {max(settled):.3f}″, rms {rms:.3f}″ in ten minutes; first 15 s {max(first):.3f}″")
    assert max(first) < 0.5
    assert max(settled) < aim_arcsec


@pytest.mark.parametrize("jitter_s", [0.005, 0.02, 0.05])
def test_a_link_of_uneven_delays_costs_little(jitter_s: float) -> None:
    """The moment of a reading is known as an interval; the quickest exchange gives the travel time."""
    bench = Bench()
    chance = random.Random(3)  # noqa: S311 - the same delays every time
    bench.line.delay_s = lambda: chance.expovariate(1.0 / jitter_s)
    bench.restarted()
    met = []
    for place in [(-20.0, -30.0), (30.0, -60.0), (5.0, -20.0), (-50.0, -10.0)]:
        star = bench.star(*place)
        plan = bench.gone_to(star)
        path = OnSky(bench.planner, star, plan)
        bench.wait(plan.arrival - bench.now)
        met.append(max(map(abs, bench.errors(path))))
        bench.polled_until_landed()
        errors = bench.tracked(path, 120.0)
        settled = max(math.hypot(*pair) * STEP_ARCSEC for pair in errors[20:])
        assert settled < 0.5
    print(
        f"jitter {jitter_s * 1e3:.0f} ms: off by {[round(error, 2) for error in met]} counts at the arrivals, "
        f"latency {bench.drive.start_latency:.3f} s, tracking {settled:.3f}″, {bench.drive._learnt.axes}"
    )


def test_neighbouring_velocities_are_dithered() -> None:
    bench = Bench()
    path = Straight((CENTRE, CENTRE), (13873.3 * COUNTS_PER_SECOND, 0.0), bench.now)
    bench.tracked(path, 60.0)
    seen = []
    for _ in range(120):
        bench.tracked(path, 1.0)
        seen.append(bench.unit.memory.velocities("tracking_velocity")[0])
    spread = sorted(set(seen))
    print(f"mean register {sum(seen) / len(seen):.2f} of 13873.30, from {spread[0]} to {spread[-1]}")
    assert sum(seen) / len(seen) == pytest.approx(13873.3, abs=2.0)
    assert spread[-1] - spread[0] <= 200  # 0.24 counts/s


def test_counts_are_never_fed_back() -> None:
    """At an even rate whole counts wander through every phase; the velocity hardly notices."""
    bench, path = tracking_bench()
    velocities = []
    for _ in range(60):
        bench.tracked(path, 1.0)
        velocities.append(bench.velocity(0))
    assert max(abs(after - before) for before, after in itertools.pairwise(velocities)) < 0.25


def test_lost_polls_of_ten_seconds_are_survived() -> None:
    bench, path = tracking_bench()
    bench.line.dead = True
    silent_until = bench.now + 10.0
    while bench.now < silent_until:
        with pytest.raises(TransportError):
            bench.drive.read(bench.now)
        with pytest.raises(TransportError):
            bench.drive.follow(
                Straight(path.counts, (path.rates[0] + 0.1, path.rates[1] + 0.1), path.since), bench.now
            )
        bench.wait(0.5)
    blind = bench.errors(path)
    bench.line.dead = False
    assert not bench.drive.read(bench.now).unsynchronised
    after = bench.tracked(path, 10.0)[-1]
    print(f"off the path after silence {blind}, ten seconds later {after}")
    assert max(map(abs, blind)) < 0.2
    assert max(map(abs, after)) < 0.2


def test_a_velocity_whose_answer_was_lost_is_written_again() -> None:
    bench, path = tracking_bench()
    bench.line.deaf_to_answers = True
    moved = Straight((path.counts[0] + 100.0, path.counts[1]), path.rates, path.since)
    with pytest.raises(TransportError):
        bench.drive.follow(moved, bench.now)
    bench.line.deaf_to_answers = False
    errors = bench.tracked(moved, 25.0)[-1]
    assert max(map(abs, errors)) < 0.3


@pytest.mark.parametrize("seconds", [1.0, 5.0])
def test_a_joystick_is_seen_and_its_displacement_closed(seconds: float) -> None:
    bench, path = tracking_bench(drive__joystick_mode=8)
    bench.unit.write_registers(0, [bench.control | 0x08])
    bench.unit.joystick(255, 128)
    bench.tracked(path, seconds)
    pushed = bench.errors(path)[0]
    reading = bench.drive.read(bench.now)
    assert "joystick" in reading.motion
    assert reading.axes[0].rate == pytest.approx(bench.velocity(0), abs=1e-6)
    assert abs(reading.axes[0].counts - bench.true(0)) < 1.5
    bench.unit.joystick(128, 128)
    bench.drive.read(bench.now)
    bench.tracked(path, abs(pushed) / 200.0 + 15.0)
    left = bench.errors(path)
    print(f"pushed by {pushed:.1f} counts, {left[0]:+.3f} left")
    assert abs(pushed) > 20.0
    assert max(map(abs, left)) < 0.5


def test_velocities_never_step_beyond_the_catch_up_bound() -> None:
    bench, path = tracking_bench()
    far = Straight((path.counts[0] + 5000.0, path.counts[1] - 5000.0), path.rates, path.since)
    seen = []
    for _ in range(60):
        bench.tracked(far, 1.0)
        seen.append((bench.velocity(0) - far.rates[0], bench.velocity(1) - far.rates[1]))
    print("largest excess", max(abs(excess) for pair in seen for excess in pair), "counts/s")
    assert max(abs(excess) for pair in seen for excess in pair) <= 200.01
    assert max(map(abs, bench.errors(far))) < 0.3


def test_a_path_is_taken_up_from_rest() -> None:
    bench = Bench()
    path = Straight((CENTRE + 3.3, CENTRE - 5.7), (16.5, -2.0), bench.now)
    bench.drive.follow(path, bench.now)
    errors = bench.tracked(path, 15.0)
    assert max(map(abs, errors[-1])) < 0.3


def test_nothing_is_followed_without_power_or_trust() -> None:
    bench, path = tracking_bench()
    bench.drive.power(on=False)
    bench.drive.read(bench.now)
    with pytest.raises(DriveRefused, match="standby"):
        bench.drive.follow(path, bench.now)
    bench.drive.power(on=True)
    bench.drive.read(bench.now)
    bench.tracked(path, 20.0)
    bench.unit.power_cycle()
    bench.drive.read(bench.now)
    with pytest.raises(Unsynchronised, match="power-cycled"):
        bench.drive.follow(path, bench.now)
    bench.wait(5.0)
    assert bench.velocity(0) == 0.0


def test_stop_ends_tracking() -> None:
    bench, _ = tracking_bench()
    bench.drive.stop(bench.now)
    bench.wait(0.5)
    before = bench.true(0), bench.true(1)
    bench.wait(60.0)
    assert (bench.true(0), bench.true(1)) == before
    assert not bench.drive.read(bench.now).tracking


@pytest.mark.parametrize("keep", [True, False])
def test_close_keeps_tracking_only_when_told(keep: bool) -> None:
    bench, _ = tracking_bench()
    bench.drive.close(bench.now, keep_tracking=keep)
    bench.wait(2.0)
    assert (bench.velocity(0) != 0.0) == keep


@pytest.mark.parametrize("position_format", ["right", "left"])
def test_a_sync_moves_the_position_and_not_the_telescope(position_format: str) -> None:
    bench, _ = tracking_bench(simulator__position_format=position_format)
    bench.unit.write_registers(0x12, [0])
    here = bench.true(0) + bench.unit.axes[0].offset / 2**24
    velocity = bench.velocity(0)
    started = bench.now
    bench.drive.sync([CENTRE + 123_456.3, CENTRE - 65_432.1], bench.now)
    reading = bench.drive.read(bench.now)
    gone = (bench.now - started) * SIDEREAL
    assert abs(reading.axes[0].counts - (CENTRE + 123_456)) < gone + 1.5
    assert bench.velocity(0) == velocity
    assert abs(bench.unit.true_position(1) - here) < gone + 1.0
    assert bench.unit.memory.raw("axis1_negative_limit") > 0
    assert reading.tracking
    path = Straight((CENTRE + 123_456.3, CENTRE - 65_432.1), (16.5371, -0.7313), started)
    errors = bench.tracked(path, 30.0)
    assert max(map(abs, errors[-1])) < 0.3


def test_counts_of_many_phases_leave_the_interval_that_their_nearest_edges_leave() -> None:
    """The dead reckoning against an axis of which only whole counts are told.

    A count told at a phase f of the truth leaves f below it and 1 − f above it. With every second that has passed
    since, both grow by what the clocks may differ, 150 ppm of the way, and once by half a millisecond of jitter. The
    smallest of each that 30 phases leave is what is known.
    """
    axis = TrackedAxis(1000.5, 0.0, 13873, LAW)
    truth = 1000.031
    drift, jitter = 1.5e-4 * SIDEREAL, 0.5e-3 * SIDEREAL
    below = above = math.inf
    for beat in range(1, 30):
        true = truth + SIDEREAL * beat
        axis.observe(math.floor(true), float(beat))
        below, above = min(below + drift, true % 1.0 + jitter), min(above + drift, 1.0 - true % 1.0 + jitter)
        assert axis.at(beat) - axis.below <= true <= axis.at(beat) + axis.above
    print(f"{axis.below:.3f} + {axis.above:.3f} counts after 30 readings, {below:.3f} + {above:.3f} by their phases")
    assert axis.below + axis.above == pytest.approx(below + above, abs=1e-6)
    assert axis.margin <= below + above
    assert not axis.disturbed


def test_a_displacement_is_no_rounding() -> None:
    """The count 1003 says that the axis is in [1003, 1004), wherever it was: no more and no less is known of it."""
    axis = TrackedAxis(1000.0, 0.0, 0, LAW, below=0.01, above=0.01)
    moved = axis.observe(1003, 1.0)
    assert 3.0 <= moved <= 4.0
    assert axis.at(1.0) - axis.below == pytest.approx(1003.0)
    assert axis.at(1.0) + axis.above == pytest.approx(1004.0)
    assert axis.disturbed
