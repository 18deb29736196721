"""Whether an axis keeps up with a rate that its drive makes by short moves, beside its own tracking as trimmed."""

import math

from pointing.limits import Check
from pointing.plan import Axis

_NAME = "short moves"


def held(axis: Axis, rate: float) -> Check | None:
    """Whether short moves hold an axis to a rate, radians per second, and how far off it is meanwhile.

    None of an axis at rest, and of one whose drive makes any rate.
    """
    moves = axis.short_moves
    if moves is None or not rate:
        return None
    beside, most = math.degrees(axis.beside(rate)) * 3600.0, math.degrees(moves.most) * 3600.0
    name, said = f"{axis.name} {_NAME}", f"{axis.name}: {beside:.2f}″/s of its rate are made by short moves"
    if beside > most:
        return Check(name, ok=False, detail=f"{said}, which hold up to {most:g}″/s")
    return Check(name, ok=True, detail=f"{said}, up to {beside * moves.lag_s:.1f}″ off meanwhile")


def too_fast(check: Check) -> bool:
    """Whether a check of `held` has failed; waiting slows nothing."""
    return not check.ok and check.name.endswith(_NAME)


def fastest(axis: Axis) -> float:
    """The largest rate either way, radians per second, that its drive follows."""
    if axis.short_moves is None:
        return axis.fastest
    trims, per_radian = axis.trims, abs(axis.gearing.counts_per_radian)
    trimmed = 0.0 if trims is None else max(abs(rate) for rate in trims[:3]) / per_radian
    return min(axis.fastest, trimmed + axis.short_moves.most)
