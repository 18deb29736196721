"""A place in a mount's frame: its two coordinates, and the angles that functions of pointing-model terms are made of.

The mount's own coordinates are `lon` and `lat`: hour angle (west positive) and declination of an equatorial mount,
azimuth (north through east) and elevation of an altazimuth mount. They are mechanical: |lat| > 90° is beyond the pole
or zenith, where cos lat is negative and the direction is nevertheless (lat, lon) put into the same formulas.

An axis may be wound by whole turns, or a file may give its reading in any turn. `Place.own` brings both coordinates
into one, which the posture and nothing else decides, and powers of an angle and functions of the user's are of those:
normal, hour angle in −180° to 180°, azimuth in 0° to 360° and |lat| up to 90°; beyond, those of the same direction
by `Frame.beyond_the_pole`: hour angle in 0° to 360°, azimuth in 180° to 540° and lat in 90° to 270° (−270° to −90° on
a southern equatorial mount). So hour angles go on over the meridian, H = 0 in normal posture and H = 180° beyond, and
over both sides of it by which a German mount reaches; they leap by a turn at lower culmination. Azimuths leap in the
north, A = ±180° from south through east in normal posture and 0° or −360° beyond. About a leap two places of the
telescope may point on one star, or none. Sines and cosines know no turns.

The *other pole* is the zenith of an equatorial mount, the north celestial pole of an altazimuth one; in both it
stands at lon 0, lat φ. One spherical triangle thus serves both: ζ the distance from the other pole, α the angle there
(azimuth of an equatorial mount, hour angle of an altazimuth one) and the parallactic angle q at the place.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from pointing.model.functions import SCALAR, Real, functions_of, once
from pointing.tube import turn_of_axis2

MountKind = Literal["equatorial", "altazimuth"]
KINDS: tuple[MountKind, ...] = get_args(MountKind)
Angle = tuple[Real, Real, Real]  # value, ∂/∂lon, ∂/∂lat

OWN_TURNS = ((-math.pi, 3.0 * math.pi), (-1.5 * math.pi, 1.5 * math.pi))
"""Between which `Place.own` gives lon and lat, whatever the mount and the posture, radians."""

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
    def middle(self) -> tuple[float, float]:
        """Middle of the turn in which `Place.own` gives the coordinates in normal posture, radians."""
        return (0.0 if self.equatorial else math.pi), 0.0

    @cached_property
    def middle_beyond(self) -> tuple[float, float]:
        """As `middle`, beyond the pole."""
        return self.beyond_the_pole(*self.middle)

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

    def beyond_the_pole(self, lon: Real, lat: Real) -> tuple[Real, Real]:
        """Mechanical coordinates of the same direction over the pole of axis 1, radians, floats or arrays."""
        return lon + math.pi, turn_of_axis2(equatorial=self.equatorial, latitude=self.latitude) - lat

    def place(self, lon: Real, lat: Real) -> "Place":
        """Return the place at mechanical coordinates, radians."""
        return Place(self, lon, lat)


class Place:
    """A place, or arrays of places, at mechanical coordinates; angles are computed when they are first asked for."""

    def __init__(self, frame: Frame, lon: Real, lat: Real) -> None:
        self.frame, self.functions = frame, functions_of(lat)
        self.lon, self.lat = lon, lat
        if self.functions is SCALAR:  # cheaper at once
            self.sin_lat, self.cos_lat = math.sin(lat), math.cos(lat)

    @once
    def sin_lat(self) -> Real:
        """Sin lat."""
        return self.functions.sin(self.lat)

    @once
    def cos_lat(self) -> Real:
        """Cos lat."""
        return self.functions.cos(self.lat)

    @once
    def sin_lon(self) -> Real:
        """Sin lon."""
        return self.functions.sin(self.lon)

    @once
    def cos_lon(self) -> Real:
        """Cos lon."""
        return self.functions.cos(self.lon)

    @once
    def beyond(self) -> Real:
        """1 beyond the pole, else 0."""
        return (1.0 - self.functions.copysign(1.0, self.cos_lat)) / 2.0

    @once
    def own(self) -> tuple[Real, Real]:
        """The coordinates in the turn of the posture, radians: the same however the axes are wound."""
        (lon, lat), (lon_beyond, lat_beyond), beyond = self.frame.middle, self.frame.middle_beyond, self.beyond
        lon, lat = lon + beyond * (lon_beyond - lon), lat + beyond * (lat_beyond - lat)
        nearest = self.functions.nearest
        return nearest(self.lon, lon), nearest(self.lat, lat)

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
        """One of the angles H, D, A, E, Z, Q with its gradient, radians; the mount's own in the turn of the posture.

        Azimuth counts from south through east, as in the functions of TPOINT's generic terms.
        """
        return _ANGLES[self.frame.kind][letter](self)


class ShiftedPlace(Place):
    """A place beside another, of which it takes the sines and cosines of what is the same.

    Parameters
    ----------
    before : Place
        The other.
    by_lon, by_lat : float or array
        Added to its coordinates, radians; the number 0 for the same.
    """

    def __init__(self, before: Place, by_lon: Real, by_lat: Real) -> None:
        self.frame, self.functions, self._before = before.frame, before.functions, before
        self._by_lon, self._by_lat = by_lon, by_lat
        self._same_lon, self._same_lat = (type(by) is float and not by for by in (by_lon, by_lat))

    @once
    def lon(self) -> Real:
        """Radians."""
        return self._before.lon if self._same_lon else self._before.lon + self._by_lon

    @once
    def lat(self) -> Real:
        """Radians."""
        return self._before.lat if self._same_lat else self._before.lat + self._by_lat

    @once
    def sin_lon(self) -> Real:
        """Sin lon."""
        return self._before.sin_lon if self._same_lon else self.functions.sin(self.lon)

    @once
    def cos_lon(self) -> Real:
        """Cos lon."""
        return self._before.cos_lon if self._same_lon else self.functions.cos(self.lon)

    @once
    def sin_lat(self) -> Real:
        """Sin lat."""
        return self._before.sin_lat if self._same_lat else self.functions.sin(self.lat)

    @once
    def cos_lat(self) -> Real:
        """Cos lat."""
        return self._before.cos_lat if self._same_lat else self.functions.cos(self.lat)


class CarriedPlace(Place):
    """A place that a motion gives with its sines and cosines; lon and lat, if asked for, wind on from a place before.

    Parameters
    ----------
    before : Place
        Less than half a turn away in lon and in lat.
    sin_lon, cos_lon, sin_lat, cos_lat : float or array
        Of the place.
    """

    def __init__(self, before: Place, sin_lon: Real, cos_lon: Real, sin_lat: Real, cos_lat: Real) -> None:
        self.frame, self.functions, self._before = before.frame, before.functions, before
        self.sin_lon, self.cos_lon, self.sin_lat, self.cos_lat = sin_lon, cos_lon, sin_lat, cos_lat

    @once
    def lon(self) -> Real:
        """Radians."""
        before = self._before
        return before.lon + self._angle(before.sin_lon, before.cos_lon, self.sin_lon, self.cos_lon)

    @once
    def lat(self) -> Real:
        """Radians."""
        before = self._before
        return before.lat + self._angle(before.sin_lat, before.cos_lat, self.sin_lat, self.cos_lat)

    def _angle(self, sine: Real, cosine: Real, new_sine: Real, new_cosine: Real) -> Real:
        return self.functions.atan2(new_sine * cosine - new_cosine * sine, new_cosine * cosine + new_sine * sine)


def _own_lon(place: Place) -> Angle:
    return place.own[0], 1.0, 0.0


def _own_azimuth(place: Place) -> Angle:
    return math.pi - place.own[0], -1.0, 0.0


def _own_lat(place: Place) -> Angle:
    return place.own[1], 0.0, 1.0


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
    """A of an equatorial mount, which leaps in the north as that of an altazimuth one."""
    _, by_lon, by_lat = _alpha(place)
    x, y, *_ = place._other  # noqa: SLF001
    return place.functions.atan2(y, -x), -by_lon, -by_lat


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
