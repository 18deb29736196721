"""Asteroids and comets: where a body on its osculating orbit is seen.

The body moves about the Sun alone; the Sun's own place is that of `ephemeris`, so the Earth and the body stand in the
same axes. The astrometric direction is from the observer, at the moment, to where the body was when its light left:
|X(t − τ) − O(t)| = c τ, solved by Newton's method. Its rate follows by differentiating that equation,

    τ̇ = n·(V − Ȯ) / (c + n·V)

with n the direction, so that nothing is differenced.

What two-body motion leaves out is the pull of the planets, which grows with the square of the time from the epoch of
the elements: d days from it, nine of ten bodies of the main belt are within 0.0007″·d² of their place (1″ in 38 days,
7″ in a hundred) and half of them within a quarter of that; one near a planet can be farther off.
"""

import math
from dataclasses import dataclass
from pathlib import Path

from pointing.ephemeris import sun
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.mpc import read_elements
from pointing.sky import AU_M, LIGHT_M_S, SkyFrame
from pointing.two_body import Orbit
from pointing.vectors import Vector, direction_with_rate

_LIGHT_AU_S = LIGHT_M_S / AU_M
_CLOSED_S = 1e-9  # of light time: a body at 100 km/s goes 0.1 mm
_ROUNDS = 12  # Newton needs two or three
_DRIFT_ARCSEC_DAY2 = 0.0007


@dataclass(frozen=True)
class MinorBody:
    """A body that moves about the Sun by osculating elements.

    Parameters
    ----------
    name : str
        What people call it.
    orbit : Orbit
        Where it moves.
    epoch : Instant or None
        When the elements osculate; None where that is not known.
    """

    name: str
    orbit: Orbit
    epoch: Instant | None = None

    @classmethod
    def from_file(cls, path: str | Path, name: str = "") -> "MinorBody":
        """Read a body from a file of one-line elements, by name, number or designation.

        Raises
        ------
        TargetError
            As `pointing.mpc.read_elements`.
        """
        found = read_elements(path, name)
        return cls(found.name, found.orbit, found.epoch)

    def note_at(self, instant: Instant) -> str:
        """Say how old the elements are, and by how much two-body motion may have drifted since."""
        if self.epoch is None:
            return (
                f"{self.name}: its elements do not say when they osculate; two-body motion drifts by up to 1″ in 38 "
                "days and 7″ in a hundred, more near a planet: take elements of this month"
            )
        days = abs(instant.since(self.epoch)) / DAY
        side = "after" if instant >= self.epoch else "before"
        return (
            f"{self.name}: {days:.0f} days {side} the epoch of its elements, {self.epoch.utc_iso(0)[:10]}; two-body "
            f"motion drifts by up to {_DRIFT_ARCSEC_DAY2 * days * days:.1f}″ in that time, more near a planet: take "
            "elements of a near epoch"
        )

    def astrometric(self, frame: SkyFrame) -> Vector:
        """Astrometric direction, a unit vector of the ICRS axes: with light time, without aberration."""
        return self._seen(frame)[0][0]

    def astrometric_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """`astrometric` and its derivative per second."""
        return self._seen(frame)[0]

    def distance_au(self, frame: SkyFrame) -> float:
        """Return the distance that the light has come, au."""
        return self._seen(frame)[2] * _LIGHT_AU_S

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        (direction, _), (from_sun, _), _ = self._seen(frame)
        return frame.observe(direction, from_sun)

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        (direction, rate), from_sun, _ = self._seen(frame)
        return frame.observe_with_rate(direction, rate, from_sun)

    def _seen(self, frame: SkyFrame) -> tuple[tuple[Vector, Vector], tuple[Vector, Vector], float]:
        """Directions from the observer and from the Sun, ICRS axes, each with its derivative per second; light time.

        Raises
        ------
        TargetError
            The light time is not found: the body falls past the observer as fast as light.
        """
        ox, oy, oz = frame.position_au
        delay = 0.0
        for _ in range(_ROUNDS):
            (hx, hy, hz), (ux, uy, uz) = self._heliocentric(emitted := frame.instant.plus(-delay))
            (sx, sy, sz), (wx, wy, wz) = sun(emitted)
            dx, dy, dz = sx + hx - ox, sy + hy - oy, sz + hz - oz
            vx, vy, vz = wx + ux, wy + uy, wz + uz
            distance = math.sqrt(dx * dx + dy * dy + dz * dz)
            nx, ny, nz = dx / distance, dy / distance, dz / distance
            recede = nx * vx + ny * vy + nz * vz
            step = (distance - _LIGHT_AU_S * delay) / (_LIGHT_AU_S + recede)
            delay += step
            if abs(step) < _CLOSED_S:
                break
        else:
            raise TargetError(f"{self.name}: its light time does not close, {delay:g} s; check the elements")
        ax, ay, az = (v * _LIGHT_AU_S for v in frame.velocity_c)
        delay_rate = (recede - nx * ax - ny * ay - nz * az) / (_LIGHT_AU_S + recede)
        k = 1.0 - delay_rate
        seen = direction_with_rate((dx, dy, dz), (vx * k - ax, vy * k - ay, vz * k - az))
        return seen, direction_with_rate((hx, hy, hz), (ux * k, uy * k, uz * k)), delay

    def _heliocentric(self, instant: Instant) -> tuple[Vector, Vector]:
        """Position, au, and velocity, au a second, from the Sun."""
        place, (vx, vy, vz) = self.orbit.state(instant)
        return place, (vx / DAY, vy / DAY, vz / DAY)
