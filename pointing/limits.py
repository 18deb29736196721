"""Where the telescope may point: the horizon, the zone round the Sun, the travel of each axis.

A *margin* is the angle in radians by which a direction is allowed; negative by how much it is forbidden. Horizon and
Sun margins never change faster than the direction itself moves, so a path whose next stretch is shorter than the
margin is proven clear without looking between.
"""

import bisect
import csv
import math
from dataclasses import dataclass, field
from pathlib import Path

from pointing.errors import PointingError
from pointing.vectors import Vector


@dataclass(frozen=True)
class Check:
    """One question asked of a plan."""

    name: str
    ok: bool
    detail: str


@dataclass(frozen=True)
class Horizon:
    """The lowest allowed observed altitude, as one value or against azimuth.

    Parameters
    ----------
    altitudes : tuple of (azimuth, altitude)
        Radians, azimuth ascending in [0, 2π); straight lines between, closed through north. One point: all round.
    """

    altitudes: tuple[tuple[float, float], ...]
    _highest: float = field(init=False, repr=False, compare=False)
    _azimuths: tuple[float, ...] = field(init=False, repr=False, compare=False)
    _slope: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        azimuths = tuple(azimuth for azimuth, _ in self.altitudes)
        if not azimuths:
            raise PointingError("an empty horizon: give at least one azimuth and altitude")
        if list(azimuths) != sorted(set(azimuths)) or not 0 <= azimuths[0] <= azimuths[-1] < math.tau:
            raise PointingError("a horizon's azimuths must ascend within 0° to 360°, each once: sort the table")
        for _, altitude in self.altitudes:
            if not -math.pi / 2 <= altitude < math.pi / 2:
                raise PointingError(f"a horizon altitude of {math.degrees(altitude):g}°: allowed are −90° to 90°")
        object.__setattr__(self, "_azimuths", azimuths)
        object.__setattr__(self, "_highest", max(altitude for _, altitude in self.altitudes))
        object.__setattr__(self, "_slope", self._steepest())

    @classmethod
    def level(cls, altitude_deg: float) -> "Horizon":
        """The same altitude all round."""
        return cls(((0.0, math.radians(altitude_deg)),))

    @classmethod
    def read(cls, path: Path) -> "Horizon":
        """Read a CSV table with the columns azimuth_deg, altitude_deg.

        Raises
        ------
        PointingError
            The file cannot be read, or a row is not two numbers; the text names the line.
        """
        try:
            with path.open(newline="", encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        except (OSError, UnicodeDecodeError) as error:
            raise PointingError(f"horizon file {path}: {error}; check the path in [limits] horizon") from error
        points = {}
        for line, row in enumerate(rows, start=2):
            try:
                azimuth, altitude = float(row["azimuth_deg"]), float(row["altitude_deg"])
            except (KeyError, TypeError, ValueError):
                text = f"horizon file {path}, line {line}: needs the columns azimuth_deg,altitude_deg in numbers"
                raise PointingError(text) from None
            if not (math.isfinite(azimuth) and math.isfinite(altitude)):
                raise PointingError(f"horizon file {path}, line {line}: {azimuth}, {altitude} is not finite")
            points[math.radians(azimuth % 360.0)] = math.radians(altitude)
        return cls(tuple(sorted(points.items())))

    def altitude(self, azimuth: float) -> float:
        """The lowest allowed altitude at an azimuth, radians."""
        if len(self.altitudes) == 1:
            return self._highest
        azimuth %= math.tau
        i = bisect.bisect_right(self._azimuths, azimuth)
        left_azimuth, left = self.altitudes[i - 1]
        right_azimuth, right = self.altitudes[i % len(self.altitudes)]
        span = (right_azimuth - left_azimuth) % math.tau or math.tau
        return left + (right - left) * ((azimuth - left_azimuth) % math.tau) / span

    def margin(self, observed: Vector) -> float:
        """By how much a direction clears the horizon, radians; never more than the distance to the nearest edge."""
        x, y, z = observed
        rho = math.hypot(x, y)
        altitude = math.atan2(z, rho)
        above_all = altitude - self._highest
        if len(self.altitudes) == 1:
            return above_all
        here = altitude - self.altitude(math.atan2(y, -x))
        if here <= 0.0:
            return here
        # A step of d changes the altitude by at most d and the azimuth by at most d / cos(altitude); within d ≤ ρ/2
        # the cosine stays above ρ/2, so the height above the line falls by at most d · (1 + 2 · slope / ρ).
        return max(above_all, min(here / (1.0 + 2.0 * self._slope / max(rho, 1e-9)), rho / 2.0))

    def _steepest(self) -> float:
        points = self.altitudes
        slopes = [0.0]
        for (left_azimuth, left), (right_azimuth, right) in zip(points, points[1:] + points[:1], strict=True):
            span = (right_azimuth - left_azimuth) % math.tau or math.tau
            slopes.append(abs(right - left) / span)
        return max(slopes)


@dataclass(frozen=True)
class Limits:
    """What the sky side of the safety rules allows.

    Parameters
    ----------
    horizon : Horizon
        The lowest allowed observed altitude.
    sun_avoidance : float
        Radius of the forbidden zone round the Sun, radians; 0 for none.
    """

    horizon: Horizon
    sun_avoidance: float = 0.0

    def sun_margin(self, observed: Vector, sun: Vector) -> float:
        """Angle between a direction and the edge of the Sun's zone, radians; infinite where there is no zone."""
        return separation(observed, sun) - self.sun_avoidance if self.sun_avoidance > 0.0 else math.inf


def separation(a: Vector, b: Vector) -> float:
    """Angle between two unit vectors, radians, exact at any size (after Vincenty)."""
    ax, ay, az = a
    bx, by, bz = b
    cross = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return math.atan2(cross, ax * bx + ay * by + az * bz)
