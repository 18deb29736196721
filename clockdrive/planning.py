"""Plans and rates that need no drive: targets and times as people give them, positions as they say."""

import math
from typing import TYPE_CHECKING, TypeAlias, cast

from clockdrive import parse
from clockdrive.answers import Answer, PlanAnswer, plan_answer, rates_answer
from clockdrive.assembly import planner as planner_of
from clockdrive.assembly import surroundings as surroundings_of
from clockdrive.assembly import timing as timing_of
from clockdrive.best import best
from clockdrive.clock import SystemClock
from clockdrive.configuration import Configuration
from clockdrive.errors import ConfigurationError
from clockdrive.surroundings import Surroundings
from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.mount import POSTURES
from pointing.plan import Start
from pointing.planner import Planner
from pointing.targets import Star, Target

if TYPE_CHECKING:
    from datetime import datetime

    from astropy.coordinates import SkyCoord
    from astropy.time import Time

    TargetLike: TypeAlias = str | SkyCoord | Target
    TimeLike: TypeAlias = float | datetime | Time | str

# What a unit may hold otherwise than the defaults, and which would change the counts or the time of a plan.
_DECIDING = frozenset(
    (
        *("type", "mount_x_mas", "mount_y_mas", "motor_steps", "main_gear", "secondary_gear", "drive_type"),
        *("acceleration_register", "deceleration_register", "max_speed_deg_s", "min_deg", "max_deg"),
    )
)


def plan_from(
    configuration: Configuration, target: "TargetLike", time: float, counts: tuple[float, float]
) -> PlanAnswer:
    """Plan a slew from given counts with the configured law of motion; nothing is contacted.

    Raises
    ------
    TargetError, Unreachable
        It is no target; it cannot be reached.
    ConfigurationError
        The site of a real telescope is left to its unit, which is not asked.
    """
    planner, around, left = without_a_drive(configuration, time)
    plan = planner.plan(resolve(target, planner, time), Start(time, counts), timing_of(configuration))
    defaults = [name for name in left if name.partition(".")[2] in _DECIDING]
    unasked = (f"the unit was not asked, so these are defaults: {', '.join(defaults)}",) if defaults else ()
    return plan_answer(plan, planner, (*around.notes(plan.arrival, math.asin(plan.observed[2])), *unasked))


def rates_at(configuration: Configuration, target: "TargetLike", time: float) -> Answer:
    """Tracking rates of a target; nothing is contacted.

    Raises
    ------
    TargetError, ConfigurationError
        As for `plan_from`.
    """
    planner, _, _ = without_a_drive(configuration, time)
    return rates_of(planner, resolve(target, planner, time), time)


def without_a_drive(configuration: Configuration, time: float) -> tuple[Planner, Surroundings, tuple[str, ...]]:
    """Return what plans under the present air, and the keys that nobody has given and no unit was asked for.

    Raises
    ------
    ConfigurationError
        As for `plan_from`.
    """
    left = () if configuration.simulated else configuration.left_to_the_unit()
    if "site.latitude_deg" in left or "site.longitude_deg" in left:
        text = "[site] latitude_deg and longitude_deg: give both, no unit is asked for them here"
        raise ConfigurationError(configuration.source, [text])
    planner = planner_of(configuration)
    around = surroundings_of(configuration, planner, SystemClock())
    around.open(time)
    return planner, around, left


def rates_of(planner: Planner, target: Target, time: float) -> Answer:
    """Tracking rates of a target in the first posture that the axis limits allow."""
    middle = tuple((axis.minimum + axis.maximum) / 2.0 for axis in planner.axes)
    states = [planner.track(target, time, posture, (middle[0], middle[1])) for posture in POSTURES]
    allowed = [
        state
        for state in states
        if all(axis.minimum <= angle <= axis.maximum for axis, (angle, _) in zip(planner.axes, state, strict=True))
    ]
    direction = target.observed(planner.sky.at(Instant.from_posix(time)))
    return rates_answer(target.name, time, direction, (allowed or states)[0], planner)


def resolve(given: "TargetLike", planner: Planner, time: float) -> Target:
    """Turn whatever a person gives into a target.

    Raises
    ------
    TargetError
        It is none; the text says what is wrong with it.
    """
    if isinstance(given, str):
        found = parse.target(given)
        return best(planner, time) if isinstance(found, parse.Best) else found
    if callable(getattr(given, "observed_with_rate", None)):
        return cast("Target", given)
    if hasattr(given, "icrs"):
        return Star.from_skycoord(given)
    raise TargetError(f"{given!r} is no target: give a name, a SkyCoord or a target of `pointing`")


def posix(given: "TimeLike") -> float:
    """POSIX seconds of a moment given as seconds, datetime, astropy's Time, or text.

    Raises
    ------
    InputError
        The text is no moment.
    """
    if isinstance(given, str):
        return parse.utc(given, 0.0)
    if hasattr(given, "unix"):
        return float(given.unix)
    return float(given) if isinstance(given, int | float) else given.timestamp()
