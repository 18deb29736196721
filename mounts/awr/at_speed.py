"""Both axes at speeds until told otherwise: the keys of the one speed that comes nearest, held for ever."""

import math
from collections.abc import Sequence

from mounts.awr.cascade import Press, Stage
from mounts.awr.errors import AwrError
from mounts.awr.ladder import Ladder, Rung

Keys = tuple[str, int, int]
"""A speed, and of each axis the key that is held: to larger counts, to smaller ones, none."""


def held_at(ladder: Ladder, rates: Sequence[float]) -> Stage | None:
    """Keys of the speed nearest to the faster of two rates, steps a second; None where neither axis is to move.

    Raises
    ------
    AwrError
        No speed moves the axes that way while their drives go as they do.
    """
    moved = [axis for axis in (0, 1) if rates[axis]]
    if not moved:
        return None
    fast = max(moved, key=lambda axis: abs(rates[axis]))

    def off(rung: Rung) -> float:
        key = rung.key(fast, rates[fast])
        return math.inf if key is None else abs(math.log(abs(rates[fast] / key.rate)))

    rungs = [rung for rung in ladder.rungs if all(rung.key(axis, rates[axis]) for axis in moved)]
    if not rungs:
        raise AwrError("no speed moves the axes that way while their drives go as they do: `stop` them first")
    rung = min(rungs, key=off)
    presses: list[Press | None] = [None, None]
    for axis in moved:
        key = rung.key(axis, rates[axis])
        presses[axis] = Press(key, math.inf) if key is not None else None
    return Stage(rung.speed, (presses[0], presses[1]), (0.0, 0.0), math.inf, (0.0, 0.0), (0.0, 0.0))


def keys_of(stage: Stage | None) -> Keys | None:
    """Which keys it holds."""
    if stage is None:
        return None
    one, two = (press.sign if press else 0 for press in stage.presses)
    return stage.speed, one, two
