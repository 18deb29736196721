"""Stars and readings that do not belong together: what a small model leaves is as wide as the run itself.

A telescope's errors are degrees at most, and zero points and a small model take them up. Where a small model leaves
more than a degree, of most stars, and hardly less than zero points alone, the numbers are not those of one telescope.
A table of mistakes is then tried; the one with which the residuals collapse is named. Two of them leave less than a
degree of a good telescope: they are spoken of where they explain what a small model does not.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pointing.model.finding import Finding
from pointing.model.first_order import fit_first_order
from pointing.model.place import MountKind
from pointing.model.possible import LARGEST_RMS
from pointing.model.run import Array, PointingRun

_NOT_LESS = 0.5  # of what zero points alone leave
_COLLAPSE = 10.0
_NOTICED = math.radians(1.0 / 60.0)  # below which a small model explains the run
_LEAST_STARS = 8  # with which a collapse is no chance
_HOURS = 15.0
_QUARTER = math.pi / 2.0

Mend = Callable[[PointingRun], dict[str, Array]]


@dataclass(frozen=True)
class MixUp:
    """A mistake: its name, the mounts on which it is made, what it is with its remedy, and the run without it."""

    name: str
    mounts: tuple[MountKind, ...]
    text: str
    mend: Mend


def _shifted(by: int) -> Mend:
    return lambda run: {"star1": np.roll(run.star1, by), "star2": np.roll(run.star2, by)}


_BOTH: tuple[MountKind, ...] = ("equatorial", "altazimuth")
MIX_UPS = (
    MixUp("shifted-stars", _BOTH, "each star stands with the reading before its own: shift the star's columns down",
          _shifted(1)),
    MixUp("shifted-stars", _BOTH, "each star stands with the reading after its own: shift the star's columns up",
          _shifted(-1)),
    MixUp("hours", ("equatorial",), "the star's and the axis's hour angles are hours read as degrees: multiply by 15",
          lambda run: {"star1": run.star1 * _HOURS, "axis1": run.axis1 * _HOURS}),
    MixUp("hours", ("equatorial",), "the star's hour angles are hours read as degrees: multiply by 15",
          lambda run: {"star1": run.star1 * _HOURS}),
    MixUp("hours", ("equatorial",), "the axis's hour angles are hours read as degrees: multiply by 15",
          lambda run: {"axis1": run.axis1 * _HOURS}),
    MixUp("zenith-distance", ("altazimuth",), "the elevations are zenith distances: take them from 90°",
          lambda run: {"star2": _QUARTER - run.star2, "axis2": _QUARTER - run.axis2}),
    MixUp("zenith-distance", ("altazimuth",), "the star's elevations are zenith distances: take them from 90°",
          lambda run: {"star2": _QUARTER - run.star2}),
    MixUp("zenith-distance", ("altazimuth",), "the telescope's elevations are zenith distances: take them from 90°",
          lambda run: {"axis2": _QUARTER - run.axis2}),
)  # fmt: skip


def mixed_up(run: PointingRun) -> Iterator[Finding]:
    """Stars with the readings of others, hours, zenith distances: what is left collapses without the mistake."""
    left = _left(run)
    if left <= _NOTICED:
        return
    mended = [(each, fit_first_order(_mended(run, each)).rms) for each in MIX_UPS if run.mount in each.mounts]
    each, rms = min(mended, key=lambda pair: pair[1])
    if rms * _COLLAPSE < left:
        yield Finding(
            each.name, "refuse" if left > LARGEST_RMS else "warn",
            f"a small model leaves {_degrees(left)} of {len(run)} stars, and {_degrees(rms)} without this mistake: "
            f"{each.text}",
        )  # fmt: skip


def no_telescope(run: PointingRun) -> Iterator[Finding]:
    """Readings of which a small model explains hardly more than zero points alone, most of them degrees off."""
    left = _left(run)
    if left > LARGEST_RMS and _of_no_telescope(run, left):
        yield Finding(
            "no-telescope", "refuse",
            f"a small model leaves {_degrees(left)} of {len(run)} stars, possible is {_degrees(LARGEST_RMS)}, and "
            "hardly less than zero points alone: stars and readings do not belong together; see that each star "
            "stands with its own reading, in the right columns and units",
        )  # fmt: skip


def _left(run: PointingRun) -> float:
    """What a small model leaves, radians on the sky; 0 of too few stars to judge."""
    return fit_first_order(run).rms if len(run) >= _LEAST_STARS else 0.0


def _of_no_telescope(run: PointingRun, left: float) -> bool:
    """Whether zero points alone leave hardly more, of most stars: a few stars far off are no mix-up of the run."""
    first, second = run.offsets()
    across = (first - np.median(first)) * np.cos(run.star2)
    distance = np.hypot(across, second - np.median(second))
    spread = math.sqrt(float(np.mean(distance**2)))
    return left > _NOT_LESS * spread and float(np.median(distance)) > LARGEST_RMS


def _mended(run: PointingRun, mix_up: MixUp) -> PointingRun:
    return replace(run, **mix_up.mend(run))  # type: ignore[arg-type] # all of them are arrays


def _degrees(angle: float) -> str:
    arcsec = math.degrees(angle) * 3600.0
    return f"{arcsec / 3600.0:.3g}°" if arcsec >= 3600.0 else f"{arcsec:.0f}″"
