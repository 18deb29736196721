"""The simulated controllers, asked on their own wire; the cubics of the oracle are numpy's."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from mounts.apo.commands import TABLE
from mounts.apo.replies import ReplyDecoder
from mounts.apo.simulator import SimulatedObservatory
from mounts.apo.simulator_clock import ControllerClock
from mounts.apo.simulator_settings import HARDWARE, AxisHardware, SimulatorSettings
from mounts.apo.status_word import StatusWord

T0 = 1_800_000_000.0  # 08:00:00 UTC
TAI0 = 28_800.0 + 37.0


class Wire:
    """One axis of a simulated telescope, and somebody who types."""

    def __init__(
        self, axis: int = 1, kind: str = "apo", positions=(0.0, 40.0, 0.0), hardware=None, **settings
    ) -> None:
        self.unit = SimulatedObservatory(kind, SimulatorSettings(**settings), T0, hardware, positions)
        self.line = self.unit.lines[axis - 1 if kind == "apo" else 0]
        self.axis = self.unit.axes[axis - 1]
        self.word = "" if kind == "apo" else ("AZ ", "ALT ", "ROT ")[axis - 1]
        self.number = axis

    def say(self, text: str, after: float):
        """Say a line `after` seconds; return the reply."""
        (reply,) = ReplyDecoder().feed(self.line.receive(f"{self.word}{text}\r".encode(), T0 + after))
        assert reply.echo == self.word + text
        return reply

    def told(self, text: str, after: float) -> None:
        assert self.say(text, after).ok

    def refused(self, text: str, after: float) -> str:
        reply = self.say(text, after)
        assert not reply.ok
        return reply.error

    def status(self, after: float):
        words = self.say("STATUS", after).lines[0].split()
        return float(words[0]), float(words[1]), float(words[2]), StatusWord(int(words[3]), self.axis.kind)

    def names(self, after: float) -> set[str]:
        return set(self.status(after)[3].names)

    def true(self, after: float) -> float:
        self.unit.advance(T0 + float(after))
        return self.unit.true_position(self.number)


def hermite(x0, v0, x1, v1, dt):
    """The cubic through both ends, solved as linear equations."""
    rows = [[1, 0, 0, 0], [0, 1, 0, 0], [1, dt, dt**2, dt**3], [0, 1, 2 * dt, 3 * dt**2]]
    return Polynomial(np.linalg.solve(rows, [x0, v0, x1, v1]))


# Interpolated paths -----------------------------------------------------------------------------------------------


def test_the_axis_is_on_the_cubic_through_the_nodes_between_frames_too():
    wire = Wire()
    nodes = [(0.0, 0.0, 2.0), (0.02, 0.03, 3.0), (0.2, 0.12, 5.3), (0.9, 0.2, 9.0)]
    for position, velocity, time in nodes:
        wire.told(f"MOVE {position} {velocity} {TAI0 + time}", 0.1)
    worst = 0.0
    for (x0, v0, t0), (x1, v1, t1) in pairwise(nodes):
        cubic = hermite(x0, v0, x1, v1, t1 - t0)
        for time in np.linspace(t0, t1, 37)[:-1]:
            worst = max(worst, abs(wire.true(time) - cubic(time - t0)))
    print(f"off the cubic by at most {worst * 3.6e9:.2f} µas")
    assert worst < 2e-7  # POSIX seconds resolve 0.24 µs
    record = wire.axis.record
    assert (record.nodes, record.position_jump, record.velocity_jump) == (4, 0.0, 0.0)


def test_frame_by_frame_and_in_one_stride_the_axis_is_at_the_same_place():
    many = bare(0, fiducials_deg=tuple(np.arange(-1, 2, 0.05).tolist()), fiducial_width_deg=0.01)
    plain, watched = Wire(hardware=[bare(0)] * 3), Wire(hardware=[many] * 3)
    for wire in (plain, watched):
        for position, velocity, time in [(0.0, 0.0, 1.0), (0.3, 0.12, 6.0), (1.2, 0.17, 12.0)]:
            wire.told(f"MOVE {position} {velocity} {TAI0 + time}", 0.1)
    for after in np.arange(0.5, 11.9, 0.37):
        assert plain.true(after) == pytest.approx(watched.true(after), abs=1e-9)
    assert len(watched.axis.fiducials.passages) > 10


def bare(axis: int, kind: str = "apo", **changes) -> AxisHardware:
    values = {**vars(HARDWARE[kind][axis]), "fiducials_deg": (), **changes}
    return AxisHardware(**values)


def test_the_record_has_what_the_cubics_ask_of_the_axis():
    wire = Wire()
    wire.told(f"MOVE 0 0 {TAI0 + 1}", 0.1)
    wire.told(f"MOVE 0.5 0.1 {TAI0 + 5}", 0.1)
    cubic = hermite(0.0, 0.0, 0.5, 0.1, 4.0)
    times = np.linspace(0.0, 4.0, 40001)
    record = wire.axis.record
    assert record.velocity == pytest.approx(abs(cubic.deriv()(times)).max(), rel=1e-7)
    assert record.acceleration == pytest.approx(abs(cubic.deriv(2)(times)).max(), rel=1e-9)
    assert record.jerk == pytest.approx(abs(cubic.deriv(3)(0.0)), rel=1e-9)


def test_the_first_node_finds_the_axis_where_its_drift_has_brought_it():
    wire = Wire()
    wire.told("MOVE 0 0.02", 0.0)
    position, velocity, time = map(float, wire.say("DRIFT", 5.0).lines[0].split())
    assert (velocity, time) == (0.02, TAI0 + 5)
    wire.told(f"MOVE {position + 0.04} 0.02 {time + 2.0}", 5.1)
    wire.told(f"MOVE {position + 0.10} 0.02 {time + 5.0}", 5.1)
    assert wire.true(6.9) == pytest.approx(position + 0.038, abs=2e-7)
    assert wire.axis.record.position_jump < 1e-7
    assert wire.true(9.0) == pytest.approx(position + 0.08, abs=2e-7)


@pytest.mark.parametrize("first", ["wait", "join"])
def test_a_first_node_off_the_drift_is_met_by_a_jump_or_by_a_cubic(first):
    wire = Wire(first_node=first)
    wire.told(f"MOVE 0.005 0 {TAI0 + 4}", 0.0)
    wire.told(f"MOVE 0.005 0 {TAI0 + 8}", 0.0)
    half_way = wire.true(2.0)
    assert half_way == pytest.approx(0.0 if first == "wait" else 0.0025, abs=1e-6)
    assert wire.axis.record.position_jump == pytest.approx(0.005 if first == "wait" else 0.0, abs=1e-15)
    assert wire.true(7.0) == pytest.approx(0.005, abs=1e-9)


@pytest.mark.parametrize("policy", ["halt", "extrapolate"])
def test_a_path_that_runs_dry_halts_or_goes_on_and_is_recorded(policy):
    wire = Wire(on_expiry=policy)
    wire.told(f"MOVE 0 0 {TAI0 + 1}", 0.1)
    wire.told(f"MOVE 0.2 0.1 {TAI0 + 5}", 0.1)
    assert "buffer_empty" not in wire.names(4.9)
    assert "update_late" not in wire.names(4.9)
    assert {"buffer_empty", "update_late"} <= wire.names(6.5)
    assert wire.axis.record.dry == [pytest.approx(T0 + 5.0, abs=1e-6)]
    expected = 0.2 + 0.1**2 / 0.2 if policy == "halt" else 0.2 + 0.1 * 15.0
    assert wire.true(20.0) == pytest.approx(expected, abs=1e-6)
    assert wire.status(20.0)[1] == (0.0 if policy == "halt" else 0.1)


def test_a_node_in_time_keeps_the_path_from_running_dry():
    wire = Wire()
    for count in range(20):
        wire.told(f"MOVE {0.004 * count} 0.004 {TAI0 + 2 + count}", max(0.1, count))
    assert wire.axis.record.dry == []
    assert "update_late" not in wire.names(20.5)


def test_a_late_node_is_refused_and_not_queued():
    wire = Wire()
    assert "passed" in wire.refused(f"MOVE 1 0 {TAI0 + 9.9}", 10.0)
    assert wire.names(10.0) == {"buffer_empty", "update_late"}
    assert wire.axis.record.late == [T0 + 10.0]
    assert wire.true(30.0) == 0.0


def test_a_late_node_may_be_dropped_in_silence():
    wire = Wire(refusals="silence")
    wire.told(f"MOVE 1 0 {TAI0 + 9.9}", 10.0)
    assert wire.true(30.0) == 0.0
    assert "update_late" in wire.names(30.0)


def test_a_node_before_the_one_before_is_refused():
    wire = Wire()
    wire.told(f"MOVE 0 0 {TAI0 + 9}", 0.0)
    assert "not after" in wire.refused(f"MOVE 0 0 {TAI0 + 9}", 0.0)


def test_one_node_more_than_the_buffer_holds_is_refused():
    wire = Wire(max_nodes=4)
    for count in range(4):
        wire.told(f"MOVE 0 0 {TAI0 + 2 + count}", 0.0)
    assert "4 nodes" in wire.refused(f"MOVE 0 0 {TAI0 + 9}", 0.0)
    wire.told(f"MOVE 0 0 {TAI0 + 9}", 2.1)


@pytest.mark.parametrize("command", ["MOVE", "MOVE 5", "MOVE 5 0.1", "DRIFT", "INIT", "STOP", "X", "P", "RESET"])
def test_what_supersedes_a_path_flushes_it(command):
    wire = Wire(boot_s=0.0)
    for count in range(9):
        wire.told(f"MOVE {0.1 * count} 0.1 {TAI0 + 2 + count}", 0.0)
    wire.told(command, 4.5)
    assert "buffer_empty" in wire.names(4.6)
    assert wire.axis.record.dry == []


def test_velocity_is_clipped_silently_with_bit_4():
    wire = Wire()
    wire.told("MOVE 0 9.0", 0.0)
    assert "velocity_limited" in wire.names(0.1)
    _, velocity, _, word = wire.status(30.0)
    assert velocity == 1.75
    assert word.has("velocity_limited")
    wire.told("INIT", 31.0)
    assert "velocity_limited" not in wire.names(31.1)


def test_a_path_that_asks_too_much_is_followed_as_well_as_the_axis_can_and_is_told():
    wire = Wire()
    wire.told(f"MOVE 0 0 {TAI0 + 1}", 0.0)
    wire.told(f"MOVE 0.03 0 {TAI0 + 2}", 0.0)  # 0.18 deg/s² at both ends
    wire.told(f"MOVE 0.03 0 {TAI0 + 9}", 0.0)
    velocities = np.diff([wire.true(after) for after in np.arange(1.0, 4.0, 0.05)]) / 0.05
    print(f"acceleration at most {abs(np.diff(velocities)).max() / 0.05:.4f} deg/s²")
    assert abs(np.diff(velocities)).max() / 0.05 < 0.1001
    assert "acceleration_limited" in wire.names(4.0)
    assert "velocity_limited" not in wire.names(4.0)
    assert wire.true(8.0) == pytest.approx(0.03, abs=1e-9)
    assert wire.axis.record.acceleration == pytest.approx(0.18)


@pytest.mark.parametrize(("kind", "name"), [("apo", "motion_error"), ("sdss", "out_of_closed_loop")])
def test_an_axis_too_far_behind_its_path_gives_up_and_wants_init(kind, name):
    wire = Wire(kind=kind)
    wire.told(f"MOVE 0 0 {TAI0 + 1}", 0.0)
    wire.told(f"MOVE 3 0 {TAI0 + 3}", 0.0)
    wire.told(f"MOVE 3 0 {TAI0 + 90}", 0.0)
    assert name in wire.names(10.0)
    assert wire.status(40.0)[1] == 0.0
    assert "INIT" in wire.refused("MOVE 1", 40.0)
    wire.told("INIT", 41.0)
    wire.told("MOVE 1", 41.0)
    assert wire.true(80.0) == pytest.approx(1.0)


# Other motion -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [1, 2, 3])
@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_move_to_a_position_lands_there_within_velocity_and_acceleration(kind, axis):
    hardware = HARDWARE[kind][axis - 1]
    wire = Wire(axis, kind)
    start, to = wire.true(0.0), hardware.highest_deg - 1.0
    wire.told(f"MOVE {to}", 0.0)
    distance, a, v = to - start, hardware.acceleration, hardware.velocity
    least = distance / v + v / a if distance > v * v / a else 2.0 * math.sqrt(distance / a)
    times = np.arange(0.0, 1.2 * least + 10.0, 0.05)
    places = np.array([wire.true(after) for after in times])
    velocities = np.diff(places) / 0.05
    arrived = times[np.argmax(abs(places - to) < 1e-6)]
    print(f"{kind} {axis}: {distance:.1f}° in {arrived:.2f} s, at least {least:.2f} s")
    assert abs(velocities).max() <= v * (1 + 1e-4)
    resolved = 4.0 * v * 1.2e-7 / 0.05**2  # what half the resolution of POSIX seconds makes of four differences
    assert abs(np.diff(velocities)).max() / 0.05 <= a + resolved
    assert least <= arrived < 1.07 * least + 1.0
    assert places[-1] == pytest.approx(to, abs=1e-9)
    assert places.max() < to + 1e-3


def test_a_line_from_now_is_caught_up_with():
    wire = Wire()
    wire.told("MOVE 3 0.05", 1.0)
    assert wire.true(41.0) == pytest.approx(3.0 + 0.05 * 40.0, abs=1e-6)


def test_move_alone_overshoots_and_comes_back():
    wire = Wire()
    wire.told("MOVE 0 1", 0.0)
    before = wire.true(30.0)
    wire.told("MOVE", 30.0)
    places = [wire.true(after) for after in np.arange(30.0, 60.0, 0.1)]
    assert max(places) > before + 1.0
    assert places[-1] == pytest.approx(before, abs=1e-6)


@pytest.mark.parametrize(("command", "times"), [("INIT", 1.0), ("STOP", 5.0)])
def test_init_and_stop_brake_and_stay(command, times):
    wire = Wire()
    wire.told("MOVE 0 1", 0.0)
    before, velocity, _, _ = wire.status(30.0)
    wire.told(command, 30.0)
    assert wire.true(60.0) == pytest.approx(before + velocity**2 / (2.0 * 0.1 * times), abs=1e-5)


def test_drift_goes_on_at_the_present_velocity_even_while_it_accelerates():
    wire = Wire()
    wire.told("MOVE 90", 0.0)
    position, velocity, _ = map(float, wire.say("DRIFT", 6.0).lines[0].split())
    assert velocity == pytest.approx(0.6, abs=0.01)
    assert wire.true(16.0) == pytest.approx(position + 10.0 * velocity, abs=1e-4)


def test_stow_drives_to_the_stow_position():
    wire = Wire(2)
    wire.told("P", 0.0)
    assert wire.true(60.0) == pytest.approx(30.0)


def test_steps_move_by_step_and_count():
    wire = Wire()
    wire.told("STEP 0.5", 0.0)
    wire.told("+", 1.0)
    assert wire.true(20.0) == pytest.approx(0.5)
    wire.told("- 3", 20.0)
    assert wire.true(50.0) == pytest.approx(-1.0)


def test_an_offset_moves_what_is_in_the_buffer_and_not_what_comes_later():
    wire = Wire()
    for count in range(6):
        wire.told(f"MOVE {0.01 * count} 0.01 {TAI0 + 2 + count}", 0.0)
    wire.told("+MOVE 0.002", 4.0)
    assert wire.true(6.9) == pytest.approx(0.049 + 0.002, abs=2e-7)
    wire.told(f"MOVE 0.1 0.01 {TAI0 + 12}", 6.9)
    wire.told(f"MOVE 0.11 0.01 {TAI0 + 13}", 6.9)
    assert wire.true(12.5) == pytest.approx(0.105, abs=2e-7)
    assert wire.axis.record.dry == []


def test_an_offset_may_be_a_line_from_now_or_from_a_time():
    for text, expected in (("+MOVE 0.1 0.01", 0.1 + 0.2), (f"+MOVE 0.1 0.01 {TAI0 + 5}", 0.1 + 0.25)):
        wire = Wire()
        wire.told("MOVE 0", 0.0)
        wire.told("+MOVE", 0.0)
        wire.told(text, 10.0)
        assert wire.true(30.0) == pytest.approx(expected, abs=1e-6)


# Limits -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("to", "limit", "name"), [(400, 360.0, "forward_soft_limit"), (-300, -180.0, "reverse_soft_limit")]
)
def test_a_soft_limit_stops_the_axis_on_it(to, limit, name):
    wire = Wire(positions=(0.99 * limit, 40.0, 0.0))
    wire.told(f"MOVE {to}", 0.0)
    places = [wire.true(after) for after in np.arange(0.0, 60.0, 0.1)]
    assert max(abs(place) for place in places) <= abs(limit) + 1e-9
    assert places[-1] == pytest.approx(limit, abs=1e-6)
    assert name in wire.names(60.0)
    wire.told("MOVE 0", 60.0)
    assert name not in wire.names(70.0)


def test_a_drift_ends_at_the_soft_limit():
    wire = Wire(2, positions=(0.0, 84.0, 0.0))
    wire.told("MOVE 84 0.02", 0.0)
    assert wire.true(200.0) == pytest.approx(85.0, abs=1e-6)
    assert "forward_soft_limit" in wire.names(200.0)


def test_limits_and_velocity_can_be_set_and_told():
    wire = Wire()
    wire.told("SET.LIMITS 10 -5", 0.0)
    wire.told("MAXV 0.5", 0.0)
    assert wire.say("SET.LIMITS", 0.0).lines == ("-5.0000000 10.0000000",)
    assert wire.say("MAXV", 0.0).lines == ("0.50000",)
    wire.told("MOVE 50", 0.0)
    assert wire.status(12.0)[1] == 0.5
    assert wire.true(60.0) == pytest.approx(10.0, abs=1e-6)


def test_limits_go_by_the_name_in_the_settings_and_may_not_be_told():
    wire = Wire(limits_command="SET.LIMIT", tells_settings=False)
    assert "unknown" in wire.refused("SET.LIMITS 1 2", 0.0)
    wire.told("SET.LIMIT -1 2", 0.0)
    assert "argument" in wire.refused("MAXV", 0.0)


def test_commands_that_a_controller_does_not_have_are_refused_by_name_and_alias():
    wire = Wire(unknown=("LOG", "HELP"))
    for text in ("LOG hello", "HELP", "? MOVE"):
        assert "unknown command" in wire.refused(text, 0.0)
    wire.told("DEBUG on", 0.0)


def test_a_limit_switch_stops_the_axis_one_way_and_not_the_other():
    wire = Wire()
    wire.told("MOVE 0 1", 0.0)
    here, velocity, _, _ = wire.status(20.0)
    wire.axis.press_limit(1)
    assert wire.true(40.0) == pytest.approx(here + velocity**2 / (2 * 0.5), abs=1e-4)
    assert "forward_limit_switch" in wire.names(40.0)
    wire.told("MOVE 0", 41.0)
    assert wire.true(90.0) == pytest.approx(0.0, abs=1e-6)
    assert "forward_limit_switch" not in wire.names(90.0)


# Status and time --------------------------------------------------------------------------------------------------


def test_status_tells_tai_seconds_of_the_day_through_midnight():
    wire = Wire()
    midnight = 86_400.0 - TAI0
    assert wire.status(midnight - 1.0)[2] == 86_399.0
    assert wire.status(midnight)[2] == 0.0
    assert wire.status(midnight + 1.0)[2] == 1.0


def test_a_path_goes_on_through_midnight():
    wire = Wire()
    midnight = 86_400.0 - TAI0
    wire.told(f"MOVE 0 0.01 {86_398.0}", midnight - 4.0)
    wire.told(f"MOVE 0.05 0.01 {3.0}", midnight - 4.0)
    wire.told(f"MOVE 0.10 0.01 {8.0}", midnight - 4.0)
    assert wire.true(midnight + 5.0) == pytest.approx(0.07, abs=1e-5)


def test_a_leap_second_is_counted():
    """At the end of 2016 TAI − UTC went from 36 to 37 s, and a second passed that POSIX time does not have."""
    new_year = 1_483_228_800.0
    clock = ControllerClock(new_year - 10.0)
    clock.set(new_year - 10.0)
    assert clock.reading(clock.count(new_year - 1.0)) == 86_399.0 + 36.0 - 86_400.0
    assert clock.reading(clock.count(new_year)) == 37.0
    assert clock.count(new_year) == 11.0
    assert clock.posix(11.0) == new_year


def test_a_clock_may_be_off_and_drift():
    wire = Wire(clock_offset_s=0.25, clock_drift_ppm=100.0)
    assert wire.status(0.0)[2] == TAI0 + 0.25
    assert wire.status(10_000.0)[2] == TAI0 + 10_000.0 + 0.25 + 1.0
    wire.told(f"MOVE 0 0.001 {TAI0 + 10_011.25}", 10_000.0)
    wire.told(f"MOVE 0.01 0.001 {TAI0 + 10_021.25}", 10_000.0)
    assert wire.true(10_015.0) == pytest.approx(0.005, abs=2e-6)


def test_without_the_1_hz_the_clock_runs_by_its_own_crystal():
    wire = Wire()
    wire.told("MOVE 0 0.01", 0.0)
    wire.axis.lose_one_hz(T0 + 100.0, 1000.0)
    assert wire.status(100.0)[2] == TAI0 + 100.0
    assert wire.status(1100.0)[2] == TAI0 + 1101.0
    assert "one_hz_lost" in wire.names(1100.0)


def test_a_clock_that_is_not_set_tells_minus_one_and_refuses_nodes():
    wire = Wire(kind="sdss", clock_set=False)
    assert wire.status(5.0)[2] == -1.0
    assert "clock_not_set" in wire.names(5.0)
    assert "clock" in wire.refused(f"MOVE 0 0 {TAI0 + 9}", 5.0)
    wire.told("SET.TIME", 6.0)
    assert wire.status(7.0)[2] == TAI0 + 7.0
    assert "clock_not_set" not in wire.names(8.0)


def test_only_the_sdss_sets_its_clock_by_set_time():
    wire = Wire(clock_offset_s=3.0)
    wire.told("SET.TIME", 0.0)
    assert wire.status(1.0)[2] == TAI0 + 4.0


def test_sticky_bits_stay_until_init_on_the_apo_and_until_read_on_the_sdss():
    apo, sdss = Wire(), Wire(kind="sdss")
    for wire in (apo, sdss):
        wire.axis.fail("one_hz_lost")
        wire.axis.repair("one_hz_lost")
        assert "one_hz_lost" in wire.names(1.0)
    assert "one_hz_lost" in apo.names(2.0)
    assert "one_hz_lost" not in sdss.names(2.0)
    apo.told("INIT", 3.0)
    assert "one_hz_lost" not in apo.names(4.0)


def test_init_does_not_clear_what_still_holds():
    wire = Wire()
    wire.axis.fail("amplifier_hot")
    wire.told("INIT", 1.0)
    assert "amplifier_hot" in wire.names(2.0)
    assert "INIT" in wire.refused("MOVE 1", 3.0)


def test_the_stop_button_halts_and_needs_init():
    wire = Wire()
    wire.told("MOVE 0 1", 0.0)
    wire.true(20.0)
    wire.axis.fail("stop_button")
    assert "stop_button" in wire.names(20.1)
    assert wire.status(25.0)[1] == 0.0
    wire.told("INIT", 25.0)
    assert "INIT" in wire.refused("MOVE 1", 26.0)
    wire.axis.repair("stop_button")
    assert "stop_button" not in wire.names(27.0)
    wire.told("INIT", 27.0)
    wire.told("MOVE 1", 28.0)


def test_a_restart_is_silent_then_told_by_bit_30_and_needs_init():
    wire = Wire(boot_s=5.0, boot_banner="axis controller ready")
    wire.told("MOVE 0 1", 0.0)
    wire.axis.restart(T0 + 20.0)
    assert wire.line.receive(b"STATUS\r", T0 + 24.0) == b""
    assert wire.line.receive(b"STATUS\r", T0 + 25.0).startswith(b"axis controller ready\r\nSTATUS\r\n")
    assert "restarted" in wire.names(26.0)
    assert wire.status(27.0)[1] == 0.0
    assert "INIT" in wire.refused(f"MOVE 0 0 {TAI0 + 40}", 27.0)
    wire.told("INIT", 28.0)
    assert "restarted" not in wire.names(28.0)
    wire.told("MOVE 0", 28.0)


def test_a_restart_may_lose_the_position_and_the_clock():
    wire = Wire(positions=(77.0, 40.0, 0.0))
    wire.axis.restart(T0 + 1.0, loses_position=True, loses_clock=True)
    position, _, time, _ = wire.status(10.0)
    assert (position, time) == (0.0, -1.0)
    assert wire.true(11.0) == 77.0


def test_the_semaphore_of_another_refuses_moves():
    wire = Wire(kind="sdss")
    wire.axis.fail("semaphore_taken")
    assert "semaphore" in wire.refused("MOVE 1", 0.0)
    assert "semaphore_taken" in wire.names(0.0)
    wire.axis.repair("semaphore_taken")
    wire.told("MOVE 1", 0.0)


def test_the_position_can_be_set_at_rest_only():
    wire = Wire()
    wire.told("SET.POSITION 221.33", 0.0)
    assert wire.status(0.0)[0] == 221.33
    assert wire.true(1.0) == 0.0
    wire.told("ZERO", 1.0)
    assert wire.status(1.0)[0] == 0.0
    wire.told("MOVE 5", 1.0)
    assert "moves" in wire.refused("SET.POSITION 1", 3.0)


# Fiducials --------------------------------------------------------------------------------------------------------

FIDUCIAL = [bare(0, fiducials_deg=(5.0, 10.0), fiducial_width_deg=0.2)] * 3


def test_a_fiducial_corrects_the_position_at_its_second_edge_when_that_is_wanted():
    wire = Wire(hardware=FIDUCIAL)
    wire.axis.let_slip(0.01)
    wire.told("MS.ON", 0.0)
    wire.told("MOVE 7", 0.0)
    assert wire.status(60.0)[0] == pytest.approx(7.0)
    assert wire.true(60.0) == pytest.approx(7.0, abs=1e-9)
    heading, rising, falling = wire.say("MS.DUMP", 60.0).lines
    assert heading == "time position velocity error edge correction"
    assert rising.split()[1:] == ["4.890000", rising.split()[2], "0.010000", "0", "0.000000"]
    assert falling.split()[3:] == ["0.010000", "1", "0.010000"]
    assert T0 < float(falling.split()[0]) < T0 + 20.0


def test_without_ms_on_nothing_is_corrected_until_correct():
    wire = Wire(hardware=FIDUCIAL)
    wire.axis.let_slip(0.01)
    wire.told("MOVE 7", 0.0)
    assert wire.true(60.0) == pytest.approx(7.01)
    wire.told("CORRECT", 60.0)
    assert wire.status(60.0)[0] == pytest.approx(7.01)
    assert wire.true(90.0) == pytest.approx(7.0)


def test_too_large_an_error_is_told_and_waits_for_correct():
    wire = Wire(hardware=FIDUCIAL)
    wire.axis.let_slip(0.05)
    wire.told("MS.ON", 0.0)
    wire.told("MOVE 7", 0.0)
    assert "fiducial_error" in wire.names(60.0)
    assert wire.true(60.0) == pytest.approx(7.05)
    wire.told("CORRECT", 60.0)
    assert wire.true(90.0) == pytest.approx(7.0)
    assert "fiducial_error" not in wire.names(90.0)


def test_corrections_end_at_the_time_of_ms_off():
    wire = Wire(hardware=FIDUCIAL)
    wire.axis.let_slip(0.01)
    wire.told("MS.ON", 0.0)
    wire.told(f"MS.OFF {TAI0 + 1}", 0.0)
    wire.told(f"MS.OFF {TAI0 + 12}", 0.5)  # supersedes
    wire.told(f"MOVE 0 0 {TAI0 + 1}", 0.5)
    wire.told(f"MOVE 6 0.9 {TAI0 + 13}", 0.5)
    wire.told(f"MOVE 15 0 {TAI0 + 33}", 0.5)
    corrections = [float(row.split()[5]) for row in wire.say("MS.DUMP", 40.0).lines[1:]]
    assert corrections == [0.0, 0.01, 0.0, 0.0]


@pytest.mark.parametrize("command", ["MOVE", "DRIFT", "INIT", "MS.OFF"])
def test_what_ends_corrections_ends_them(command):
    wire = Wire(hardware=FIDUCIAL)
    wire.told("MS.ON", 0.0)
    wire.told(command, 1.0)
    wire.axis.let_slip(0.01)
    wire.told("MOVE 7", 2.0)
    assert wire.true(60.0) == pytest.approx(7.01)


def test_a_fiducial_left_by_the_edge_that_it_was_entered_by_corrects_nothing():
    wire = Wire(hardware=FIDUCIAL)
    wire.axis.let_slip(0.01)
    wire.told("MS.ON", 0.0)
    wire.told("MOVE 5", 0.0)
    wire.told("MOVE 0", 40.0)
    assert wire.true(80.0) == pytest.approx(0.01)
    wire.told("MOVE 7", 80.0)
    wire.told("MOVE 0", 110.0)
    assert wire.true(150.0) == pytest.approx(0.0, abs=1e-9)
    edges = [(row.split()[4], row.split()[5]) for row in wire.say("MS.DUMP", 150.0).lines[1:]]
    print(edges)
    assert edges[3] == ("1", "0.010000")


def test_a_dump_has_the_last_twenty_passages():
    wire = Wire()
    wire.told("MOVE 300", 0.0)
    assert len(wire.say("MS.DUMP", 250.0).lines) == 21


# The wire ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ok", ["last", "alone"])
@pytest.mark.parametrize("end", ["\r", "\n", "\r\n", "\n\r"])
def test_replies_are_understood_in_every_style(ok, end):
    wire = Wire(ok=ok, line_end=end)
    assert wire.say("STATUS", 0.0).lines == (f"0.0000000 0.00000 {TAI0:.3f} 1 0.0000000",)
    assert wire.say("STOP", 0.0).ok
    assert wire.refused("GOTO 5", 0.0)


def test_every_command_of_the_table_is_obeyed_or_refused_with_a_reason():
    samples = {
        "position": "1.5", "velocity": "0.1", "time": f"{TAI0 + 30}", "size": "0.1", "count": "2", "percent": "50",
        "state": "on", "command": "MOVE", "text": "hello there",
    }  # fmt: skip
    for kind in ("apo", "sdss"):
        for row in TABLE:
            for word in (row.name, *row.aliases):
                for form in row.forms:
                    wire = Wire(kind=kind)
                    assert wire.say(" ".join((word, *(samples[m] for m in form))), 1.0).ok


def test_log_debug_output_and_identity_are_kept_and_told():
    wire = Wire()
    wire.told("LOG here we go", 0.0)
    wire.told("DEBUG on", 0.0)
    wire.told("OUTPUT.LIMIT 55", 0.0)
    assert wire.say("OUTPUT.LIMIT", 0.0).lines == ("55",)
    assert wire.axis.logged == ["here we go"]
    assert wire.axis.debug
    assert "axis code" in wire.say("ID", 0.0).lines[0]
    assert len(wire.say("HELP", 0.0).lines) == len(TABLE)
    assert wire.say("? DRIFT", 0.0).lines[0].startswith("DRIFT: go on")


def test_a_line_may_come_byte_by_byte_and_several_at_once():
    wire = Wire()
    answers = [wire.line.receive(bytes((byte,)), T0) for byte in b"STATUS\r\n"]
    assert [bool(answer) for answer in answers] == [False] * 6 + [True, False]
    both = ReplyDecoder().feed(wire.line.receive(b"ID\rSTOP\r", T0))
    assert [reply.echo for reply in both] == ["ID", "STOP"]


def test_any_bytes_are_answered_or_kept_within_bounds():
    wire, chance = Wire(), np.random.default_rng(3)
    for _ in range(200):
        wire.line.receive(chance.bytes(50), T0)
    wire.line.receive(b"x" * 100_000, T0)
    assert len(wire.line.state[1]) < 300
    assert b"256" in wire.line.receive(b"\r", T0)


def test_the_axes_of_the_sdss_share_a_line_by_prefix():
    wire = Wire(2, "sdss")
    wire.told("MOVE 45", 0.0)
    assert wire.true(60.0) == pytest.approx(45.0)
    assert [wire.unit.true_position(axis) for axis in (1, 3)] == [0.0, 0.0]
    (reply,) = ReplyDecoder().feed(wire.line.receive(b"STATUS\r", T0))
    assert "which axis" in reply.error


def test_the_axes_of_the_sdss_may_be_chosen_by_a_line():
    wire = Wire(2, "sdss", axis_select="line")
    assert b"which axis" in wire.line.receive(b"STATUS\r", T0)
    assert wire.line.receive(b"ALT\rMOVE 45\rROT\r", T0).count(b"OK") == 3
    assert b"ERR: " in wire.line.receive(b"ALT MOVE 30\r", T0)
    assert wire.true(60.0) == pytest.approx(45.0)


def test_a_snapshot_goes_on_where_it_was():
    def busy() -> Wire:
        wire = Wire(kind="sdss", boot_banner="hello")
        wire.axis.let_slip(0.003)
        wire.axis.fail("one_hz_lost")
        wire.told("MS.ON", 0.0)
        wire.told("MOVE 20 0.3", 0.0)
        wire.line.receive(b"ALT MOVE 55\rAZ STA", T0 + 7.0)
        for count in range(3):
            wire.line.receive(f"TUS\rROT MOVE {0.1 * count} 0.1 {TAI0 + 9 + count}\rAZ STA".encode(), T0 + 7.0)
        wire.unit.advance(T0 + 7.7)
        return wire

    one, two = busy(), Wire(kind="sdss", boot_banner="hello")
    two.unit.restore(json.loads(json.dumps(one.unit.snapshot())))
    assert two.unit.snapshot() == one.unit.snapshot()
    for after in (7.71, 8.4, 9.9, 30.0, 300.0):
        for wire in (one, two):
            wire.unit.advance(T0 + after)
        assert [two.unit.true_position(i) for i in (1, 2, 3)] == [one.unit.true_position(i) for i in (1, 2, 3)]
    assert one.unit.snapshot() == two.unit.snapshot()


def test_an_hour_of_tracking_with_nodes_takes_no_time():
    wire = Wire()
    for count in range(721):
        wire.told(f"MOVE {0.004 * 5 * count:.12f} 0.004 {(TAI0 + 2 + 5 * count) % 86400}", max(0.0, 5 * count - 4.0))
    assert wire.axis.record.dry == []
    assert wire.true(3601.0) == pytest.approx(0.004 * 3599.0, abs=1e-6)
