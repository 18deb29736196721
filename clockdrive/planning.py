"""Plans and rates that need no drive: targets and times as people give them, positions as they say."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, cast

from clockdrive import parse
from clockdrive.answers import AxesAnswer, PassAnswer, PlanAnswer, pass_answer, plan_answer, rates_answer
from clockdrive.assembly import instruments as instruments_of
from clockdrive.assembly import surroundings as surroundings_of
from clockdrive.best import best
from clockdrive.budgeting import budget_json, budget_of
from clockdrive.clock import SystemClock
from clockdrive.configuration import Configuration
from clockdrive.drives import kind_of
from clockdrive.errors import ConfigurationError, InputError
from clockdrive.instruments import Instruments
from clockdrive.rotating import field, hold_of, parked_rotator, rotator_rates
from clockdrive.surroundings import Surroundings
from pointing.errors import TargetError, Unreachable
from pointing.instant import Instant
from pointing.mount import POSTURES
from pointing.pass_plan import UP_S, PassPlan, is_fast, pass_plan
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.rotator import Hold
from pointing.targets import ARCSEC, Star, Target, notes_of
from pointing.vectors import Vector

if TYPE_CHECKING:
    from collections.abc import Sequence
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


def counted(configuration: Configuration) -> tuple[int, int]:
    """The lowest and the highest count at which an axis of the configured drive can stand."""
    signed = kind_of(configuration).axes(configuration)[0].units in {"microsteps", "steps"}
    return (-(2**31), 2**31 - 1) if signed else (0, 0xFFFFFF)


def plan_from(
    configuration: Configuration,
    target: "TargetLike",
    time: float,
    counts: tuple[float, float],
    *,
    instrument: str | None = None,
    drift: "Drift | None" = None,
    rotator: str | None = None,
    position_angle_deg: float | None = None,
) -> PlanAnswer | PassAnswer:
    """Plan a slew from given counts with the configured law of motion; nothing is contacted.

    Raises
    ------
    TargetError, Unreachable
        It is no target; it cannot be reached.
    ConfigurationError
        The site of a real telescope is left to its unit, which is not asked.
    Refused
        There is no such instrument; by default it is `main`, or the first.
    """
    instruments, around, left = without_a_drive(configuration, time, instrument)
    planner = instruments.planner
    resolved = drifting(resolve(target, planner, time, sources_of(configuration)), drift, time)
    hold = hold_of(planner.rotator, rotator, position_angle_deg)
    start = Start(time, counts, rotator=parked_rotator(planner))
    found = plan_or_pass(planner, resolved, start, kind_of(configuration).timing(configuration), hold)
    defaults = [name for name in left if name.partition(".")[2] in _DECIDING]
    unasked = (f"the unit was not asked, so these are defaults: {', '.join(defaults)}",) if defaults else ()
    return answered(found, time, planner, around, resolved, (*instruments.notes, *unasked))


def plan_or_pass(
    planner: Planner, target: Target, start: Start, timing: Timing, hold: Hold | None = None
) -> Plan | PassPlan:
    """Plan a slew, or the pass of a satellite that is not up yet; a rotator goes to `hold`, or what is configured.

    Raises
    ------
    Unreachable
        It cannot be reached now; a pass is planned only of what is too fast to be met at rest.
    """
    try:
        plan = planner.plan(target, start, timing)
    except Unreachable as refusal:
        up, leading = refusal.reachable, timing.leading
        if up is None or not is_fast(planner, target, up):
            raise
        ahead = pass_plan(planner, target, up, leading)
        if ahead is not None and leading is None:
            ahead = _met(planner, target, ahead, start, timing, hold)
        if ahead is None:
            raise
        return ahead
    return _turned(planner, plan, target, start, timing, hold)


def _turned(planner: Planner, plan: Plan, target: Target, start: Start, timing: Timing, hold: Hold | None) -> Plan:
    """The plan with what the rotator does, of a telescope that has one."""
    if planner.rotator is None:
        return plan
    from pointing.rotator_plan import with_rotator  # noqa: PLC0415 - only of a telescope that has one

    return with_rotator(planner, plan, target, start, timing, hold)


def _met(
    planner: Planner, target: Target, ahead: PassPlan, start: Start, timing: Timing, hold: Hold | None
) -> PassPlan | None:
    """The pass with the moment at which axes that wait for it meet it by a slew, and where the rotator waits.

    None where they cannot meet it: it is too fast for them.
    """
    one, two = (axis.gearing.counts(angle) for axis, angle in zip(planner.axes, ahead.wait, strict=True))
    begin = Start(ahead.reachable + UP_S, (one, two), rotator=start.rotator)
    try:
        axes = planner.plan(target, begin, timing)
        turns = _turned(planner, axes, target, begin, timing, hold).rotator
    except Unreachable:
        return None
    return replace(ahead, joined=axes.arrival, rotator=None if turns is None else turns.axis.angle)


def answered(
    found: Plan | PassPlan,
    time: float,
    planner: Planner,
    around: Surroundings,
    target: Target,
    notes: tuple[str, ...] = (),
    uncertainty_counts: tuple[float, float] | None = None,
) -> PlanAnswer | PassAnswer:
    """Put a plan or a pass, asked for at `time`, into words and numbers.

    `uncertainty_counts` is by how much the drive's position may be off in each axis; None where no drive was asked.
    """
    budget = budget_json(budget_of(found, planner, around, uncertainty_counts))
    if isinstance(found, Plan):
        said = notes_at(around, found.arrival, found.observed, target)
        return plan_answer(found, planner, (*said, *notes), target, budget)
    (one, _), (two, _) = found.trajectory.angles(found.joined)
    said = notes_at(around, found.joined, planner.mount.observed(one, two), target)
    return pass_answer(found, time, planner, (*said, *notes), budget)


def notes_at(around: Surroundings, time: float, observed: Vector, target: Target | None) -> tuple[str, ...]:
    """What a person should know of the clock, the air and the target at a time and an observed direction."""
    altitude = math.asin(max(-1.0, min(1.0, observed[2])))
    of_the_target = () if target is None else notes_of(target, Instant.from_posix(time))
    return *around.notes(time, altitude), *of_the_target


def rates_at(
    configuration: Configuration,
    target: "TargetLike",
    time: float,
    *,
    instrument: str | None = None,
    drift: "Drift | None" = None,
    rotator: str | None = None,
    position_angle_deg: float | None = None,
) -> AxesAnswer:
    """Tracking rates of a target; nothing is contacted.

    Raises
    ------
    TargetError, ConfigurationError, Refused
        As for `plan_from`.
    """
    planner = without_a_drive(configuration, time, instrument)[0].planner
    resolved = drifting(resolve(target, planner, time, sources_of(configuration)), drift, time)
    return rates_of(planner, resolved, time, hold_of(planner.rotator, rotator, position_angle_deg))


def without_a_drive(
    configuration: Configuration, time: float, instrument: str | None = None
) -> tuple[Instruments, Surroundings, tuple[str, ...]]:
    """Return what plans under the present air, and the keys that nobody has given and no unit was asked for.

    Raises
    ------
    ConfigurationError, Refused
        As for `plan_from`.
    """
    left = () if configuration.simulated else configuration.left_to_the_unit()
    if "site.latitude_deg" in left or "site.longitude_deg" in left:
        text = "[site] latitude_deg and longitude_deg: give both, no unit is asked for them here"
        raise ConfigurationError(configuration.source, [text])
    instruments = instruments_of(configuration, instrument)
    around = surroundings_of(configuration, instruments.planner, SystemClock())
    around.open(time)
    return instruments, around, left


def rates_of(planner: Planner, target: Target, time: float, hold: Hold | None = None) -> AxesAnswer:
    """Tracking rates of a target in the first posture that the axis limits allow, and of a rotator that holds it."""
    middle = tuple((axis.minimum + axis.maximum) / 2.0 for axis in planner.axes)
    ways = [(posture, planner.track(target, time, posture, (middle[0], middle[1]))) for posture in POSTURES]
    allowed = [
        (posture, state)
        for posture, state in ways
        if all(axis.minimum <= angle <= axis.maximum for axis, (angle, _) in zip(planner.axes, state, strict=True))
    ]
    instant = Instant.from_posix(time)
    posture, state = (allowed or ways)[0]
    direction, turning = target.observed(planner.sky.at(instant)), field(planner, target, time, posture)
    if planner.rotator is not None:
        turning |= rotator_rates(planner, planner.rotator.holding(hold), target, time, posture)
    return rates_answer(target.name, time, direction, state, planner, turning, notes_of(target, instant))


def sources_of(configuration: Configuration) -> parse.Sources:
    """Return the files from which targets come."""
    return parse.Sources(kernel=configuration.targets.kernel)


def resolve(given: "TargetLike", planner: Planner, time: float, sources: parse.Sources) -> Target:
    """Turn whatever a person gives into a target.

    Raises
    ------
    TargetError
        It is none; the text says what is wrong with it.
    """
    if isinstance(given, str):
        found = parse.target(given, sources)
        return best(planner, time) if isinstance(found, parse.Best) else found
    if callable(getattr(given, "observed_with_rate", None)):
        return cast("Target", given)
    if hasattr(given, "icrs"):
        return Star.from_skycoord(given)
    raise TargetError(f"{given!r} is no target: give a name, a SkyCoord or a target of `pointing`")


class Drift(NamedTuple):
    """Rates of one's own on the sky, arcseconds a second, and the POSIX time of no displacement, if not the start."""

    east_arcsec_s: float
    north_arcsec_s: float
    since: float | None = None


def drift_of(rate_arcsec_s: "Sequence[float] | None", rate_from: "TimeLike | None") -> Drift | None:
    """Put together rates as people give them.

    Raises
    ------
    InputError
        They are not two numbers; there is a time but no rates.
    """
    if rate_arcsec_s is None:
        if rate_from is not None:
            raise InputError("a time of rates without rates: give both, or neither")
        return None
    try:
        east, north = (float(rate) for rate in rate_arcsec_s)
    except (TypeError, ValueError):
        raise InputError(
            f"rates {rate_arcsec_s!r}: give two numbers, east and north in arcseconds a second"
        ) from None
    return Drift(east, north, None if rate_from is None else posix(rate_from))


def drifting(target: Target, drift: Drift | None, time: float) -> Target:
    """Let a target drift; its displacement is none at `time` where the drift does not say when.

    Raises
    ------
    TargetError
        The rates are impossible, or lead more than half around the sky by `time`.
    """
    if drift is None:
        return target
    from pointing.rate_offset import RateOffsetTarget  # noqa: PLC0415 - only of what drifts

    since = time if drift.since is None else drift.since
    made = RateOffsetTarget(
        target, drift.east_arcsec_s * ARCSEC, drift.north_arcsec_s * ARCSEC, Instant.from_posix(since)
    )
    drifted = math.hypot(made.east_rate, made.north_rate) * abs(time - since)
    if drifted > math.pi:
        raise TargetError(
            f"{target.name}: a drift of {math.degrees(drifted):.1f}° since {made.since.utc_iso(0)}: at most 180°; "
            "check --rate and --rate-from"
        )
    return made


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
