"""What the driver of a box wants to be given back: all that nobody can ask the box.

Position and its time, the moves under way, the ties of the encoders, the measured crystal. A move is remembered
before it is sent: where a program ended in between, half of it may stand in the box.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import cast

from mounts.remembered import NEVER, number, recalled, reinterpreted, text

REINTERPRETED = reinterpreted("gears")


@dataclass(frozen=True)
class KeptMove:
    """A move that was sent."""

    half: int
    sign: int
    begin: float


@dataclass(frozen=True)
class KeptAxis:
    """One axis."""

    counts: float
    uncertainty: float
    moves: tuple[KeptMove, ...] = ()
    encoder_zero: float | None = None
    unproved_steps: float = 0.0


@dataclass(frozen=True)
class Kept:
    """All that is remembered."""

    unsynchronised: str = NEVER
    time: float = -math.inf
    axes: tuple[KeptAxis, KeptAxis] = (KeptAxis(0.0, 0.0), KeptAxis(0.0, 0.0))
    crystal: float = 1.0
    crystal_uncertainty: float | None = None
    resting: bool = False
    sending: bool = False
    doubted: float | None = None
    proved: bool = False
    meaning: str = ""

    def later(self, seconds: float) -> "Kept":
        """The same, by a clock that is ahead."""
        one, two = (
            replace(axis, moves=tuple(replace(move, begin=move.begin + seconds) for move in axis.moves))
            for axis in self.axes
        )
        doubted = None if self.doubted is None else self.doubted + seconds
        return replace(self, time=self.time + seconds, axes=(one, two), doubted=doubted)

    def as_json(self) -> dict[str, object]:
        """As it is stored."""
        kept = asdict(self)
        return kept | {"time": None if math.isinf(self.time) else self.time, "axes": [asdict(a) for a in self.axes]}

    @classmethod
    def of(cls, memory: Mapping[str, object], meaning: str) -> "Kept":
        """What was stored, judged: unsynchronised where it is nothing, broken, or of another telescope."""
        found, why = recalled(memory, _read)
        if found is None:
            return cls(unsynchronised=why, meaning=meaning)
        why = found.unsynchronised
        if not why and found.meaning != meaning:
            why = REINTERPRETED
        proved = found.proved and found.meaning == meaning
        return replace(found, unsynchronised=why, proved=proved, meaning=meaning)


def at_park(counts: Sequence[float], time: float, meaning: str) -> dict[str, object]:
    """What a driver remembers that has left its telescope at rest somewhere, synchronised."""
    one, two = (KeptAxis(float(each), 0.0) for each in counts)
    return Kept("", time, (one, two), resting=True, meaning=meaning).as_json()


def _read(memory: Mapping[str, object]) -> Kept:
    one, two = (_axis(cast("Mapping[str, object]", kept)) for kept in cast("Sequence[object]", memory["axes"]))
    time, crystal = memory["time"], memory.get("crystal_uncertainty")
    doubted = memory["doubted"]
    return Kept(
        unsynchronised=text(memory["unsynchronised"]),
        time=-math.inf if time is None else number(time),
        axes=(one, two),
        crystal=number(memory["crystal"]),
        crystal_uncertainty=None if crystal is None else number(crystal),
        resting=memory["resting"] is True,
        sending=memory["sending"] is True,
        doubted=None if doubted is None else number(doubted),
        proved=memory["proved"] is True,
        meaning=text(memory["meaning"]),
    )


def _axis(kept: Mapping[str, object]) -> KeptAxis:
    moves = tuple(
        KeptMove(int(number(move["half"])), int(number(move["sign"])), number(move["begin"]))
        for move in cast("Sequence[Mapping[str, object]]", kept["moves"])
    )
    zero = kept["encoder_zero"]
    return KeptAxis(
        number(kept["counts"]),
        number(kept["uncertainty"]),
        moves,
        None if zero is None else number(zero),
        number(kept["unproved_steps"]),
    )
