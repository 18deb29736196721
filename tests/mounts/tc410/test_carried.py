"""What is reported of an axis in motion is right within what is stated, and faults teach nothing false."""

import math

import pytest
from tc410_bench import Bench

from mounts.drive import AxisSlew
from mounts.errors import DriveRefused
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND
from mounts.tc410.slew import LandingLaw, Tc410SlewModel
from mounts.tc410.slew_watch import AxisWatch
from mounts.tc410.tracking import TrackedAxis
from mounts.tc410.trust import Trust
from mounts.tc410.unit import Values
from transports.errors import TransportError

LAW = LandingLaw.from_registers(26, 26, 0xFFFFFF)
STANDBY_COUNTS = 20.0


def kept_times(bench):
    """Note where the axes truly are when the unit is asked for its flags."""
    truth = {}
    receive = bench.line.unit.receive

    def received(data, t):
        answer = receive(data, t)
        if data.startswith(b":FF040003"):
            truth["counts"] = bench.unit.true_position(1), bench.unit.true_position(2)
        return answer

    bench.line.unit = type("Noted", (), {"receive": staticmethod(received)})()
    return truth


@pytest.mark.parametrize("baud", [0, 9600])
@pytest.mark.parametrize("happening", ["nothing", "hard limit", "power", "joystick"])
def test_a_reading_in_motion_is_right_within_what_it_states(happening, baud):
    bench = Bench(simulator__baud=baud, axis1__acceleration_register=255, axis1__deceleration_register=100)
    truth = kept_times(bench)
    bench.slew(AxisSlew(CENTRE + 40000, 16.5), AxisSlew(CENTRE - 60000, -3.0))
    worst, stated = -math.inf, 0.0
    for step in range(120):
        if step == 12:
            {
                "nothing": lambda: None,
                "hard limit": lambda: bench.unit.press_limit(1, 1),
                "power": lambda: bench.unit.write_coils(0, [False]),
                "joystick": lambda: bench.unit.joystick(230, 20),
            }[happening]()
        bench.wait(0.1)
        reading = bench.drive.read(bench.now)
        for axis, true in zip(reading.axes, truth["counts"], strict=True):
            worst = max(worst, abs(axis.counts - true) - axis.uncertainty_counts)
            stated = max(stated, axis.uncertainty_counts)
    print(
        f"{happening}, {baud or 'no'} baud: beyond what is stated by {worst:.3f} counts; stated at most ±{stated:.1f}"
    )
    assert worst <= 0.02


def test_a_count_read_before_the_landing_does_not_teach_that_tracking_went_on():
    model = Tc410SlewModel(acceleration=26, deceleration=26, max_velocity=0xF00000)
    travel = model.travel(0.0, 10000, 0.0, 0.0)
    watch = AxisWatch(model, 0.0, 0.0, 10000, travel, 16.5, 100.0)

    def at(elapsed):
        return Values(100.0 + elapsed, 0.0, {}, {}, 100.0 + elapsed, 100.0 + elapsed)

    landed = travel.duration
    watch.see(9993.0, at(landed - 0.5), at(landed + 0.1), slewing=False, other_slewing=True)
    assert watch.creeps is None
    watch.see(10008.0, at(landed + 1.0), at(landed + 1.0), slewing=False, other_slewing=True)
    assert watch.creeps


def test_a_slew_from_tracking_at_another_rate_teaches_the_true_acceleration():
    bench = Bench(simulator__baud=9600)
    bench.slew(AxisSlew(CENTRE + 2000, 6.4), AxisSlew(CENTRE, 6.4))
    bench.polled_until_landed()
    bench.wait(10.0)
    bench.drive.read(bench.now)
    bench.slew(AxisSlew(CENTRE + 60000, -42.0), AxisSlew(CENTRE + 60000, -42.0))
    bench.polled_until_landed()
    bench.wait(10.0)
    bench.drive.read(bench.now)
    scales = [axis.acceleration_scale for axis in bench.drive.learnt.axes]
    print("true over nominal acceleration learnt:", *(f"{scale:.4f}" for scale in scales))
    assert all(abs(scale - 1.0) < 0.004 for scale in scales)


def test_a_command_whose_answer_is_lost_widens_the_dead_reckoning_until_it_is_known():
    axis = TrackedAxis(1000.0, 0.0, 14000, LAW, 0.01, 0.01)
    attempted = 14500
    axis.attempt(attempted, 1.0)
    apart = (attempted - 14000) * COUNTS_PER_SECOND
    assert axis.doubtful
    assert axis.margin_at(3.0) == pytest.approx(0.01 + 2.0 * apart)
    axis.command(attempted, 3.0)  # it may have had it from the first attempt on
    assert axis.above >= 2.0 * apart
    assert not axis.doubtful


def test_a_slow_axis_that_nobody_watched_may_have_stood_still():
    axis = TrackedAxis(1000.5, 0.0, 20, LAW, 0.01, 0.01)
    axis.observe(1000, 1.0)
    assert axis.margin < 0.02
    axis.observe(1001, 31.0)
    assert axis.margin > 30.0 * 20 * COUNTS_PER_SECOND


def test_each_loss_of_power_may_move_the_axes_again():
    bench = Bench(simulator__standby_steps=0.0)
    for times in (1, 2, 3):
        for power in ([False], [True]):
            bench.unit.write_coils(0, power)
            bench.wait(1.0)
            reading = bench.drive.read(bench.now)
        assert reading.axes[0].uncertainty_counts >= times * STANDBY_COUNTS


def test_a_sync_without_power_leaves_the_motors_their_settling():
    bench = Bench(simulator__standby_steps=0.0)
    bench.unit.write_coils(0, [False])
    bench.drive.read(bench.now)
    bench.drive.sync([CENTRE, CENTRE], bench.now)
    assert bench.drive.read(bench.now).axes[0].uncertainty_counts >= STANDBY_COUNTS


@pytest.mark.parametrize("silence_s", [2.0, 12.0])
def test_a_power_cut_that_nobody_saw_is_allowed_for(silence_s):
    bench = Bench()
    bench.drive.read(bench.now)
    bench.wait(silence_s)
    uncertainty = bench.drive.read(bench.now).axes[0].uncertainty_counts
    assert (uncertainty >= STANDBY_COUNTS) == (silence_s > 5.0)


def test_axes_that_went_on_tracking_unseen_had_their_power():
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 2000, 16.5), AxisSlew(CENTRE, 0.0))
    bench.polled_until_landed()
    bench.wait(1.0)
    bench.drive.read(bench.now)
    bench.wait(30.0)
    assert bench.drive.read(bench.now).axes[0].uncertainty_counts < 1.0


def test_what_the_unit_does_is_asked_when_the_answer_to_a_control_word_is_lost():
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 2000, 16.5), AxisSlew(CENTRE, 0.0))
    bench.polled_until_landed()
    bench.line.deaf_to_answers = True
    with pytest.raises((TransportError, DriveRefused)):
        bench.drive.stop(bench.now)
    bench.line.deaf_to_answers = False
    assert not bench.drive.read(bench.now).tracking
    assert not bench.unit.memory.raw("velocity_control")


def test_a_new_doubt_adds_to_the_old_one():
    trust = Trust({})
    trust.may_be_off(20.0)
    trust.moved_unseen(20.0)
    assert trust.uncertainty_counts == 40.0
