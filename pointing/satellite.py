"""An Earth satellite: where it is by its two-line elements, and where it is seen.

SGP4 gives the place in the axes TEME. Its velocity is not quite the derivative of its place, so the place is made
into segments of three minutes, counted from the epoch: polynomials of degree 9 through the Chebyshev nodes, which
follow SGP4 to 0.1 mm and have a derivative. Light takes its time: what is seen now is where the satellite was then,
in axes that stand still meanwhile. Time since the epoch is that of a clock, leap seconds included.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.sky import AU_M, LIGHT_M_S, SIDEREAL_ROTATION, Sky, SkyFrame
from pointing.tle import Tle, choose, read_tle
from pointing.vectors import Vector

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sgp4.api import Satrec

OLDEST_DAYS = 90.0
_SEGMENT = 180.0  # s; the steps of SGP4's resonances, 720 minutes, are whole numbers of it
_SEGMENTS_A_DAY = int(DAY / _SEGMENT)
_NODES = np.cos(np.pi * (np.arange(10) + 0.5) / 10)
_TO_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))
_HALF = _SEGMENT / 2.0
_DEEP = 86400.0 / (
    225.0 * 60.0
)  # revolutions a day; below, SGP4 counts the Sun and the Moon, and air does not matter

Powers = tuple[float, float, float, float, float, float, float, float, float, float]
Segment = tuple[Powers, Powers, Powers]

_NEWER = "get newer elements"
_REASONS = {  # the error codes of SGP4
    1: "its elements are of no orbit any more, as if it had decayed",
    2: "its mean motion falls below zero",
    3: "the perturbed eccentricity leaves 0 to 1",
    4: "the orbit has no width left",
    5: "it is below the ground",
    6: "it has decayed",
}


class _Growth(NamedTuple):
    """Expected error of elements in kilometres: at their epoch, and per day squared."""

    at_epoch_km: float
    km_day2: float


# What comparisons with precise orbits find, rounded up: drag shifts a low satellite by the square of the time.
_LOW, _HIGH = _Growth(1.0, 1.0), _Growth(3.0, 0.1)


@dataclass(frozen=True)
class Satellite:
    """An Earth satellite with its elements.

    Parameters
    ----------
    elements : Tle
        One element set.

    Raises
    ------
    TargetError
        The elements are of no orbit, or of one that meets the ground.
    """

    elements: Tle
    _record: "Satrec" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        from sgp4.api import Satrec  # noqa: PLC0415 - 10 ms: only its users pay

        record = Satrec.twoline2rv(self.elements.line1, self.elements.line2)
        if record.altp <= 0.0:
            depth = -record.altp * record.radiusearthkm
            raise TargetError(f"{self.elements}: its perigee is {depth:.0f} km below the ground; {_NEWER}")
        if record.error:
            raise TargetError(f"{self.elements}: {_REASONS[record.error]}; {_NEWER}")
        object.__setattr__(self, "_record", record)

    @classmethod
    def read(cls, path: Path, wanted: str = "") -> "Satellite":
        """Read one satellite of a TLE file, by its name or number; without either, the only one.

        Raises
        ------
        TargetError
            The file cannot be used, or has no such satellite, or several.
        """
        return cls(choose(read_tle(path), wanted, f"TLE file {path}"))

    @property
    def name(self) -> str:
        """What people call it."""
        return self.elements.name

    @property
    def fastest_m_s(self) -> float:
        """A speed over the turning ground that it never exceeds, metres per second."""
        record = self._record
        radius, eccentricity = float(record.a * record.radiusearthkm) * 1e3, float(record.ecco)
        # Vis-viva at the perigee, the ground's turn at the apogee; periodic terms are below a percent of the axis.
        at_perigee = float(record.no_kozai) / 60.0 * radius * math.sqrt((1.0 + eccentricity) / (1.0 - eccentricity))
        return 1.03 * (at_perigee + SIDEREAL_ROTATION * radius * (1.0 + eccentricity))

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        return self.observed_with_rate(frame)[0]

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second.

        Raises
        ------
        TargetError
            The elements are over 90 days from the moment, or SGP4 finds no orbit then.
        """
        return frame.observe_near(*self.topocentric(frame))

    def topocentric(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Metres from the observer, horizon frame, to where the light comes from, and the change of that per second.

        Raises
        ------
        TargetError
            As for `observed_with_rate`.
        """
        segment, u = self._segment(frame.instant)
        a, b, c, d, e, f, g, h, i = frame.from_teme()
        # Over the light time the orbit is straight to 0.1 m of its length, 3e-10 s of the light time.
        (x, y, z), (vx, vy, vz) = _evaluated(segment, u)
        px, py, pz = frame.topocentric((a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z))
        wx, wy, wz = a * vx + b * vy + c * vz, d * vx + e * vy + f * vz, g * vx + h * vy + i * vz
        light = math.sqrt(px * px + py * py + pz * pz) / LIGHT_M_S
        for _ in range(2):
            qx, qy, qz = px - wx * light, py - wy * light, pz - wz * light
            light = math.sqrt(qx * qx + qy * qy + qz * qz) / LIGHT_M_S
        (x, y, z), (vx, vy, vz) = _evaluated(segment, u - light / _HALF)
        place = frame.topocentric((a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z))
        wx, wy, wz = a * vx + b * vy + c * vz, d * vx + e * vy + f * vz, g * vx + h * vy + i * vz
        # Under the turning Earth a place that stands still in TEME goes to the west.
        tx, ty = SIDEREAL_ROTATION * y, -SIDEREAL_ROTATION * x
        tx, ty, tz = a * tx + b * ty, d * tx + e * ty, g * tx + h * ty
        # c τ = |p(t, t − τ)|, differentiated.
        px, py, pz = place
        distance = math.sqrt(px * px + py * py + pz * pz)
        receding = (px * wx + py * wy + pz * wz) / distance
        turning = (px * tx + py * ty + pz * tz) / distance
        k = 1.0 - (receding + turning) / (LIGHT_M_S + receding)
        return place, (k * wx + tx, k * wy + ty, k * wz + tz)

    def steady(self, frame: SkyFrame) -> Callable[[float], float]:
        """Give, for an angle in radians, the seconds for which it surely stays within that of where it is seen."""
        seconds = math.dist(self.topocentric(frame)[0], (0.0, 0.0, 0.0)) / self.fastest_m_s
        return lambda angle: seconds * math.sin(min(angle, math.pi / 2.0))

    def altitudes(
        self, sky: Sky, start: Instant, seconds: "NDArray[np.float64]"
    ) -> tuple["NDArray[np.float64]", "NDArray[np.float64]"]:
        """Altitudes, radians, and distances, metres, on a grid of seconds after a moment, in SGP4's own speed.

        Without refraction, light time and aberration, to 0.01°; NaN where `observed` would raise.
        """
        days, rest = divmod(start.since(self.elements.epoch), DAY)
        places, codes = self.places(int(days), rest + seconds)
        stale = np.abs(days * DAY + rest + seconds) > OLDEST_DAYS * DAY
        s, c = np.sin(SIDEREAL_ROTATION * seconds), np.cos(SIDEREAL_ROTATION * seconds)
        x, y, z = places.T
        level = np.array(sky.at(start).from_teme()).reshape(3, 3) @ (c * x + s * y, c * y - s * x, z)
        south, east, up = level - np.array([sky.south_au, 0.0, sky.zenith_au])[:, None] * AU_M
        distance = np.sqrt(south**2 + east**2 + up**2)
        return np.where((codes != 0) | stale, np.nan, np.arcsin(up / distance)), distance

    def age_days(self, instant: Instant) -> float:
        """Days from the epoch of the elements to a moment."""
        return instant.since(self.elements.epoch) / DAY

    def expected_error_km(self, instant: Instant) -> float:
        """How far along its track it may be from where the elements have it, as a rule.

        1 km at the epoch and 1 km × (days)² in low orbits (a period below 225 minutes), 3 km and 0.1 km × (days)² in
        high ones.
        """
        growth = _LOW if self.elements.revolutions_a_day > _DEEP else _HIGH
        return growth.at_epoch_km + growth.km_day2 * self.age_days(instant) ** 2

    def note_at(self, instant: Instant) -> str:
        """Say how old the elements are and what error to expect of them, at most, where it is nearest."""
        days, error = self.age_days(instant), self.expected_error_km(instant)
        nearest = float(self._record.altp * self._record.radiusearthkm)
        arcsec = math.degrees(math.atan2(error, nearest)) * 3600.0
        age = f"{days:.1f} days old" if days >= 0.0 else f"of {-days:.1f} days later"
        return (
            f"{self.name}: its elements are {age}: expect it up to {error:.3g} km along its track from where they "
            f"have it, {arcsec:.0f}″ at the {nearest:.0f} km of its perigee"
        )

    def places(self, days: int, seconds: "NDArray[np.float64]") -> tuple["NDArray[np.float64]", "NDArray[np.uint8]"]:
        """Where SGP4 has it, and what SGP4 complains of.

        Parameters
        ----------
        days : int
            Days since the epoch.
        seconds : array (n,)
            Seconds on top of them.

        Returns
        -------
        tuple of array (n, 3), array (n,)
            Metres from the Earth's centre in TEME, and error codes: where one is not 0 the place is none.
        """
        record = self._record
        whole = np.full(len(seconds), record.jdsatepoch + days)
        codes, kilometres, _ = record.sgp4_array(whole, record.jdsatepochF + seconds / DAY)
        return kilometres * 1e3, codes

    def _segment(self, instant: Instant) -> tuple[Segment, float]:
        """Return the segment a moment is in and where in it, from −1 to 1."""
        day, start = self.elements.epoch
        days, seconds = instant.day - day, instant.seconds - start
        if abs(days + seconds / DAY) > OLDEST_DAYS:
            raise TargetError(
                f"{self.elements}: {abs(days + seconds / DAY):.0f} days from {instant.utc_iso(0)}, more than"
                f" {OLDEST_DAYS:.0f}; nobody knows where it is: {_NEWER}"
            )
        index = math.floor(seconds / _SEGMENT)
        return _powers(self, days * _SEGMENTS_A_DAY + index), (seconds - index * _SEGMENT) / _HALF - 1.0


@lru_cache(maxsize=1024)
def _powers(satellite: Satellite, index: int) -> Segment:
    """Power series in u ∈ [−1, 1] of x, y, z in metres, for three minutes from index × 180 s after the epoch on."""
    days, segment = divmod(index, _SEGMENTS_A_DAY)
    places, codes = satellite.places(days, (segment + 0.5 * (_NODES + 1.0)) * _SEGMENT)
    if codes.any():
        instant = satellite.elements.epoch.plus(index * _SEGMENT)
        reason = _REASONS[int(codes[codes != 0][0])]
        raise TargetError(f"{satellite.elements}: by {instant.utc_iso(0)} {reason}; {_NEWER}")
    x, y, z = (tuple(column) for column in (_TO_POWERS @ places).T.tolist())
    return x, y, z


def _evaluated(segment: Segment, u: float) -> tuple[Vector, Vector]:
    """Place and velocity, metres and metres per second."""
    (x, dx), (y, dy), (z, dz) = (_series(powers, u) for powers in segment)
    return (x, y, z), (dx / _HALF, dy / _HALF, dz / _HALF)


def _series(powers: Powers, u: float) -> tuple[float, float]:
    """A power series and its derivative, by Horner's rule."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = powers
    value = ((((((((c9 * u + c8) * u + c7) * u + c6) * u + c5) * u + c4) * u + c3) * u + c2) * u + c1) * u + c0
    slope = (
        ((((((9 * c9 * u + 8 * c8) * u + 7 * c7) * u + 6 * c6) * u + 5 * c5) * u + 4 * c4) * u + 3 * c3) * u + 2 * c2
    ) * u + c1
    return value, slope
