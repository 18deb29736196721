"""What the simulated TC410 senses: its discrete inputs and input registers, by name."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from mounts.tc410.axis import FRACTION_BITS
from mounts.tc410.registers import CENTRE, DRIVE_TYPES, REGISTERS, Register, binary_to_gray, gray_to_binary

if TYPE_CHECKING:
    from mounts.tc410.simulator import SimulatedTC410

ARCSEC_PER_TURN = 1296000.0
_NAMES = (
    *(register.name for register in REGISTERS if register.kind == "discrete"),
    *(flag.name for register in REGISTERS if register.kind == "input" for flag in register.flags),
)


def states(unit: "SimulatedTC410") -> dict[str, bool]:
    """Every discrete input and every flag of the input registers."""
    around = unit.surroundings
    asserted = {
        "manual_power_on": around.manual_power,
        "remote_power_on": unit.coil,
        "motor_power_enabled": unit.powered,
        "system_fan_running": unit.fans[0],
        "axis1_fan_running": unit.fans[1],
        "axis2_fan_running": unit.fans[2],
        "joystick_detected": around.joystick is not None,
        "joystick_present": around.joystick is not None,
        "autoguider_detected": around.autoguider is not None,
        "autoguider_present": around.autoguider is not None,
        **{f"autoguider_{direction}": True for direction in around.directions},
        **dict.fromkeys(around.alarms, True),
        **dict.fromkeys(unit.moving, True),
        **_axis_states(unit, 1),
        **_axis_states(unit, 2),
    }
    return dict.fromkeys(_NAMES, False) | asserted


def _axis_states(unit: "SimulatedTC410", number: int) -> dict[str, bool]:
    axis, hardware = unit.axes[number - 1], unit.hardware[number - 1]
    counts, true = unit.counted_position(number), unit.true_position(number)
    lowest, highest = unit.soft_limits(number)
    negative, positive = hardware.negative_switch, hardware.positive_switch
    found = {
        "encoder_detected": bool(hardware.encoder_bits),
        "slewing": axis.slewing,
        "decelerating": axis.slewing and axis.decelerating,
        "slew_negative": axis.slewing and axis.target < axis.position,
        "hard_positive_limit": positive is not None and true >= positive,
        "hard_negative_limit": negative is not None and true <= negative,
        "soft_positive_limit": counts >= highest,
        "soft_negative_limit": counts <= lowest,
    }
    return {f"axis{number}_{name}": state for name, state in found.items()}


def measure(unit: "SimulatedTC410", register: Register, now: Mapping[str, bool]) -> tuple[int, ...]:
    """Words of an input register, with the unit's `states` now."""
    if register.flags:
        return (sum(1 << flag.bit for flag in register.flags if now[flag.name] != flag.active_low),)
    if register.axis:
        return _measure_axis(unit, register)
    around = unit.surroundings
    inside, one, two = around.temperatures_c
    joystick, guider = around.joystick or (0, 0), around.autoguider or (0, 0)
    values = {
        "system_temperature": inside,
        "axis1_controller_temperature": one,
        "axis2_controller_temperature": two,
        "supply_current": 2000 if unit.powered else 100,
        "supply_voltage": 24000 if unit.powered else 0,
        "joystick_adc_axis1": joystick[0],
        "joystick_adc_axis2": joystick[1],
        "autoguider_adc_axis1": guider[0],
        "autoguider_adc_axis2": guider[1],
    }
    return register.encode(values[register.name])


def _measure_axis(unit: "SimulatedTC410", register: Register) -> tuple[int, ...]:
    number = register.axis
    match register.name.removeprefix(f"axis{number}_"):
        case "drive_type":
            kind = unit.hardware[number - 1].drive_type
            return (next(code for code, name in DRIVE_TYPES.items() if name.lower() == kind),)
        case "velocity":
            return register.encode(unit.axes[number - 1].moved)
        case "encoder_raw":
            return (_encoder(unit, number),)
        case _:
            return (gray_to_binary(_encoder(unit, number)),)


def _encoder(unit: "SimulatedTC410", number: int) -> int:
    """Gray reading of the absolute encoder, which sees where the axis really is."""
    hardware = unit.hardware[number - 1]
    if not hardware.encoder_bits:
        return 0
    turns = (unit.true_position(number) - CENTRE) * float(hardware.turns_per_count)
    turns += unit.random.gauss(0.0, unit.settings.encoder_noise_arcsec) / ARCSEC_PER_TURN
    reading = round(hardware.encoder_at_centre + (-turns if hardware.encoder_reversed else turns) * 0x10000) & 0xFFFF
    unused = 16 - hardware.encoder_bits
    return binary_to_gray(reading >> unused) << unused


def fans(unit: "SimulatedTC410") -> tuple[bool, ...]:
    """Which fans run: from the start temperature until below the stop temperature."""
    start, stop = unit.memory.value("fan_start_temperature"), unit.memory.value("fan_stop_temperature")
    return tuple(
        temperature >= start or (running and temperature > stop)
        for running, temperature in zip(unit.fans, unit.surroundings.temperatures_c, strict=True)
    )


def soft_limit_counts(word: int, shift: int) -> int:
    """Counts of a soft-limit register of which `shift` bits are not kept."""
    return word << shift & ((1 << FRACTION_BITS) - 1)
