"""The Sun, the Moon and the planets as targets.

The place at a moment is where the light seen then left the body: light time is solved to convergence, and its
derivative is part of the rate. Both ends of the way come from one ephemeris, a JPL kernel, with the observer's place
on the Earth added. Where no kernel covers the moment ERFA's series stand in, and `note_at` says how wrong they may
be. A planet with moons is its system's barycentre where the kernel does not hold the planet itself: 0.1″ from Pluto,
0.07″ from Jupiter, less for the others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from pointing import planetary_series
from pointing.bodies import BODIES, EARTH, SERIES_YEARS, SUN, Body
from pointing.chebyshev import State
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.kernel import EXTRA, Kernel, bundled_kernel, kernel, since_j2000
from pointing.sky import AU_M, LIGHT_M_S, YEAR_DAYS, SkyFrame
from pointing.vectors import Vector

Ephemeris = Callable[[int, Instant], State]  # gives the state of the body of a number at a moment of TDB

_LIGHT_AU_S = LIGHT_M_S / AU_M
_ENOUGH_S = 1e-3  # a Newton step of the light time after which less than 1e-10 s is missing
_ROUNDS = 8
_NOWHERE: tuple[Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class Astrometric(NamedTuple):
    """Where a body is seen from an observer at rest, ICRS axes.

    Parameters
    ----------
    direction, rate : Vector
        Unit vector from the observer, and its derivative per second.
    from_sun : tuple of Vector
        Unit vector from the Sun, and its derivative per second; zero for the Sun itself.
    distance_au : float
        How far the body was when the light left it.
    """

    direction: Vector
    rate: Vector
    from_sun: tuple[Vector, Vector]
    distance_au: float


@dataclass(frozen=True)
class SolarSystemBody:
    """The Sun, the Moon, or a planet from Mercury to Pluto.

    Parameters
    ----------
    name : str
        Which; case does not matter.
    kernel : Path, optional
        An SPK file to take it from; by default that of the package skyfield-data where it is installed, else ERFA's
        series.

    Raises
    ------
    TargetError
        There is no such body; the kernel cannot be read or does not hold it; Pluto without a kernel.
    """

    name: str
    kernel: Path | None = None
    _body: Body = field(init=False, repr=False, compare=False)
    _kernel: Kernel | None = field(init=False, repr=False, compare=False)
    _number: int = field(init=False, repr=False, compare=False)
    _span: tuple[float, float] = field(init=False, repr=False, compare=False)  # of the kernel, s of TDB since J2000

    def __post_init__(self) -> None:
        body = BODIES.get(self.name.strip().casefold())
        if body is None:
            names = ", ".join(known.name for known in BODIES.values())
            raise TargetError(f"{self.name!r} is no body of the solar system that is known here: give {names}")
        path = self.kernel or bundled_kernel()
        opened = None if path is None else kernel(path)
        number, span = (0, (math.inf, -math.inf)) if opened is None else _found(opened, body)
        if opened is None and math.isinf(body.series_arcsec):
            raise TargetError(f"{body.name} is known from a JPL kernel only: {EXTRA}, or set [targets] kernel")
        made = {"name": body.name, "_body": body, "_kernel": opened, "_number": number, "_span": span}
        for name, value in made.items():
            object.__setattr__(self, name, value)

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        place = self.astrometric(frame)
        return frame.observe(place.direction, place.from_sun[0])

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        place = self.astrometric(frame)
        return frame.observe_with_rate(place.direction, place.rate, place.from_sun)

    def astrometric(self, frame: SkyFrame) -> Astrometric:
        """Where the body is seen from the place of a frame by an observer at rest.

        Raises
        ------
        TargetError
            Pluto, when the kernel does not cover the moment; the kernel is damaged.
        """
        now = _tdb(frame)
        state, number = self._ephemeris(now)
        return _seen(state, number, now, _observer(state, now, frame))

    def note_at(self, instant: Instant) -> str:
        """Say which ephemeris stands in at a moment, and how wrong it may be; empty where a kernel covers it."""
        if self._covers(instant):
            return ""
        first, last = SERIES_YEARS
        inside = first <= _year(since_j2000(instant)) < last
        error = f"up to {self._body.series_arcsec:g}″" if inside else f"how far is known for {first} to {last} only"
        return f"{self._why_no_kernel()}; ERFA's series stand in, which may be off: {error}"

    def _covers(self, instant: Instant) -> bool:
        return self._span[0] <= since_j2000(instant) <= self._span[1]

    def _why_no_kernel(self) -> str:
        if self._kernel is None:
            return f"{self.name}: no JPL kernel is installed, {EXTRA}"
        begin, end = (_year(seconds) for seconds in self._span)
        name = self._kernel.path.name
        return f"{self.name}: kernel {name} covers {begin:.1f} to {end:.1f}, set [targets] kernel to a longer one"

    def _ephemeris(self, instant: Instant) -> tuple[Ephemeris, int]:
        """Who knows the body's place at a moment, and by which number."""
        if self._kernel is not None and self._covers(instant):
            return self._kernel.state, self._number
        if math.isinf(self._body.series_arcsec):
            raise TargetError(f"{self._why_no_kernel()}; ERFA's series, which stand in for others, do not have it")
        return planetary_series.state, self._body.numbers[0]


def _found(opened: Kernel, body: Body) -> tuple[int, tuple[float, float]]:
    """By which number a kernel holds a body, and from when to when it holds the Earth and the Sun as well."""
    needed = [opened.span(number) for number in (EARTH, SUN)]
    for number in body.numbers:
        spans = [span for span in (opened.span(number), *needed) if span is not None]
        if len(spans) == 1 + len(needed):
            return number, (max(begin for begin, _ in spans), min(end for _, end in spans))
    wanted = f"{body.name}, the Earth and the Sun (numbers {' or '.join(map(str, body.numbers))}, {EARTH} and {SUN})"
    raise TargetError(f"kernel {opened.path} does not hold {wanted}: set [targets] kernel to one such as de440s.bsp")


def _observer(state: Ephemeris, now: Instant, frame: SkyFrame) -> State:
    """Barycentric place in au and velocity in au a second of the place on the Earth that a frame is of."""
    (x, y, z), (vx, vy, vz) = state(EARTH, now)
    (gx, gy, gz), (sx, sy, sz) = frame.geocentric_au, frame.spin_au_day
    return (x + gx, y + gy, z + gz), (vx + sx / DAY, vy + sy / DAY, vz + sz / DAY)


def _seen(state: Ephemeris, number: int, now: Instant, observer: State) -> Astrometric:
    (ox, oy, oz), (vx, vy, vz) = observer
    then, ((bx, by, bz), (ux, uy, uz)) = _when_the_light_left(state, number, now, observer[0])
    x, y, z = bx - ox, by - oy, bz - oz
    distance = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / distance, y / distance, z / distance
    # With r = b(t − τ) − o(t) and |r| = c τ: τ̇ = n·(ḃ − ȯ) / (c + n·ḃ), and b moves by ḃ (1 − τ̇).
    recede = x * ux + y * uy + z * uz
    pace = 1.0 - (recede - (x * vx + y * vy + z * vz)) / (_LIGHT_AU_S + recede)
    ux, uy, uz = ux * pace, uy * pace, uz * pace
    rate = _turning((x, y, z), (ux - vx, uy - vy, uz - vz), distance)
    if number == SUN:
        return Astrometric((x, y, z), rate, _NOWHERE, distance)
    (sx, sy, sz), (wx, wy, wz) = state(SUN, then)
    hx, hy, hz = bx - sx, by - sy, bz - sz
    far = math.sqrt(hx * hx + hy * hy + hz * hz)
    from_sun = hx / far, hy / far, hz / far
    moving = _turning(from_sun, (ux - wx * pace, uy - wy * pace, uz - wz * pace), far)
    return Astrometric((x, y, z), rate, (from_sun, moving), distance)


def _when_the_light_left(state: Ephemeris, number: int, now: Instant, observer: Vector) -> tuple[Instant, State]:
    """When the light that arrives now left a body, and the body's state then: Newton's method in the light time."""
    ox, oy, oz = observer
    light_time, then = 0.0, now
    for _ in range(_ROUNDS):
        (x, y, z), (vx, vy, vz) = state(number, then)
        rx, ry, rz = x - ox, y - oy, z - oz
        distance = math.sqrt(rx * rx + ry * ry + rz * rz)
        recede = (rx * vx + ry * vy + rz * vz) / distance
        step = (distance - _LIGHT_AU_S * light_time) / (_LIGHT_AU_S + recede)
        light_time += step
        then = now.plus(-light_time)
        if abs(step) < _ENOUGH_S:
            break
    return then, ((x - vx * step, y - vy * step, z - vz * step), (vx, vy, vz))


def _turning(direction: Vector, velocity: Vector, distance: float) -> Vector:
    """Derivative of a unit vector whose end, at a distance, has a velocity."""
    x, y, z = direction
    vx, vy, vz = velocity
    along = x * vx + y * vy + z * vz
    return (vx - along * x) / distance, (vy - along * y) / distance, (vz - along * z) / distance


def _tdb(frame: SkyFrame) -> Instant:
    """The moment of a frame in TDB, to 0.05 ms (USNO Circular 179, eq. 2.6, the leading terms)."""
    centuries = frame.years / 100.0
    late = 0.001657 * math.sin(628.3076 * centuries + 6.2401) + 0.000022 * math.sin(575.3385 * centuries + 4.2970)
    return frame.instant.plus(late)


def _year(seconds: float) -> float:
    return 2000.0 + seconds / DAY / YEAR_DAYS
