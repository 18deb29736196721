"""What a value may be, alone and beside the others: every finding is a sentence with key, value and allowed range."""

import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from clockdrive.configuration_keys import Facts, Key, Kind, Raw, Value, number_of
from clockdrive.drives import Finding, check_of
from clockdrive.gear_teeth import GearTeeth

_PORT = re.compile(r"tcp://(?:\[[0-9A-Fa-f:.]+\]|[^\s/:@?#\[\]]+):(?P<port>\d{1,5})")
_LINKS = re.compile(rf"sim:|(?:{_PORT.pattern})|(?:serial://[^\s?]+|COM\d+)(?:\?baud=[1-9]\d*)?")
_SOURCES = re.compile(r"(?:file|command|alpaca):\S.*", re.DOTALL)
_RATIO = re.compile(r"\s*(\d{1,6})\s*(?:/\s*(\d{1,6})\s*)?", re.ASCII)
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
    yield from check_of(str(facts["drive.kind"])).contradictions(facts)


def _travel(facts: Facts, axis: str) -> Iterator[Finding]:
    low, high, park = (number_of(facts, f"{axis}.{name}") for name in ("min_deg", "max_deg", "park_deg"))
    if low >= high:
        text = f"{axis}.min_deg = {low:g} is not below {axis}.max_deg = {high:g}: the axis could not move"
        yield (f"{axis}.min_deg", f"{axis}.max_deg"), text
    elif not low <= park <= high:
        text = f"{axis}.park_deg = {park:g}: allowed {low:g} to {high:g} deg, as {axis}.min_deg and max_deg say"
        yield (f"{axis}.park_deg", f"{axis}.min_deg", f"{axis}.max_deg"), text


def cautions(facts: Facts) -> Iterator[str]:
    """What is possible, and unwise."""
    yield from _twice(facts)
    yield from check_of(str(facts["drive.kind"])).cautions(facts)


def _twice(facts: Facts) -> Iterator[str]:
    """A model and the mount registers add up."""
    x, y = number_of(facts, "mount.mount_x_mas"), number_of(facts, "mount.mount_y_mas")
    if facts["mount.pointing_model"] is not None and (x or y):
        terms = "AN and AW" if facts["mount.type"] == "altaz-fork" else "MA and ME"
        yield (
            f"mount.pointing_model with mount.mount_x_mas = {x:g}, mount_y_mas = {y:g}: they add up; where {terms} "
            "of the model were fitted without these registers, set both to 0, or the misalignment is applied twice"
        )
