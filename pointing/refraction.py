"""Atmospheric refraction of directions in the horizon frame, forward exactly as ERFA's `atioq` does it.

ΔZ = A tan Z + B tan³ Z with Z observed, brought to the unrefracted Z by one Newton step; below 3° altitude the amount
is held, so it stays finite at the horizon and under it. ERFA's own inverse misses this by up to 11″ at 3°; ours
solves the forward direction, which rises with Z, to 1e-12 rad.

What is near has parallax on top: its ray runs, above the air, beside the line that would meet the observer, as if he
stood higher (`lowered`).
"""

import math

from pointing.vectors import Vector

_LEAST_LEVEL = 1e-6  # ERFA's bounds on the cosine and the sine of the altitude
_LEAST_HEIGHT = 0.05
_TOLERANCE = 1e-14
_LARGEST = 0.1
_EARTH_M = 6371e3  # mean radius; 0.3 % more or less of it is 0.03″ of a satellite's place at Z 80°


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


def lowered(place: Vector, velocity: Vector, a: float, b: float, column_m: float) -> tuple[Vector, Vector]:
    """Place and velocity of what would be seen, by a straight line, in the direction the ray has above the air.

    At a path length s from the observer the ray turns by dθ = −n′ sin Z ds, and above the air it runs beside the line
    through the observer by d = ∫ s dθ, on the side of the zenith: parallactic refraction. With n − 1 = γ exp(−h/H),
    h = s cos Z + s² sin² Z / 2r, β = H/r, x² = cos² Z / (2β sin² Z) that is γ (r / sin Z) (1 − √π x exp(x²) erfc x).
    By the continued fraction of erfc it is γ H sin Z (c + 3p) / (c² + 6 c p + 3 p²) with c = cos² Z and p = β sin² Z,
    exact at the zenith and at the horizon; for small β the well-known γ H tan Z / cos Z. Z is the observed one:
    c = cos² Z₀ + 2γ sin² Z₀ of the unrefracted Z₀. The place is lowered by d / sin Z. Below 3° altitude that is held,
    as refraction is.

    Parameters
    ----------
    place, velocity : Vector
        Metres from the observer, horizon frame, and their change per second.
    a, b : float
        The constants of refraction, radians; both contain the refractivity here: a − b = γ − γ²/2 (ERFA's `refco`).
    column_m : float
        H, the height of the air at the density it has here.

    Returns
    -------
    tuple[Vector, Vector]
        Within 1 % (down to 10° altitude) and 2 % (to 5°) of what a ray through an exponential atmosphere does.
    """
    x, y, z = place
    vx, vy, vz = velocity
    gamma = 1.0 - math.sqrt(1.0 - 2.0 * (a - b))
    r2 = x * x + y * y + z * z
    height = z / math.sqrt(r2)
    if height > _LEAST_HEIGHT:
        cos2 = height * height
        dcos2 = 2.0 * (z * vz - cos2 * (x * vx + y * vy + z * vz)) / r2
    else:
        cos2, dcos2 = _LEAST_HEIGHT * _LEAST_HEIGHT, 0.0
    sin2, dsin2 = 1.0 - cos2, -dcos2
    beta = column_m / _EARTH_M
    c, dc = cos2 + 2.0 * gamma * sin2, dcos2 + 2.0 * gamma * dsin2
    p, dp = beta * sin2, beta * dsin2
    above, dabove = c + 3.0 * p, dc + 3.0 * dp
    below, dbelow = c * c + 6.0 * c * p + 3.0 * p * p, 2.0 * (c + 3.0 * p) * dc + 6.0 * (c + p) * dp
    drop = gamma * column_m * above / below
    return (x, y, z - drop), (vx, vy, vz - drop * (dabove / above - dbelow / below))
