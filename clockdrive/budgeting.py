"""The error budget of a plan: what clock, air and drive say of themselves, and how it is put into an answer."""

import math
from typing import Any

from clockdrive.surroundings import Surroundings
from pointing.error_budget import ErrorBudget, Stated, error_budget
from pointing.pass_plan import PassPlan
from pointing.plan import AxisState, Plan
from pointing.planner import Planner

_ARCSEC = 180.0 / math.pi * 3600.0
_MEASURED = 1.0, 1.0  # hPa, K: what stations are good for
_CONFIGURED = 10.0, 10.0  # how far a night's air is from one that was written down once


def budget_of(
    plan: Plan | PassPlan,
    planner: Planner,
    around: Surroundings,
    uncertainty_counts: tuple[float, float] | None = None,
) -> ErrorBudget:
    """How far off a plan may land, or be as it goes along with a satellite.

    Parameters
    ----------
    plan, planner, around
        What is planned, for which telescope, under which clock and air.
    uncertainty_counts : tuple of float, optional
        By how much the drive's position may be off, counts; None where no drive was asked.
    """
    measured = around.air.reading is not None and not around.air.trouble
    pressure_hpa, temperature_k = _MEASURED if measured else _CONFIGURED
    time, axes = _arrival(plan)
    clock = around.clock(time)
    source = "measured" if measured else "configured"
    stated = Stated(
        pressure_hpa,
        temperature_k,
        f"{source} air, taken as right to {pressure_hpa:g} hPa and {temperature_k:g} °C",
        clock.error_s,
        clock.text,
        uncertainty_counts,
    )
    return error_budget(planner, axes, time, stated)


def _arrival(plan: Plan | PassPlan) -> tuple[float, AxisState]:
    """When the axes are on the target, and their angles and rates then."""
    if isinstance(plan, PassPlan):
        return plan.joined, plan.trajectory.angles(plan.joined)
    one, two = plan.axes
    return plan.arrival, ((one.angle, one.rate), (two.angle, two.rate))


def budget_json(budget: ErrorBudget) -> dict[str, Any]:
    """Plain values, arcseconds; null where nobody knows."""
    return {
        "total_arcsec": round(budget.total * _ARCSEC, 3),
        "unknown": list(budget.unknown),
        "sources": [
            {
                "name": each.name,
                "arcsec": None if each.error is None else round(each.error * _ARCSEC, 3),
                "assumption": each.assumption,
            }
            for each in budget.sources
        ],
    }
