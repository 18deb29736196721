"""What is impossible in a configuration of a TC410, and what unwise."""

import math
from collections.abc import Iterator

from clockdrive.configuration_keys import (
    TC410_HALF_RANGE,
    TC410_UNITS_PER_S,
    Facts,
    number_of,
    tc410_fastest_deg_s,
)
from clockdrive.drives import Finding
from mounts.tc410 import motors

_FASTEST_DEG_S = 100.0  # no telescope's axis; inverted gears give thousands


def contradictions(facts: Facts) -> Iterator[Finding]:
    """What its fan, its gears, its counts and its motors cannot be together."""
    yield from _fan(facts)
    for section in ("axis1", "axis2"):
        yield from _axis(facts, section)


def _fan(facts: Facts) -> Iterator[Finding]:
    start, stop = number_of(facts, "drive.fan_start_c"), number_of(facts, "drive.fan_stop_c")
    if stop >= start:
        text = f"drive.fan_stop_c = {stop:g}: allowed below drive.fan_start_c = {start:g} °C"
        yield ("drive.fan_stop_c", "drive.fan_start_c"), text


def _axis(facts: Facts, axis: str) -> Iterator[Finding]:
    drive_type = str(facts[f"{axis}.drive_type"])
    gears = tuple(f"{axis}.{name}" for name in ("motor_steps", "main_gear", "secondary_gear", "drive_type"))
    fastest = tc410_fastest_deg_s(facts, axis)
    if fastest > _FASTEST_DEG_S:
        text = (
            f"{axis}.main_gear = {facts[f'{axis}.main_gear']}, secondary_gear = {facts[f'{axis}.secondary_gear']}: "
            f"{TC410_UNITS_PER_S} units/s would be {fastest:.4g} deg/s, allowed up to {_FASTEST_DEG_S:g} deg/s; a "
            'gear that slows the axis is less than 1, as "1/285"'
        )
        yield gears, text
        return
    speed = number_of(facts, f"{axis}.max_speed_deg_s")
    if speed > fastest:
        text = (
            f"{axis}.max_speed_deg_s = {speed:g}: allowed at most {_rounded_down(fastest):g} deg/s, "
            f"which is {TC410_UNITS_PER_S} units/s with this {drive_type} gearing"
        )
        yield (f"{axis}.max_speed_deg_s", *gears), text
    reach = TC410_HALF_RANGE * fastest / TC410_UNITS_PER_S
    centre = number_of(facts, f"{axis}.centre_deg")
    for name in ("min_deg", "max_deg"):
        angle = number_of(facts, f"{axis}.{name}")
        if abs(angle - centre) > reach:
            text = (
                f"{axis}.{name} = {angle:g}: allowed {centre - reach:.2f} to {centre + reach:.2f} deg, "
                f"which the drive's 24 bits count with this gearing round {axis}.centre_deg = {centre:g}"
            )
            yield (f"{axis}.{name}", f"{axis}.centre_deg", *gears), text
    yield from _motor(facts, axis)


def _motor(facts: Facts, axis: str) -> Iterator[Finding]:
    drive_type = str(facts[f"{axis}.drive_type"])
    current, most = number_of(facts, f"{axis}.motor_current_a"), motors.MOST_A[drive_type]
    if current > most:
        text = f"{axis}.motor_current_a = {current:g}: allowed 1 to {most:g} A with drive_type = {drive_type}"
        yield (f"{axis}.motor_current_a", f"{axis}.drive_type"), text
    if facts.get(f"{axis}.motor_rated_a") is None:
        return
    wiring, rating = str(facts[f"{axis}.motor_wiring"]), str(facts[f"{axis}.motor_rating"])
    label = number_of(facts, f"{axis}.motor_rated_a")
    rated = motors.rated_current_a(wiring, rating, label)
    keys = tuple(f"{axis}.{name}" for name in ("motor_current_a", "motor_wiring", "motor_rating", "motor_rated_a"))
    if rated is None:
        yield keys, f"{axis}.motor_rating = {rating}: a motor wired {wiring} is rated per-phase; set that"
    elif motors.overdriven(current, rated):
        text = (
            f"{axis}.motor_current_a = {current:g}: allowed at most {rated:.2f} A, for {label:g} A {rating} "
            f"wired {wiring}; more overheats it with little more torque"
        )
        yield keys, text


def cautions(facts: Facts) -> Iterator[str]:
    """Motors that are fed too little, or are too small."""
    for axis in ("axis1", "axis2"):
        label = facts.get(f"{axis}.motor_rated_a")
        current = number_of(facts, f"{axis}.motor_current_a")
        wiring, rating = str(facts[f"{axis}.motor_wiring"]), str(facts[f"{axis}.motor_rating"])
        rated = (
            None
            if label is None
            else motors.rated_current_a(wiring, rating, number_of(facts, f"{axis}.motor_rated_a"))
        )
        if rated is not None and motors.erratic(current, rated):
            yield (
                f"{axis}.motor_current_a = {current:g}: below {motors.ERRATIC * rated:.2f} A, half of what the motor "
                "is rated for, microsteps become uneven; raise it"
            )
        if rated is not None and rated < motors.LEAST_A:
            yield (
                f"{axis}.motor_rated_a = {label}: the drive gives at least {motors.LEAST_A:g} A, this motor takes "
                f"{rated:.2f} A as it is wired; use another motor or wiring"
            )


def _rounded_down(value: float) -> float:
    return math.floor(value * 1e4) / 1e4
