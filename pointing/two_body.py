"""Motion about the Sun alone, from osculating elements: ellipse, parabola and hyperbola by one set of formulas.

Counted from perihelion at distance q, with the universal anomaly s (ds/dt = 1/r) and Stumpff's functions c₀…c₃ of
x = s² µ (1 − e)/q, all orbits obey

    t = q s + µ e s³ c₃      r = q + µ e s² c₂
    x = q − µ s² c₂          y = √(µ q (1 + e)) s c₁

(Stiefel and Scheifele, Linear and Regular Celestial Mechanics, 1971, §11; Danby, Fundamentals of Celestial Mechanics,
1988, §6.9). Nothing in them is special at e = 1, so near-parabolic orbits lose no digit. Astronomical units and days
of TT, which serves as TDB.

Elements are of the ecliptic and equinox J2000 as the Minor Planet Center has them: its plane is inclined to the
equator of the ICRS by 84381.448″ (IAU 1976). The Sun's attraction is k² with Gauss's k = 0.01720209895.
"""

import math
from dataclasses import dataclass, field

from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.vectors import Vector

GAUSS = 0.01720209895
ATTRACTION = GAUSS * GAUSS  # au³/day²
OBLIQUITY = math.radians(84381.448 / 3600.0)
_SMALL = 4.0  # |x| below which the closed forms cancel and the series, of 14 terms, does not
_C2 = tuple(1.0 / math.factorial(2 * k + 2) for k in range(14))
_C3 = tuple(1.0 / math.factorial(2 * k + 3) for k in range(14))
_ROUNDS = 40  # Newton from above needed at most 11 for 100 000 orbits of every kind
_BOUNDS = {
    "perihelion distance q": ("au", 1e-4, 1e3),
    "eccentricity e": ("", 0.0, 100.0),
    "inclination": ("rad", 0.0, math.pi),
    "longitude of the node": ("rad", -math.tau, math.tau),
    "argument of perihelion": ("rad", -math.tau, math.tau),
}


@dataclass(frozen=True)
class Orbit:
    """An orbit about the Sun.

    Parameters
    ----------
    perihelion : Instant
        A passage through perihelion.
    q : float
        Perihelion distance, au.
    e : float
        Eccentricity: below 1 an ellipse, 1 a parabola, above a hyperbola.
    inclination, node, argument : float
        Inclination, longitude of the ascending node and argument of perihelion, radians, ecliptic J2000.

    Raises
    ------
    TargetError
        An element is impossible.
    """

    perihelion: Instant
    q: float
    e: float
    inclination: float
    node: float
    argument: float
    _axes: tuple[Vector, Vector] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = self.q, self.e, self.inclination, self.node, self.argument
        for value, (name, (unit, low, high)) in zip(values, _BOUNDS.items(), strict=True):
            if not low <= value <= high:
                bounds = f"{low:.5g} to {high:.5g} {unit}".rstrip().replace("-", "−")
                raise TargetError(f"{name} {value:.10g}: possible are {bounds}; check the elements")
        object.__setattr__(self, "_axes", self._perifocal_axes())

    @property
    def period_days(self) -> float:
        """Time of a revolution; infinite unless the orbit is an ellipse."""
        if self.e >= 1.0:
            return math.inf
        axis = self.q / (1.0 - self.e)
        return math.tau / GAUSS * axis * math.sqrt(axis)

    def state(self, instant: Instant) -> tuple[Vector, Vector]:
        """Heliocentric position, au, and velocity, au a day, ICRS axes."""
        (x, y), (vx, vy) = self._in_plane(self._from_perihelion(instant))
        (px, py, pz), (qx, qy, qz) = self._axes
        return (
            (x * px + y * qx, x * py + y * qy, x * pz + y * qz),
            (vx * px + vy * qx, vx * py + vy * qy, vx * pz + vy * qz),
        )

    def _from_perihelion(self, instant: Instant) -> float:
        """Days from the perihelion passage nearest to a moment."""
        days = instant.since(self.perihelion) / DAY
        return days if self.e >= 1.0 else math.remainder(days, self.period_days)

    def _in_plane(self, days: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Position and velocity in the plane of the orbit, x towards perihelion."""
        q, e = self.q, self.e
        s = universal_anomaly(days, q, e)
        x = s * s * ATTRACTION * (1.0 - e) / q
        c2, c3 = stumpff(x)
        c0, c1 = 1.0 - x * c2, 1.0 - x * c3
        r = q + ATTRACTION * e * s * s * c2
        level = math.sqrt(ATTRACTION * q * (1.0 + e))
        return (
            (q - ATTRACTION * s * s * c2, level * s * c1),
            (-ATTRACTION * s * c1 / r, level * c0 / r),
        )

    def _perifocal_axes(self) -> tuple[Vector, Vector]:
        """Unit vectors to perihelion and 90° on in the direction of motion, ICRS axes."""
        si, ci = math.sin(self.inclination), math.cos(self.inclination)
        sn, cn = math.sin(self.node), math.cos(self.node)
        sw, cw = math.sin(self.argument), math.cos(self.argument)
        to_perihelion = (cn * cw - sn * sw * ci, sn * cw + cn * sw * ci, sw * si)
        onward = (-cn * sw - sn * cw * ci, -sn * sw + cn * cw * ci, cw * si)
        return _equatorial(to_perihelion), _equatorial(onward)


def universal_anomaly(days: float, q: float, e: float) -> float:
    """Solve Kepler's equation in its universal form, from perihelion on, to the last digits of a float.

    The time grows with s at the rate r, and ever faster as far as aphelion: from any upper bound Newton's steps come
    down to the solution and never cross it.

    Parameters
    ----------
    days : float
        From perihelion, in either direction; of an ellipse not beyond half a revolution.
    q, e : float
        Perihelion distance, au, and eccentricity.

    Returns
    -------
    float
        s, days per au.
    """
    time = abs(days)
    if time == 0.0:
        return 0.0
    s = _upper_bound(time, q, e)
    bend = ATTRACTION * (1.0 - e) / q
    for _ in range(_ROUNDS):
        square = s * s
        c2, c3 = stumpff(square * bend)
        pull = ATTRACTION * e * square
        lower = s - (s * (q + pull * c3) - time) / (q + pull * c2)
        if not lower < s:
            break
        s = lower
    return math.copysign(s, days)


def _upper_bound(time: float, q: float, e: float) -> float:
    """A universal anomaly that is not below the solution: the least of what each term of the equation allows."""
    bounds = [time / q]
    if e > 0.0:
        least_c3 = 1.0 / 6.0 if e >= 1.0 else 1.0 / math.pi**2  # at perihelion, at aphelion
        bounds.append(math.cbrt(time / (ATTRACTION * e * least_c3)))
    root = math.sqrt(ATTRACTION * abs(1.0 - e) / q)
    if e > 1.0:
        # M = e sinh F − F is at least (e − 1) sinh F.
        bounds.append(math.asinh(time * root**3 / ATTRACTION / (e - 1.0)) / root)
    elif e < 1.0:
        bounds.append(math.pi / root)
    return min(bounds)


def stumpff(x: float) -> tuple[float, float]:
    """Stumpff's c₂ = (1 − cos √x)/x and c₃ = (√x − sin √x)/√x³, continued to negative x by cosh and sinh."""
    if abs(x) < _SMALL:
        c2 = c3 = 0.0
        for two, three in zip(reversed(_C2), reversed(_C3), strict=True):
            c2, c3 = two - x * c2, three - x * c3
        return c2, c3
    root = math.sqrt(abs(x))
    if x > 0.0:
        return (1.0 - math.cos(root)) / x, (root - math.sin(root)) / (x * root)
    return (1.0 - math.cosh(root)) / x, (root - math.sinh(root)) / (x * root)


def _equatorial(ecliptic: Vector) -> Vector:
    x, y, z = ecliptic
    s, c = math.sin(OBLIQUITY), math.cos(OBLIQUITY)
    return x, c * y - s * z, s * y + c * z
