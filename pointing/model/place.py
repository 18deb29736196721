"""A place in a mount's frame: its two coordinates, and the angles that functions of pointing-model terms are made of.

The mount's own coordinates are `lon` and `lat`: hour angle (west positive) and declination of an equatorial mount,
azimuth (north through east) and elevation of an altazimuth mount. They are mechanical: |lat| > 90° is beyond the pole
or zenith, where cos lat is negative and the direction is nevertheless (lat, lon) put into the same formulas.

The *other pole* is the zenith of an equatorial mount, the north celestial pole of an altazimuth one; in both it
stands at lon 0, lat φ. One spherical triangle thus serves both: ζ the distance from the other pole, α the angle there
(azimuth of an equatorial mount, hour angle of an altazimuth one) and the parallactic angle q at the place.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from pointing.model.functions import Real, functions_of, once

MountKind = Literal["equatorial", "altazimuth"]
KINDS: tuple[MountKind, ...] = get_args(MountKind)
Angle = tuple[Real, Real, Real]  # value, ∂/∂lon, ∂/∂lat

_TINY = 1e-15  # keeps a gradient finite at a pole, where it has no meaning


@dataclass(frozen=True)
class Frame:
    """In which the places of one mount stand.

    Parameters
    ----------
    kind : {"equatorial", "altazimuth"}
        What the mount's own coordinates are.
    latitude : float
        φ, radians, north positive.
    """

    kind: MountKind
    latitude: float

    @cached_property
    def sin(self) -> float:
        """Sin φ."""
        return math.sin(self.latitude)

    @cached_property
    def cos(self) -> float:
        """Cos φ."""
        return math.cos(self.latitude)

    @property
    def equatorial(self) -> bool:
        """Whether the coordinates are hour angle and declination."""
        return self.kind == "equatorial"

    def place(self, lon: Real, lat: Real) -> "Place":
        """Return the place at mechanical coordinates, radians."""
        return Place(self, lon, lat)


class Place:
    """A place, or arrays of places, at mechanical coordinates; angles are computed when they are first asked for."""

    def __init__(self, frame: Frame, lon: Real, lat: Real) -> None:
        f = functions_of(lat)
        self.frame, self.functions = frame, f
        self.lon, self.lat = lon, lat
        self.sin_lat, self.cos_lat = f.sin(lat), f.cos(lat)

    @once
    def sin_lon(self) -> Real:
        """Sin lon."""
        return self.functions.sin(self.lon)

    @once
    def cos_lon(self) -> Real:
        """Cos lon."""
        return self.functions.cos(self.lon)

    @once
    def _other(self) -> tuple[Real, Real, Real, Real]:
        """Components of the place about the other pole (x towards the own pole, y, z), and sin ζ."""
        sin, cos = self.frame.sin, self.frame.cos
        x = self.sin_lat * cos - self.cos_lat * self.cos_lon * sin
        y = -self.cos_lat * self.sin_lon
        z = self.sin_lat * sin + self.cos_lat * self.cos_lon * cos
        return x, y, z, self.functions.at_least(self.functions.hypot(x, y), _TINY)

    @property
    def cos_zeta(self) -> Real:
        """Cos ζ."""
        return self._other[2]

    @property
    def sin_zeta(self) -> Real:
        """Sin ζ."""
        return self._other[3]

    @once
    def zeta_gradient(self) -> tuple[Real, Real]:
        """(∂ζ/∂lon, ∂ζ/∂lat)."""
        sin, cos = self.frame.sin, self.frame.cos
        along = self.cos_lat * sin - self.sin_lat * self.cos_lon * cos
        return cos * self.cos_lat * self.sin_lon / self.sin_zeta, -along / self.sin_zeta

    def angle(self, letter: str) -> Angle:
        """One of the angles H, D, A, E, Z, Q with its gradient, radians.

        Azimuth counts from south through east, as in the functions of TPOINT's generic terms.
        """
        return _ANGLES[self.frame.kind][letter](self)


def _own_lon(place: Place) -> Angle:
    return place.lon, 1.0, 0.0


def _own_azimuth(place: Place) -> Angle:
    return math.pi - place.lon, -1.0, 0.0


def _own_lat(place: Place) -> Angle:
    return place.lat, 0.0, 1.0


def _zeta(place: Place) -> Angle:
    return place.functions.atan2(place.sin_zeta, place.cos_zeta), *place.zeta_gradient


def _from_other_equator(place: Place) -> Angle:
    value, by_lon, by_lat = _zeta(place)
    return math.pi / 2.0 - value, -by_lon, -by_lat


def _own_zenith(place: Place) -> Angle:
    """Z of an altazimuth mount: of the sky, thus the same in both postures."""
    f = place.functions
    return f.atan2(abs(place.cos_lat), place.sin_lat), 0.0, -f.copysign(1.0, place.cos_lat)


def _alpha(place: Place) -> Angle:
    x, y, _, sine = place._other  # noqa: SLF001
    sin, cos = place.frame.sin, place.frame.cos
    dx = (place.cos_lat * place.sin_lon * sin, place.cos_lat * cos + place.sin_lat * place.cos_lon * sin)
    dy = (-place.cos_lat * place.cos_lon, place.sin_lat * place.sin_lon)
    by_lon, by_lat = ((x * b - y * a) / (sine * sine) for a, b in zip(dx, dy, strict=True))
    return place.functions.atan2(y, x), by_lon, by_lat


def _alpha_from_south(place: Place) -> Angle:
    value, by_lon, by_lat = _alpha(place)
    return math.pi - value, -by_lon, -by_lat


def _parallactic(place: Place) -> Angle:
    sin, cos, sine = place.frame.sin, place.frame.cos, place.sin_zeta
    x = sin * place.cos_lat - cos * place.sin_lat * place.cos_lon
    y = cos * place.sin_lon
    dx = (cos * place.sin_lat * place.sin_lon, -sin * place.sin_lat - cos * place.cos_lat * place.cos_lon)
    dy = (cos * place.cos_lon, 0.0)
    by_lon, by_lat = ((x * b - y * a) / (sine * sine) for a, b in zip(dx, dy, strict=True))
    return place.functions.atan2(y, x), by_lon, by_lat


def _parallactic_westward(place: Place) -> Angle:
    value, by_lon, by_lat = _parallactic(place)
    return -value, -by_lon, -by_lat


_ANGLES: dict[MountKind, dict[str, Callable[[Place], Angle]]] = {
    "equatorial": {
        "H": _own_lon,
        "D": _own_lat,
        "A": _alpha_from_south,
        "E": _from_other_equator,
        "Z": _zeta,
        "Q": _parallactic,
    },
    "altazimuth": {
        "H": _alpha,
        "D": _from_other_equator,
        "A": _own_azimuth,
        "E": _own_lat,
        "Z": _own_zenith,
        "Q": _parallactic_westward,
    },
}

LETTERS = frozenset(_ANGLES["equatorial"])
"""The angles a function may be made of: hour angle, declination, azimuth, elevation, zenith distance, parallactic."""
