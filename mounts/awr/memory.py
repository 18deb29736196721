"""What the driver of a unit wants to be given back: all that nobody can ask the unit.

Position and its time, the words that were in force, the calibration that the position rests on, the delay of the
keys, the index of the worm, and what stands in RAM by programs and by a person's hand. A goto is remembered before
its first key: where a program ended in between, nobody knows how far it went.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

NEVER = "the position of this drive was never synchronised; `sync` on a known star"
UNREADABLE = "what was remembered of this drive's position cannot be read; `sync` on a known star"
REINTERPRETED = (
    "calibration, steps per degree, centre, sense, mount type or site were configured anew since the last sync, so "
    "counts mean other places; `sync` on a known star"
)
UNENDED = "the program ended while keys moved the telescope, and nobody knows how far; `sync` on a known star"


@dataclass(frozen=True)
class KeptAxis:
    """One axis."""

    counts: float
    uncertainty: float
    rate: float = 0.0
    side: float = 0.0


@dataclass(frozen=True)
class Shown:
    """Of which axes it was seen that keys move them as assumed, and how far they did since the last sync, steps."""

    assumed: str = ""
    axes: tuple[bool, bool] = (False, False)
    led: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Kept:
    """All that is remembered."""

    unsynchronised: str = NEVER
    time: float = -math.inf
    axes: tuple[KeptAxis, KeptAxis] = (KeptAxis(0.0, 0.0), KeptAxis(0.0, 0.0))
    moving: bool = False
    cookie: int | None = None
    directions: int | None = None
    calibration: int | None = None
    delay_s: float | None = None
    index: tuple[float, float] | None = None
    meaning: str = ""
    ram: Mapping[int, int] = field(default_factory=dict)
    """Words by address that RAM holds otherwise than the non-volatile memory."""
    written: Mapping[int, int] = field(default_factory=dict)
    """Those of them that a person wrote, and may commit."""
    shown: Shown = Shown()

    def as_json(self) -> dict[str, object]:
        """As it is stored."""
        return vars(self) | {
            "time": None if math.isinf(self.time) else self.time,
            "axes": [dict(vars(axis)) for axis in self.axes],
            "shown": dict(vars(self.shown)),
            "ram": {str(address): value for address, value in self.ram.items()},
            "written": {str(address): value for address, value in self.written.items()},
        }

    @classmethod
    def of(cls, memory: Mapping[str, object], meaning: str) -> "Kept":
        """What was stored, judged: unsynchronised where it is nothing, broken, or of another telescope."""
        if not memory:
            return cls(meaning=meaning)
        try:
            found = _read(memory)
        except (KeyError, TypeError, ValueError):
            return cls(unsynchronised=UNREADABLE, meaning=meaning)
        why = found.unsynchronised
        if not why and found.moving:
            why = UNENDED
        if not why and found.meaning != meaning:
            why = REINTERPRETED
        return replace(found, unsynchronised=why, moving=False, meaning=meaning)


def at_park(counts: Sequence[float], time: float, meaning: str, shown: Shown | None = None) -> dict[str, object]:
    """What a driver remembers that has left its telescope at rest somewhere, synchronised."""
    one, two = (KeptAxis(float(each), 0.0) for each in counts)
    return Kept("", time, (one, two), meaning=meaning, shown=shown or Shown()).as_json()


def _read(memory: Mapping[str, object]) -> Kept:
    one, two = (_axis(cast("Mapping[str, object]", kept)) for kept in cast("Sequence[object]", memory["axes"]))
    index = cast("Sequence[object] | None", memory["index"])
    return Kept(
        unsynchronised=_text(memory["unsynchronised"]),
        time=-math.inf if memory["time"] is None else _number(memory["time"]),
        axes=(one, two),
        moving=memory["moving"] is True,
        cookie=_whole(memory["cookie"]),
        directions=_whole(memory["directions"]),
        calibration=_whole(memory["calibration"]),
        delay_s=None if memory["delay_s"] is None else _number(memory["delay_s"]),
        index=None if index is None else (_number(index[0]), _number(index[1])),
        meaning=_text(memory["meaning"]),
        ram=_words(memory.get("ram", {})),
        written=_words(memory.get("written", {})),
        shown=_shown(memory["shown"]) if "shown" in memory else Shown(),
    )


def _shown(stored: object) -> Shown:
    kept = cast("Mapping[str, object]", stored)
    axes, led = (cast("Sequence[object]", kept[name]) for name in ("axes", "led"))
    return Shown(_text(kept["assumed"]), (axes[0] is True, axes[1] is True), (_number(led[0]), _number(led[1])))


def _axis(kept: Mapping[str, object]) -> KeptAxis:
    return KeptAxis(
        _number(kept["counts"]), _number(kept["uncertainty"]), _number(kept["rate"]), _number(kept.get("side", 0.0))
    )


def _words(kept: object) -> dict[int, int]:
    return {int(address): int(_number(value)) for address, value in cast("Mapping[str, object]", kept).items()}


def _whole(stored: object) -> int | None:
    return None if stored is None else int(_number(stored))


def _number(stored: object) -> float:
    if isinstance(stored, bool) or not isinstance(stored, int | float) or not math.isfinite(stored):
        raise TypeError(stored)
    return float(stored)


def _text(stored: object) -> str:
    if not isinstance(stored, str):
        raise TypeError(stored)
    return stored
