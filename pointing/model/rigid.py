"""A pointing model in three parts: what the axes read, what is rigid, in closed form, and what bends.

First come the terms that an axis's own reading decides: its worm, and the side of the pier. Rigid are the terms of
constant amount in TPOINT's order: index errors, collimation, non-perpendicularity and the tilt of axis 1. The tilts
make one rotation together. All further terms act on what the rigid part gives; their amount changes over the sky, so
on the way from the star they are undone first, by Newton's method.

Directions stand in the mount's own frame, in which the lateral angle is `zero` − lon.
"""

import math
from dataclasses import dataclass

from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.rigid_step import COLLIMATION, INDEX1, INDEX2, KINDS, SKEW, TILT, rigid_terms
from pointing.model.terms import Term
from pointing.offset import carried
from pointing.vectors import Vector

Rows = tuple[Vector, Vector, Vector]

_ZERO: dict[MountKind, float] = {"equatorial": 0.0, "altazimuth": math.pi}
_TINY = 1e-300


@dataclass(frozen=True)
class RigidPart:
    """The terms of constant amount.

    Parameters
    ----------
    reading : PointingModel or None
        The terms before these, which the axis's own reading decides.
    index1, index2 : float
        Added to the angle of an axis, radians.
    collimation, skew : float
        Towards increasing axis 1 along the great circle, and about the horizontal axis, radians.
    tilt : tuple
        Rows of the rotation that takes what the tube looks at to where it looks on the sky.
    bending : Bending or None
        All other terms, the tilt before them.
    """

    reading: PointingModel | None
    index1: float
    index2: float
    collimation: float
    skew: float
    tilt: Rows
    bending: "Bending | None"


def rigid_part(model: PointingModel) -> RigidPart:
    """Take a model apart.

    Amounts of one part add up. For collimation and non-perpendicularity that holds because there is no more than one
    term of each on a mount: two of these one after the other are not their sum.
    """
    order = sorted(zip(model.terms, model.coefficients, strict=True), key=lambda pair: pair[0].rank)
    reading = [pair for pair in order if pair[1] and pair[0].rank < 0]
    order = [pair for pair in order if pair[1] and pair[0].rank >= 0]
    sums = dict.fromkeys((INDEX1, INDEX2, COLLIMATION, SKEW, TILT), 0.0)
    rigid = rigid_terms([each for each, _ in order])
    for each, coefficient in order[: len(rigid)]:
        sums[KINDS[each.result]] += coefficient * each.sign * each.moves.sign
    tilts = [pair for pair in order[: len(rigid)] if KINDS[pair[0].result] == TILT]
    order = order[len(rigid) :]
    tilt = _rotation(_only(model, tilts))
    return RigidPart(
        _only(model, reading) if reading else None,
        sums[INDEX1],
        sums[INDEX2],
        sums[COLLIMATION],
        sums[SKEW],
        tilt,
        Bending(_only(model, order), tilt) if order else None,
    )


def _only(model: PointingModel, pairs: list[tuple[Term, float]]) -> PointingModel:
    return PointingModel(model.kind, model.latitude, tuple(p[0] for p in pairs), tuple(p[1] for p in pairs))


def _rotation(tilts: PointingModel) -> Rows:
    """The matrix of a model that is a rotation: its columns are where it takes the frame's axes."""
    zero = _ZERO[tilts.kind]
    axes = ((zero, 0.0), (zero - math.pi / 2.0, 0.0), (zero, math.pi / 2.0))
    one, two, three = (_vector(zero, *tilts.star(*axis)) for axis in axes)
    return tuple(zip(one, two, three, strict=True))  # type: ignore[return-value]


def _vector(zero: float, lon: float, lat: float) -> Vector:
    level = math.cos(lat)
    return level * math.cos(zero - lon), level * math.sin(zero - lon), math.sin(lat)


@dataclass(frozen=True)
class Bending:
    """The terms of a model whose amount changes over the sky, and the tilt of axis 1 before them, on directions.

    Parameters
    ----------
    model : PointingModel
        These terms alone.
    tilt : tuple
        As for `RigidPart`.
    """

    model: PointingModel
    tilt: Rows

    def star(self, direction: Vector, *, beyond: bool) -> Vector:
        """Direction of the star, where the tube looks in a direction."""
        x, y, z = direction
        (a, b, c), (d, e, f), (g, h, i) = self.tilt
        tilted = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
        return _vector(_ZERO[self.model.kind], *self.model.star(*self._mechanical(tilted, beyond=beyond)))

    def rolled(self, up: Vector, direction: Vector, *, beyond: bool) -> Vector:
        """How the tube's upper side lies on the sky: tilted with axis 1, and bent the shortest way, without a twist.

        A pointing model says where the tube looks once it is bent, and not how it is rolled; what bends by gravity is
        taken to bend about an axis across the tube.
        """
        x, y, z = direction
        (a, b, c), (d, e, f), (g, h, i) = self.tilt
        tilted = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
        x, y, z = up
        up = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
        return carried(up, tilted, self.star(direction, beyond=beyond))

    def telescope(self, direction: Vector, *, beyond: bool) -> tuple[Vector, bool]:
        """Direction in which the tube looks at a star, and on which side; inverse of `star`.

        A term may push a place across the pole of axis 1.

        Raises
        ------
        Unreachable
            There is none.
        """
        lon, lat = self.model.telescope(*self._mechanical(direction, beyond=beyond))
        return self._untilted(_vector(_ZERO[self.model.kind], lon, lat)), math.cos(lat) < 0.0

    def telescope_and_rate(self, direction: Vector, rate: Vector, *, beyond: bool) -> tuple[Vector, Vector, bool]:
        """As `telescope`, with the derivative, for a moving star.

        Raises
        ------
        Unreachable
            As for `telescope`.
        """
        zero, (x, y, z), (vx, vy, vz) = _ZERO[self.model.kind], direction, rate
        rho, side = max(math.hypot(x, y), _TINY), -1.0 if beyond else 1.0
        across, upwards = side * (y * vx - x * vy) / rho, side * (vz * rho - z * (x * vx + y * vy) / rho)
        (lon, lat), (across, upwards) = self.model.telescope_and_motion(
            *self._mechanical(direction, beyond=beyond), across, upwards
        )
        c, s = math.cos(lat), math.sin(lat)
        x, y = math.cos(zero - lon), math.sin(zero - lon)
        moved = across * y - upwards * s * x, -across * x - upwards * s * y, upwards * c
        return self._untilted((c * x, c * y, s)), self._untilted(moved), c < 0.0

    def _untilted(self, v: Vector) -> Vector:
        x, y, z = v
        (a, b, c), (d, e, f), (g, h, i) = self.tilt
        return a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z

    def _mechanical(self, direction: Vector, *, beyond: bool) -> tuple[float, float]:
        x, y, z = direction
        lon, lat = _ZERO[self.model.kind] - math.atan2(y, x), math.atan2(z, math.hypot(x, y))
        return self.model.frame.beyond_the_pole(lon, lat) if beyond else (lon, lat)
