"""The keys of a configuration that a TC410 can hold itself, joined to its registers in one table, read both ways."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives.tc410.gears import gearings, park_counts
from clockdrive.drives.tc410.sections import axes_of, drive_of
from mounts.tc410.input_modes import LOGARITHMIC, MOST_SHIFT
from mounts.tc410.registers import COUNTS_PER_SECOND, DRIVE_TYPES, by_name
from pointing.mount import MountType

if TYPE_CHECKING:
    from mounts.tc410.unit import Unit

_MAS_PER_DEGREE = 3.6e6
_TURN_MAS = 360.0 * _MAS_PER_DEGREE
_INWARDS = 0.3  # counts by which an angle is moved outward, so that rounding it inward gives the same register
_WIDEST_DEG = 720.0
_FASTEST_DEG_S = 99.0
_DRIVE_CODES = {name.lower(): code for code, name in DRIVE_TYPES.items()}


def registers(configuration: Configuration) -> dict[str, float]:
    """Every register value that the configuration, defaults included, asks for."""
    return {key.register: key.to_register(configuration) for key in _KEYS}


def registers_of_key(name: str) -> tuple[str, ...]:
    """The registers of a key by its dotted name, or one register by its own; empty when it is neither."""
    return tuple(key.register for key in _KEYS if name in {key.dotted, key.register})


def registers_of(unit: "Unit") -> dict[str, float]:
    """Read every register that a key of the configuration speaks of, by name."""
    blocks = [("joystick_mode", "longitude"), ("mount_type", "mount_type"), ("mount_x", "mount_y")]
    for axis in (1, 2):
        for first, last in (
            ("drive_type", "drive_type"),
            ("negative_limit", "encoder_zero"),
            ("motor_steps", "park"),
        ):
            blocks.append((f"axis{axis}_{first}", f"axis{axis}_{last}"))
    return {name: value for block in blocks for name, value in unit.read(*block).values.items()}


def keys_from(unit: "Unit") -> dict[str, object]:
    """Read what the unit's own registers say of the configuration, by dotted key; zeros were never set."""
    return _keys_of(registers_of(unit))


def _keys_of(found: Mapping[str, float]) -> dict[str, object]:
    return _site_keys(found) | _drive_keys(found) | _axis_keys(found, 1) | _axis_keys(found, 2)


def completed_from(configuration: Configuration, unit: "Unit") -> Configuration:
    """Take from the unit what nobody has configured; its top speeds by the gears then in force, not by its own.

    Raises
    ------
    ConfigurationError
        The unit's values are impossible, or contradict what is configured.
    """
    found = registers_of(unit)
    own = {key: value for key, value in _keys_of(found).items() if not key.endswith("max_speed_deg_s")}
    completed = configuration.completed(own)
    speeds = (
        _speed_key(found, axis, gearing.step_deg_float) for axis, gearing in enumerate(gearings(completed), start=1)
    )
    return completed.completed({key: value for keys in speeds for key, value in keys.items()})


def _speed_key(found: Mapping[str, float], axis: int, step_deg: float) -> dict[str, object]:
    """The top speed of an axis of which a count is `step_deg`; none where it is no telescope's."""
    speed = found[f"axis{axis}_max_speed"] * COUNTS_PER_SECOND * step_deg
    if not 0.0 < speed <= _FASTEST_DEG_S:  # a unit as the factory made it knows no gears
        return {}
    return {f"axis{axis}.max_speed_deg_s": math.ceil(speed * 1e6) / 1e6}  # the register rounds down


def travel_from(configuration: Configuration, found: Mapping[str, float]) -> dict[str, object]:
    """Soft limits and park positions that somebody gave the unit, by dotted key, for a configuration's gears."""
    keys: dict[str, object] = {}
    for axis, gearing in enumerate(gearings(configuration), start=1):
        angles = sorted(
            math.degrees(gearing.angle(found[f"axis{axis}_{side}_limit"] + inwards))
            for side, inwards in (("negative", -_INWARDS), ("positive", _INWARDS))
        )
        if all(abs(angle) <= _WIDEST_DEG for angle in angles):
            keys |= {f"axis{axis}.min_deg": round(angles[0], 6), f"axis{axis}.max_deg": round(angles[1], 6)}
            park = math.degrees(gearing.angle(found[f"axis{axis}_park"]))
            if angles[0] <= park <= angles[1]:
                keys[f"axis{axis}.park_deg"] = round(park, 6)
    return keys


@dataclass(frozen=True)
class Difference:
    """A register that the unit has otherwise than the configuration asks."""

    key: str
    register: str
    unit: float
    configured: float
    unit_value: object
    """What the key would be to say the same as the unit; None where it cannot say it."""


def differences(configuration: Configuration, found: Mapping[str, float]) -> tuple[Difference, ...]:
    """Compare the unit's registers with the configuration, defaults included, as the registers would hold both."""
    values = _keys_of(found)
    values |= {
        f"axis{axis}.park_deg": round(math.degrees(gearing.angle(found[f"axis{axis}_park"])), 6)
        for axis, gearing in enumerate(gearings(configuration), start=1)
    }
    rows = []
    for key in _KEYS:
        row, wanted = by_name(key.register), key.to_register(configuration)
        if row.encode(found[key.register]) != row.encode(wanted):
            held = row.decode(row.encode(wanted))
            rows.append(Difference(key.dotted, key.register, found[key.register], held, values.get(key.dotted)))
    return tuple(rows)


@dataclass(frozen=True)
class _Key:
    """A configuration key and the register that holds it."""

    dotted: str
    register: str
    to_register: Callable[[Configuration], float]


def _general_keys() -> Sequence[_Key]:
    return (
        _Key("site.latitude_deg", "latitude", lambda c: c.site.latitude_deg * _MAS_PER_DEGREE),
        _Key("site.longitude_deg", "longitude", lambda c: _signed_mas(c.site.longitude_deg)),
        _Key("mount.type", "mount_type", lambda c: MountType.from_text(c.mount.type).value),
        _Key("mount.mount_x_mas", "mount_x", lambda c: c.mount.mount_x_mas),
        _Key("mount.mount_y_mas", "mount_y", lambda c: c.mount.mount_y_mas),
        _Key("drive.joystick_mode", "joystick_mode", lambda c: drive_of(c).joystick_mode),
        _Key("drive.autoguider_mode", "autoguider_mode", lambda c: drive_of(c).autoguider_mode),
        _Key("drive.fan_start_c", "fan_start_temperature", lambda c: drive_of(c).fan_start_c),
        _Key("drive.fan_stop_c", "fan_stop_temperature", lambda c: drive_of(c).fan_stop_c),
    )


def _axis_keys_of(i: int) -> Sequence[_Key]:
    def key(name: str, register: str, value: Callable[[Configuration], float]) -> _Key:
        return _Key(f"axis{i + 1}.{name}", f"axis{i + 1}_{register}", value)

    return (
        key("drive_type", "drive_type", lambda c: _DRIVE_CODES[axes_of(c)[i].drive_type]),
        key("motor_steps", "motor_steps", lambda c: axes_of(c)[i].motor_steps),
        key("main_gear", "main_gear_multiplier", lambda c: axes_of(c)[i].main_gear.teeth[0]),
        key("main_gear", "main_gear_divisor", lambda c: axes_of(c)[i].main_gear.teeth[1]),
        key("secondary_gear", "secondary_gear_multiplier", lambda c: axes_of(c)[i].secondary_gear.teeth[0]),
        key("secondary_gear", "secondary_gear_divisor", lambda c: axes_of(c)[i].secondary_gear.teeth[1]),
        key("acceleration_register", "acceleration", lambda c: axes_of(c)[i].acceleration_register),
        key("deceleration_register", "deceleration", lambda c: axes_of(c)[i].deceleration_register),
        key("max_speed_deg_s", "max_speed", lambda c: _speed(c, i)),
        key("motor_current_a", "motor_current", lambda c: axes_of(c)[i].motor_current_a),
        key("encoder_zero", "encoder_zero", lambda c: axes_of(c)[i].encoder_zero),
        key("park_deg", "park", lambda c: park_counts(c)[i]),
    )


_KEYS = (*_general_keys(), *_axis_keys_of(0), *_axis_keys_of(1))


def named(configuration: Configuration) -> list[tuple[str, float]]:
    """Return the registers that somebody has configured, rather than left to the unit or to a default."""
    return [
        (key.register, key.to_register(configuration))
        for key in _KEYS
        if configuration.origins[key.dotted] not in {"default", "unit"}
    ]


def _speed(configuration: Configuration, index: int) -> float:
    gearing = gearings(configuration)[index]
    return axes_of(configuration)[index].max_speed_deg_s / gearing.step_deg_float / COUNTS_PER_SECOND


def _signed_mas(longitude_deg: float) -> float:
    return (longitude_deg * _MAS_PER_DEGREE + _TURN_MAS / 2.0) % _TURN_MAS - _TURN_MAS / 2.0


def _site_keys(found: Mapping[str, float]) -> dict[str, object]:
    keys: dict[str, object] = {"mount.mount_x_mas": int(found["mount_x"]), "mount.mount_y_mas": int(found["mount_y"])}
    if found["latitude"] or found["longitude"]:
        keys["site.latitude_deg"] = found["latitude"] / _MAS_PER_DEGREE
        keys["site.longitude_deg"] = found["longitude"] / _MAS_PER_DEGREE
    if found["mount_type"] in {kind.value for kind in MountType}:
        keys["mount.type"] = MountType(int(found["mount_type"])).text
    return keys


def _drive_keys(found: Mapping[str, float]) -> dict[str, object]:
    keys: dict[str, object] = {}
    for name in ("joystick_mode", "autoguider_mode"):
        mode = int(found[name])
        if mode & LOGARITHMIC:
            keys[f"drive.{name}"] = LOGARITHMIC
        elif mode & 0x3F <= MOST_SHIFT:
            keys[f"drive.{name}"] = mode & 0x3F
    start, stop = found["fan_start_temperature"], found["fan_stop_temperature"]
    if stop < start:
        keys |= {"drive.fan_start_c": start, "drive.fan_stop_c": stop}
    return keys


def _axis_keys(found: Mapping[str, float], axis: int) -> dict[str, object]:
    def of(name: str) -> int:
        return int(found[f"axis{axis}_{name}"])

    speed: dict[str, object] = {}
    keys: dict[str, object] = {
        "acceleration_register": of("acceleration"),
        "deceleration_register": of("deceleration"),
        "motor_current_a": found[f"axis{axis}_motor_current"],
        "encoder_zero": of("encoder_zero"),
    }
    kind = DRIVE_TYPES.get(of("drive_type"), "none").lower()
    if kind != "none":
        keys["drive_type"] = kind
    gears = {name: (of(f"{name}_multiplier"), of(f"{name}_divisor")) for name in ("main_gear", "secondary_gear")}
    if of("motor_steps") and _slows(gears.values()):
        keys["motor_steps"] = of("motor_steps")
        keys |= {name: f"{multiplier}/{divisor}" for name, (multiplier, divisor) in gears.items()}
        if kind != "none":
            step = Fraction(360, of("motor_steps"))
            for multiplier, divisor in gears.values():
                step *= Fraction(multiplier, divisor)
            speed = _speed_key(found, axis, float(step) / {"gecko": 10, "ims": 16}[kind])
    return {f"axis{axis}.{name}": value for name, value in keys.items()} | speed


def _slows(gears: Iterable[tuple[int, int]]) -> bool:
    """Whether gears were ever set: the factory's 1/1, and zeros, are no telescope's."""
    product = 1.0
    for multiplier, divisor in gears:
        product *= multiplier / divisor if divisor else 0.0
    return 0.0 < product < 1.0
