"""What a value may be, alone and beside the others: every finding is a sentence with key, value and allowed range."""

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from clockdrive.configuration_keys import (
    TC410_HALF_RANGE,
    TC410_UNITS_PER_S,
    Facts,
    Key,
    Kind,
    Raw,
    Value,
    tc410_fastest_deg_s,
)
from clockdrive.gear_teeth import GearTeeth
from mounts.avr_box.settings import SIDEREAL_DAY_S
from mounts.avr_box.timers import tracking_rate
from mounts.tc410 import motors

_PORT = re.compile(r"tcp://(?:\[[0-9A-Fa-f:.]+\]|[^\s/:@?#\[\]]+):(?P<port>\d{1,5})")
_LINKS = re.compile(rf"sim:|(?:{_PORT.pattern})|(?:serial://[^\s?]+|COM\d+)(?:\?baud=[1-9]\d*)?")
_SOURCES = re.compile(r"(?:file|command|alpaca):\S.*", re.DOTALL)
_RATIO = re.compile(r"\s*(\d{1,6})\s*(?:/\s*(\d{1,6})\s*)?", re.ASCII)
_FASTEST_DEG_S = 100.0  # no telescope's axis; inverted gears give thousands
_COARSEST_ARCSEC = 2.0  # of a microstep of a box that a telescope can be held by; its own gears make 0.1
_OFF_SIDEREAL = 2.0  # times the rate that the divisor of a box can make with no gears that are as its manual has them
_FLAGS = {"true": True, "yes": True, "on": True, "1": True, "false": False, "no": False, "off": False, "0": False}


class BadValue(ValueError):  # noqa: N818 - it never leaves the configuration
    """The value is not one of those allowed."""


def from_text(key: Key, text: str) -> object:
    """The value that a text on a command line or in the environment stands for; the text itself where it is none."""
    try:
        match key.kind:
            case "integer":
                return int(text, 0)
            case "number":
                return float(text)
            case "flag":
                return _FLAGS[text.strip().lower()]
            case _:
                return text
    except (ValueError, KeyError):
        return text


def checked(key: Key, raw: object, folder: Path) -> Value:
    """The value of `key`, of its own type, relative paths taken from `folder`.

    Raises
    ------
    BadValue
        It is of another type, or not allowed.
    """
    if isinstance(raw, Path) and key.kind == "path":  # checked before
        return raw
    value = _TYPED[key.kind](raw)
    if isinstance(value, str) and key.kind == "path":
        if value in key.choices:  # a name in place of a path
            return value
        return folder / Path(value).expanduser()
    if key.choices and value not in key.choices:
        raise BadValue
    if isinstance(value, GearTeeth):
        for teeth in value.teeth:
            _within(key, teeth)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        _within(key, value)
    return value


def _within(key: Key, value: float) -> None:
    if key.low is not None and (value < key.low or (key.above and value == key.low)):
        raise BadValue
    if key.high is not None and value > key.high:
        raise BadValue


def _text(raw: object) -> str:
    if not isinstance(raw, str) or not raw.strip() or "\0" in raw:
        raise BadValue
    return raw


def _link(raw: object) -> str:
    text = _text(raw)
    port = _PORT.fullmatch(text)
    if not _LINKS.fullmatch(text) or (port and not 1 <= int(port["port"]) <= 65535):
        raise BadValue
    return text


def _source(raw: object) -> str:
    if not _SOURCES.fullmatch(_text(raw)):
        raise BadValue
    return str(raw)


def _flag(raw: object) -> bool:
    if not isinstance(raw, bool):
        raise BadValue
    return raw


def _integer(raw: object) -> int:
    if isinstance(raw, bool) or not isinstance(raw, int):
        raise BadValue
    return raw


def _number(raw: object) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise BadValue
    try:
        value = float(raw)
    except OverflowError:
        raise BadValue from None
    if not math.isfinite(value):
        raise BadValue
    return value


def _ratio(raw: object) -> GearTeeth:
    if isinstance(raw, GearTeeth):
        return raw
    parts = _RATIO.fullmatch(str(raw)) if isinstance(raw, str | int) and not isinstance(raw, bool) else None
    if parts is None or int(parts[1]) == 0 or (parts[2] is not None and int(parts[2]) == 0):
        raise BadValue
    return GearTeeth(int(parts[1]), int(parts[2] or 1))


_TYPED: dict[Kind, Callable[[object], Raw | GearTeeth]] = {
    "text": _text,
    "path": _text,
    "link": _link,
    "source": _source,
    "flag": _flag,
    "integer": _integer,
    "number": _number,
    "ratio": _ratio,
}

Finding = tuple[tuple[str, ...], str]  # the keys that contradict each other, and the sentence


def contradictions(facts: Facts) -> Iterator[Finding]:
    """What is impossible though each value alone is allowed."""
    for section in ("axis1", "axis2", "rotator"):
        if f"{section}.min_deg" in facts:
            yield from _travel(facts, section)
    if facts.get("limits.horizon") is not None and "limits.horizon_deg" in facts:
        yield (
            ("limits.horizon", "limits.horizon_deg"),
            "limits.horizon and limits.horizon_deg are both given: keep one of them",
        )
    if facts["drive.kind"] == "apo":
        yield from _lines(facts)
    if facts["drive.kind"] == "awr":
        yield from _factory(facts)
    if facts["drive.kind"] == "avr-box":
        for section in ("axis1", "axis2"):
            yield from _avr_gears(facts, section)
    if facts["drive.kind"] == "tc410":
        yield from _fan(facts)
        for section in ("axis1", "axis2"):
            yield from _tc410_axis(facts, section)


def _travel(facts: Facts, axis: str) -> Iterator[Finding]:
    low, high, park = (_float(facts, f"{axis}.{name}") for name in ("min_deg", "max_deg", "park_deg"))
    if low >= high:
        text = f"{axis}.min_deg = {low:g} is not below {axis}.max_deg = {high:g}: the axis could not move"
        yield (f"{axis}.min_deg", f"{axis}.max_deg"), text
    elif not low <= park <= high:
        text = f"{axis}.park_deg = {park:g}: allowed {low:g} to {high:g} deg, as {axis}.min_deg and max_deg say"
        yield (f"{axis}.park_deg", f"{axis}.min_deg", f"{axis}.max_deg"), text


def _lines(facts: Facts) -> Iterator[Finding]:
    """Each axis has a line of its own, or none has and the telescope is simulated."""
    sections = [section for section in ("axis1", "axis2", "rotator") if f"{section}.min_deg" in facts]
    given = {f"{section}.link": facts.get(f"{section}.link") for section in sections}
    if not any(given.values()):
        if facts["drive.link"] != "sim:":
            text = f"drive.link = {facts['drive.link']}: each axis of apo has a line of its own, {', '.join(given)}"
            yield ("drive.link", *given), text
        return
    for name in (name for name, link in given.items() if link is None):
        yield (name,), f"{name} is missing: each axis of apo has a line of its own, as tcp://192.168.1.21:1024"
    for name, link in given.items():
        first = next(each for each in given if given[each] == link)
        if link not in {None, "sim:"} and first != name:
            yield (name, first), f"{name} = {link} is {first} too: each axis has a line of its own"
    if "sim:" in given.values() and set(given.values()) != {"sim:"}:
        yield tuple(given), f"{', '.join(given)}: some are sim:, others not; the simulator is all axes or none"


_FACTORY = {
    "drive.sidereal_steps_per_s": "RA motor steps a second at sidereal rate, printed on the calibration sheet that "
    "AWR supplies with the drive box",
    "axis2.steps_per_degree": "Dec motor steps a degree, steps of the motor times microsteps times gear ratio / 360, "
    "as the calibration sheet of AWR has them",
}


def _factory(facts: Facts) -> Iterator[Finding]:
    """What only the factory's sheet tells."""
    for dotted, what in _FACTORY.items():
        if facts.get(dotted) is None:
            text = f"{dotted} is missing, and there is no default: the {what}; ask AWR for it with the serial number"
            yield (dotted,), text


def _avr_gears(facts: Facts, axis: str) -> Iterator[Finding]:
    """Gears that slow the axis, and by which axis 1 tracks about as the sky does, as its divisor is fixed."""
    names = tuple(f"{axis}.{name}" for name in ("motor_steps", "microsteps", "main_gear", "secondary_gear"))
    steps, microsteps, main, secondary = (facts[name] for name in names)
    if not (isinstance(main, GearTeeth) and isinstance(secondary, GearTeeth)):
        raise TypeError(names)
    turn = _float(facts, names[0]) * _float(facts, names[1]) / float(main * secondary)
    given = f"{axis}.main_gear = {main}, secondary_gear = {secondary}, {steps} steps of {microsteps} microsteps"
    if 1_296_000.0 / turn > _COARSEST_ARCSEC:
        text = (
            f"{given}: a microstep would be {1_296_000.0 / turn:.4g}″ of the axis, allowed up to "
            f'{_COARSEST_ARCSEC:g}″; a gear that slows the axis is less than 1, as "1/360"'
        )
        yield names, text
        return
    of_sidereal = tracking_rate() / turn * SIDEREAL_DAY_S
    if axis == "axis1" and not 1.0 / _OFF_SIDEREAL <= of_sidereal <= _OFF_SIDEREAL:
        text = (
            f"{given}: the box would track at {of_sidereal:.4g} times the sidereal rate, allowed "
            f"{1.0 / _OFF_SIDEREAL:g} to {_OFF_SIDEREAL:g}; compare the gears with the mount's"
        )
        yield names, text


def _fan(facts: Facts) -> Iterator[Finding]:
    start, stop = _float(facts, "drive.fan_start_c"), _float(facts, "drive.fan_stop_c")
    if stop >= start:
        text = f"drive.fan_stop_c = {stop:g}: allowed below drive.fan_start_c = {start:g} °C"
        yield ("drive.fan_stop_c", "drive.fan_start_c"), text


def _tc410_axis(facts: Facts, axis: str) -> Iterator[Finding]:
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
    speed = _float(facts, f"{axis}.max_speed_deg_s")
    if speed > fastest:
        text = (
            f"{axis}.max_speed_deg_s = {speed:g}: allowed at most {_rounded_down(fastest):g} deg/s, "
            f"which is {TC410_UNITS_PER_S} units/s with this {drive_type} gearing"
        )
        yield (f"{axis}.max_speed_deg_s", *gears), text
    reach = TC410_HALF_RANGE * fastest / TC410_UNITS_PER_S
    centre = _float(facts, f"{axis}.centre_deg")
    for name in ("min_deg", "max_deg"):
        angle = _float(facts, f"{axis}.{name}")
        if abs(angle - centre) > reach:
            text = (
                f"{axis}.{name} = {angle:g}: allowed {centre - reach:.2f} to {centre + reach:.2f} deg, "
                f"which the drive's 24 bits count with this gearing round {axis}.centre_deg = {centre:g}"
            )
            yield (f"{axis}.{name}", f"{axis}.centre_deg", *gears), text
    yield from _motor(facts, axis)


def _motor(facts: Facts, axis: str) -> Iterator[Finding]:
    drive_type = str(facts[f"{axis}.drive_type"])
    current, most = _float(facts, f"{axis}.motor_current_a"), motors.MOST_A[drive_type]
    if current > most:
        text = f"{axis}.motor_current_a = {current:g}: allowed 1 to {most:g} A with drive_type = {drive_type}"
        yield (f"{axis}.motor_current_a", f"{axis}.drive_type"), text
    if facts.get(f"{axis}.motor_rated_a") is None:
        return
    wiring, rating = str(facts[f"{axis}.motor_wiring"]), str(facts[f"{axis}.motor_rating"])
    label = _float(facts, f"{axis}.motor_rated_a")
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
    """What is possible, and unwise."""
    yield from _twice(facts)
    if facts["drive.kind"] == "tc410":
        yield from _weak_motors(facts)


def _twice(facts: Facts) -> Iterator[str]:
    """A model and the mount registers add up."""
    x, y = _float(facts, "mount.mount_x_mas"), _float(facts, "mount.mount_y_mas")
    if facts["mount.pointing_model"] is not None and (x or y):
        terms = "AN and AW" if facts["mount.type"] == "altaz-fork" else "MA and ME"
        yield (
            f"mount.pointing_model with mount.mount_x_mas = {x:g}, mount_y_mas = {y:g}: they add up; where {terms} "
            "of the model were fitted without these registers, set both to 0, or the misalignment is applied twice"
        )


def _weak_motors(facts: Facts) -> Iterator[str]:
    for axis in ("axis1", "axis2"):
        label = facts.get(f"{axis}.motor_rated_a")
        current = _float(facts, f"{axis}.motor_current_a")
        wiring, rating = str(facts[f"{axis}.motor_wiring"]), str(facts[f"{axis}.motor_rating"])
        rated = (
            None if label is None else motors.rated_current_a(wiring, rating, _float(facts, f"{axis}.motor_rated_a"))
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


def _float(facts: Facts, dotted: str) -> float:
    value = facts[dotted]
    if not isinstance(value, int | float):
        raise TypeError(dotted)
    return float(value)


def _rounded_down(value: float) -> float:
    return math.floor(value * 1e4) / 1e4
