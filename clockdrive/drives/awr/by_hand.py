"""`drive set`, `diff`, `save`, `reload` and `raw` of an AWR Microstep."""

from typing import Any, Protocol, runtime_checkable

from clockdrive.answers import Answer
from clockdrive.errors import InputError
from mounts.awr.commands import RELAYS
from mounts.awr.errors import AwrError
from mounts.awr.registers import by_name, shown, value_of

_SWITCH = {"on": True, "off": False, "1": True, "0": False}
IN_RAM = "in RAM only: `drive save` commits it to the non-volatile memory, `drive reload` discards it"
_RAW = "a key is held so: `drive raw axis1 LEFT guide 0.5`, or RIGHT; UP or DOWN of axis2"


@runtime_checkable
class HasWords(Protocol):
    """A drive with the words and keys of an AWR Microstep."""

    def soft_write(self, name: str, value: int) -> str:
        """Write a word in RAM; return what it was."""
        ...

    def commit(self) -> tuple[str, ...]:
        """Have what was written kept for good; return the names."""
        ...

    def discard(self) -> None:
        """Have soft writes forgotten."""
        ...

    def switch_relay(self, number: int, *, on: bool) -> None:
        """Switch a relay."""
        ...

    def way_of(self, name: str, speed: str, seconds: float) -> tuple[float, float]:
        """By how many steps a key for a time moves either axis."""
        ...

    def press(self, name: str, speed: str, seconds: float) -> None:
        """Hold a key for a time."""
        ...

    def differing(self) -> dict[str, tuple[int, int]]:
        """Words that RAM holds otherwise than the non-volatile memory: this and that."""
        ...


def relay_of(name: str) -> int | None:
    """The number of a relay, `relay_2`; None of another name.

    Raises
    ------
    InputError
        There is no such relay.
    """
    if not name.startswith("relay"):
        return None
    digits = name.removeprefix("relay").lstrip("_")
    if digits not in {str(number) for number in RELAYS}:
        raise InputError(f"{name}: there are {', '.join(f'relay_{number}' for number in RELAYS)}")
    return int(digits)


def relay_set(drive: HasWords, number: int, value: float | str) -> Answer:
    """Switch a relay.

    Raises
    ------
    InputError
        It is neither on nor off.
    """
    word = str(value).strip().lower()
    if word not in _SWITCH:
        raise InputError(f"relay_{number} = {value}: give on or off")
    drive.switch_relay(number, on=_SWITCH[word])
    text = "on" if _SWITCH[word] else "off"
    return _answer(f"relay_{number}", text, "", "")


def word_set(drive: HasWords, name: str, value: float | str) -> Answer:
    """Write a word in RAM.

    Raises
    ------
    AwrError
        There is no such register, it is never written, or not so; lower-case digits.
    """
    register, number = by_name(name), value_of(value) if isinstance(value, str) else _whole(value)
    before = drive.soft_write(register.name, number)
    return _answer(register.name, shown(register, number), before, IN_RAM)


def differing(drive: HasWords) -> Answer:
    """What RAM holds otherwise than the non-volatile memory."""
    rows = [
        {
            "key": "RAM",
            "register": name,
            "unit": ram,
            "configured": lasting,
            "units": "is the non-volatile word",
            "unit_value": ram,
        }
        for name, (ram, lasting) in drive.differing().items()
    ]
    return Answer({"ok": True, "differences": rows})


def key_of(axis: str, text: str) -> tuple[str, str, float]:
    """Key, speed and seconds of `LEFT guide 0.5`.

    Raises
    ------
    InputError
        It is written otherwise.
    """
    words = text.split()
    if len(words) != 3 or axis not in {"axis1", "axis2"} or (words[0].upper() in {"UP", "DOWN"}) != (axis == "axis2"):
        raise InputError(f"{axis} {text}: {_RAW}")
    try:
        seconds = float(words[2].removesuffix("s"))
    except ValueError:
        raise InputError(f"{words[2]}: give the seconds of the key, 0.5; {_RAW}") from None
    return words[0].upper(), words[1].lower(), seconds


def pressed(drive: HasWords, key: str, speed: str, seconds: float) -> dict[str, Any]:
    """Hold a key for a time; whoever calls has seen that its way is allowed."""
    drive.press(key, speed, seconds)
    said = f"{key} was held at {speed} speed for {seconds:g} s"
    return {"ok": True, "command": said, "lines": [said], "fiducials": []}


def _whole(value: float) -> int:
    if value != int(value):
        raise AwrError(f"{value:g}: words are whole numbers, 0 to 65535")
    return int(value)


def _answer(name: str, text: str, before: str, note: str) -> Answer:
    row = {"group": "awr", "text": text, "raw": []}
    return Answer({"ok": True, "registers": {name: row}, "before": before, "note": note})
