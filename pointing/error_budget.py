"""How far off a plan may land, source by source: each a standard deviation on the sky, added as squares.

A source that nobody knows stays in the list without a number; the total is then at least what it says. Nothing is
measured here: a budget tells what is stated, by the pointing model's fit, the air, the clock, the Earth, the drive.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pointing.geometry import Geometry
from pointing.instant import Instant

if TYPE_CHECKING:
    from pointing.model.pointing_model import PointingModel

_SIDEREAL = math.tau / 86164.0905  # rad/s
_ROUNDING = 1.0 / math.sqrt(12.0)  # of a count: the standard deviation of what is rounded
_KELVIN = 273.15
_NO_MODEL = "there is none: misalignment, collimation, flexure and the gears' periodic error are not known"


@dataclass(frozen=True)
class Source:
    """One source of error.

    Parameters
    ----------
    name : str
        What it is.
    error : float or None
        Standard deviation on the sky, radians; None where nobody knows.
    assumption : str
        What that rests on.
    """

    name: str
    error: float | None
    assumption: str


@dataclass(frozen=True)
class ErrorBudget:
    """All sources of one plan."""

    sources: tuple[Source, ...]

    @property
    def total(self) -> float:
        """Root of the sum of squares of all that is known, radians."""
        return math.hypot(*(each.error for each in self.sources if each.error is not None))

    @property
    def unknown(self) -> tuple[str, ...]:
        """Names of the sources that have no number."""
        return tuple(each.name for each in self.sources if each.error is None)


@dataclass(frozen=True)
class Stated:
    """What the telescope's surroundings and drive say of their own errors.

    Parameters
    ----------
    pressure_hpa, temperature_k : float
        Standard deviations of the air.
    air : str
        Where those are from.
    clock_s : float or None
        Of the computer's clock.
    clock : str
        Who says so.
    counts : tuple of float
        By how much the position may be off in each axis.
    """

    pressure_hpa: float
    temperature_k: float
    air: str
    clock_s: float | None
    clock: str
    counts: tuple[float, float] = (0.0, 0.0)


def error_budget(telescope: Geometry, angles: tuple[float, float], time: float, stated: Stated) -> ErrorBudget:
    """Budget of a telescope that stands at axis angles, radians, at POSIX `time`."""
    observed = telescope.mount.observed(*angles)
    altitude = math.asin(max(-1.0, min(1.0, observed[2])))
    sine = observed[0] * -math.cos(telescope.mount.latitude) + observed[2] * math.sin(telescope.mount.latitude)
    diurnal = _SIDEREAL * math.sqrt(max(0.0, 1.0 - sine * sine))  # sky motion of the place, cos δ of it
    earth = telescope.sky.at(Instant.from_posix(time)).earth_orientation
    return ErrorBudget(
        (
            *_of_the_model(telescope.mount.model, angles),
            _of_the_air(telescope, altitude, stated),
            Source("clock", None if stated.clock_s is None else diurnal * stated.clock_s, stated.clock),
            Source("UT1", diurnal * earth.dut1_error, f"UT1−UTC to {earth.dut1_error:.2g} s by its table"),
            Source("counts", _on_sky(telescope, angles, (_ROUNDING, _ROUNDING)), "targets are whole counts"),
            Source("drive", _on_sky(telescope, angles, stated.counts), "uncertainty of its position"),
        )
    )


def _of_the_model(model: "PointingModel | None", angles: tuple[float, float]) -> Iterator[Source]:
    if model is None:
        yield Source("pointing model", None, _NO_MODEL)
        return
    from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - takes 30 ms; only its users pay

    if not isinstance(model, ModelOnFile):
        yield Source("pointing model", None, "its terms are given without standard deviations")
        return
    _, _, jacobian = model.star_and_jacobian(*angles)
    moved = [
        math.hypot(*by) * sigma
        for by, sigma in zip(jacobian.by_coefficient, model.sigmas, strict=True)
        if sigma is not None
    ]
    known = len(moved) == len(model.terms)
    text = "standard deviations of its terms, as if uncorrelated"
    yield Source("pointing model", math.hypot(*moved) if known else None, text if known else "not all terms have one")
    left = f"what its {model.n} stars were off, periodic error in it" if model.sky_rms else "the file does not say"
    yield Source("what the model leaves", model.sky_rms or None, left)


def _of_the_air(telescope: Geometry, altitude: float, stated: Stated) -> Source:
    """Refraction goes with pressure over absolute temperature, to a per cent."""
    air = telescope.sky.site.weather
    if not air.refraction:
        return Source("refraction", 0.0, "switched off")
    share = math.hypot(
        stated.pressure_hpa / max(air.pressure_hpa, 1.0), stated.temperature_k / (air.temperature_c + _KELVIN)
    )
    return Source("refraction", telescope.sky.refraction(altitude) * share, stated.air)


def _on_sky(telescope: Geometry, angles: tuple[float, float], counts: tuple[float, float]) -> float:
    one, two = (each / abs(axis.gearing.counts_per_radian) for each, axis in zip(counts, telescope.axes, strict=True))
    return math.hypot(one * math.cos(angles[1]), two)
