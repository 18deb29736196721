"""What the telescope answers, in the form that DESIGN gives to JSON: degrees, counts, UTC.

Each answer is a frozen value with its `json`; displays and notebooks show the same.
"""

import html
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from mounts.tc410.registers import COUNTS_PER_SECOND
from pointing.plan import AxisPlan, AxisState, Plan
from pointing.planner import Planner
from pointing.vectors import Vector, azimuth_altitude, horizon_to_equatorial, hour_angle_declination

if TYPE_CHECKING:
    from astropy.time import Time
    from astropy.units import Quantity

    from clockdrive.centring import Centred
    from clockdrive.instruments import Instruments
    from clockdrive.slewing import Arrival


def utc(time: float) -> str:
    """POSIX seconds as UTC, to the millisecond."""
    moment = datetime.fromtimestamp(round(time, 3), UTC)
    return moment.strftime("%Y-%m-%dT%H:%M:%S.") + f"{moment.microsecond // 1000:03d}Z"


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


def refusal(reason: str, reachable: float | None = None) -> dict[str, Any]:
    """Why something was not done, and when it can be."""
    answer: dict[str, Any] = {"ok": False, "reason": reason}
    return answer if reachable is None else {**answer, "reachable_utc": utc(reachable)}


@dataclass(frozen=True)
class Answer:
    """Any answer: `json` holds plain values, as the command line prints them."""

    json: Mapping[str, Any]

    def __getitem__(self, name: str) -> Any:  # noqa: ANN401 - plain values of any kind
        return self.json[name]

    def _repr_html_(self) -> str:
        return _table(self.json)


@dataclass(frozen=True)
class PlanAnswer(Answer):
    """A plan: where both axes go, when they arrive, and every check that was made."""

    plan: Plan

    @property
    def eta(self) -> "Quantity":
        """Time to the arrival, latency included."""
        from astropy import units  # noqa: PLC0415 - takes 0.8 s; only its users pay

        return self.plan.eta * units.s

    @property
    def arrival(self) -> "Time":
        """When both axes are on the target."""
        from astropy.time import Time  # noqa: PLC0415 - likewise

        return Time(self.plan.arrival, format="unix")

    def __str__(self) -> str:
        place = self.json["observed"]
        return (
            f"{self.plan.target}: arrival {self.json['arrival_utc']} in {self.plan.eta:.1f} s, {self.plan.posture}, "
            f"azimuth {place['azimuth_deg']:.3f}°, altitude {place['altitude_deg']:.3f}°"
        )


def plan_answer(plan: Plan, planner: Planner, notes: Sequence[str] = ()) -> PlanAnswer:
    """Put a plan into the form of `plan --json`."""
    return PlanAnswer(
        {
            "ok": True,
            "target": plan.target,
            "start_utc": utc(plan.start),
            "arrival_utc": utc(plan.arrival),
            "eta_s": round(plan.eta, 6),
            "posture": plan.posture,
            "observed": observed(plan.observed, planner.mount.latitude),
            "axes": [_axis(axis) for axis in plan.axes],
            "checks": [{"name": check.name, "ok": check.ok, "detail": check.detail} for check in plan.checks],
            "notes": list(notes),
        },
        plan,
    )


def arrival_answer(arrival: "Arrival", planner: Planner, notes: Sequence[str] = ()) -> Answer:
    """Put an arrival into the form of `goto --json`."""
    return Answer(
        {
            **plan_answer(arrival.plan, planner, notes).json,
            "arrived_utc": utc(arrival.arrived),
            "arrival_error_arcsec": round(arrival.error_arcsec, 3),
            "slews": arrival.slews,
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


def rates_answer(name: str, time: float, direction: Vector, state: AxisState, planner: Planner) -> Answer:
    """Put tracking rates into the form of `rates --json`."""
    axes = []
    for axis, (angle, rate) in zip(planner.axes, state, strict=True):
        counts_s = rate * axis.gearing.counts_per_radian
        axes.append(
            {
                "name": axis.name,
                "angle_deg": math.degrees(angle),
                "rate_deg_s": math.degrees(rate),
                "rate_counts_s": counts_s,
                "velocity_register": velocity_register(counts_s),
            }
        )
    return Answer(
        {
            "ok": True,
            "target": name,
            "utc": utc(time),
            "observed": observed(direction, planner.mount.latitude),
            "axes": axes,
        }
    )


def velocity_register(counts_s: float) -> int:
    """The TC410's velocity register nearest to a rate."""
    return round(counts_s / COUNTS_PER_SECOND)


def _axis(axis: AxisPlan) -> dict[str, Any]:
    return {
        "name": axis.name,
        "angle_deg": math.degrees(axis.angle),
        "from_counts": round(axis.from_counts),
        "target_counts": axis.target_counts,
        "travel_s": axis.travel.duration,
        "rate_deg_s": math.degrees(axis.rate),
        "velocity_register": velocity_register(axis.rate_counts),
    }


def _table(value: object) -> str:
    if isinstance(value, Mapping):
        rows = "".join(f"<tr><th>{html.escape(str(k))}</th><td>{_table(v)}</td></tr>" for k, v in value.items())
        return f"<table>{rows}</table>"
    if isinstance(value, list | tuple):
        return "".join(_table(item) for item in value) or "–"
    return html.escape(f"{value:.6g}" if isinstance(value, float) else str(value))
