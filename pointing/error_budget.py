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
from pointing.plan import AxisState

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
    counts : tuple of float or None
        By how much the position may be off in each axis; None where no drive was asked.
    """

    pressure_hpa: float
    temperature_k: float
    air: str
    clock_s: float | None
    clock: str
    counts: tuple[float, float] | None = None


def error_budget(telescope: Geometry, axes: AxisState, time: float, stated: Stated) -> ErrorBudget:
    """Budget of a telescope that is on a target at POSIX `time`; how sure the target's own place is, is not in it.

    Parameters
    ----------
    telescope : Geometry
        The telescope.
    axes : tuple
        ((angle, rate) of axis 1, (angle, rate) of axis 2), radians and radians per second: the rates say how fast the
        target goes, and so what the clock's error is worth.
    time : float
        POSIX seconds.
    stated : Stated
        What surroundings and drive say.
    """
    (angle1, rate1), (angle2, rate2) = axes
    angles = angle1, angle2
    motion = math.hypot(rate1 * math.cos(angle2), rate2)
    observed = telescope.mount.observed(*angles)
    altitude = math.asin(max(-1.0, min(1.0, observed[2])))
    sine = observed[0] * -math.cos(telescope.mount.latitude) + observed[2] * math.sin(telescope.mount.latitude)
    turning = min(motion, _SIDEREAL * math.sqrt(max(0.0, 1.0 - sine * sine)))  # of it what is the Earth's, cos δ
    earth = telescope.sky.at(Instant.from_posix(time)).earth_orientation
    return ErrorBudget(
        (
            *_of_the_model(telescope.mount.model),
            _of_the_air(telescope, altitude, stated),
            Source("clock", None if stated.clock_s is None else motion * stated.clock_s, stated.clock),
            Source("UT1", turning * earth.dut1_error, f"UT1−UTC to {earth.dut1_error:.2g} s by its table"),
            _of_whole_counts(telescope, angles),
            _of_the_drive(telescope, angles, stated.counts),
        )
    )


def _of_the_model(model: "PointingModel | None") -> Iterator[Source]:
    """What a model leaves, and how uncertain it is itself.

    A file has no correlations, without which the deviations of its terms say little about a place. Where the stars
    stood the variance of the fitted place is on average that of one component times k/n; both components of the sky
    RMS have 2n − k degrees of freedom.
    """
    if model is None:
        yield Source("pointing model", None, _NO_MODEL)
        return
    from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - takes 30 ms; only its users pay

    if not isinstance(model, ModelOnFile):
        yield Source("pointing model", None, "its terms are given without standard deviations")
        return
    k = len(model.sigmas) - model.sigmas.count(None)
    known = model.sky_rms > 0.0 and 2 * model.n > k
    own = model.sky_rms * math.sqrt(k / (2 * model.n - k)) if known else None
    text = f"{k} fitted terms, on average over the {model.n} stars" if known else "the file does not say of the fit"
    yield Source("pointing model", own, text)
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


def _of_whole_counts(telescope: Geometry, angles: tuple[float, float]) -> Source:
    one, two = (0.0 if axis.units == "degrees" else _ROUNDING for axis in telescope.axes)
    assumption = "targets are whole counts" if one or two else "the drive goes to any angle"
    return Source("counts", _on_sky(telescope, angles, (one, two)), assumption)


def _of_the_drive(telescope: Geometry, angles: tuple[float, float], counts: tuple[float, float] | None) -> Source:
    if counts is None:
        return Source("drive", None, "it was not asked")
    return Source("drive", _on_sky(telescope, angles, counts), "uncertainty of its position")


def _on_sky(telescope: Geometry, angles: tuple[float, float], counts: tuple[float, float]) -> float:
    one, two = (each / abs(axis.gearing.counts_per_radian) for each, axis in zip(counts, telescope.axes, strict=True))
    return math.hypot(one * math.cos(angles[1]), two)
