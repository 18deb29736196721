"""Observed direction to mechanical axis angles and back, for the three mount types in both postures.

Frames (right-handed): the horizon frame has x south, y east, z zenith. An equatorial mount's base frame has x to the
meridian point of the equator, y east, z the north celestial pole; an altazimuth's is the horizon frame. The mount's
own frame is the base frame turned by the rotation vector (X, Y, 0): v_mount = R(X, Y)ᵀ · v_base, the TC410's mount
registers. First order: MA = −X, ME = −Y; AW = X, AN = −Y.

*Normal* posture has |axis 2| ≤ 90°. *Beyond* is the same direction reached over the pole or zenith: axis 1 + 180°,
axis 2 = 180° − axis 2, which a southern equatorial mount writes −180° − axis 2.

The *pointing origin* is the place in the focal plane on which the target is put. It is fixed to the tube: from the
tube's axis by x across, along the great circle in the direction of increasing axis 1, then by y with axis 2. That is
how it lies on the sky in normal posture; beyond, the tube has turned over and both are reversed there. Solved in
closed form after Wallace 2002 (SPIE 4848, 125) without non-perpendicularity: x is TPOINT's CH of an equatorial mount
and −CA of an altazimuth mount, y adds to axis 2. A *posture* then says on which side of the pole the origin is.
"""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from pointing.errors import PointingError, Unreachable
from pointing.vectors import Vector

Posture = Literal["normal", "beyond"]
POSTURES: tuple[Posture, Posture] = ("normal", "beyond")

_POLE = 1e-12  # closer to axis 1 than this, its angle is taken as 0 and its rate as 0: there is none
_GRAZING = 1e-12  # square of the reach below which an origin across the tube passes the pole by
_FARTHEST_ORIGIN = math.pi / 4


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
    origin_x, origin_y : float
        The pointing origin in the focal plane, radians; 0, 0 is the tube's axis.

    Raises
    ------
    PointingError
        The latitude, the misalignment or the origin is impossible.
    """

    type: MountType
    latitude: float
    x: float = 0.0
    y: float = 0.0
    origin_x: float = 0.0
    origin_y: float = 0.0
    _rows: tuple[Vector, Vector, Vector] = field(init=False, repr=False, compare=False)
    _zero: float = field(init=False, repr=False, compare=False)
    _turn: float = field(init=False, repr=False, compare=False)
    _across: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= math.pi / 2:
            raise PointingError(f"latitude {math.degrees(self.latitude):g}°: possible are −90° to 90°")
        if not math.hypot(self.x, self.y) <= math.pi:
            turns = f"X {math.degrees(self.x):g}°, Y {math.degrees(self.y):g}°"
            raise PointingError(f"a misalignment of {turns}: possible are 180° together; a mount has a few degrees")
        if not max(abs(self.origin_x), abs(self.origin_y)) <= _FARTHEST_ORIGIN:
            place = f"x {math.degrees(self.origin_x):g}°, y {math.degrees(self.origin_y):g}°"
            raise PointingError(f"a pointing origin at {place}: possible are −45° to 45° each; check its unit")
        turned = _transposed(_rodrigues(self.x, self.y))
        altaz = self.type is MountType.ALTAZ_FORK
        rows = turned if altaz else _product(turned, _equator_from_horizon(self.latitude))
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_zero", math.pi if altaz else 0.0)
        south = self.latitude < 0 and not altaz
        object.__setattr__(self, "_turn", -math.pi if south else math.pi)
        object.__setattr__(self, "_across", -math.sin(self.origin_x))

    @property
    def origin_distance(self) -> float:
        """Angle between the tube's axis and the pointing origin, radians."""
        along, up = (
            math.cos(self.origin_x) * math.cos(self.origin_y),
            math.cos(self.origin_x) * math.sin(self.origin_y),
        )
        return math.atan2(math.hypot(self._across, up), along)

    def axes(self, observed: Vector, posture: Posture) -> tuple[float, float]:
        """Mechanical axis angles that bring the pointing origin on an observed direction.

        Parameters
        ----------
        observed : Vector
            Unit vector in the horizon frame.
        posture : Posture
            Which of the two ways to point there.

        Returns
        -------
        tuple[float, float]
            Radians; axis 1 in normal posture within (−π, π] of its zero, turned by what the origin asks; not wound.

        Raises
        ------
        Unreachable
            The direction is nearer to the pole of axis 1 than the origin's x reaches.
        """
        x, y, z = self._to_mount(observed)
        axis1, reach = self._zero - math.atan2(y, x), math.hypot(x, y)
        if self._across:
            reach = self._reach(reach)
            turned = math.atan2(self._across, reach)
            axis1 += turned if posture == "normal" else -turned
        axis2 = math.atan2(z, reach)
        if posture == "normal":
            return axis1, axis2 - self.origin_y
        return axis1 + math.pi, self._turn - axis2 - self.origin_y

    def observed(self, axis1: float, axis2: float) -> Vector:
        """Observed direction of the pointing origin, horizon frame, at mechanical axis angles; inverse of `axes`."""
        up = axis2 + self.origin_y
        lateral = self._zero - axis1
        cos2, z = math.cos(up), math.sin(up)
        x = cos2 * math.cos(lateral)
        y = cos2 * math.sin(lateral)
        if self._across:
            along = math.cos(self.origin_x)
            x, y = along * x - self._across * math.sin(lateral), along * y + self._across * math.cos(lateral)
            z *= along
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

        Raises
        ------
        Unreachable
            As for `axes`.
        """
        if self._across:
            return self._off_axis(observed, rate, posture)
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
            return (axis1, rate1), (axis2 - self.origin_y, rate2)
        return (axis1 + math.pi, rate1), (self._turn - axis2 - self.origin_y, -rate2)

    def _off_axis(
        self, observed: Vector, rate: Vector, posture: Posture
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """`axes_and_rates` with an origin across the tube.

        With ρ² = X² + Y², b_y the origin's component across and c² = ρ² − b_y², axis 1 is that of the tube's axis
        turned by ±atan2(b_y, c), and axis 2 is ±atan2(Z, c); the rates are their derivatives, with c ċ = ρ ρ̇.
        """
        x, y, z = self._to_mount(observed)
        vx, vy, vz = self._to_mount(rate)
        rho = math.hypot(x, y)
        reach = self._reach(rho)
        outwards = x * vx + y * vy
        turned, turning = math.atan2(self._across, reach), -self._across * outwards / (rho * rho * reach)
        axis1, rate1 = self._zero - math.atan2(y, x), (y * vx - x * vy) / (rho * rho)
        axis2, rate2 = math.atan2(z, reach), (vz * reach - z * outwards / reach) / (reach * reach + z * z)
        if posture == "normal":
            return (axis1 + turned, rate1 + turning), (axis2 - self.origin_y, rate2)
        return (axis1 - turned + math.pi, rate1 - turning), (self._turn - axis2 - self.origin_y, -rate2)

    def _reach(self, rho: float) -> float:
        """Component along the tube's plane of an origin across it, for a direction `rho` from axis 1.

        Raises
        ------
        Unreachable
            There is none: the origin passes by.
        """
        across = abs(self._across)
        reach2 = (rho - across) * (rho + across)
        if reach2 < _GRAZING:
            blind, here = math.degrees(abs(self.origin_x)), math.degrees(math.asin(min(rho, 1.0)))
            raise Unreachable(
                f"the place is {here:.4f}° from the pole of axis 1, where a pointing origin {blind:.4f}° beside the "
                "tube's axis does not come: take another instrument, or wait until the target has passed"
            )
        return math.sqrt(reach2)

    def posture(self, axis2: float) -> Posture:
        """Whether at an axis 2 angle the pointing origin lies in the normal range or beyond the pole."""
        return "normal" if math.cos(axis2 + self.origin_y) >= 0.0 else "beyond"

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
