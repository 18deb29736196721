"""Observed direction to mechanical axis angles and back, for the three mount types in both postures.

Frames (right-handed): the horizon frame has x south, y east, z zenith. An equatorial mount's base frame has x to the
meridian point of the equator, y east, z the north celestial pole; an altazimuth's is the horizon frame. The mount's
own frame is the base frame turned by the rotation vector (X, Y, 0): v_mount = R(X, Y)ᵀ · v_base, the TC410's mount
registers. First order: MA = −X, ME = −Y; AW = X, AN = −Y.

*Normal* posture has |axis 2| ≤ 90°. *Beyond* is the same direction reached over the pole or zenith: axis 1 + 180°,
axis 2 = 180° − axis 2, which a southern equatorial mount writes −180° − axis 2.

From there a *pointing model* leads to the mechanical angles. What bends is undone first, then the tilt of axis 1 by
the model, which adds to (X, Y), then the tube in closed form, then what the axes read wrong, as by a worm: see
`pointing.model.rigid` and `pointing.tube`.

The *pointing origin* is the place in the focal plane on which the target is put. It is fixed to the tube: from the
tube's axis by x across, along the great circle in the direction of increasing axis 1, then by y with axis 2. That is
how it lies on the sky in normal posture; beyond, the tube has turned over and both are reversed there. So it acts
where collimation acts, x as an addition to TPOINT's CH or −CA, y to the index of axis 2, and all that follows in the
model, flexure too, is that of the place where the origin looks. A *posture* says on which side of the pole the origin
is.
"""

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import TYPE_CHECKING, Literal

from pointing.errors import PointingError
from pointing.tube import AngleRates, Tube, turn_of_axis2
from pointing.vectors import Vector

if TYPE_CHECKING:
    from pointing.model.place import MountKind
    from pointing.model.pointing_model import PointingModel
    from pointing.model.rigid import Bending

Rows = tuple[Vector, Vector, Vector]
Posture = Literal["normal", "beyond"]
POSTURES: tuple[Posture, Posture] = ("normal", "beyond")

_FARTHEST_ORIGIN = math.pi / 4
_SAME_SITE = math.radians(0.1)  # a model's latitude matters to its flexure, to 0.2 % at that
_ORIGIN = (
    "a pointing origin {blind:.4f}° beside the tube's axis does not come",
    "take another instrument, or wait until the target has passed",
)
_MODEL = (
    (
        "the tube, by the pointing model's {model:.4f}° of collimation and non-perpendicularity, comes no nearer "
        "than {{blind:.4f}}°"
    ),
    "wait until the target has passed",
)
_BOTH = (
    (
        "the pointing origin, by its own {origin:.4f}° beside the tube's axis and the pointing model's {model:.4f}° "
        "of collimation and non-perpendicularity together, comes no nearer than {{blind:.4f}}°"
    ),
    "take another instrument, or wait until the target has passed",
)


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

    @property
    def kind(self) -> "MountKind":
        """What the axes measure, in the word of pointing models."""
        return "altazimuth" if self is MountType.ALTAZ_FORK else "equatorial"


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
    model : PointingModel, optional
        What the mechanical angles differ from the mount's own coordinates by.

    Raises
    ------
    PointingError
        The latitude, the misalignment or the origin is impossible, or the model is of another mount.
    """

    type: MountType
    latitude: float
    x: float = 0.0
    y: float = 0.0
    origin_x: float = 0.0
    origin_y: float = 0.0
    model: "PointingModel | None" = field(default=None, repr=False)
    _reading: "PointingModel | None" = field(init=False, repr=False, compare=False)
    _rows: Rows = field(init=False, repr=False, compare=False)
    _tube: Tube = field(init=False, repr=False, compare=False)
    _bending: "Bending | None" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not abs(self.latitude) <= math.pi / 2:
            raise PointingError(f"latitude {math.degrees(self.latitude):g}°: possible are −90° to 90°")
        if not math.hypot(self.x, self.y) <= math.pi:
            turns = f"X {math.degrees(self.x):g}°, Y {math.degrees(self.y):g}°"
            raise PointingError(f"a misalignment of {turns}: possible are 180° together; a mount has a few degrees")
        if not max(abs(self.origin_x), abs(self.origin_y)) <= _FARTHEST_ORIGIN:
            place = f"x {math.degrees(self.origin_x):g}°, y {math.degrees(self.origin_y):g}°"
            raise PointingError(f"a pointing origin at {place}: possible are −45° to 45° each; check its unit")
        altaz = self.type is MountType.ALTAZ_FORK
        rows = _transposed(_rodrigues(self.x, self.y))
        if not altaz:
            rows = _product(rows, _equator_from_horizon(self.latitude))
        tube = Tube(
            zero=math.pi if altaz else 0.0,
            turn=turn_of_axis2(equatorial=not altaz, latitude=self.latitude),
            collimation=self.origin_x,
            index2=self.origin_y,
            aside=_ORIGIN,
        )
        reading = bending = None
        if self.model is not None:
            rows, tube, reading, bending = self._modelled(self.model, rows, tube)
        object.__setattr__(self, "_reading", reading)
        object.__setattr__(self, "_rows", rows)
        object.__setattr__(self, "_tube", tube)
        object.__setattr__(self, "_bending", bending)

    def _modelled(
        self, model: "PointingModel", rows: Rows, tube: Tube
    ) -> "tuple[Rows, Tube, PointingModel | None, Bending | None]":
        """Add a model to the frame and the tube; what bends stands between the two, what the axes read at the end."""
        from pointing.model.rigid import rigid_part  # noqa: PLC0415 - takes 30 ms; only its users pay

        if model.kind != self.type.kind or abs(model.latitude - self.latitude) > _SAME_SITE:
            here = f"{self.type.kind} one at latitude {math.degrees(self.latitude):.4f}°"
            of = f"{model.kind} mount at latitude {math.degrees(model.latitude):.4f}°"
            raise PointingError(f"a pointing model of an {of}, and this is an {here}: take the model of this one")
        rigid = rigid_part(model)
        tube = replace(
            tube,
            collimation=self.origin_x + rigid.collimation,
            skew=rigid.skew,
            index1=rigid.index1,
            index2=self.origin_y + rigid.index2,
            aside=self._aside(math.hypot(rigid.collimation, rigid.skew)),
        )
        if rigid.bending is None:
            rows = _product(_transposed(rigid.tilt), rows)
        return rows, tube, rigid.reading, rigid.bending

    def _aside(self, by_model: float) -> tuple[str, str]:
        """What keeps the tube from the pole of axis 1, each with its size, and what helps; of the model's radians."""
        if not by_model:
            return _ORIGIN
        what, remedy = _BOTH if self.origin_x else _MODEL
        return what.format(origin=math.degrees(abs(self.origin_x)), model=math.degrees(by_model)), remedy

    @property
    def origin_distance(self) -> float:
        """Angle between the tube's axis and the pointing origin, radians."""
        along, across = math.cos(self.origin_x), math.sin(self.origin_x)
        return math.atan2(math.hypot(across, along * math.sin(self.origin_y)), along * math.cos(self.origin_y))

    @property
    def frame(self) -> Rows:
        """Axes of the mount's own frame in the horizon frame, by (X, Y) and the model's tilt; the last is axis 1."""
        if self.model is None or self._bending is None:
            return self._rows
        from pointing.model.rigid import rigid_part  # noqa: PLC0415 - takes 30 ms; only its users pay

        return _product(_transposed(rigid_part(self.model).tilt), self._rows)  # what bends has the tilt in itself

    @property
    def pole(self) -> Vector:
        """Where axis 1 points, horizon frame: its end of increasing axis 2."""
        return self.frame[2]

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
            Radians; axis 1 in normal posture within (−π, π] of its zero, turned by what origin and model ask; not
            wound.

        Raises
        ------
        Unreachable
            The direction is nearer to the pole of axis 1 than collimation and the origin's x let the tube come.
        """
        place, beyond = self._to_mount(observed), posture == "beyond"
        if self._bending is not None:
            place, beyond = self._bending.telescope(place, beyond=beyond)
        axes = self._tube.axes(place, beyond=beyond)
        return axes if self._reading is None else self._reading.telescope(*axes)

    def observed(self, axis1: float, axis2: float) -> Vector:
        """Observed direction of the pointing origin, horizon frame, at mechanical axis angles; inverse of `axes`."""
        if self._reading is not None:
            axis1, axis2 = self._reading.star(axis1, axis2)
        place = self._tube.direction(axis1, axis2)
        if self._bending is not None:
            place = self._bending.star(place, beyond=self._tube.beyond(axis2))
        return self._to_horizon(place)

    def up(self, axis1: float, axis2: float) -> Vector:
        """How the focal plane lies on the sky: the way its upper side points from `observed`, horizon frame.

        The upper side is fixed to the tube: the one towards which axis 2 grows, so north or the zenith in normal
        posture and turned over beyond. Its unit vector is a tangent at `observed`.
        """
        if self._reading is not None:
            axis1, axis2 = self._reading.star(axis1, axis2)
        up = self._tube.up(axis1, axis2)
        if self._bending is not None:
            place = self._tube.direction(axis1, axis2)
            up = self._bending.rolled(up, place, beyond=self._tube.beyond(axis2))
        return self._to_horizon(up)

    def axes_and_rates(self, observed: Vector, rate: Vector, posture: Posture) -> AngleRates:
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
        place, motion, beyond = self._to_mount(observed), self._to_mount(rate), posture == "beyond"
        if self._bending is not None:
            place, motion, beyond = self._bending.telescope_and_rate(place, motion, beyond=beyond)
        axes = self._tube.axes_and_rates(place, motion, beyond=beyond)
        if self._reading is None:
            return axes
        (axis1, rate1), (axis2, rate2) = axes
        (axis1, axis2), (rate1, rate2) = self._reading.telescope_and_rates(
            axis1, axis2, rate1 * math.cos(axis2), rate2
        )
        return (axis1, rate1), (axis2, rate2)

    def posture(self, axis2: float) -> Posture:
        """Whether at an axis 2 angle the pointing origin lies in the normal range or beyond the pole."""
        return POSTURES[self._tube.beyond(axis2)]

    def _to_horizon(self, v: Vector) -> Vector:
        x, y, z = v
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z

    def _to_mount(self, v: Vector) -> Vector:
        x, y, z = v
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


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
