"""What a fit predicts for a place on the sky, with astropy's units."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy import units
from astropy.coordinates import SkyCoord
from astropy.units import Quantity

from pointing.errors import PointingError
from pointing.model.place import Frame, MountKind
from pointing.model.run import nearest_turn
from pointing.mount import POSTURES, Posture

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

_FRAMES: dict[str, tuple[MountKind, tuple[str, str]]] = {
    "altaz": ("altazimuth", ("az", "alt")),
    "hadec": ("equatorial", ("ha", "dec")),
}


@dataclass(frozen=True, eq=False)
class PredictedPlace:
    """Where the telescope must point for a star, and how sure that is.

    Parameters
    ----------
    axis1, axis2 : Quantity
        Mechanical angles of the telescope, degrees; NaN in the blind spot about the pole of axis 1.
    offset1, offset2 : Quantity
        Star minus telescope in axis 1 and axis 2, mechanical, arcseconds.
    sigma : Quantity
        Standard deviation of the place on the sky, √(σ_X² + σ_Y²), that the coefficients' uncertainty leaves.
    observation_sigma : Quantity
        The same of a single observation, with its own scatter.
    """

    axis1: Quantity
    axis2: Quantity
    offset1: Quantity
    offset2: Quantity
    sigma: Quantity
    observation_sigma: Quantity

    def _repr_html_(self) -> str:
        columns = [np.ravel(getattr(self, each.name).value) for each in fields(self)]
        heads = [f"{each.name}, {getattr(self, each.name).unit}" for each in fields(self)]
        rows = "".join(
            "<tr>" + "".join(f"<td>{value:.5f}</td>" for value in row) + "</tr>" for row in zip(*columns, strict=True)
        )
        return f"<table><tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>{rows}</table>"


def predict(
    fit: "Fit",
    first: Any,  # noqa: ANN401 - a quantity, or a SkyCoord
    second: Any = None,  # noqa: ANN401
    *,
    posture: Posture = "normal",
) -> PredictedPlace:
    """Predict the telescope's angles for observed places.

    Parameters
    ----------
    fit : Fit
        The fit.
    first, second : Quantity
        The mount's own coordinates: hour angle (west positive) and declination, or azimuth and elevation. Or `first`
        alone, a `SkyCoord` of the frame AltAz or HADec.
    posture : {"normal", "beyond"}
        How the telescope points there: beyond the pole or zenith, or not.

    Raises
    ------
    PointingError
        The place is of another frame, or has no unit of angle, or there is no such posture.
    """
    if posture not in POSTURES:
        raise PointingError(f"there is no posture {posture!r}: possible are {' and '.join(POSTURES)}")
    lon, lat = np.broadcast_arrays(*_coordinates(fit.model.frame, first, second))
    if posture == "beyond":
        lon, lat = fit.model.frame.beyond_the_pole(lon, lat)
    axis1, axis2 = (each.reshape(np.shape(lon)) for each in fit.model.telescope(np.ravel(lon), np.ravel(lat)))
    sigma, of_one = (fit.predicted_sigma(axis1, axis2, observation=each) for each in (False, True))
    offsets = nearest_turn(lon - axis1), nearest_turn(lat - axis2)
    return PredictedPlace(
        *(Quantity(radians, "rad").to(units.deg) for radians in (axis1, axis2)),
        *(Quantity(radians, "rad").to(units.arcsec) for radians in (*offsets, sigma, of_one)),
    )


def _coordinates(frame: Frame, first: Any, second: Any) -> tuple[Any, Any]:  # noqa: ANN401
    """The mount's own coordinates, radians."""
    if second is not None:
        try:
            return Quantity(first).to_value("rad"), Quantity(second).to_value("rad")
        except units.UnitsError as error:
            raise PointingError(f"{error}; give angles with a unit, as in 30 * u.deg") from None
    if not isinstance(first, SkyCoord) or first.frame.name not in _FRAMES:
        raise PointingError(
            "give two angles with units, or a SkyCoord of the frame AltAz or HADec; transform others to it first"
        )
    kind, names = _FRAMES[first.frame.name]
    lon, lat = (getattr(first, name).to_value("rad") for name in names)
    return (lon, lat) if kind == frame.kind else across(Frame(kind, frame.latitude), lon, lat)


def across(frame: Frame, lon: Any, lat: Any) -> tuple[Any, Any]:  # noqa: ANN401 - floats or arrays
    """Coordinates of the other kind of mount of a place: azimuth and elevation of an hour angle and declination."""
    place = frame.place(lon, lat)
    if frame.equatorial:
        return (np.pi - place.angle("A")[0]) % (2.0 * np.pi), place.angle("E")[0]
    return place.angle("H")[0], place.angle("D")[0]
