"""Observed direction to mechanical axis angles and back, for the three mount types in both postures.

Frames (right-handed): the horizon frame has x south, y east, z zenith. An equatorial mount's base frame has x to the
meridian point of the equator, y east, z the north celestial pole; an altazimuth's is the horizon frame. The mount's
own frame is the base frame turned by the rotation vector (X, Y, 0): v_mount = R(X, Y)ᵀ · v_base, the TC410's mount
registers. First order: MA = −X, ME = −Y; AW = X, AN = −Y.

*Normal* posture has |axis 2| ≤ 90°. *Beyond* is the same direction reached over the pole or zenith: axis 1 + 180°,
axis 2 = 180° − axis 2, which a southern equatorial mount writes −180° − axis 2.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from pointing.errors import PointingError
from pointing.vectors import Vector

Posture = Literal["normal", "beyond"]
POSTURES: tuple[Posture, Posture] = ("normal", "beyond")

_POLE = 1e-12  # closer to axis 1 than this, its angle is taken as 0 and its rate as 0: there is none


class MountType(Enum):
    """The mount types, numbered as in the TC410's register."""

    EQUATORIAL_FORK = 1
    ALTAZ_FORK = 2
    GERMAN = 3

    @property
    def text(self) -> str:
        """The configuration's word for it."""
        return self.name.lower().replace("_", "-")

    @classmethod
    def from_text(cls, text: str) -> "MountType":
        """Read the configuration's word.

        Raises
        ------
        PointingError
            The word names no mount type.
        """
        for kind in cls:
            if kind.text == text:
                return kind
        raise PointingError(f"mount type {text!r}: use one of {', '.join(kind.text for kind in cls)}")


@dataclass(frozen=True)
class Mount:
    """A mount on its site, with the direction of its first axis.

    Parameters
    ----------
    type : MountType
        Equatorial fork, altazimuth fork or German.
    latitude : float
        Radians, north positive.
    x, y : float
        The rotation vector of the misalignment, radians.

    Raises
    ------
    PointingError
        The latitude or the misalignment is impossible.
    """

    type: MountType
    latitude: float
    x: float = 0.0
    y: float = 0.0
    _rows: tuple[Vector, Vector, Vector] = field(init=False, repr=False, compare=False)
    _zero: float = field(init=False, repr=False, compare=False)
    _turn: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= math.pi / 2:
            raise PointingError(f"latitude {math.degrees(self.latitude):g}°: possible are −90° to 90°")
        if not math.hypot(self.x, self.y) <= math.pi:
            turns = f"X {math.degrees(self.x):g}°, Y {math.degrees(self.y):g}°"
            raise PointingError(f"a misalignment of {turns}: possible are 180° together; a mount has a few degrees")
        turned = _transposed(_rodrigues(self.x, self.y))
        altaz = self.type is MountType.ALTAZ_FORK
        rows = turned if altaz else _product(turned, _equator_from_horizon(self.latitude))
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_zero", math.pi if altaz else 0.0)
        south = self.latitude < 0 and not altaz
        object.__setattr__(self, "_turn", -math.pi if south else math.pi)

    def axes(self, observed: Vector, posture: Posture) -> tuple[float, float]:
        """Mechanical axis angles that point at an observed direction.

        Parameters
        ----------
        observed : Vector
            Unit vector in the horizon frame.
        posture : Posture
            Which of the two ways to point there.

        Returns
        -------
        tuple[float, float]
            Radians; axis 1 within (−π, π] of its zero in normal posture, not wound.
        """
        x, y, z = self._to_mount(observed)
        axis1 = self._zero - math.atan2(y, x)
        axis2 = math.atan2(z, math.hypot(x, y))
        return (axis1, axis2) if posture == "normal" else (axis1 + math.pi, self._turn - axis2)

    def observed(self, axis1: float, axis2: float) -> Vector:
        """Observed direction, horizon frame, at mechanical axis angles; the inverse of `axes` for either posture."""
        cos2 = math.cos(axis2)
        lateral = self._zero - axis1
        x = cos2 * math.cos(lateral)
        y = cos2 * math.sin(lateral)
        z = math.sin(axis2)
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z

    def axes_and_rates(
        self, observed: Vector, rate: Vector, posture: Posture
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Angle and rate of each axis that keep the telescope on a moving direction.

        Parameters
        ----------
        observed, rate : Vector
            Unit vector in the horizon frame and its derivative per second.
        posture : Posture
            Which of the two ways to point there.

        Returns
        -------
        tuple
            ((angle, rate) of axis 1, (angle, rate) of axis 2), radians and radians per second.
        """
        x, y, z = self._to_mount(observed)
        vx, vy, vz = self._to_mount(rate)
        rho2 = x * x + y * y
        rho = math.sqrt(rho2)
        axis1 = self._zero - math.atan2(y, x)
        axis2 = math.atan2(z, rho)
        if rho < _POLE:
            rate1, rate2 = 0.0, math.copysign(math.hypot(vx, vy), -z)
        else:
            rate1 = (y * vx - x * vy) / rho2
            rate2 = vz * rho - z * (x * vx + y * vy) / rho
        if posture == "normal":
            return (axis1, rate1), (axis2, rate2)
        return (axis1 + math.pi, rate1), (self._turn - axis2, -rate2)

    def posture(self, axis2: float) -> Posture:
        """Whether an axis 2 angle lies in the normal range or beyond the pole."""
        return "normal" if math.cos(axis2) >= 0.0 else "beyond"

    def _to_mount(self, v: Vector) -> Vector:
        x, y, z = v
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


Rows = tuple[Vector, Vector, Vector]


def _rodrigues(x: float, y: float) -> Rows:
    """Active rotation by the vector (x, y, 0): Rodrigues' formula."""
    angle = math.hypot(x, y)
    if angle == 0.0:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    kx, ky = x / angle, y / angle
    s, c1 = math.sin(angle), 2.0 * math.sin(angle / 2.0) ** 2
    return (
        (1.0 - c1 * ky * ky, c1 * kx * ky, s * ky),
        (c1 * kx * ky, 1.0 - c1 * kx * kx, -s * kx),
        (-s * ky, s * kx, 1.0 - c1),
    )


def _equator_from_horizon(latitude: float) -> Rows:
    s, c = math.sin(latitude), math.cos(latitude)
    return (s, 0.0, c), (0.0, 1.0, 0.0), (-c, 0.0, s)


def _transposed(m: Rows) -> Rows:
    (a, b, c), (d, e, f), (g, h, i) = m
    return (a, d, g), (b, e, h), (c, f, i)


def _product(m: Rows, n: Rows) -> Rows:
    columns = _transposed(n)
    rows = [tuple(sum(p * q for p, q in zip(row, column, strict=True)) for column in columns) for row in m]
    return rows[0], rows[1], rows[2]  # type: ignore[return-value]
