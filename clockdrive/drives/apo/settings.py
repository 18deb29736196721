"""What a configuration means for axis controllers: gearing, travel, limits of motion."""

import math
from fractions import Fraction
from typing import Literal, cast

from clockdrive.configuration import Configuration
from clockdrive.drives import configured
from mounts.apo.controller import AXIS_WORDS
from mounts.apo.settings import ApoSettings, AxisSettings
from pointing.gearing import Gearing

NAMES = ("azimuth", "altitude", "rotator")
_SECTIONS = ("axis1", "axis2", "rotator")
_DEGREE = Fraction(1)
_ATTEMPTS = 4  # answers waited for before a command is given up


def sections(configuration: Configuration) -> tuple[str, ...]:
    """The sections of the axes that this telescope has."""
    return _SECTIONS[:2] if configuration.rotator is None else _SECTIONS


def gearing(configuration: Configuration, section: str) -> Gearing:
    """How the controller's degrees become the axis's: ±(angle − centre)."""
    return Gearing(
        _DEGREE,
        0,
        number(configuration, f"{section}.centre_deg"),
        reversed=bool(configuration.values[f"{section}.reversed"]),
    )


def settings(configuration: Configuration) -> ApoSettings:
    """What the driver must know."""
    values = configuration.values
    return ApoSettings(
        kind=cast('Literal["apo", "sdss"]', configuration.drive.kind),
        axes=tuple(
            _axis(configuration, section, name, word)
            for section, name, word in zip(sections(configuration), NAMES, AXIS_WORDS, strict=False)
        ),
        on_expiry=cast('Literal["halt", "extrapolate"]', values["drive.on_expiry"]),
        max_nodes=int(number(configuration, "drive.max_nodes")),
        stows=bool(values["drive.stow"]),
        together=values["drive.landing"] == "together",
        meaning=_meaning(configuration),
        call_s=call_s(configuration),
    )


def call_s(configuration: Configuration) -> float:
    """Seconds that a call to a controller may take, with repeating it; the time of the line apart."""
    return _ATTEMPTS * number(configuration, "drive.timeout_s")


def travel(configuration: Configuration, section: str) -> tuple[float, float]:
    """Lowest and highest angle of an axis, radians."""
    return math.radians(number(configuration, f"{section}.min_deg")), math.radians(
        number(configuration, f"{section}.max_deg")
    )


def park_degrees(configuration: Configuration) -> tuple[float, ...]:
    """Where the controllers' positions are when parked."""
    return tuple(
        gearing(configuration, section).counts(math.radians(number(configuration, f"{section}.park_deg")))
        for section in sections(configuration)
    )


def number(configuration: Configuration, dotted: str) -> float:
    """The value of a key that is a number."""
    return float(cast("float", configuration.values[dotted]))


def _axis(configuration: Configuration, section: str, name: str, word: str) -> AxisSettings:
    gear = gearing(configuration, section)
    low, high = sorted(gear.counts(angle) for angle in travel(configuration, section))
    return AxisSettings(
        name,
        word,
        low,
        high,
        number(configuration, f"{section}.max_speed_deg_s"),
        number(configuration, f"{section}.acceleration_deg_s2"),
        number(configuration, f"{section}.jerk_deg_s3"),
    )


def _meaning(configuration: Configuration) -> str:
    """What must not change between a sync and the next goto."""
    gears = (gearing(configuration, section) for section in sections(configuration))
    return configured.meaning(configuration, (f"{gear.centre_deg!r} {gear.reversed}" for gear in gears))
