"""Where the telescope may point: the horizon, the zone round the Sun, the travel of each axis.

A *margin* is the angle in radians by which a direction is allowed; negative by how much it is forbidden. *Room* is
how far one can go from it in any direction and still be allowed: a path whose next stretch is shorter than its room
is proven clear without looking between. Of the Sun's round zone the margin is the room.
"""

import bisect
import csv
import math
from dataclasses import dataclass, field
from pathlib import Path

from pointing.errors import PointingError
from pointing.vectors import Vector

_STEPS = 360  # points of a widened horizon
_STEP = math.tau / _STEPS
_ZENITH = math.radians(89.999)  # a horizon stays below it


@dataclass(frozen=True)
class Check:
    """One question asked of a plan; `margin` where it is asked of a place, infinite for what is not bounded."""

    name: str
    ok: bool
    detail: str
    margin: float = field(default=math.inf, compare=False)


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
        """Read a CSV table with the columns azimuth_deg, altitude_deg, its rows in any order.

        An azimuth of −90° is one of 270°; 360° may repeat 0° to close the table.

        Raises
        ------
        PointingError
            The file cannot be read, a row is not two possible numbers, or an azimuth has two altitudes; the text
            names the line.
        """
        try:
            with path.open(newline="", encoding="utf-8-sig") as file:
                table = csv.DictReader(file, skipinitialspace=True)
                if not {"azimuth_deg", "altitude_deg"} <= set(table.fieldnames or ()):
                    text = f"horizon file {path}: its first line must name the columns azimuth_deg,altitude_deg"
                    raise PointingError(text)
                rows = [(table.line_num, row) for row in table]
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise PointingError(f"horizon file {path}: {error}; check the path in [limits] horizon") from error
        if not rows:
            raise PointingError(f"horizon file {path} has no rows: give at least one azimuth and altitude")
        points: dict[float, float] = {}
        for line, row in rows:
            where = f"horizon file {path}, line {line}"
            azimuth, altitude = _row(row["azimuth_deg"], row["altitude_deg"], where)
            if points.setdefault(azimuth, altitude) != altitude:
                raise PointingError(
                    f"{where}: azimuth {azimuth:g}° has two altitudes, {points[azimuth]:g}° and {altitude:g}°; "
                    f"for a vertical edge move one of them by 0.01°"
                )
        return cls(tuple((math.radians(azimuth), math.radians(points[azimuth])) for azimuth in sorted(points)))

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
        """Altitude of a direction above the lowest allowed there, radians."""
        x, y, z = observed
        return math.atan2(z, math.hypot(x, y)) - self.altitude(math.atan2(y, -x))

    def room(self, observed: Vector, floor: float = 0.0) -> float:
        """How far, radians, one can go from a direction anywhere and still have a margin of `floor` or more."""
        x, y, z = observed
        rho = math.hypot(x, y)
        altitude = math.atan2(z, rho)
        above_all = altitude - self._highest - floor
        if len(self.altitudes) == 1:
            return above_all
        here = altitude - self.altitude(math.atan2(y, -x)) - floor
        if here <= 0.0:
            return here
        # A step of d changes the altitude by at most d and the azimuth by at most d / cos(altitude); within d ≤ ρ/2
        # the cosine stays above ρ/2, so the height above the line falls by at most d · (1 + 2 · slope / ρ).
        return max(above_all, min(here / (1.0 + 2.0 * self._slope / max(rho, 1e-9)), rho / 2.0))

    def widened(self, by: float) -> "Horizon":
        """The horizon above which everything within `by` radians of a direction is above this one.

        Such a circle spans asin(sin `by` / cos altitude) of azimuth to either side, where it can touch this horizon
        at all; the new one is the highest altitude in that span, raised by `by`. It never comes out lower than
        needed, and is higher by at most what this one climbs in a degree more.
        """
        if by <= 0.0:
            return self
        highest = self._highest + by
        if len(self.altitudes) == 1:
            return Horizon(((0.0, min(highest, _ZENITH)),))
        level = math.cos(highest) if highest + by < math.pi / 2 else 0.0
        span = math.asin(math.sin(by) / level) if level > math.sin(by) else math.pi
        return Horizon(
            tuple(
                (azimuth, min(self._highest_within(azimuth, span + _STEP) + by, _ZENITH))
                for azimuth in (i * _STEP for i in range(_STEPS))
            )
        )

    def _highest_within(self, azimuth: float, span: float) -> float:
        """Highest altitude within `span` of an azimuth, radians: at an end of the span, or at a point in it."""
        if span >= math.pi:
            return self._highest
        ends = self.altitude(azimuth - span), self.altitude(azimuth + span)
        inside = (top for place, top in self.altitudes if abs(math.remainder(place - azimuth, math.tau)) <= span)
        return max(*ends, *inside)

    def distance(self, observed: Vector) -> float:
        """How far, radians, it is at least from a direction to the line of the horizon, from either side."""
        here = self.margin(observed)
        if here >= 0.0 or len(self.altitudes) == 1:
            return abs(self.room(observed))
        x, y, z = observed
        rho = math.hypot(x, y)
        below_all = min(altitude for _, altitude in self.altitudes) - math.atan2(z, rho)
        return max(below_all, min(-here / (1.0 + 2.0 * self._slope / max(rho, 1e-9)), rho / 2.0))  # as in `room`

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

    def __post_init__(self) -> None:
        if not 0.0 <= self.sun_avoidance <= math.pi:
            raise PointingError(
                f"a Sun avoidance of {math.degrees(self.sun_avoidance):g}°: allowed are 0° (none) to 180°"
            )

    def widened(self, by: float) -> "Limits":
        """The limits for one direction that keep everything within `by` radians of it within these."""
        return Limits(
            self.horizon.widened(by), min(self.sun_avoidance + by, math.pi) if self.sun_avoidance > 0.0 else 0.0
        )

    def sun_margin(self, observed: Vector, sun: Vector) -> float:
        """Angle from a direction to the edge of the Sun's zone, radians; infinite where there is no zone.

        Parameters
        ----------
        observed, sun : Vector
            Directions in one frame; that of the Sun need not be a unit vector.
        """
        return separation(observed, sun) - self.sun_avoidance if self.sun_avoidance > 0.0 else math.inf


def separation(a: Vector, b: Vector) -> float:
    """Angle between two vectors of any length, radians, exact at any size (after Vincenty)."""
    ax, ay, az = a
    bx, by, bz = b
    cross = math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)
    return math.atan2(cross, ax * bx + ay * by + az * bz)


def _row(azimuth_text: str | None, altitude_text: str | None, where: str) -> tuple[float, float]:
    """Azimuth in [0°, 360°) and altitude of one row."""
    try:
        azimuth, altitude = float(azimuth_text or ""), float(altitude_text or "")
    except ValueError:
        raise PointingError(f"{where}: {azimuth_text!r}, {altitude_text!r} are not two numbers of degrees") from None
    if not -360.0 <= azimuth <= 360.0 or not -90.0 <= altitude < 90.0:
        raise PointingError(
            f"{where}: azimuth {azimuth:g}°, altitude {altitude:g}°; possible are −360° to 360° and −90° to below 90°"
        )
    azimuth %= 360.0
    return (0.0 if azimuth == 360.0 else azimuth), altitude  # the remainder of −1e-20 is 360.0
