"""What is assumed of a unit is found out: after a few slews the arrival is right on a unit that is otherwise."""

import json
import os

import pytest
from tc410_bench import Bench, OnSky, Straight

from mounts.drive import AxisSlew
from mounts.tc410.calibration import AxisLearnt, Learnt
from mounts.tc410.interval import Interval
from mounts.tc410.registers import CENTRE

JOURNEY = [(-20.0, -30.0), (30.0, -60.0), (10.0, 0.0), (-40.0, -42.0), (-41.0, -43.0)]  # hour angle, declination
FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
PACES = {"quick polls": 0.02, "slow polls": 0.5}


def journey(bench: Bench, places: list[tuple[float, float]], poll_s: float = 0.25) -> None:
    """Slew from place to place, tracking for a while at each."""
    for place in places:
        star = bench.star(*place)
        plan = bench.gone_to(star)
        bench.polled_until_landed(poll_s)
        bench.tracked(OnSky(bench.planner, star, plan), 20.0)


def error_at_arrival(bench: Bench, place: tuple[float, float]) -> float:
    """Largest error of an axis, in counts, at the stated arrival."""
    star = bench.star(*place)
    plan = bench.gone_to(star)
    path = OnSky(bench.planner, star, plan)
    bench.wait(plan.arrival - bench.now)
    worst = max(map(abs, bench.errors(path)))
    bench.polled_until_landed()
    bench.tracked(path, 20.0)
    return worst


UNITS = {
    "as assumed": {},
    "ramps 3 % quicker": {"simulator__acceleration_error": 0.03},
    "ramps 3 % slower": {"simulator__acceleration_error": -0.03},
    "lands 1.5 s late": {"simulator__landing_s": 1.5},
    "clock 100 ppm slow": {"simulator__clock_drift_ppm": 100.0},
    "everything": {
        "simulator__acceleration_error": -0.03,
        "simulator__landing_s": 1.5,
        "simulator__clock_drift_ppm": 100.0,
        "simulator__slew_idle": "per-axis",
        "simulator__position_format": "left",
        "simulator__slew_bit_clears": False,
    },
    "everything at 9600 baud": {
        "simulator__acceleration_error": 0.03,
        "simulator__landing_s": 1.5,
        "simulator__clock_drift_ppm": -100.0,
        "simulator__slew_idle": "per-axis",
        "simulator__baud": 9600,
    },
}
TAUGHT = [
    (name, pace)
    for name in UNITS
    for pace in PACES
    if FULL or pace == "quick polls" or "everything" in name  # by slow polls, less is told apart in all of it at once
]


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "pace"), TAUGHT)
def test_after_five_slews_the_sixth_arrives_within_two_counts(name: str, pace: str) -> None:
    bench = Bench(**UNITS[name])
    journey(bench, JOURNEY, PACES[pace])
    errors = [error_at_arrival(bench, place) for place in [(5.0, -20.0), (-50.0, -10.0), (-10.0, -65.0)]]
    learnt = bench.drive.memory["learnt"]
    print(f"sixth to eighth slew: {', '.join(f'{error:.2f}' for error in errors)} counts; {learnt}")
    assert max(errors) <= 2.0


@pytest.mark.parametrize("error", [-0.03, 0.03])
@pytest.mark.parametrize("landing_s", [0.0, 1.5])
def test_what_is_learnt_is_what_was_injected(error: float, landing_s: float) -> None:
    bench = Bench(simulator__acceleration_error=error, simulator__landing_s=landing_s)
    journey(bench, [*JOURNEY, (5.0, -20.0), (-50.0, -10.0)])
    for axis in bench.drive._learnt.axes:
        print(
            f"acceleration {axis.acceleration_scale:.4f} of {1 + error}, landing {axis.landing_s:.3f} of {landing_s}"
        )
        assert axis.acceleration_scale == pytest.approx(1.0 + error, abs=0.003)
        assert axis.landing_s == pytest.approx(
            landing_s, abs=0.1
        )  # of the axis that lands first the flags alone tell


@pytest.mark.parametrize("unit", ["both", "per-axis"])
@pytest.mark.parametrize("assumed", ["both", "per-axis"])
def test_the_idle_rule_is_found_out(unit: str, assumed: str) -> None:
    bench = Bench(simulator__slew_idle=unit, drive__slew_idle=assumed)
    assert bench.drive.axes_land_together == (assumed == "both")
    journey(bench, JOURNEY[:3])
    assert bench.drive.axes_land_together == (unit == "both")
    assert any("slew_idle" in note for note in bench.drive.notes) == (unit != assumed)


def test_a_unit_as_assumed_teaches_nothing_new() -> None:
    bench = Bench()
    journey(bench, JOURNEY)
    for axis in bench.drive._learnt.axes:
        assert axis.acceleration_scale == pytest.approx(1.0, abs=5e-4)
        assert axis.landing_s < 0.01


def test_what_was_learnt_outlives_the_process() -> None:
    bench = Bench(simulator__acceleration_error=0.03, simulator__landing_s=1.5)
    journey(bench, JOURNEY)
    bench.drive.close(bench.now, keep_tracking=False)
    bench.keep(bench.drive.memory)
    before = bench.drive._learnt
    bench.restarted()
    assert bench.drive._learnt == before
    assert error_at_arrival(bench, (5.0, -20.0)) <= 2.0


def disturb_joystick(bench: Bench) -> None:
    bench.unit.write_registers(0, [bench.control | 0x08])
    bench.unit.joystick(255, 128)
    bench.wait(2.0)
    bench.drive.read(bench.now)
    bench.unit.joystick(128, 128)


def disturb_limit(bench: Bench) -> None:
    bench.unit.press_limit(1, +1)


def disturb_power(bench: Bench) -> None:
    bench.unit.write_coils(0, [False])


def disturb_supply(bench: Bench) -> None:
    bench.unit.power_cycle()


def disturb_stop(bench: Bench) -> None:
    bench.drive.stop(bench.now)


@pytest.mark.parametrize("disturb", [disturb_joystick, disturb_limit, disturb_power, disturb_supply, disturb_stop])
@pytest.mark.parametrize("after_s", [2.0, 12.0])
def test_a_disturbed_slew_teaches_nothing(disturb: object, after_s: float) -> None:
    bench = Bench(drive__joystick_mode=8)
    before = bench.drive._learnt.axes
    began = bench.slew(AxisSlew(CENTRE + 180_000, 16.5), AxisSlew(CENTRE + 100_000, 0.1))
    while bench.now < began + after_s:
        bench.drive.read(bench.now)
        bench.wait(0.2)
    disturb(bench)
    for _ in range(100):
        bench.drive.read(bench.now)
        bench.wait(0.2)
    bench.drive.close(bench.now, keep_tracking=False)
    assert bench.drive._learnt.axes == before


@pytest.mark.parametrize("unit", ["both", "per-axis"])
@pytest.mark.parametrize("assumed", ["both", "per-axis"])
def test_slews_whose_end_nobody_saw_teach_no_nonsense(unit: str, assumed: str) -> None:
    bench = Bench(simulator__slew_idle=unit, drive__slew_idle=assumed)
    bench.slew(AxisSlew(CENTRE + 20_000, 16.5), AxisSlew(CENTRE + 150_000))
    bench.wait(2.0)
    bench.drive.read(bench.now)
    bench.wait(60.0)
    for _ in range(20):
        bench.wait(1.0)
        bench.drive.read(bench.now)
    bench.slew(AxisSlew(CENTRE + 100_000, 16.5), AxisSlew(CENTRE))
    bench.wait(300.0)
    bench.drive.read(bench.now)
    for _ in range(20):
        bench.wait(1.0)
        bench.drive.read(bench.now)
    for axis in bench.drive._learnt.axes:
        assert axis.landing_s == pytest.approx(0.0, abs=0.01)
        assert axis.acceleration_scale == pytest.approx(1.0, abs=1e-3)


def test_the_latency_is_the_median_so_that_one_slow_start_changes_nothing() -> None:
    bench = Bench()
    places = [AxisSlew(CENTRE + 500 * k) for k in range(1, 6)]
    for k, slew in enumerate(places):
        if k == 2:
            bench.line.before = lambda _: bench.wait(0.05)
        bench.slew(slew, AxisSlew(CENTRE))
        bench.line.before = None
        bench.polled_until_landed()
    print(f"latency {bench.drive.start_latency:.4f} s")
    assert bench.drive.start_latency == pytest.approx(0.053, abs=0.003)


def test_a_memory_that_cannot_be_read_counts_as_nothing_learnt() -> None:
    learnt = Learnt((AxisLearnt(1.02, 0.5), AxisLearnt(0.98, 1.5)), (0.05, 0.06), "per-axis")
    assert Learnt.from_json(json.loads(json.dumps(learnt.as_json()))) == learnt
    for spoilt in ({}, None, {"axes": []}, {"axes": [{}, {}]}, {**learnt.as_json(), "latencies_s": ["x"]}, 7):
        assert Learnt.from_json(spoilt) == Learnt()
    fine = {"acceleration_scale": 1.0, "landing_s": 0.0}
    for name, value in (("acceleration_scale", 0.0), ("acceleration_scale", float("nan")), ("landing_s", 1e9)):
        assert Learnt.from_json({**learnt.as_json(), "axes": [fine, {**fine, name: value}]}) == Learnt()


def test_a_value_is_moved_only_as_far_as_an_observation_asks() -> None:
    seen = Interval(1.0, 2.0)
    assert [seen.nearest(value) for value in (0.0, 1.1, 5.0)] == [1.25, 1.1, 1.75]
    assert seen.within(Interval(1.5, 9.0)) == Interval(1.5, 2.0)
    assert seen.within(Interval(3.0, 9.0)) is None


def test_a_bench_path_is_even() -> None:
    assert Straight((1.0, 2.0), (3.0, 4.0), 10.0).at(12.0) == ((7.0, 3.0), (10.0, 4.0))
