"""How sure a fitted model is of its places, over the sky."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from astropy import units
from astropy.table import QTable
from astropy.units import Quantity
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.place import Frame
from pointing.model.predicted_place import across

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

Array = NDArray[np.float64]

_SHOWN = 6  # rows and columns of the notebook's table, about


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Standard deviation of the predicted place, √(σ_X² + σ_Y²), on a grid over the horizon.

    Parameters
    ----------
    azimuth : Quantity, (m,)
        North through east.
    elevation : Quantity, (n,)
        Rising.
    sigma : Quantity, (n, m)
        Arcseconds; NaN in the blind spot about the pole of axis 1.
    """

    azimuth: Quantity
    elevation: Quantity
    sigma: Quantity

    @property
    def median(self) -> Quantity:
        """Of all places, each counted with the sky it stands for."""
        known = np.isfinite(self.sigma.value)
        values = self.sigma.value[known]
        area = np.broadcast_to(np.cos(self.elevation.to_value("rad"))[:, None], self.sigma.shape)[known]
        order = np.argsort(values)
        share = np.cumsum(area[order]) / area.sum()
        return values[order][np.searchsorted(share, 0.5)] * self.sigma.unit

    @property
    def worst(self) -> tuple[Quantity, Quantity, Quantity]:
        """(σ, azimuth, elevation) where it is greatest."""
        i, j = np.unravel_index(np.nanargmax(self.sigma.value), self.sigma.shape)
        return self.sigma[i, j], self.azimuth[j], self.elevation[i]

    def to_table(self) -> QTable:
        """Return one row a place: azimuth, elevation, sigma."""
        azimuth, elevation = np.meshgrid(self.azimuth, self.elevation)
        return QTable(
            [azimuth.ravel(), elevation.ravel(), self.sigma.ravel()], names=["azimuth", "elevation", "sigma"]
        )

    def __repr__(self) -> str:
        sigma, azimuth, elevation = self.worst
        return (
            f"ErrorMap(median {self.median.to_value('arcsec'):.2f}″, worst {sigma.to_value('arcsec'):.2f}″ at "
            f"azimuth {azimuth.to_value('deg'):.0f}°, elevation {elevation.to_value('deg'):.0f}°)"
        )

    def _repr_html_(self) -> str:
        rows = np.unique(np.linspace(0, len(self.elevation) - 1, _SHOWN).astype(int))[::-1]
        columns = np.unique(np.linspace(0, len(self.azimuth) - 1, _SHOWN + 1).astype(int))
        head = "".join(f"<th>A {self.azimuth[j].to_value('deg'):.0f}°</th>" for j in columns)
        body = "".join(
            f"<tr><th>E {self.elevation[i].to_value('deg'):.0f}°</th>"
            + "".join(f"<td>{self.sigma[i, j].to_value('arcsec'):.2f}</td>" for j in columns)
            + "</tr>"
            for i in rows
        )
        return f"<table><caption>{self!r}, σ in ″</caption><tr><th></th>{head}</tr>{body}</table>"


def error_map(fit: "Fit", step_deg: float = 5.0, lowest_deg: float = 15.0) -> ErrorMap:
    """Return the map of a fit.

    Parameters
    ----------
    fit : Fit
        The fit. Where its run has both sides of a pier, the west is seen in normal posture, the east beyond.
    step_deg : float
        Of the grid.
    lowest_deg : float
        Elevation at which it begins.

    Raises
    ------
    PointingError
        Step or elevation are impossible.
    """
    if not 0.1 <= step_deg <= 45.0:
        raise PointingError(f"a step of {step_deg:g}°: possible are 0.1° to 45°")
    if not 0.0 <= lowest_deg < 90.0:
        raise PointingError(f"a lowest elevation of {lowest_deg:g}°: possible are 0° up to 90°")
    azimuth = np.arange(0.0, 360.0 + 1e-9, step_deg)
    elevation = np.linspace(lowest_deg, 90.0, math.ceil((90.0 - lowest_deg) / step_deg) + 1)
    sigma = np.degrees(_sigma(fit, *np.meshgrid(np.radians(azimuth), np.radians(elevation)))) * 3600.0
    return ErrorMap(azimuth * units.deg, elevation * units.deg, sigma * units.arcsec)


def _sigma(fit: "Fit", azimuth: Array, elevation: Array) -> Array:
    """σ at observed directions, radians."""
    frame = fit.model.frame
    lon, lat = azimuth, elevation
    if frame.equatorial:
        lon, lat = across(Frame("altazimuth", frame.latitude), azimuth, elevation)
        if fit.run.beyond.any():
            east = np.sin(lon) < 0.0
            lon, lat = (
                np.where(east, other, own)
                for own, other in zip((lon, lat), frame.beyond_the_pole(lon, lat), strict=True)
            )
    return np.asarray(fit.predicted_sigma(*fit.model.telescope(lon, lat)))
