"""Atmospheric refraction of directions in the horizon frame, forward exactly as ERFA's `atioq` does it.

ΔZ = A tan Z + B tan³ Z with Z observed, brought to the unrefracted Z by one Newton step; below 3° altitude the amount
is held, so it stays finite at the horizon and under it. ERFA's own inverse misses this by up to 11″ at 3°; ours
solves the forward direction, which rises with Z, to 1e-12 rad.
"""

import math

from pointing.vectors import Vector

_LEAST_LEVEL = 1e-6  # ERFA's bounds on the cosine and the sine of the altitude
_LEAST_HEIGHT = 0.05
_TOLERANCE = 1e-14
_LARGEST = 0.1


def refract(v: Vector, a: float, b: float) -> Vector:
    """Observed unit vector of an unrefracted one; a, b in radians."""
    x, y, z = v
    r = math.sqrt(x * x + y * y)
    r = max(r, _LEAST_LEVEL)
    h = max(z, _LEAST_HEIGHT)
    t = r / h
    w = b * t * t
    lift = (a + w) * t / (1.0 + (a + 3.0 * w) / (h * h))
    cosine = 1.0 - 0.5 * lift * lift
    f = cosine - lift * h / r
    x *= f
    y *= f
    z = cosine * z + lift * r
    n = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * n, y * n, z * n


def refract_with_rate(v: Vector, rate: Vector, a: float, b: float) -> tuple[Vector, Vector]:
    """`refract` and its derivative, for a direction that changes by `rate` per second."""
    x, y, z = v
    dx, dy, dz = rate
    r, dr = math.sqrt(x * x + y * y), 0.0
    if r > _LEAST_LEVEL:
        dr = (x * dx + y * dy) / r
    else:
        r = _LEAST_LEVEL
    h, dh = (z, dz) if z > _LEAST_HEIGHT else (_LEAST_HEIGHT, 0.0)
    t = r / h
    dt = (dr - t * dh) / h
    w = b * t * t
    dw = 2.0 * b * t * dt
    slope = (a + 3.0 * w) / (h * h)
    lift = (a + w) * t / (1.0 + slope)
    dlift = (dw * t + (a + w) * dt - lift * (3.0 * dw / h - 2.0 * slope * dh) / h) / (1.0 + slope)
    cosine = 1.0 - 0.5 * lift * lift
    f = cosine - lift * h / r
    df = -lift * dlift - (dlift * h + lift * (dh - h * dr / r)) / r
    ox, oy, oz = x * f, y * f, cosine * z + lift * r
    odx, ody = dx * f + x * df, dy * f + y * df
    odz = cosine * dz - lift * dlift * z + dlift * r + lift * dr
    n = 1.0 / math.sqrt(ox * ox + oy * oy + oz * oz)
    ox, oy, oz = ox * n, oy * n, oz * n
    odx, ody, odz = odx * n, ody * n, odz * n
    along = ox * odx + oy * ody + oz * odz
    return (ox, oy, oz), (odx - along * ox, ody - along * oy, odz - along * oz)


def unrefract(v: Vector, a: float, b: float) -> Vector:
    """Unrefracted unit vector of an observed one; inverse of `refract` to 1e-12 rad."""
    x, y, z = v
    level = math.hypot(x, y)
    zenith_distance = math.atan2(level, z) + refraction(math.atan2(z, level), a, b)
    true_level = math.sin(zenith_distance)
    k = true_level / level if level > 0.0 else 1.0
    return x * k, y * k, math.cos(zenith_distance)


def refraction(altitude: float, a: float, b: float) -> float:
    """How much higher a direction is seen than it is, radians, at an *observed* altitude."""
    if a == 0.0 and b == 0.0:
        return 0.0
    observed = math.pi / 2.0 - altitude
    low, high = observed - _LARGEST, observed + _LARGEST
    zenith_distance = observed
    for _ in range(60):
        s, c = math.sin(zenith_distance), math.cos(zenith_distance)
        (seen_level, _, seen_height), (level_rate, _, height_rate) = refract_with_rate(
            (s, 0.0, c), (c, 0.0, -s), a, b
        )
        excess = math.atan2(seen_level, seen_height) - observed
        if excess > 0.0:
            high = zenith_distance
        else:
            low = zenith_distance
        step = excess / (level_rate * seen_height - height_rate * seen_level)
        following = zenith_distance - step
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - zenith_distance) < _TOLERANCE:
            return following - observed
        zenith_distance = following
    return zenith_distance - observed
