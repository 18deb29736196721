"""A target that moves as an ephemeris table says: an ECSV file of places against time, joined by splines.

The places are *astrometric* ICRS: with light time, without aberration, deflection or refraction, which the chain adds
as for any other target. A table without distances is taken as it stands, as its observer sees it. One with distances
is geocentric, unless its meta data say `observer: topocentric`, and is moved to the site by the parallax, the light
time of the difference included. Cubic splines through the Cartesian unit vector (and the distance) are continuous
with first and second derivative, so no step of the table is felt in the tracking. Nothing is extrapolated.
"""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pointing.ephemeris_file import read_rows, refuse_disorder
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.sky import AU_M, LIGHT_M_S, SkyFrame
from pointing.spline import LEAST_POINTS, Spline
from pointing.targets import ARCSEC
from pointing.vectors import Vector, direction_with_rate, from_longitude_latitude

if TYPE_CHECKING:
    from numpy.typing import NDArray

_LIGHT_AU_S = LIGHT_M_S / AU_M
_ROUGH_ARCSEC = 0.1
_FARTHEST = 2.0 * math.sin(math.radians(15.0))  # chord between rows; the curve must not come near the centre

Pair = tuple[Vector, Vector]


@dataclass(frozen=True)
class EphemerisTable:
    """A body at the places of a table.

    Parameters
    ----------
    name : str
        What people call it.
    times : tuple of n Instant
        Strictly increasing, n ≥ 4.
    directions : tuple of n Vector
        Astrometric unit vectors, ICRS axes.
    distances_au : tuple of n float, optional
        From the Earth's centre, when the places are geocentric and shall be moved to the site.
    observer : str
        `geocentric`, `topocentric`, or nothing where that is not known.

    Attributes
    ----------
    roughness_arcsec : float
        About how far the curve through the rows is from the body: what leaving out every other row changes, over 16
        as the error goes with the fourth power of the step.

    Raises
    ------
    TargetError
        Times do not increase, there are fewer than 4, rows are 30° apart, or a distance is not above 0.
    """

    name: str
    times: tuple[Instant, ...]
    directions: tuple[Vector, ...] = field(repr=False)
    distances_au: tuple[float, ...] = field(default=(), repr=False)
    observer: str = "topocentric"
    roughness_arcsec: float = field(init=False, compare=False)
    _spline: Spline = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        refuse_disorder(self.name, self.times)
        for row, distance in enumerate(self.distances_au, 1):
            if not 0.0 < distance < math.inf:
                raise TargetError(f"{self.name}, row {row}: distance {distance:g} au; possible are numbers above 0")
        for row, (before, after) in enumerate(pairwise(self.directions), 2):
            if math.dist(before, after) > _FARTHEST:
                raise TargetError(f"{self.name}, row {row}: more than 30° from the row before; give closer rows")
        seconds = [time.since(self.first) for time in self.times]
        values = np.array(self.directions, float)
        if self.distances_au:
            values = np.column_stack([values, np.array(self.distances_au)])
        object.__setattr__(self, "_spline", Spline(seconds, values))
        object.__setattr__(self, "roughness_arcsec", _roughness(seconds, values[:, :3]) / ARCSEC)

    @property
    def first(self) -> Instant:
        """The moment of the first row, before which the body's place is not known."""
        return self.times[0]

    @property
    def last(self) -> Instant:
        """The moment of the last row, after which the body's place is not known."""
        return self.times[-1]

    @classmethod
    def from_file(cls, path: str | Path) -> "EphemerisTable":
        """Read an ECSV table; `pointing.ephemeris_file` says what it holds.

        Raises
        ------
        TargetError
            It cannot be read, a column or unit is missing, or a row is impossible; the text names the row, the first
            being 1.
        """
        rows = read_rows(path)
        directions = tuple(from_longitude_latitude(*place) for place in zip(rows.ra, rows.dec, strict=True))
        return cls(rows.name, rows.times, directions, rows.distances_au, observer=rows.observer)

    def note_at(self, instant: Instant) -> str:  # noqa: ARG002 - it holds for all moments
        """Say when the observer of the places is not known, or the rows are too far apart for 0.1″."""
        told = []
        if not self.observer:
            told.append(
                "no distances and no observer in its table, so the places are taken for those of this site; "
                "geocentric ones are off by the parallax, 8.8″ at 1 au: add a column distance, or `observer: "
                "topocentric`"
            )
        if self.roughness_arcsec > _ROUGH_ARCSEC:
            told.append(f"joined to about {self.roughness_arcsec:.1f}″: take a table of closer rows")
        return f"{self.name}: {'; '.join(told)}" if told else ""

    def astrometric(self, frame: SkyFrame) -> Vector:
        """Astrometric direction at a moment, as seen from the site, ICRS axes."""
        return self.astrometric_with_rate(frame)[0]

    def astrometric_with_rate(self, frame: SkyFrame) -> Pair:
        """`astrometric` and its derivative per second.

        Raises
        ------
        TargetError
            The moment is before the first or after the last row.
        """
        if not self.first <= frame.instant <= self.last:
            raise TargetError(
                f"{self.name}: its table holds {self.first.utc_iso()} to {self.last.utc_iso()}, not "
                f"{frame.instant.utc_iso()}, and nothing is extrapolated; bring a table of that time"
            )
        value, change = self._spline.at(frame.instant.since(self.first))
        direction = direction_with_rate((value[0], value[1], value[2]), (change[0], change[1], change[2]))
        if not self.distances_au:
            return direction
        return direction_with_rate(*_from_site(direction, (value[3], change[3]), frame))

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        return frame.observe(self.astrometric(frame))

    def observed_with_rate(self, frame: SkyFrame) -> Pair:
        """Return the observed direction and its derivative per second."""
        return frame.observe_with_rate(*self.astrometric_with_rate(frame))


def _roughness(seconds: list[float], values: "NDArray[np.float64]") -> float:
    """About the largest error of a spline, radians; 0 where the rows are too few to tell."""
    if len(seconds) < 2 * LEAST_POINTS:
        return 0.0
    coarse = Spline(seconds[::2], values[::2])
    last = len(seconds) - 1 - (len(seconds) % 2 == 0)  # between rows of the coarse one
    missed = [math.dist(coarse.at(seconds[i])[0], values[i]) for i in range(1, last, 2)]
    return max(missed) / 16.0


def _from_site(direction: Pair, distance: tuple[float, float], frame: SkyFrame) -> Pair:
    """Place of a body from the site, au, and its velocity, au a second, given those from the Earth's centre.

    A place from the Earth's centre is X(t − τ) − E(t). Light reaches the site earlier or later by up to 21 ms, in
    which the body goes on at its barycentric velocity Ẋ = (ρ̇ + Ė) / (1 − τ̇): 0.3″ for the Moon.
    """
    (n, dn), (far, dfar) = direction, distance
    place = tuple(far * x for x in n)
    velocity = tuple(dfar * x + far * dx for x, dx in zip(n, dn, strict=True))
    turn = tuple(spin / DAY for spin in frame.spin_au_day)
    earth = tuple(v * _LIGHT_AU_S - u for v, u in zip(frame.velocity_c, turn, strict=True))
    slowed = 1.0 - dfar / _LIGHT_AU_S
    going = tuple((v + e) / slowed for v, e in zip(velocity, earth, strict=True))
    x, y, z = (p - g for p, g in zip(place, frame.geocentric_au, strict=True))
    vx, vy, vz = (v - u for v, u in zip(velocity, turn, strict=True))
    near = math.sqrt(x * x + y * y + z * z)
    # By how much less light time there is, and how that changes.
    gain = (far - near) / _LIGHT_AU_S
    gain_rate = (dfar - (x * vx + y * vy + z * vz) / near) / _LIGHT_AU_S
    gx, gy, gz = going
    return (
        (x + gx * gain, y + gy * gain, z + gz * gain),
        (vx + gx * gain_rate, vy + gy * gain_rate, vz + gz * gain_rate),
    )
