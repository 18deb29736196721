"""What the telescope answers, in the form that DESIGN gives to JSON: degrees, counts, UTC.

Each answer is a frozen value with its `json`; displays and notebooks show the same.
"""

# Properties with astropy's values import where they are asked: astropy takes a second to load; only its users pay.
# ruff: noqa: PLC0415

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clockdrive.figures import place, planned, tracked
from clockdrive.rotating import field, held
from clockdrive.utc import utc
from pointing.limits import Check
from pointing.next_limit import next_limit
from pointing.pass_plan import PassPlan, planned_pass
from pointing.plan import AxisState, Plan
from pointing.planner import Planner
from pointing.site import Site
from pointing.targets import Target
from pointing.time_lost import regained
from pointing.trajectory import Trajectory
from pointing.vectors import Vector, azimuth_altitude, horizon_to_equatorial, hour_angle_declination

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord
    from astropy.table import QTable
    from astropy.time import Time
    from astropy.units import Quantity

    from clockdrive.centring import Centred
    from clockdrive.instruments import Instruments
    from clockdrive.slewing import Arrival


def observed(direction: Vector, latitude: float) -> dict[str, float]:
    """An observed direction in degrees, over the horizon and over the equator."""
    azimuth, altitude = azimuth_altitude(direction)
    hour_angle, declination = hour_angle_declination(horizon_to_equatorial(direction, latitude))
    return {
        "azimuth_deg": math.degrees(azimuth),
        "altitude_deg": math.degrees(altitude),
        "hour_angle_deg": math.degrees(hour_angle),
        "declination_deg": math.degrees(declination),
    }


@dataclass(frozen=True)
class Answer:
    """Any answer: `json` holds plain values, as the command line prints them."""

    json: Mapping[str, Any]

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401 - plain values of any kind
        return self.json[name]

    def _repr_html_(self) -> str:
        return _table(self.json)


@dataclass(frozen=True)
class AxesAnswer(Answer):
    """Where both axes are on a target at a moment, and how fast they go there."""

    time: float
    direction: Vector
    state: AxisState
    site: Site

    @property
    def moment(self) -> "Time":
        """When."""
        from clockdrive.quantities import moment

        return moment(self.time)

    @property
    def observed(self) -> "SkyCoord":
        """The target as it is seen through the air then, in `AltAz`."""
        from clockdrive.quantities import observed_place

        return observed_place(self.direction, self.time, self.site)

    @property
    def angles(self) -> "Quantity":
        """Mechanical angles of axis 1 and axis 2, degrees."""
        from clockdrive.quantities import angles

        return angles([angle for angle, _ in self.state])

    @property
    def rates(self) -> "Quantity":
        """Rates of axis 1 and axis 2, arcseconds a second."""
        from clockdrive.quantities import rates

        return rates([rate for _, rate in self.state])

    @property
    def field_rotation(self) -> "Quantity":
        """How fast the sky turns in the focal plane, degrees an hour; NaN where that is not known."""
        from astropy import units

        known = self.json.get("field_rotation_deg_s")
        return ((math.nan if known is None else known) * units.deg / units.s).to(units.deg / units.hour)


@dataclass(frozen=True)
class PlanAnswer(AxesAnswer):
    """A plan: where both axes go, when they arrive, and every check that was made."""

    plan: Plan

    @property
    def eta(self) -> "Quantity":
        """Time to the arrival, latency included."""
        from astropy import units

        return self.plan.eta * units.s

    @property
    def arrival(self) -> "Time":
        """When both axes are on the target, and the rotator holds what it is to hold."""
        return self.moment

    def __str__(self) -> str:
        place = self.json["observed"]
        return (
            f"{self.plan.target}: arrival {self.json['arrival_utc']} in {self.plan.eta:.1f} s, {self.plan.posture}, "
            f"azimuth {place['azimuth_deg']:.3f}°, altitude {place['altitude_deg']:.3f}°"
        )


@dataclass(frozen=True)
class PassAnswer(AxesAnswer):
    """The pass of a satellite that is not up yet: where to wait, when both axes go along with it, what is lost.

    Angles, rates and place are those of the moment at which both axes go along with it.
    """

    ahead: PassPlan

    @property
    def ends(self) -> "Time":
        """When it is followed no further."""
        from clockdrive.quantities import moment

        return moment(self.ahead.ends)

    def way(self, step_s: float = 1.0) -> "QTable":
        """The way of both axes: time, azimuth and altitude to which they point, angle and rate of each axis."""
        from clockdrive.quantities import way_of_a_pass

        return way_of_a_pass(self.ahead, step_s)


def plan_answer(
    plan: Plan,
    planner: Planner,
    notes: Sequence[str] = (),
    target: Target | None = None,
    budget: Mapping[str, Any] | None = None,
) -> PlanAnswer:
    """Put a plan into the form of `plan --json`; of the target it tells when tracking it meets a limit.

    `budget` is how far off it may land, as `budgeting.budget_json` has it.
    """
    return PlanAnswer(
        {
            "ok": True,
            "target": plan.target,
            "start_utc": utc(plan.start),
            "arrival_utc": utc(plan.arrival),
            **({} if plan.rotator is None else {"axes_arrival_utc": utc(max(plan.landings))}),
            "eta_s": round(plan.eta, 6),
            "posture": plan.posture,
            "observed": observed(plan.observed, planner.mount.latitude),
            "axes": [planned(*each) for each in zip(planner.axes, plan.axes, strict=True)],
            "checks": [{"name": check.name, "ok": check.ok, "detail": check.detail} for check in plan.checks],
            **_turning(plan, planner, target),
            **_afterwards(plan, planner, target),
            **({} if budget is None else {"budget": budget}),
            "notes": list(notes),
        },
        plan.arrival,
        plan.observed,
        _state(plan),
        planner.sky.site,
        plan,
    )


def _state(plan: Plan) -> AxisState:
    one, two = plan.axes
    return (one.angle, one.rate), (two.angle, two.rate)


def _turning(plan: Plan, planner: Planner, target: Target | None) -> dict[str, Any]:
    """What the rotator does, and how the field lies and turns at the arrival on a target."""
    turning: dict[str, Any] = {} if target is None else field(planner, target, plan.arrival, plan.posture)
    turns = plan.rotator
    if turns is None or planner.rotator is None:
        return turning
    way = {**planned(planner.rotator.axis, turns.axis), **held(turns.hold)}
    return {
        **turning,
        "rotator": {**way, "arrival_utc": utc(turns.arrival), "next_limit": limit_answer(turns.limit)},
    }


def _afterwards(plan: Plan, planner: Planner, target: Target | None) -> dict[str, Any]:
    if target is None:
        return {}
    angles = plan.axes[0].angle, plan.axes[1].angle
    if plan.trajectory is not None:
        return {"pass": _pass(planned_pass(plan.trajectory.anew(), plan.arrival, angles), planner)}
    found = next_limit(Trajectory(planner, target, plan.posture, angles), max(plan.landings))
    if found is None:
        return {"next_limit": None}
    return {"next_limit": {**(limit_answer(found) or {}), **_lost(regained(planner, target, found[0]), found[0])}}


def _lost(again: float | None, since: float) -> dict[str, Any]:
    """When a target that met a limit can be tracked again, and what is lost by then."""
    if again is None:
        return {"regained_utc": None, "lost_s": None}
    return {"regained_utc": utc(again), "lost_s": round(again - since, 3)}


def limit_answer(found: tuple[float, Check] | None) -> dict[str, Any] | None:
    """Say when the next limit is met, and which; None when it is not within a day."""
    return None if found is None else {"name": found[1].name, "utc": utc(found[0]), "detail": found[1].detail}


def pass_answer(
    ahead: PassPlan,
    time: float,
    planner: Planner,
    notes: Sequence[str] = (),
    budget: Mapping[str, Any] | None = None,
) -> PassAnswer:
    """Put the pass of a target that is not up yet into the form of `plan --json`, as if started at `time`."""
    state = ahead.trajectory.angles(ahead.joined)
    direction = planner.mount.observed(state[0][0], state[1][0])
    return PassAnswer(
        {
            "ok": True,
            "target": ahead.target,
            "start_utc": utc(time),
            "arrival_utc": utc(ahead.joined),
            "eta_s": round(ahead.joined - time, 6),
            "posture": ahead.posture,
            "observed": observed(direction, planner.mount.latitude),
            "axes": [
                {
                    "name": axis.name,
                    "angle_deg": math.degrees(angle),
                    **place(axis, angle),
                    "rate_deg_s": math.degrees(rate),
                    **axis.words.of_rate(axis, rate),
                }
                for axis, (angle, rate) in zip(planner.axes, state, strict=True)
            ],
            "checks": [],
            "pass": _pass(ahead, planner),
            **({} if budget is None else {"budget": budget}),
            "notes": [f"not up yet: wait at the axis angles of `pass` until {utc(ahead.reachable)}", *notes],
        },
        ahead.joined,
        direction,
        state,
        planner.sky.site,
        ahead,
    )


def _pass(found: PassPlan, planner: Planner) -> dict[str, Any]:
    return {
        "reachable_utc": utc(found.reachable),
        "joined_utc": utc(found.joined),
        "ends_utc": utc(found.ends),
        "limit": None if found.limit is None else found.limit.detail,
        "posture": found.posture,
        "wait": {
            axis.name: {"angle_deg": math.degrees(angle), "counts": axis.nearest(angle)}
            for axis, angle in zip(planner.axes, found.wait, strict=True)
        },
        "lost": [
            {"begin_utc": utc(begin), "end_utc": utc(end), "seconds": round(end - begin, 3)}
            for begin, end in found.lost
        ],
        "lost_s": round(found.lost_s, 3),
        "followed_s": round(found.followed_s, 3),
    }


def arrival_answer(
    arrival: "Arrival",
    planner: Planner,
    notes: Sequence[str] = (),
    target: Target | None = None,
    warnings: Sequence[str] = (),
) -> Answer:
    """Put an arrival into the form of `goto --json`; `warnings` are what came up on the way."""
    return Answer(
        {
            **plan_answer(arrival.plan, planner, notes, target).json,
            "arrived_utc": utc(arrival.arrived),
            "arrival_error_arcsec": round(arrival.error_arcsec, 3),
            "slews": arrival.slews,
            "warnings": list(warnings),
        }
    )


def centred_answer(found: "Centred", instrument: str) -> Answer:
    """Put what an image told into the form of `centre --json`."""
    return Answer(
        {
            "ok": True,
            "target": found.target,
            "instrument": instrument,
            "exposure_utc": utc(found.exposure),
            "error": _east_north(found.error),
            "centre": _east_north(found.centre),
            "moved_arcsec": found.moved_arcsec,
            "slewed": found.slewed,
            "guide_cleared": _east_north(found.cleared) if any(found.cleared) else None,
        }
    )


def instrument_answer(instruments: "Instruments", *, moved: bool) -> Answer:
    """Put the pointing origins into the form of `instrument --json`."""
    return Answer(
        {
            "ok": True,
            "instrument": instruments.name,
            "moved": moved,
            "limits_widened_deg": math.degrees(instruments.planner.mount.origin_distance),
            "instruments": {
                name: {"x_arcsec": section.x_arcsec, "y_arcsec": section.y_arcsec}
                for name, section in instruments.sections.items()
            },
        }
    )


def _east_north(arcsec: tuple[float, float]) -> dict[str, float]:
    return {"east_arcsec": arcsec[0], "north_arcsec": arcsec[1]}


def rates_answer(
    name: str,
    time: float,
    direction: Vector,
    state: AxisState,
    planner: Planner,
    turning: Mapping[str, Any],
    notes: Sequence[str] = (),
) -> AxesAnswer:
    """Put tracking rates, and how the field turns, into the form of `rates --json`."""
    axes = [tracked(axis, angle, rate) for axis, (angle, rate) in zip(planner.axes, state, strict=True)]
    return AxesAnswer(
        {
            "ok": True,
            "target": name,
            "utc": utc(time),
            "observed": observed(direction, planner.mount.latitude),
            "axes": axes,
            **turning,
            "notes": list(notes),
        },
        time,
        direction,
        state,
        planner.sky.site,
    )


def _table(value: object) -> str:
    if isinstance(value, Mapping):
        rows = "".join(f"<tr><th>{html.escape(str(k))}</th><td>{_table(v)}</td></tr>" for k, v in value.items())
        return f"<table>{rows}</table>"
    if isinstance(value, list | tuple):
        return "".join(_table(item) for item in value) or "–"
    return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))
