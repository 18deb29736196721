"""`drive set`, `diff`, `save`, `reload` and `raw` of an AWR Microstep."""

from typing import TYPE_CHECKING, Any, cast

from clockdrive.answers import Answer
from clockdrive.direct_speed import check_way
from clockdrive.drives.by_hand import ByHand
from clockdrive.errors import InputError
from mounts.awr.commands import RELAYS
from mounts.awr.errors import AwrError
from mounts.awr.registers import by_name, shown, value_of

if TYPE_CHECKING:
    from mounts.awr.by_hand import ByHand as Hand
    from mounts.awr.drive import AwrDrive

_SWITCH = {"on": True, "off": False, "1": True, "0": False}
_CONFIRM_DISCARD = "what was written in RAM and not committed is lost: confirm it with --yes"
IN_RAM = "in RAM only: `drive save` commits it to the non-volatile memory, `drive reload` discards it"
_RAW = "a key is held so: `drive raw axis1 LEFT guide 0.5`, or RIGHT; UP or DOWN of axis2"


class AwrByHand(ByHand):
    """Its words, relays and keys."""

    @property
    def _hand(self) -> "Hand":
        return cast("AwrDrive", self.at_rest.session.drive).hand

    def set(self, name: str, value: float | str, *, force: bool) -> Answer:  # noqa: ARG002 - nothing is risky
        """Switch a relay, at any time; or write a word in RAM, at rest."""
        relay = relay_of(name)
        if relay is None:
            answer = self.at_rest.changing(lambda: word_set(self._hand, name, value))
        else:
            answer = relay_set(self._hand, relay, value)
        self.at_rest.session.note("drive", f"{name} set to {value}")
        return answer

    def diff(self) -> Answer:
        """What RAM holds otherwise than the non-volatile memory."""
        return differing(self._hand)

    def raw(self, axis: str, text: str, *, confirmed: bool) -> Answer:  # noqa: ARG002 - its way is checked
        """Hold a key for a time, if its way is allowed."""
        hand, session, (name, speed, seconds) = self._hand, self.at_rest.session, key_of(axis, text)

        def work() -> dict[str, Any]:
            one, two = hand.way_of(name, speed, seconds)
            session.poll()
            first, second = (each.gearing.counts_per_radian * seconds for each in session.planner.axes)
            check_way(session, (one / first, two / second), seconds, f"{name} at {speed} speed")
            return pressed(hand, name, speed, seconds)

        given = self.at_rest.changing(work)
        session.note("drive", given["command"])
        return Answer(given)

    def save(self) -> Answer:
        """Have what was written in RAM kept for good."""
        names = self.at_rest.changing(self._hand.commit)
        return self.at_rest.done(f"committed to the non-volatile memory: {', '.join(names)}")

    def reload(self, *, confirmed: bool) -> Answer:
        """Have what was written in RAM forgotten."""
        if not confirmed:
            raise InputError(_CONFIRM_DISCARD)
        self.at_rest.changing(self._hand.discard)
        return self.at_rest.done("the soft writes are discarded")


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


def relay_set(hand: "Hand", number: int, value: float | str) -> Answer:
    """Switch a relay.

    Raises
    ------
    InputError
        It is neither on nor off.
    """
    word = str(value).strip().lower()
    if word not in _SWITCH:
        raise InputError(f"relay_{number} = {value}: give on or off")
    hand.switch_relay(number, on=_SWITCH[word])
    text = "on" if _SWITCH[word] else "off"
    return _answer(f"relay_{number}", text, "", "")


def word_set(hand: "Hand", name: str, value: float | str) -> Answer:
    """Write a word in RAM.

    Raises
    ------
    AwrError
        There is no such register, it is never written, or not so; lower-case digits.
    """
    register, number = by_name(name), value_of(value) if isinstance(value, str) else _whole(value)
    before = hand.soft_write(register.name, number)
    return _answer(register.name, shown(register, number), before, IN_RAM)


def differing(hand: "Hand") -> Answer:
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
        for name, (ram, lasting) in hand.differing().items()
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


def pressed(hand: "Hand", key: str, speed: str, seconds: float) -> dict[str, Any]:
    """Hold a key for a time; whoever calls has seen that its way is allowed."""
    hand.press(key, speed, seconds)
    said = f"{key} was held at {speed} speed for {seconds:g} s"
    return {"ok": True, "command": said, "lines": [said], "fiducials": [], "note": ""}


def _whole(value: float) -> int:
    if value != int(value):
        raise AwrError(f"{value:g}: words are whole numbers, 0 to 65535")
    return int(value)


def _answer(name: str, text: str, before: str, note: str) -> Answer:
    row = {"group": "awr", "text": text, "raw": []}
    return Answer({"ok": True, "registers": {name: row}, "before": before, "note": note})
