"""What a term moves: the results of TPOINT's generic terms, as exact motions on the sphere.

A *result* turns a place by an amount γ. In mechanical coordinates beyond the pole cos lat is negative; the formulas
then bring the change of sign of D, X, P, E, S, V on the sky by themselves, and none for H, A, U, L, N, W. Z asks for
it, because a vertical displacement belongs to the sky.

First-order checks (equatorial Δh, Δδ; altazimuth ΔA, ΔE) stand in the table of `pointing.model.terms`. Each motion
comes with its partial derivatives by lon, lat and γ and with its inverse at a given γ; all are closed forms, but for
the inverse of the Nasmyth displacements, which is solved for.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from pointing.model.functions import Real
from pointing.model.place import KINDS, MountKind, Place, ShiftedPlace
from pointing.model.root import solve

Coordinates = tuple[Real, Real]


class Step(NamedTuple):
    """A place after a motion, and the partial derivatives of its coordinates."""

    to: Place
    lon_lon: Real = 1.0
    lon_lat: Real = 0.0
    lon_amount: Real = 0.0
    lat_lon: Real = 0.0
    lat_lat: Real = 1.0
    lat_amount: Real = 0.0


Motion = Callable[[Place, Real], Step]
Return = Callable[[Place, Real], Coordinates]


@dataclass(frozen=True)
class Result:
    """What one letter of a generic term moves.

    Parameters
    ----------
    letter : str
        TPOINT's letter; NRX and NRY have none and bring their names.
    sentence : str
        What it is.
    mounts : tuple of str
        The mounts that have it.
    sign : float
        −1 where a positive coefficient is a negative motion: azimuth counts to the left.
    forward : callable
        (place, γ) → `Step`.
    back : callable
        (place after, γ) → coordinates before; nan where no place leads there.
    """

    letter: str
    sentence: str
    mounts: tuple[MountKind, ...]
    sign: float
    forward: Motion
    back: Return


def _along_lon(place: Place, amount: Real) -> Step:
    return Step(ShiftedPlace(place, amount, 0.0), lon_amount=1.0)


def _along_lon_back(place: Place, amount: Real) -> Coordinates:
    return place.lon - amount, place.lat


def _along_lat(place: Place, amount: Real) -> Step:
    return Step(ShiftedPlace(place, 0.0, amount), lat_amount=1.0)


def _along_lat_back(place: Place, amount: Real) -> Coordinates:
    return place.lon, place.lat - amount


def _cone(place: Place, amount: Real) -> Step:
    """Collimation: v′ = v cos γ + ê sin γ, ê the unit vector of increasing lon at v."""
    c, s = place.cos_lat, place.sin_lat
    cg, sg = place.functions.cos(amount), place.functions.sin(amount)
    along = c * cg
    to, new = _placed(place, along, sg, s * cg)
    new2 = new * new
    return Step(
        to,
        lon_lat=sg * cg * s / new2,
        lon_amount=c / new2,
        lat_lat=along / new,
        lat_amount=-s * sg / new,
    )


def _cone_back(place: Place, amount: Real) -> Coordinates:
    """Inverse of the cone: its cosine before is that along the meridian, by cos γ."""
    cg, sg = place.functions.cos(amount), place.functions.sin(amount)
    along = _along_before(place, sg)
    return place.lon - _aside(place, along, sg), _turned(place, along / cg, place.sin_lat / cg)


def _perpendicular(place: Place, amount: Real) -> Step:
    """Non-perpendicularity: rotation about the horizontal axis point (lon, 0) of the current vector."""
    c, s = place.cos_lat, place.sin_lat
    cg, sg = place.functions.cos(amount), place.functions.sin(amount)
    to, new = _placed(place, c, s * sg, s * cg)
    new2 = new * new
    return Step(
        to,
        lon_lat=sg / new2,
        lon_amount=c * s * cg / new2,
        lat_lat=c * cg / new,
        lat_amount=-s * sg / new,
    )


def _perpendicular_back(place: Place, amount: Real) -> Coordinates:
    """Inverse: sin lat = sin lat′ / cos γ."""
    cg, sg = place.functions.cos(amount), place.functions.sin(amount)
    cosine, sine = _along_before(place, sg) / cg, place.sin_lat / cg
    return place.lon - _aside(place, cosine, sine * sg), _turned(place, cosine, sine)


def _along_before(place: Place, sg: Real) -> Real:
    """Cos lat cos γ before a cone or a turn: cos² lat cos² γ = cos² lat′ − sin² γ; nan where that is negative."""
    f, c = place.functions, place.cos_lat
    return f.copysign(1.0, c) * f.root((abs(c) - sg) * (abs(c) + sg))


def _aside(place: Place, along: Real, across: Real) -> Real:
    """The angle about the pole from the place's meridian, on its side of the pole."""
    side = place.functions.copysign(1.0, place.cos_lat)
    return place.functions.atan2(side * across, side * along)


def _tilt(axis: Callable[[Place], tuple[Real, Real]]) -> tuple[Motion, Return]:
    """Rotation about a fixed point of the own equator; `axis` gives (sin ψ, cos ψ), ψ counted from that point.

    To first order lat grows by γ sin ψ and lon by −γ cos ψ tan lat.
    """

    def forward(place: Place, amount: Real) -> Step:
        f, c, s = place.functions, place.cos_lat, place.sin_lat
        sp, cp = axis(place)
        cg, sg = f.cos(amount), f.sin(amount)
        x, y, z = c * cp, c * sp * cg - s * sg, c * sp * sg + s * cg
        side = f.copysign(1.0, c)
        new = side * f.hypot(x, y)
        new2 = new * new
        lon = place.lon + f.atan2(side * (y * cp - x * sp), side * (x * cp + y * sp))
        return Step(
            place.frame.place(lon, _turned(place, new, z)),
            lon_lon=(x * c * cp * cg + y * c * sp) / new2,
            lon_lat=(y * s * cp - x * (s * sp * cg + c * sg)) / new2,
            lon_amount=-x * z / new2,
            lat_lon=c * cp * sg / new,
            lat_lat=(c * cg - s * sp * sg) / new,
            lat_amount=y / new,
        )

    def back(place: Place, amount: Real) -> Coordinates:
        step = forward(place, -amount)
        return step.to.lon, step.to.lat

    return forward, back


def _vertical(place: Place, amount: Real) -> Step:
    """Displacement by γ away from the zenith: v′ = a v − b ẑ with b = sin γ / sin Z and a = cos γ + b cos Z."""
    f = place.functions
    if not place.frame.equatorial:
        down = -f.copysign(1.0, place.cos_lat)
        return Step(ShiftedPlace(place, 0.0, down * amount), lat_amount=down)
    c, s, sp, cp = place.cos_lat, place.sin_lat, place.sin_lon, place.cos_lon
    cos_z, sin_z = place.cos_zeta, place.sin_zeta
    cg, sg = f.cos(amount), f.sin(amount)
    b = sg / sin_z
    a = cg + b * cos_z
    x, y, z = a * c * cp - b * place.frame.cos, a * c * sp, a * s - b * place.frame.sin
    side = f.copysign(1.0, c)
    new = side * f.hypot(x, y)
    z_lon, z_lat = place.zeta_gradient
    b_z, b_amount = -b * cos_z / sin_z, cg / sin_z
    a_z, a_amount = b_z * cos_z - b * sin_z, b_amount * cos_z - sg

    def partials(a_by: Real, b_by: Real, v: tuple[Real, Real, Real]) -> tuple[Real, Real]:
        """Of lon and lat, where a, b and the vector change."""
        x_by = a_by * c * cp + a * v[0] - b_by * place.frame.cos
        y_by = a_by * c * sp + a * v[1]
        z_by = a_by * s + a * v[2] - b_by * place.frame.sin
        return (x * y_by - y * x_by) / (new * new), z_by / new

    lon_lon, lat_lon = partials(a_z * z_lon, b_z * z_lon, (-c * sp, c * cp, 0.0))
    lon_lat, lat_lat = partials(a_z * z_lat, b_z * z_lat, (-s * cp, -s * sp, c))
    lon_amount, lat_amount = partials(a_amount, b_amount, (0.0, 0.0, 0.0))
    lon = place.lon + f.atan2(side * (y * cp - x * sp), side * (x * cp + y * sp))
    return Step(
        place.frame.place(lon, _turned(place, new, z)), lon_lon, lon_lat, lon_amount, lat_lon, lat_lat, lat_amount
    )


def _vertical_back(place: Place, amount: Real) -> Coordinates:
    """Inverse; out of reach where the place before would be beyond the zenith or the nadir."""
    f = place.functions
    z = place.angle("Z")[0]
    step = _vertical(place, -amount)
    there = (z >= amount) & (z - amount <= math.pi)
    return f.only(there, step.to.lon), f.only(there, step.to.lat)


def _nasmyth_x(place: Place, amount: Real) -> Step:
    """Displacement by γ along the unit tangent −ê cos E − n̂ sin E of a Nasmyth focal plane; n̂ points up."""
    c, s = place.cos_lat, place.sin_lat
    return _displaced(place, amount, (s * s, -c, -s * c), (2.0 * s * c, s, s * s - c * c))


def _nasmyth_y(place: Place, amount: Real) -> Step:
    """Displacement by γ along −ê sin E + n̂ cos E."""
    c, s = place.cos_lat, place.sin_lat
    return _displaced(place, amount, (-s * c, -s, c * c), (s * s - c * c, -c, -2.0 * s * c))


def _displaced(place: Place, amount: Real, tangent: tuple[Real, Real, Real], by_lat: tuple[Real, Real, Real]) -> Step:
    """v′ = v cos γ + t sin γ, with the unit tangent t and its derivative by lat.

    Vectors are in components along the place's meridian plane, across it and up.
    """
    c, s = place.cos_lat, place.sin_lat
    cg, sg = place.functions.cos(amount), place.functions.sin(amount)
    r, e, z = c * cg + tangent[0] * sg, tangent[1] * sg, s * cg + tangent[2] * sg
    r_lat, e_lat, z_lat = by_lat[0] * sg - s * cg, by_lat[1] * sg, by_lat[2] * sg + c * cg
    r_amount, e_amount, z_amount = tangent[0] * cg - c * sg, tangent[1] * cg, tangent[2] * cg - s * sg
    to, new = _placed(place, r, e, z)
    new2 = new * new
    return Step(
        to,
        lon_lat=(r * e_lat - e * r_lat) / new2,
        lon_amount=(r * e_amount - e * r_amount) / new2,
        lat_lat=z_lat / new,
        lat_amount=z_amount / new,
    )


def _placed(place: Place, r: Real, e: Real, z: Real) -> tuple[Place, Real]:
    """The place in a direction, of components as in `_displaced`, and the cosine of its latitude.

    It is on the side of the zenith on which it comes to lie, as with an index error in elevation.
    """
    f = place.functions
    side = f.copysign(1.0, r)
    new = side * f.hypot(r, e)
    return place.frame.place(place.lon + f.atan2(side * e, side * r), _turned(place, new, z)), new


def _solved_back(motion: Motion) -> Return:
    """Inverse of a motion that is the same at every lon: solved for lat, then lon is turned back."""

    def too_low(place: Place, lat: Real, amount: Real) -> Real:
        return place.lat - motion(place.frame.place(place.lon, lat), amount).to.lat

    def back(place: Place, amount: Real) -> Coordinates:
        reach = 2.0 * abs(amount)
        lat = solve(too_low, place, amount, place.lat, (place.lat - reach, place.lat + reach))
        return place.lon - (motion(place.frame.place(place.lon, lat), amount).to.lon - place.lon), lat

    return back


def _turned(place: Place, cosine: Real, sine: Real) -> Real:
    """The latitude of this cosine and sine, on the winding of the place's own."""
    c, s = place.cos_lat, place.sin_lat
    return place.lat + place.functions.atan2(sine * c - cosine * s, cosine * c + sine * s)


_ALTAZ: tuple[MountKind, ...] = ("altazimuth",)
_EQUATORIAL: tuple[MountKind, ...] = ("equatorial",)

RESULTS: dict[str, Result] = {
    result.letter: result
    for result in (
        Result("H", "hour angle", _EQUATORIAL, 1.0, _along_lon, _along_lon_back),
        Result("X", "east-west on the sky", _EQUATORIAL, 1.0, _cone, _cone_back),
        Result("D", "declination", _EQUATORIAL, 1.0, _along_lat, _along_lat_back),
        Result("U", "polar axis, vertically, as ME", _EQUATORIAL, 1.0, *_tilt(lambda at: (at.cos_lon, -at.sin_lon))),
        Result("L", "polar axis, sideways, as MA", _EQUATORIAL, 1.0, *_tilt(lambda at: (at.sin_lon, at.cos_lon))),
        Result("P", "h-δ non-perpendicularity", _EQUATORIAL, 1.0, _perpendicular, _perpendicular_back),
        Result("A", "azimuth, to the left", _ALTAZ, -1.0, _along_lon, _along_lon_back),
        Result("S", "left-right on the sky, to the left", _ALTAZ, -1.0, _cone, _cone_back),
        Result("Z", "zenith distance", KINDS, 1.0, _vertical, _vertical_back),
        Result("E", "elevation", _ALTAZ, 1.0, _along_lat, _along_lat_back),
        Result("N", "azimuth axis, to the north", _ALTAZ, 1.0, *_tilt(lambda at: (-at.cos_lon, at.sin_lon))),
        Result("W", "azimuth axis, to the west", _ALTAZ, 1.0, *_tilt(lambda at: (at.sin_lon, at.cos_lon))),
        Result("V", "az-el non-perpendicularity", _ALTAZ, -1.0, _perpendicular, _perpendicular_back),
        Result("NRX", "Nasmyth rotator, horizontally", _ALTAZ, 1.0, _nasmyth_x, _solved_back(_nasmyth_x)),
        Result("NRY", "Nasmyth rotator, vertically", _ALTAZ, 1.0, _nasmyth_y, _solved_back(_nasmyth_y)),
    )
}
"""By letter; NRX and NRY, which are no results of generic terms, by name."""
