"""The figures of an axis: angles and counts, or degrees, and what its drive is told, in the words of its kind."""

import math
from typing import Any

from pointing.plan import Axis, AxisPlan
from pointing.slew import Parted, Travel


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
        **axis.words.of_rate(axis, plan.rate),
        **axis.words.of_slew(axis, plan),
    }


def tracked(axis: Axis, angle: float, rate: float) -> dict[str, Any]:
    """How an axis moves when it tracks at an angle, radians, with a rate, radians per second."""
    return {
        "name": axis.name,
        "angle_deg": math.degrees(angle),
        "rate_deg_s": math.degrees(rate),
        **({} if axis.units == "degrees" else {"rate_counts_s": rate * axis.gearing.counts_per_radian}),
        **axis.words.of_rate(axis, rate),
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
