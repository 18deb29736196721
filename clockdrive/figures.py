"""The figures of an axis in the words of its drive: counts and registers, or degrees."""

import math
from typing import Any

from mounts.tc410.registers import COUNTS_PER_SECOND
from pointing.plan import Axis, AxisPlan, Trims
from pointing.slew import Parted, Travel, Waiting


def velocity_register(counts_s: float) -> int:
    """The TC410's velocity register nearest to a rate."""
    return round(counts_s / COUNTS_PER_SECOND)


def place(axis: Axis, angle: float, name: str = "target") -> dict[str, Any]:
    """Where an angle, radians, lies in the drive's units: `target_counts`, or `target_deg` of a drive in degrees."""
    return _counted(axis, axis.nearest(angle), name)


def planned(axis: Axis, plan: AxisPlan) -> dict[str, Any]:
    """What an axis does in a plan."""
    return {
        "name": axis.name,
        "angle_deg": math.degrees(plan.angle),
        **_counted(axis, plan.from_counts, "from"),
        **_counted(axis, plan.target_counts, "target"),
        "travel_s": plan.travel.duration,
        **_parted(plan.travel),
        "rate_deg_s": math.degrees(plan.rate),
        **register(axis, plan.rate),
        **_pressed(axis, plan),
    }


def tracked(axis: Axis, angle: float, rate: float) -> dict[str, Any]:
    """How an axis moves when it tracks at an angle, radians, with a rate, radians per second."""
    return {
        "name": axis.name,
        "angle_deg": math.degrees(angle),
        "rate_deg_s": math.degrees(rate),
        **({} if axis.units == "degrees" else {"rate_counts_s": rate * axis.gearing.counts_per_radian}),
        **register(axis, rate),
    }


def register(axis: Axis, rate: float) -> dict[str, Any]:
    """What the drive is told for a rate, radians per second, where it has a register or trims its own rate."""
    counts = rate * axis.gearing.counts_per_radian
    if axis.units == "counts":
        return {"velocity_register": velocity_register(counts)}
    if axis.trims is not None:
        return _trimmed(axis.trims, counts) | _lagging(axis, rate)
    if axis.units != "microsteps" or not counts:
        return {}
    return {"single_step_every_s": round(1.0 / abs(counts), 4)} | _lagging(axis, rate)


def _pressed(axis: Axis, plan: AxisPlan) -> dict[str, Any]:
    """The presses of a drive that is moved by keys, with the error that each leaves, and how sure the end is."""
    if axis.units != "steps":
        return {}
    from mounts.awr.slew_model import AwrTravel  # noqa: PLC0415 - only of such a drive
    from mounts.awr.uncertainty import TWO_SIDED_95  # noqa: PLC0415 - likewise

    travel = plan.travel.travel if isinstance(plan.travel, Waiting) else plan.travel
    presses = travel.presses if isinstance(travel, AwrTravel) else []
    arcsec = 3600.0 * abs(axis.gearing.step_deg_float)
    unknown = math.hypot(*(press.unknown for press in presses))
    return {
        "key_presses": [
            {"speed": press.speed, "hold_s": round(press.hold_s, 3), "error_arcsec": round(press.leaves * arcsec, 2)}
            for press in presses
        ],
        "uncertainty_arcsec": round(TWO_SIDED_95 * unknown * arcsec, 2),
    }


def _lagging(axis: Axis, rate: float) -> dict[str, Any]:
    """How far it is off its way by what short moves make of a rate; None where they do not hold it to that."""
    if axis.short_moves is None or not rate:
        return {}
    beside, moves = axis.beside(rate), axis.short_moves
    held = beside <= moves.most
    return {"lag_arcsec": round(math.degrees(beside * moves.lag_s) * 3600.0, 2) if held else None}


def _trimmed(trims: Trims, counts_s: float) -> dict[str, Any]:
    """How its own rate is trimmed, by which commands, and what short moves must add."""
    ticks = trims.ticks(counts_s)
    return {
        "guide_duty": round(trims.duty(counts_s), 4),
        "guide_command": "+" if ticks > 0 else "-" if ticks < 0 else None,
        "guide_ticks": abs(ticks),
        "guide_every_s": trims.every_s,
        "short_moves_counts_s": round(counts_s - trims.reached(counts_s), 4),
    }


def _parted(travel: Travel) -> dict[str, Any]:
    """In how many moves a drive goes that cannot stop one, and what that costs."""
    if not isinstance(travel, Parted):
        return {}
    return {
        "moves": len(travel.pieces),
        "longest_move_s": max((piece.duration for piece in travel.pieces), default=0.0),
        "moves_cost_s": travel.duration - travel.in_one_s,
    }


def _counted(axis: Axis, counts: float, name: str) -> dict[str, Any]:
    return {f"{name}_deg": counts} if axis.units == "degrees" else {f"{name}_counts": round(counts)}
