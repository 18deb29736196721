"""A way in two legs where the straight one is forbidden: by the centre of both axes, or one axis after the other."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from pointing.errors import Unreachable
from pointing.limits import Check
from pointing.mount import Posture
from pointing.plan import Plan, Start, Timing
from pointing.targets import Target

if TYPE_CHECKING:
    from pointing.planner import Planner

BETWEEN_S = 2.0
"""Seconds in which the end of the first leg is seen and the second one is planned."""


def way_round(
    planner: "Planner", target: Target, start: Start, timing: Timing, refused: Plan, posture: Posture | None
) -> Plan | None:
    """The plan of the earliest arrival by way of another place, which is `via`; None where there is none.

    Parameters
    ----------
    planner : Planner
        Plans both legs.
    target, start, timing, posture
        As for the straight way.
    refused : Plan
        The straight way, which is forbidden.
    """
    found: list[Plan] = []
    for place in _places(planner, start, (refused.axes[0].angle, refused.axes[1].angle)):
        try:
            first = planner.plan_axes(target.name, place, start, timing)
        except Unreachable:
            continue
        here = (first.axes[0].target_counts, first.axes[1].target_counts)
        second = planner.straight(target, Start(first.arrival + BETWEEN_S, here), timing, posture)[0]
        if second is not None:
            found.append(replace(second, start=start.time, via=first))
    return min(found, key=lambda plan: plan.arrival, default=None)


def to_axes(planner: "Planner", name: str, angles: tuple[float, float], start: Start, timing: Timing) -> Plan:
    """Plan a slew to fixed axis angles, straight or, where only horizon or Sun bar that, by way of another place.

    Parameters
    ----------
    planner : Planner
        Plans both legs.
    name, angles, start, timing
        As for `Planner.plan_axes`.

    Raises
    ------
    Unreachable
        As that one.
    """
    try:
        return planner.plan_axes(name, angles, start, timing)
    except Unreachable as refusal:
        found: list[Plan] = []
        for place in _places(planner, start, angles) if only_the_sky_bars(refusal.checks) else ():
            with suppress(Unreachable):
                first = planner.plan_axes(name, place, start, timing)
                here = (first.axes[0].target_counts, first.axes[1].target_counts)
                second = planner.plan_axes(name, angles, Start(first.arrival + BETWEEN_S, here), timing)
                found.append(replace(second, start=start.time, via=first))
        if not found:
            raise
        return min(found, key=lambda plan: plan.arrival)


def only_the_sky_bars(checks: Iterable[Check]) -> bool:
    """Whether only horizon or Sun forbid a plan, so that another way may lead there."""
    return all(check.ok or check.name in {"horizon", "Sun"} for check in checks)


def _places(planner: "Planner", start: Start, there: tuple[float, float]) -> Iterator[tuple[float, float]]:
    one, two = planner.angles(start.counts)
    yield planner.axes[0].gearing.centre, planner.axes[1].gearing.centre
    yield there[0], two
    yield one, there[1]
