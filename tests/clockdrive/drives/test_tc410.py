"""What a configuration means in a TC410's registers, worked out by hand; and back from a unit."""

import math

import pytest
from telescope_bench import T0

from clockdrive.clock import VirtualClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.drives.tc410.gears import gearings, park_counts
from clockdrive.drives.tc410.registers import completed_from, keys_from, registers
from clockdrive.drives.tc410.sections import axes_of
from clockdrive.drives.tc410.settings import settings
from mounts.tc410.unit import Unit
from transports.memory import MemoryLink
from transports.modbus_ascii import ModbusAscii

GIVEN = {
    "site.latitude_deg": 51.5,
    "site.longitude_deg": 358.5,
    "mount.type": "german",
    "mount.mount_x_mas": -7200,
    "axis1.main_gear": "1/360",
    "axis1.secondary_gear": "1/3",
    "axis1.acceleration_register": 40,
    "axis1.max_speed_deg_s": 2.0,
    "axis2.drive_type": "ims",
    "axis2.motor_current_a": 1.5,
    "limits.sun_avoidance_deg": 0.0,
}


@pytest.fixture(scope="module")
def configuration():
    return load(None, {}, GIVEN)


def test_registers_hold_what_the_manual_says(configuration):
    found = registers(configuration)
    assert found["latitude"] == pytest.approx(51.5 * 3.6e6)
    assert found["longitude"] == pytest.approx(-1.5 * 3.6e6)  # east positive, signed
    assert found["mount_type"] == 3
    assert found["mount_x"] == -7200
    assert (found["axis1_main_gear_multiplier"], found["axis1_main_gear_divisor"]) == (1, 360)
    step_deg = 360.0 / 200 / 10 / 360 / 3
    assert found["axis1_max_speed"] == pytest.approx(2.0 / step_deg / (20000.0 / 2**24))  # counts/s of one unit
    assert found["axis2_motor_current"] == 1.5


def test_gears_multiply_to_the_step(configuration):
    one, two = gearings(configuration)
    assert one.step_arcsec == pytest.approx(360.0 * 3600.0 / 200 / 10 / 360 / 3)
    assert two.step_arcsec == pytest.approx(360.0 * 3600.0 / 200 / 16 / 285 * 0.4)


def test_soft_limits_lie_within_the_angles_allowed(configuration):
    one, two = settings(configuration).axes
    for axis, section in ((one, configuration.axes[0]), (two, configuration.axes[1])):
        assert math.degrees(axis.gearing.angle(axis.lowest_counts)) >= section.min_deg - 1e-9
        assert math.degrees(axis.gearing.angle(axis.highest_counts)) <= section.max_deg + 1e-9


def test_a_unit_gives_back_what_was_configured(configuration):
    unit = tc410.simulated(configuration, T0, None)
    clock = VirtualClock(T0)
    found = keys_from(Unit(ModbusAscii(lambda: MemoryLink(unit, clock), clock)))
    plain = load(None, {}, {"drive.link": "tcp://127.0.0.1:1"})
    completed = plain.completed(found)
    assert completed.site.latitude_deg == pytest.approx(51.5)
    assert completed.site.longitude_deg == pytest.approx(-1.5)
    assert completed.mount.type == "german"
    assert axes_of(completed)[0].main_gear == axes_of(configuration)[0].main_gear
    assert axes_of(completed)[0].acceleration_register == 40
    assert axes_of(completed)[0].max_speed_deg_s == pytest.approx(2.0, rel=0.01)
    assert axes_of(completed)[1].motor_current_a == 1.5
    assert set(plain.left_to_the_unit()) >= set(found) & set(plain.values)


def test_the_units_top_speed_is_told_by_the_gears_in_force(configuration):
    """The register counts motor steps: with configured gears half as long it is half the speed."""
    unit = tc410.simulated(configuration, T0, None)
    clock = VirtualClock(T0)
    host = Unit(ModbusAscii(lambda: MemoryLink(unit, clock), clock))
    shorter = f"1/{2 * axes_of(configuration)[0].main_gear.denominator}"
    file = load(None, {}, {"drive.link": "tcp://127.0.0.1:1", "axis1.main_gear": shorter, "axis1.min_deg": -20,
                           "axis1.max_deg": 20, "axis1.centre_deg": 0, "axis1.park_deg": 0})  # fmt: skip
    one, two = axes_of(completed_from(file, host))
    assert one.max_speed_deg_s == pytest.approx(axes_of(configuration)[0].max_speed_deg_s / 2.0, rel=0.01)
    assert two.max_speed_deg_s == pytest.approx(axes_of(configuration)[1].max_speed_deg_s, rel=0.01)


def test_a_new_simulator_stands_at_park(configuration):
    unit = tc410.simulated(configuration, T0, None)
    assert (round(unit.true_position(1)), round(unit.true_position(2))) == park_counts(configuration)
