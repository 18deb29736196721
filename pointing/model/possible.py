"""Whether a pointing model can be that of a telescope: how far it displaces the star from where the axes read.

Index errors are not counted: where an axis has its zero is a choice. All else is an error of the making or mounting,
of which ten degrees is beyond any telescope. A cone about the pole of axis 1 that cannot be reached is as wide as
the displacement there, so the same bound holds for such a blind spot. A fit must leave less than a degree, too: real
runs leave 3″ to 230″.
"""

import math
from typing import TYPE_CHECKING

import erfa
import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.pointing_model import PointingModel

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

Array = NDArray[np.float64]

INDEX_TERMS = frozenset({"IH", "ID", "IA", "IE"})
LARGEST = math.radians(10.0)  # displacement on the sky
LARGEST_RMS = math.radians(1.0)  # that a fit leaves on the sky
LARGEST_INDEX = math.radians(45.0)  # as of any coefficient
_LOWEST_DEG, _STEP_DEG = 5.0, 5.0  # elevations that are looked at


def refuse_nonsense(fit: "Fit") -> None:
    """Refuse a fit that is none of a telescope, of which no advice follows.

    Raises
    ------
    PointingError
        It leaves more than `LARGEST_RMS`, or its model is impossible.
    """
    left_deg, bound_deg = fit.sky_rms_arcsec / 3600.0, math.degrees(LARGEST_RMS)
    if left_deg > bound_deg:
        raise PointingError(
            f"the fit leaves {left_deg:.3g}° on the sky, possible is up to {bound_deg:g}°: stars and readings do not "
            "belong together, or some stars are far off; see what diagnose(run) says, and fit with outliers=True"
        )
    refuse_impossible(fit.model)


def refuse_impossible(model: PointingModel) -> None:
    """Refuse a model that displaces by more than `LARGEST` anywhere 5° above the horizon, index errors apart.

    Raises
    ------
    PointingError
        Names the term that displaces most, how far the model displaces, and where.
    """
    at = _places(model)
    off, where = _farthest(model, at)
    if off <= LARGEST:
        return
    single = [(_farthest(_only(model, [name]), at)[0], name) for name in model.arcsec if name not in INDEX_TERMS]
    _, blamed = max(single)
    elevation, azimuth = math.degrees(at[1][where]), math.degrees(at[0][where])
    raise PointingError(
        f"the model displaces by {math.degrees(off):.3g}° at azimuth {azimuth:.0f}°, elevation {elevation:.0f}°, and "
        f"keeps as much about it out of reach; possible is up to {math.degrees(LARGEST):.0f}°, index errors apart: "
        f"most is of {blamed}, {model.arcsec[blamed]:+.6g}″; coefficients are arcseconds"
    )


def _farthest(model: PointingModel, at: tuple[Array, Array]) -> tuple[float, int]:
    """The largest displacement on the sky, radians, and at which of the places (azimuth, elevation)."""
    bare = _only(model, [name for name in model.arcsec if name not in INDEX_TERMS])
    lon, lat = at
    if model.kind == "equatorial":
        lon, lat = erfa.ae2hd(*at, model.latitude)
    lon2, lat2 = bare.star(lon, lat)
    off = np.nan_to_num(erfa.seps(lon, lat, lon2, lat2), nan=math.pi)
    where = int(np.argmax(off))
    return float(off[where]), where


def _only(model: PointingModel, names: list[str]) -> PointingModel:
    pairs = [pair for pair in zip(model.terms, model.coefficients, strict=True) if pair[0].name in names]
    terms, coefficients = zip(*pairs, strict=True) if pairs else ((), ())
    return PointingModel(model.kind, model.latitude, terms, coefficients)


def _places(model: PointingModel) -> tuple[Array, Array]:
    """Azimuth and elevation of places all over the sky; the pole of an equatorial mount's axis 1 among them."""
    elevations = np.arange(_LOWEST_DEG, 90.0 + _STEP_DEG / 2.0, _STEP_DEG)
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0.0, 360.0, 2.0 * _STEP_DEG)), np.radians(elevations))
    pole = [0.0 if model.latitude >= 0.0 else math.pi], [max(abs(model.latitude), math.radians(_LOWEST_DEG))]
    return np.concatenate((azimuth.ravel(), pole[0])), np.concatenate((elevation.ravel(), pole[1]))
