import json
import random
import time
from fractions import Fraction
from typing import TYPE_CHECKING

import pytest

from mounts.errors import DriveError
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND, REGISTERS, by_name, gray_to_binary
from mounts.tc410.simulator import SimulatedTC410
from mounts.tc410.simulator_settings import PERFECT_HARDWARE, AxisHardware, SimulatorSettings
from mounts.tc410.slew import Tc410SlewModel
from transports.ascii_frame import FrameDecoder, encode_frame

if TYPE_CHECKING:
    from transports.memory import Device

T0 = 1_700_000_000.0
SIDEREAL = 13873
TRACKING, SLEW, REMOTE, JOYSTICK, ANALOGUE, DIGITAL = 0x80, 0x01, 0x02, 0x08, 0x10, 0x20


class Host:
    """Writes and reads registers by name over the wire, with the time in hand."""

    def __init__(self, unit, t=T0):
        self.unit = unit
        self.t = t

    def ask(self, *pdu):
        frames = FrameDecoder().feed(self.unit.receive(encode_frame(0xFF, bytes(pdu)), self.t))
        assert len(frames) == 1
        assert frames[0][0] == 0xFF
        return frames[0][1]

    def words(self, name):
        register = by_name(name)
        function = {"holding": 3, "input": 4}[register.kind]
        answer = self.ask(function, *register.address.to_bytes(2, "big"), 0, register.words)
        assert answer[0] == function, answer.hex()
        return tuple(int.from_bytes(answer[2 + 2 * i : 4 + 2 * i], "big") for i in range(register.words))

    def read(self, name, position_format="right"):
        return by_name(name).decode(self.words(name), position_format)

    def flags(self, name):
        return set(by_name(name).asserted(self.words(name)[0]))

    def write(self, name, value, position_format="right"):
        register = by_name(name)
        words = register.encode(value, position_format)
        data = b"".join(word.to_bytes(2, "big") for word in words)
        answer = self.ask(16, *register.address.to_bytes(2, "big"), 0, len(words), len(data), *data)
        assert answer[0] == 16, answer.hex()

    def control(self, word):
        self.write("velocity_control", word)

    def power(self, on):
        assert self.ask(5, 0, 0, 0xFF * on, 0)[0] == 5

    def wait(self, seconds):
        self.t += seconds
        self.unit.advance(self.t)

    def slew(self, *targets):
        for axis, target in enumerate(targets, start=1):
            self.write(f"axis{axis}_target_position", target)
        control = int(self.read("velocity_control"))
        self.control(control & ~SLEW)
        self.control(control | SLEW)


def host_of(hardware=PERFECT_HARDWARE, configuration=None, **settings):
    return Host(SimulatedTC410(SimulatorSettings(**settings), T0, hardware, configuration))


# The wire --------------------------------------------------------------------------------------------------


def test_frames_of_other_stacks_are_answered_byte_for_byte():
    unit: Device = SimulatedTC410(SimulatorSettings(), T0)
    assert unit.receive(b":FF100050000204008000001B\r\n", T0) == b":FF10005000029F\r\n"
    assert unit.receive(b":FF0300500002AC\r\n", T0) == b":FF0304008000007A\r\n"
    assert unit.receive(b":FF050000FF00FD\r\n", T0) == b":FF050000FF00FD\r\n"


def test_every_address_of_the_table_answers_and_every_other_is_exception_2():
    host = host_of()
    for function, kind in ((1, "coil"), (2, "discrete"), (3, "holding"), (4, "input")):
        readable = {
            register.address + word
            for register in REGISTERS
            if register.kind == kind and register.access != "write"
            for word in range(register.words)
        }
        for address in range(0x80):
            answer = host.ask(function, 0, address, 0, 1)
            expected = bytes((function,)) if address in readable else bytes((function | 0x80, 2))
            assert answer[: len(expected)] == expected, (kind, hex(address))
        assert host.ask(function, 0x12, 0x34, 0, 1)[1] == 2


def test_configuration_reads_back_as_written_and_impossible_values_are_exception_3():
    host = host_of()
    rng = random.Random(5)  # noqa: S311
    for register in REGISTERS:
        if register.saved:
            conversion = register.conversion
            raw = rng.randint(conversion.lowest, conversion.highest)
            host.write(register.name, conversion.value(raw))
            assert host.read(register.name) == conversion.value(raw), register.name
    assert host.ask(6, 0, 0x14, 1, 0) == bytes((0x86, 3))
    assert host.ask(16, 0, 0x54, 0, 2, 4, 0x7F, 0xFF, 0, 0) == bytes((0x90, 3))


def test_a_pair_takes_effect_when_its_second_word_is_written():
    host = host_of()
    host.ask(6, 0, 0x50, 0x00, 0x12)
    assert host.read("axis1_position") == CENTRE
    host.ask(6, 0, 0x51, 0x34, 0x56)
    assert host.read("axis1_position") == 0x123456


# Motion ----------------------------------------------------------------------------------------------------


def test_a_slew_takes_the_predicted_time_and_lands_on_the_count():
    host = host_of()
    host.slew(CENTRE + 60_000, CENTRE - 250_000)
    assert host.flags("movement_flags") == {"slewing"}
    assert host.flags("slew_flags") == {"axis1_slewing", "axis2_slewing", "axis2_slew_negative"}
    model = Tc410SlewModel(26, 26, 0xFFFF00)
    one, two = (model.travel(CENTRE, CENTRE + d, 0, 0).duration for d in (60_000, -250_000))
    host.wait(one - 0.004)
    assert "axis1_slewing" in host.flags("slew_flags")
    assert "axis1_decelerating" in host.flags("slew_flags")
    assert host.read("axis1_velocity") > 0
    host.wait(0.008)
    assert host.flags("slew_flags") == {"axis2_slewing", "axis2_slew_negative"}
    assert host.unit.true_position(1) == CENTRE + 60_000
    host.wait(two - one)
    assert host.flags("slew_flags") == set()
    assert host.unit.true_position(2) == CENTRE - 250_000
    assert host.read("velocity_control") == 0


def test_a_slew_from_tracking_agrees_with_the_closed_form_to_the_tick():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.control(TRACKING)
    host.wait(1.0)
    host.slew(CENTRE + 5000, CENTRE)
    axis = host.unit.axes[0]
    move = Tc410SlewModel(26, 26, 0xFFFF00).law.move(axis.position, axis.velocity, (CENTRE + 5000) << 24)
    assert axis.velocity == SIDEREAL
    passed = 0
    for tick in (1, 100, move.ticks // 2, move.ticks - 1, move.ticks):
        passed += axis.slew(tick - passed)
        assert (passed, axis.position) == (tick, move.position(tick))
    assert axis.position == (CENTRE + 5000) << 24


@pytest.mark.parametrize(("slew_idle", "moves_on"), [("both", False), ("per-axis", True)])
def test_tracking_resumes_as_the_setting_says(slew_idle, moves_on):
    host = host_of(slew_idle=slew_idle)
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.control(TRACKING)
    host.slew(CENTRE + 100, CENTRE + 100_000)
    host.wait(2.0)
    assert "axis2_slewing" in host.flags("slew_flags")
    assert (host.unit.true_position(1) > CENTRE + 101) is moves_on
    host.wait(60.0)
    assert host.flags("movement_flags") == {"tracking"}
    assert host.read("axis1_velocity") == SIDEREAL


def test_the_slew_bit_may_stay_until_it_is_cleared():
    host = host_of(slew_bit_clears=False)
    host.slew(CENTRE + 100, CENTRE)
    host.wait(5.0)
    assert host.read("velocity_control") == SLEW
    host.control(SLEW)
    host.write("axis1_target_position", CENTRE)
    host.wait(5.0)
    assert host.read("axis1_position") == CENTRE + 100


def test_tracking_advances_at_the_velocity_register():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.control(TRACKING)
    host.wait(1.0)
    before = host.unit.true_position(1)
    host.wait(600.0)
    rate = (host.unit.true_position(1) - before) / 600.0
    assert rate == pytest.approx(SIDEREAL * COUNTS_PER_SECOND, rel=1e-9)
    assert host.read("axis1_velocity") == SIDEREAL


def test_positions_within_a_tick_advance_every_50_microseconds():
    host = host_of()
    host.write("axis1_target_velocity", 0x400000)
    host.control(REMOTE)
    host.wait(10.0)
    start = host.unit.true_position(1)
    places = []
    for _ in range(80):
        host.wait(50e-6)
        places.append(host.unit.true_position(1) - start)
    assert places == pytest.approx([0.25 * step for step in range(1, 81)], abs=1e-9)


def test_a_fast_clock_tracks_fast():
    distances = []
    for drift in (0.0, -100.0):
        host = host_of(clock_drift_ppm=drift)
        host.write("axis1_tracking_velocity", 1_000_000)
        host.control(TRACKING)
        host.wait(1000.0)
        distances.append(host.unit.true_position(1) - CENTRE)
    assert distances[1] / distances[0] == pytest.approx(1.0001, abs=1e-6)


def test_ramps_off_by_percents_change_the_slew_as_the_scaled_law_says():
    for error in (-0.03, 0.03):
        host = host_of(acceleration_error=error)
        host.slew(CENTRE + 20_000, CENTRE)
        law = Tc410SlewModel(26, 26, 0xFFFF00, acceleration_scale=1 + error).law
        move = law.move(CENTRE << 24, 0, (CENTRE + 20_000) << 24)
        assert host.unit.axes[0].slew(1 << 30) == move.ticks


def test_a_slow_landing_takes_its_time_longer():
    host = host_of(landing_s=1.5)
    host.slew(CENTRE + 5000, CENTRE)
    short = Tc410SlewModel(26, 26, 0xFFFF00).travel(CENTRE, CENTRE + 4980, 0, 0).duration
    host.wait(short + 1.4)
    assert "axis1_slewing" in host.flags("slew_flags")
    host.wait(0.2)
    assert host.flags("slew_flags") == set()
    assert host.unit.true_position(1) == CENTRE + 5000


# Sources of motion -----------------------------------------------------------------------------------------


def test_sources_rule_by_priority_and_idle_ones_give_way():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.write("axis1_target_velocity", -50_000)
    host.write("joystick_mode", 8)
    host.write("autoguider_mode", 12)

    def now():
        host.wait(20.0)
        return host.flags("movement_flags"), host.read("axis1_velocity")

    allowed = TRACKING | DIGITAL | ANALOGUE | JOYSTICK
    host.control(allowed)
    assert now() == ({"tracking"}, SIDEREAL)
    host.unit.disturb(directions=("east",))
    assert now() == ({"digital_autoguider"}, -6937)
    host.unit.disturb(autoguider=(128 + 64, 128))
    assert now() == ({"analogue_autoguider"}, 64 << 17 >> 12)
    host.unit.joystick(255, 128)
    assert now() == ({"joystick"}, 127 << 17 >> 8)
    host.control(allowed | REMOTE)
    assert now() == ({"remote_control"}, -50_000)
    host.control(allowed)
    host.unit.joystick(130, 127)
    host.unit.disturb(autoguider=None, directions=())
    assert now() == ({"tracking"}, SIDEREAL)
    assert {"joystick_present"} <= host.flags("digital_inputs")
    assert host.words("joystick_adc_axis1") == (130,)


def test_the_logarithmic_joystick_spans_42_decibels():
    host = host_of()
    host.write("joystick_mode", 0x80)
    host.control(JOYSTICK)
    host.unit.joystick(255, 128)
    host.wait(20.0)
    assert host.read("axis1_velocity") == 0xFFFF00


def test_all_stop_ends_slew_and_target_velocities_but_not_tracking():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.write("axis2_target_velocity", 99_999)
    host.control(TRACKING)
    host.slew(CENTRE + 1_000_000, CENTRE)
    host.wait(3.0)
    host.write("all_stop", 1)
    host.wait(10.0)
    assert host.flags("slew_flags") == set()
    assert host.read("velocity_control") == TRACKING
    assert host.read("axis1_velocity") == SIDEREAL
    assert host.read("axis2_target_velocity") == 0
    assert host.read("axis1_position") < CENTRE + 500_000
    assert host.ask(3, 0, 0x70, 0, 1) == bytes((0x83, 2))


# Limits ----------------------------------------------------------------------------------------------------


def test_a_soft_limit_stops_a_slew_and_is_flagged_in_both_places():
    host = host_of()
    host.write("axis1_positive_limit", CENTRE + 0x2000)
    host.slew(CENTRE + 100_000, CENTRE)
    host.wait(60.0)
    assert host.flags("limit_flags") == {"axis1_soft_positive_limit"}
    assert host.ask(2, 0, 0x18, 0, 8) == bytes((2, 1, 1 << 4))
    assert host.flags("slew_flags") == set()
    assert host.read("axis1_velocity") == 0
    assert CENTRE + 0x2000 <= host.read("axis1_position") < CENTRE + 50_000
    host.slew(CENTRE, CENTRE)
    host.wait(60.0)
    assert host.read("axis1_position") == CENTRE
    assert host.flags("limit_flags") == set()


def test_limit_switches_stay_where_they_are_when_the_count_is_changed():
    host = host_of((AxisHardware(), AxisHardware(negative_switch=CENTRE - 1000)))
    host.write("axis2_position", CENTRE + 5000)
    host.write("axis2_target_velocity", -200_000)
    host.control(REMOTE)
    host.wait(60.0)
    assert host.flags("limit_flags") == {"axis2_hard_negative_limit"}
    assert host.unit.true_position(2) == pytest.approx(CENTRE - 1000, abs=50)
    assert host.read("axis2_position") == pytest.approx(CENTRE + 4000, abs=50)


def test_a_pressed_switch_stops_tracking_there():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.control(TRACKING)
    host.wait(10.0)
    host.unit.press_limit(1, +1)
    here = host.unit.true_position(1)
    host.wait(10.0)
    assert host.unit.true_position(1) == pytest.approx(here, abs=1.0)
    assert host.flags("limit_flags") == {"axis1_hard_positive_limit"}


# Power, alarms, memory -------------------------------------------------------------------------------------


def test_standby_answers_and_on_return_the_axes_may_have_turned_two_steps():
    shifts = set()
    for seed in range(12):
        host = host_of(seed=seed)
        host.control(TRACKING)
        host.write("axis1_tracking_velocity", SIDEREAL)
        host.wait(5.0)
        host.power(on=False)
        counted = host.read("axis1_position")
        assert host.flags("supply_flags") == set()
        assert host.flags("movement_flags") == set()
        host.wait(100.0)
        assert host.read("axis1_position") == counted
        host.power(on=True)
        shifts.add(host.unit.true_position(1) - host.unit.counted_position(1))
        assert host.flags("supply_flags") == {"remote_power_on", "motor_power_enabled"}
    assert all(abs(shift) <= 20 for shift in shifts)
    assert len(shifts) > 6


def test_a_supply_alarm_ends_a_slew_short_of_its_target():
    host = host_of()
    host.slew(CENTRE + 1_000_000, CENTRE)
    host.wait(5.0)
    host.unit.disturb(alarms=("supply_shut_down", "supply_over_current"))
    host.wait(5.0)
    assert host.flags("supply_flags") == {"remote_power_on", "supply_shut_down", "supply_over_current"}
    assert host.ask(2, 0, 0x10, 0, 4) == bytes((2, 1, 0b0011))
    assert host.flags("slew_flags") == set()
    assert host.read("velocity_control") == 0
    assert host.read("axis1_position") < CENTRE + 500_000


@pytest.mark.parametrize("volatile", [True, False])
def test_a_power_cycle_forgets_the_position_and_what_was_not_saved(volatile):
    host = host_of(volatile_targets=volatile)
    host.write("axis1_acceleration", 40)
    host.write("save_configuration", 1)
    host.write("axis1_acceleration", 50)
    host.slew(CENTRE + 100_000, CENTRE - 777)
    host.wait(4.0)
    place = host.unit.true_position(1)
    host.unit.power_cycle()
    assert host.read("axis1_position") == CENTRE
    assert host.unit.true_position(1) == pytest.approx(place, abs=1.0)
    assert host.read("axis1_acceleration") == 40
    assert host.read("velocity_control") == 0
    assert host.read("axis2_target_position") == (CENTRE if volatile else CENTRE - 777)
    host.wait(10.0)
    assert host.read("axis1_position") == CENTRE


def test_factory_and_saved_configuration_can_be_loaded():
    host = host_of(configuration={"mount_type": 3, "axis1_deceleration": 33})
    assert host.read("axis1_main_gear_divisor") == 285
    host.write("load_factory", 1)
    assert (host.read("mount_type"), host.read("axis1_deceleration")) == (0, 26)
    host.write("load_configuration", 1)
    assert (host.read("mount_type"), host.read("axis1_deceleration")) == (3, 33)


# Readings that may be the other way ------------------------------------------------------------------------


def test_positions_are_justified_as_the_setting_says():
    host = host_of(position_format="left")
    assert host.words("axis1_position") == (0x8000, 0)
    assert host.words("axis2_target_position") == (0x8000, 0)
    host.write("axis1_position", 0x123456, "left")
    assert host.words("axis1_position") == (0x1234, 0x5600)
    assert host.unit.counted_position(1) == 0x123456


def test_limits_and_speed_may_keep_other_bits():
    host = host_of(limit_shift=16, speed_shift=0)
    host.unit.write_registers(0x13, [0x0080])
    host.unit.write_registers(0x16, [0x8000])
    assert host.unit.soft_limits(1) == (0, 0x800000)
    assert host.unit.axes[0].top == 0x8000


def test_encoders_see_the_true_axis_and_the_stored_zero_says_where():
    gears = {"main_gear": Fraction(1, 360), "secondary_gear": Fraction(1, 1)}
    hardware = (
        AxisHardware(encoder_bits=16, encoder_at_centre=1000, **gears),
        AxisHardware(encoder_bits=14, encoder_at_centre=0x4000, encoder_reversed=True, **gears),
    )
    host = host_of(hardware)
    quarter = 360 * 200 * 10 // 4
    for axis in (1, 2):
        host.write(f"axis{axis}_position", 5)
    host.slew(5 + quarter // 2, 5 + quarter // 2)
    host.wait(120.0)
    assert host.read("axis1_encoder") == 1000 + 0x2000
    assert host.read("axis2_encoder") == 0x4000 - 0x2000
    assert host.read("axis1_encoder_raw") == gray_to_binary(host.words("axis1_encoder_raw")[0]) == 1000 + 0x2000
    assert host.read("axis1_encoder_zero") == 1000
    assert host_of(hardware, encoder_zero_at="zero").read("axis1_encoder_zero") != 1000
    assert host.ask(2, 0, 0x08, 0, 4) == bytes((2, 1, 0b1100))


def test_encoder_noise_scatters_by_its_deviation():
    host = host_of((AxisHardware(encoder_bits=16), AxisHardware()), encoder_noise_arcsec=200.0)
    readings = [host.read("axis1_encoder") - 0x8000 for _ in range(400)]
    rms = (sum(reading**2 for reading in readings) / 400) ** 0.5 * 1296000 / 65536
    print(f"scatter {rms:.0f} arcsec")
    assert rms == pytest.approx(200.0, rel=0.15)


def test_fans_start_warm_and_stop_cool():
    host = host_of()
    running = []
    for degrees in (44.0, 45.0, 41.0, 40.0):
        host.unit.disturb(temperatures_c=(degrees, 20.0, degrees))
        host.wait(1.0)
        running.append((bool(host.flags("supply_flags") & {"system_fan_running"}), host.flags("fan_flags")))
    on, off = (True, {"axis2_fan_running"}), (False, set())
    assert running == [off, on, on, off]
    assert host.read("system_temperature") == 40.0
    assert host.read("axis1_controller_temperature") == 20.0


# Time ------------------------------------------------------------------------------------------------------


def test_how_often_it_is_asked_does_not_change_where_it_goes():
    rng = random.Random(9)  # noqa: S311
    units = [host_of(slew_idle=idle, landing_s=0.3) for idle in ("both", "per-axis") for _ in range(2)]
    for host in units:
        host.write("axis1_tracking_velocity", SIDEREAL)
        host.write("axis2_tracking_velocity", -77)
        host.control(TRACKING)
        host.wait(0.5)
        host.slew(CENTRE + 3000, CENTRE - 9000)
    for often, seldom in (units[:2], units[2:]):
        end = often.t + 20.0
        while often.t < end:
            often.wait(min(rng.uniform(0.0001, 0.05), max(end - often.t, 1e-3)))
        seldom.wait(often.t - seldom.t)
        assert often.unit.snapshot() == seldom.unit.snapshot()


def test_a_snapshot_survives_json_and_goes_on_the_same():
    host = host_of()
    host.unit.joystick(200, 100)
    host.slew(CENTRE + 50_000, CENTRE + 100)
    host.wait(3.0)
    copy = SimulatedTC410(SimulatorSettings(), 0.0)
    copy.restore(json.loads(json.dumps(host.unit.snapshot())))
    for unit in (copy, host.unit):
        unit.advance(host.t + 7.0)
    assert copy.snapshot() == host.unit.snapshot()


def test_a_snapshot_that_keeps_the_generator_as_numbers_goes_on_the_same():
    unit = SimulatedTC410(SimulatorSettings(seed=5), 0.0)
    unit.random.random()
    snapshot = unit.snapshot()
    version, internal, gauss = unit.random.getstate()
    copy = SimulatedTC410(SimulatorSettings(seed=6), 0.0)
    copy.restore({**snapshot, "random": [version, list(internal), gauss]})
    assert copy.random.random() == unit.random.random()


@pytest.mark.parametrize(
    "damage", [{"axes": []}, {"memory": None}, {"random": [3, [1], None]}, {"surroundings": {"x": 1}}]
)
def test_a_foreign_snapshot_is_refused_and_changes_nothing(damage):
    unit = host_of().unit
    before = unit.snapshot()
    with pytest.raises(DriveError, match="delete it to start at park"):
        unit.restore({**before, "t0": 5.0, **damage})
    assert unit.snapshot() == before


def test_hours_pass_in_milliseconds():
    host = host_of()
    host.write("axis1_tracking_velocity", SIDEREAL)
    host.control(TRACKING)
    began = time.perf_counter()
    for _ in range(600):
        host.wait(1.0)
        host.read("axis1_position")
    polled = time.perf_counter() - began
    host.slew(CENTRE - 500_000, CENTRE + 900_000)
    began = time.perf_counter()
    host.wait(120.0)
    slewed = time.perf_counter() - began
    began = time.perf_counter()
    host.wait(86400.0)
    day = time.perf_counter() - began
    print(f"10 min at 1 Hz {polled * 1e3:.0f} ms, a slew {slewed * 1e3:.1f} ms, a day {day * 1e3:.2f} ms")
    assert host.flags("movement_flags") == {"tracking"}
    assert polled < 1.0
    assert slewed < 0.2
    assert day < 0.1
