"""The instrument rotator in the application: made from a configuration, told what to hold, and how the field lies."""

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from clockdrive.configuration import Configuration
from clockdrive.errors import ArgumentError, Refused, finite
from clockdrive.figures import tracked
from pointing.errors import PointingError
from pointing.field_rotation import SkyAt, turned
from pointing.gearing import Gearing
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.mount import Posture
from pointing.plan import Axis
from pointing.rotator import MODES, Held, Hold, Rotator, field_rotation
from pointing.targets import Target

if TYPE_CHECKING:
    from mounts.drive import Reading

OPTIONS = ("rotator", "position_angle_deg")
"""What a call takes to say what the rotator is to hold."""


def rotator_of(configuration: Configuration) -> Rotator | None:
    """The rotator of a configuration, to hold what that says; None where there is none."""
    section = configuration.rotator
    if section is None:
        return None
    gearing = Gearing(Fraction(1), 0, section.centre_deg, section.reversed)
    low, high, park, angle = map(
        math.radians, (section.min_deg, section.max_deg, section.park_deg, section.position_angle_deg)
    )
    return Rotator(Axis("rotator", gearing, low, high, units="degrees"), Hold(section.mode, angle), park)


def hold_of(rotator: Rotator | None, mode: str | None, angle_deg: float | None) -> Hold | None:
    """What a person asks the rotator to hold; what is not said is as configured, and None where nothing is.

    Raises
    ------
    Refused
        There is no rotator.
    ArgumentError
        There is no such mode; the angle is none.
    """
    if mode is None and angle_deg is None:
        return None
    if rotator is None:
        raise Refused("this telescope has no rotator: a table [rotator] in its configuration says that there is one")
    if mode is not None and mode not in MODES:
        raise ArgumentError(f"a rotator that holds {mode!r}: use one of {', '.join(MODES)}")
    configured = rotator.hold
    kept = configured.angle if mode in {None, configured.mode} else 0.0
    angle = kept if angle_deg is None else math.radians(finite("a position angle of", angle_deg, "degrees"))
    try:
        return Hold(mode or configured.mode, angle)
    except PointingError as error:
        raise ArgumentError(str(error)) from error


def held(hold: Hold) -> dict[str, Any]:
    """What a rotator holds, as answers say it."""
    return {"mode": hold.mode, "held_deg": round(math.degrees(hold.angle), 9)}


def field(geometry: Geometry, target: Target, time: float, posture: Posture) -> dict[str, float | None]:
    """How the field lies and turns: the parallactic angle, and the rate of the sky in the focal plane.

    Both are None at a celestial pole, where there is no north.
    """
    frame = geometry.sky.at(Instant.from_posix(time))
    try:
        parallactic = SkyAt(frame, target.observed(frame)).parallactic_angle
        _, rate = field_rotation(geometry, target, time, posture)
    except PointingError:
        return {"parallactic_angle_deg": None, "field_rotation_deg_s": None}
    return {"parallactic_angle_deg": math.degrees(parallactic), "field_rotation_deg_s": math.degrees(rate)}


def parked_rotator(geometry: Geometry) -> tuple[float, float] | None:
    """Counts and rate of a rotator that is where it is parked, for a plan that asks no drive."""
    rotator = geometry.rotator
    return None if rotator is None else (rotator.axis.gearing.counts(rotator.park), 0.0)


def rotator_rates(
    geometry: Geometry, rotator: Rotator, target: Target, time: float, posture: Posture
) -> dict[str, Any]:
    """The angle and rate at which a rotator holds what it is to hold, wound nearest to the middle of its travel.

    Raises
    ------
    PointingError
        There is no north, or no way up, at the target.
    """
    middle = (rotator.axis.minimum + rotator.axis.maximum) / 2.0
    angle, rate = Held(geometry, target, posture, rotator.hold).state(time, middle)
    return {"rotator": {**tracked(rotator.axis, angle, rate), **held(rotator.hold)}}


def instrument_angles(geometry: Geometry, angles: tuple[float, float], rotator: float, time: float) -> dict[str, Any]:
    """How an instrument at a rotator angle, radians, lies on the sky where the axes point: degrees."""
    direction, up = geometry.mount.observed(*angles), geometry.mount.up(*angles)
    lies = turned(up, direction, rotator)
    try:
        around = SkyAt(geometry.sky.at(Instant.from_posix(time)), direction)
    except PointingError:
        return {"position_angle_deg": None}
    return {"position_angle_deg": math.degrees(around.position_angle(lies))}


def rotator_status(
    geometry: Geometry,
    rotator: Rotator,
    reading: "Reading",
    angles: tuple[float, float],
    hold: Hold | None,
    *,
    turns: bool = False,
) -> Mapping[str, Any]:
    """The rotator as it was read; `hold` is what it holds while a target is followed, once it no longer `turns`."""
    read = reading.axes[2]
    angle = rotator.axis.gearing.angle(read.counts)
    return {
        "name": rotator.axis.name,
        "angle_deg": math.degrees(angle),
        "counts": read.counts,
        "units": rotator.axis.units,
        "uncertainty_counts": read.uncertainty_counts,
        "rate_deg_s": math.degrees(read.rate / rotator.axis.gearing.counts_per_radian),
        "slewing": read.slewing or turns,
        **({"mode": None, "held_deg": None} if hold is None else held(hold)),
        **instrument_angles(geometry, angles, angle, reading.time),
    }
