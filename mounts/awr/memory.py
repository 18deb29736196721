"""What the driver of a unit wants to be given back: all that nobody can ask the unit.

Position and its time, the words that were in force, the calibration that the position rests on, the delay of the
keys, the index of the worm, and what stands in RAM by programs and by a person's hand. A goto is remembered before
its first key: where a program ended in between, nobody knows how far it went.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

from mounts.remembered import NEVER, number, recalled, reinterpreted, text

REINTERPRETED = reinterpreted("calibration, steps per degree")
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
    referenced: bool = False
    """It was seen what the rates of GUIDE and CENTRE count from."""
    scaled: bool = False
    """The postscaler was seen to divide as assumed."""
    closely: tuple[float, float] = (0.0, 0.0)
    """Share of each way to which that was seen."""
    synced: tuple[float, float] | None = None
    """Where the axes were at the last sync, counts; None for where they are."""


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
        found, why = recalled(memory, _read)
        if found is None:
            return cls(unsynchronised=why, meaning=meaning)
        why = found.unsynchronised
        if not why and found.moving:
            why = UNENDED
        if not why and found.meaning != meaning:
            why = REINTERPRETED
        return replace(found, unsynchronised=why, moving=False, meaning=meaning)


def at_park(
    counts: Sequence[float],
    time: float,
    meaning: str,
    shown: Shown | None = None,
    sides: tuple[float, float] = (1.0, 1.0),
) -> dict[str, object]:
    """What a driver remembers that has left its telescope at rest somewhere, synchronised, each motor at a side."""
    one, two = (KeptAxis(float(each), 0.0, side=side) for each, side in zip(counts, sides, strict=True))
    return Kept("", time, (one, two), meaning=meaning, shown=shown or Shown()).as_json()


def _read(memory: Mapping[str, object]) -> Kept:
    one, two = (_axis(cast("Mapping[str, object]", kept)) for kept in cast("Sequence[object]", memory["axes"]))
    index = cast("Sequence[object] | None", memory["index"])
    return Kept(
        unsynchronised=text(memory["unsynchronised"]),
        time=-math.inf if memory["time"] is None else number(memory["time"]),
        axes=(one, two),
        moving=memory["moving"] is True,
        cookie=_whole(memory["cookie"]),
        directions=_whole(memory["directions"]),
        calibration=_whole(memory["calibration"]),
        delay_s=None if memory["delay_s"] is None else number(memory["delay_s"]),
        index=None if index is None else (number(index[0]), number(index[1])),
        meaning=text(memory["meaning"]),
        ram=_words(memory.get("ram", {})),
        written=_words(memory.get("written", {})),
        shown=_shown(memory["shown"]) if "shown" in memory else Shown(),
    )


def _shown(stored: object) -> Shown:
    kept = cast("Mapping[str, object]", stored)
    axes, led = (cast("Sequence[object]", kept[name]) for name in ("axes", "led"))
    return Shown(
        text(kept["assumed"]),
        (axes[0] is True, axes[1] is True),
        _pair(led),
        kept.get("referenced") is True,
        kept.get("scaled") is True,
        _pair(kept.get("closely", (0.0, 0.0))),
        None if kept.get("synced") is None else _pair(kept["synced"]),
    )


def _pair(stored: object) -> tuple[float, float]:
    one, two = cast("Sequence[object]", stored)
    return number(one), number(two)


def _axis(kept: Mapping[str, object]) -> KeptAxis:
    return KeptAxis(
        number(kept["counts"]), number(kept["uncertainty"]), number(kept["rate"]), number(kept.get("side", 0.0))
    )


def _words(kept: object) -> dict[int, int]:
    return {int(address): int(number(value)) for address, value in cast("Mapping[str, object]", kept).items()}


def _whole(stored: object) -> int | None:
    return None if stored is None else int(number(stored))
