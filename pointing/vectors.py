"""Directions as plain tuples, and the angles they stand for.

Two right-handed frames of the observed sky: the *horizon* frame has x south, y east, z zenith; the *equatorial* frame
has x to the meridian point of the equator, y east, z the north celestial pole. Azimuth counts from north through
east, the hour angle is positive to the west. Plain floats: numpy's scalars are ten times slower.
"""

import math

Vector = tuple[float, float, float]


def from_azimuth_altitude(azimuth: float, altitude: float) -> Vector:
    """Horizon vector at an azimuth and altitude, radians."""
    level = math.cos(altitude)
    return -level * math.cos(azimuth), level * math.sin(azimuth), math.sin(altitude)


def azimuth_altitude(horizon: Vector) -> tuple[float, float]:
    """Azimuth in [0, 2π) and altitude of a horizon vector; the azimuth of the zenith is 0."""
    x, y, z = horizon
    level = math.hypot(x, y)
    return (_turn(math.atan2(y, -x)) if level else 0.0), math.atan2(z, level)


def from_hour_angle_declination(hour_angle: float, declination: float) -> Vector:
    """Equatorial vector at an hour angle and declination, radians."""
    level = math.cos(declination)
    return level * math.cos(hour_angle), -level * math.sin(hour_angle), math.sin(declination)


def hour_angle_declination(equatorial: Vector) -> tuple[float, float]:
    """Hour angle in (−π, π] and declination of an equatorial vector; the hour angle of a pole is 0."""
    x, y, z = equatorial
    level = math.hypot(x, y)
    return (math.atan2(-y, x) if level else 0.0), math.atan2(z, level)


def horizon_to_equatorial(horizon: Vector, latitude: float) -> Vector:
    """Turn a horizon vector about the east by the latitude, radians."""
    x, y, z = horizon
    s, c = math.sin(latitude), math.cos(latitude)
    return s * x + c * z, y, s * z - c * x


def equatorial_to_horizon(equatorial: Vector, latitude: float) -> Vector:
    """Turn an equatorial vector about the east by the latitude, radians; inverse of `horizon_to_equatorial`."""
    x, y, z = equatorial
    s, c = math.sin(latitude), math.cos(latitude)
    return s * x - c * z, y, s * z + c * x


def from_longitude_latitude(longitude: float, latitude: float) -> Vector:
    """Unit vector of spherical coordinates (right ascension and declination, say), radians."""
    level = math.cos(latitude)
    return level * math.cos(longitude), level * math.sin(longitude), math.sin(latitude)


def longitude_latitude(v: Vector) -> tuple[float, float]:
    """Longitude in [0, 2π) and latitude of a vector, radians; inverse of `from_longitude_latitude`."""
    x, y, z = v
    return _turn(math.atan2(y, x)), math.atan2(z, math.hypot(x, y))


def direction_with_rate(place: Vector, velocity: Vector) -> tuple[Vector, Vector]:
    """Unit vector towards a place and its derivative, given the derivative of the place."""
    x, y, z = place
    n = 1.0 / math.sqrt(x * x + y * y + z * z)
    x, y, z = x * n, y * n, z * n
    dx, dy, dz = velocity[0] * n, velocity[1] * n, velocity[2] * n
    along = x * dx + y * dy + z * dz
    return (x, y, z), (dx - along * x, dy - along * y, dz - along * z)


def tangent(v: Vector, at: Vector) -> Vector:
    """The unit vector along the sky at a direction that is nearest to `v`."""
    x, y, z = at
    along = v[0] * x + v[1] * y + v[2] * z
    a, b, c = v[0] - along * x, v[1] - along * y, v[2] - along * z
    n = 1.0 / math.sqrt(a * a + b * b + c * c)
    return a * n, b * n, c * n


def turned_eastward(v: Vector, at: Vector) -> Vector:
    """A tangent at a direction turned by a right angle, as north is to become east: v × at."""
    x, y, z = at
    return v[1] * z - v[2] * y, v[2] * x - v[0] * z, v[0] * y - v[1] * x


def angle_eastward(start: Vector, end: Vector, at: Vector) -> float:
    """Angle in (−π, π] from one tangent at a direction to another, positive from north through east."""
    across = turned_eastward(start, at)
    return math.atan2(
        end[0] * across[0] + end[1] * across[1] + end[2] * across[2],
        end[0] * start[0] + end[1] * start[1] + end[2] * start[2],
    )


def _turn(angle: float) -> float:
    """Bring an angle of (−π, π] into [0, 2π), where a negative nothing stays below 2π."""
    return (angle + math.tau if angle < 0.0 else angle) % math.tau
