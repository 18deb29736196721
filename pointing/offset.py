"""A target seen a little east and north of where it is, and how far one place is from another in these directions."""

import math
from dataclasses import dataclass, replace

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.sky import SkyFrame
from pointing.targets import Target, notes_of
from pointing.vectors import Vector

_POLE = 1e-12  # closer than this there is neither east nor north
_NEAR = 1e-7  # rad; below, the series of sin r / r is its first two terms


@dataclass(frozen=True)
class OffsetTarget:
    """`base`, displaced on the observed sky.

    Parameters
    ----------
    base : Target
        What is displaced.
    east, north : float
        Radians along the directions of increasing right ascension and declination at the target; together they are
        the great-circle distance and its direction. At a pole, which has no such directions, east is the horizon's.

    Raises
    ------
    TargetError
        An offset is no number, or more than half a turn.
    """

    base: Target
    east: float
    north: float

    def __post_init__(self) -> None:
        if not math.hypot(self.east, self.north) <= math.pi:
            east, north = math.degrees(self.east), math.degrees(self.north)
            raise TargetError(f"an offset of {east:g}° east, {north:g}° north: possible are 180° together")

    @property
    def name(self) -> str:
        """The name of what is displaced."""
        return self.base.name

    def moved(self, east: float, north: float) -> "OffsetTarget":
        """Displace further."""
        return replace(self, east=self.east + east, north=self.north + north)

    def note_at(self, instant: Instant) -> str:
        """Say what is to be said of the place of what is displaced."""
        return "".join(notes_of(self.base, instant))

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        return self.observed_with_rate(frame)[0]

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        return displaced(*self.base.observed_with_rate(frame), (self.east, self.north), frame.sky.site.latitude)


def displaced(
    v: Vector, rate: Vector, offset: tuple[float, float], latitude: float, drift: tuple[float, float] = (0.0, 0.0)
) -> tuple[Vector, Vector]:
    """Displace an observed direction along a great circle.

    With p the pole, ê = p × v / |p × v| points east and n̂ = v × ê north; the displaced direction is
    v cos r + (east ê + north n̂) sin r / r, r² = east² + north².

    Parameters
    ----------
    v, rate : Vector
        Unit vector of the horizon frame and its derivative per second.
    offset : tuple of float
        East and north, radians.
    latitude : float
        Of the site, radians.
    drift : tuple of float, optional
        How the offset itself changes, radians per second.

    Returns
    -------
    tuple[Vector, Vector]
        The displaced unit vector and its derivative per second.
    """
    (east, north), (east_drift, north_drift) = offset, drift
    distance = math.hypot(east, north)
    if distance == 0.0 and drift == (0.0, 0.0):
        return v, rate
    to_east, to_east_rate = _eastward(v, rate, latitude)
    to_north = _cross(v, to_east)
    to_north_rate = _sum(_cross(rate, to_east), _cross(v, to_east_rate))
    cos, sinc = math.cos(distance), math.sin(distance) / distance if distance else 1.0
    # d(cos r)/dt and d(sin r / r)/dt; the latter's bracket is −1/3 at r = 0 and no digit of it counts near there.
    growth = east * east_drift + north * north_drift
    bracket = (cos - sinc) / (distance * distance) if distance > _NEAR else -1.0 / 3.0
    cos_rate, sinc_rate = -sinc * growth, bracket * growth
    return (
        _sum(_scaled(v, cos), _sum(_scaled(to_east, east * sinc), _scaled(to_north, north * sinc))),
        _sum(
            _sum(_scaled(rate, cos), _scaled(v, cos_rate)),
            _sum(
                _sum(_scaled(to_east_rate, east * sinc), _scaled(to_north_rate, north * sinc)),
                _sum(
                    _scaled(to_east, east_drift * sinc + east * sinc_rate),
                    _scaled(to_north, north_drift * sinc + north * sinc_rate),
                ),
            ),
        ),
    )


def _eastward(v: Vector, rate: Vector, latitude: float) -> tuple[Vector, Vector]:
    """Direction of increasing right ascension at a direction, and its derivative; the horizon's east at a pole."""
    pole = (-math.cos(latitude), 0.0, math.sin(latitude))
    across, across_rate = _cross(pole, v), _cross(pole, rate)
    size = math.hypot(*across)
    if size < _POLE:
        return (0.0, 1.0, 0.0), (0.0, 0.0, 0.0)
    east = _scaled(across, 1.0 / size)
    return east, _scaled(_sum(across_rate, _scaled(east, -_dot(east, across_rate))), 1.0 / size)


def offset_between(v: Vector, displaced: Vector, latitude: float) -> tuple[float, float]:
    """East and north, radians, from one observed direction to another: inverse of `OffsetTarget`, to 1e-15.

    Parameters
    ----------
    v, displaced : Vector
        Unit vectors in the horizon frame.
    latitude : float
        Radians, north positive.
    """
    east, north = _directions(v, latitude)
    across, along = _dot(displaced, east), _dot(displaced, north)
    size = math.hypot(across, along)
    if size == 0.0:
        return 0.0, 0.0
    distance = math.atan2(size, _dot(v, displaced))
    return across / size * distance, along / size * distance


def carried(v: Vector, start: Vector, end: Vector) -> Vector:
    """Turn `v` by the rotation that carries `start` to `end` on their great circle; less than half a turn.

    With k = start × end: v + k × v + k × (k × v) / (1 + start · end), Rodrigues' formula of that rotation.
    """
    k = _cross(start, end)
    once = _cross(k, v)
    return _sum(_sum(v, once), _scaled(_cross(k, once), 1.0 / (1.0 + _dot(start, end))))


def _directions(v: Vector, latitude: float) -> tuple[Vector, Vector]:
    """East and north at a direction."""
    across = _cross((-math.cos(latitude), 0.0, math.sin(latitude)), v)
    size = math.hypot(*across)
    east = (0.0, 1.0, 0.0) if size < _POLE else _scaled(across, 1.0 / size)
    return east, _cross(v, east)


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(a: Vector, by: float) -> Vector:
    return a[0] * by, a[1] * by, a[2] * by
