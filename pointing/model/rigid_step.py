"""The rigid terms of a model as one motion, in closed form, with its exact derivatives: for floats and arrays.

Rigid are the terms of constant amount that come first: index errors, collimation, non-perpendicularity and the tilt
of axis 1. Their motions one after the other, as `pointing.model.results` has them, make the direction, in components
along the place's meridian plane, across it and up,

    (l − t sin γ,  sin γ + t l,  k cos ν)
    l = cos lat cos γ,  k = sin lat cos γ,  t = k sin ν / ρ,  ρ² = l² + sin² γ

for collimation γ and non-perpendicularity ν, as `pointing.tube` has it for one place, and then one rotation for all
tilts. Only angles that are read cost sines and cosines: all others are carried along.

Derivatives are on the sky. What turns about a fixed axis Ω moves a direction v by Ω × v, thus by (Ω · n̂, −Ω · ê); a
tilt turns what was moved before it, as it turns the unit vectors ê, n̂ of the place.
"""

import math
from collections.abc import Sequence

from pointing.model.functions import Real, dot
from pointing.model.place import CarriedPlace, Place
from pointing.model.term_step import Pair, Passed
from pointing.model.terms import Term
from pointing.vectors import Vector

Rows = tuple[Vector, Vector, Vector]
Member = tuple[int, Term, float]  # position in the model, term, coefficient

INDEX1, INDEX2, COLLIMATION, SKEW, TILT = "HA", "DE", "XS", "PV", "ULNW"
_AXES: dict[str, Vector] = {"U": (0.0, -1.0, 0.0), "L": (1.0, 0.0, 0.0), "N": (0.0, 1.0, 0.0), "W": (1.0, 0.0, 0.0)}
KINDS = {letter: kind for kind in (INDEX1, INDEX2, COLLIMATION, SKEW, TILT) for letter in kind}
"""What a result is of a rigid mount."""

_SAME: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_POLE: Vector = (0.0, 0.0, 1.0)


def rigid_terms(order: Sequence[Term]) -> Sequence[Term]:
    """Return those terms at the beginning of an order that are those of a rigid mount, and make one motion."""
    seen = ""
    for n, term in enumerate(order):
        if term.factors or term.result not in KINDS or term.result in seen:
            return order[:n]
        seen += term.result if KINDS[term.result] in (COLLIMATION, SKEW) else ""  # two are not their sum
    return order


class RigidStep:
    """The motion of rigid terms.

    Parameters
    ----------
    members : sequence
        The terms in their order.
    """

    def __init__(self, members: Sequence[Member]) -> None:
        sums = dict.fromkeys((INDEX1, INDEX2, COLLIMATION, SKEW), 0.0)
        self._kinds: list[tuple[int, str, float]] = []
        axes: dict[int, Vector] = {}
        tilt = _SAME
        for i, term, coefficient in members:
            sign = term.sign * term.moves.sign
            kind = KINDS[term.result]
            self._kinds.append((i, kind, sign))
            if kind != TILT:
                sums[kind] += coefficient * sign
                continue
            if coefficient:
                turn = _turn(_AXES[term.result], coefficient * sign)
                axes = {j: _times(turn, axis) for j, axis in axes.items()}
                tilt = turn if tilt is _SAME else _product(turn, tilt)
            axes[i] = _AXES[term.result]
        self._index = sums[INDEX1], sums[INDEX2]
        self._across = math.sin(sums[COLLIMATION]), math.cos(sums[COLLIMATION])
        self._askew = math.sin(sums[SKEW]), math.cos(sums[SKEW])
        self._straight = not (sums[COLLIMATION] or sums[SKEW])
        self._tilt, self._axes = tilt, axes
        self._level = tilt is _SAME
        self._axis1 = _POLE if self._level else _times(tilt, _POLE)

    def star(self, place: Place) -> Place:
        """Return the place after the terms."""
        read = Place(place.frame, place.lon + self._index[0], place.lat + self._index[1])
        return self._tilted(read, self._looking(read)[0])

    def passed(self, place: Place) -> Passed:
        """As `star`, with the derivatives."""
        read = Place(place.frame, place.lon + self._index[0], place.lat + self._index[1])
        tube, level = self._looking(read)
        after = self._tilted(read, tube)
        moved = self._moved(read, level, tube)
        if not self._level:
            moved = self._turned(moved, tube, after)
        by_kind = dict(zip((INDEX2, COLLIMATION, SKEW), moved, strict=True))
        by_kind[INDEX1] = first = _about(self._axis1, after)
        columns = [
            (i, _scaled(sign, _about(self._axes[i], after) if kind == TILT else by_kind[kind]))
            for i, kind, sign in self._kinds
        ]
        cosine, second = place.cos_lat, by_kind[INDEX2]
        return Passed(after, columns, (first[0] / cosine, second[0], first[1] / cosine, second[1]))

    def _looking(self, read: Place) -> tuple[Place, Real]:
        """Where the tube looks before the tilt of axis 1, and ρ."""
        if self._straight:
            return read, read.cos_lat
        f, c = read.functions, read.cos_lat
        (sin_g, cos_g), (sin_n, cos_n) = self._across, self._askew
        along, up = c * cos_g, read.sin_lat * cos_g
        level = f.copysign(f.hypot(along, sin_g), c)
        turned = up * (sin_n / level)
        ahead, aside = along - turned * sin_g, sin_g + turned * along
        x, y = ahead * read.cos_lon - aside * read.sin_lon, ahead * read.sin_lon + aside * read.cos_lon
        return _at(read, x, y, up * cos_n), level

    def _tilted(self, read: Place, tube: Place) -> Place:
        if self._level:
            return tube
        c = tube.cos_lat
        return _at(read, *_times(self._tilt, (c * tube.cos_lon, c * tube.sin_lon, tube.sin_lat)))

    def _moved(self, read: Place, level: Real, tube: Place) -> tuple[Pair, Pair, Pair]:
        """Derivatives by index error 2, collimation and non-perpendicularity, before the tilt."""
        s, c, new = read.sin_lat, read.cos_lat, tube.cos_lat
        if self._straight:
            return (0.0, 1.0), (1.0, 0.0), (s, 0.0)
        (sin_g, cos_g), (sin_n, cos_n) = self._across, self._askew
        # what collimation does, then how non-perpendicularity stretches, shears and raises it
        by_index = s * (sin_g * cos_g) / level, c * cos_g / level
        by_across = c / level, s * -sin_g / level
        stretched, sheared, raised = new / level, sin_n / new, cos_n * level / new
        up = s * cos_g
        return (
            (stretched * by_index[0] + sheared * by_index[1], raised * by_index[1]),
            (stretched * by_across[0] + sheared * by_across[1], raised * by_across[1]),
            (raised * up, -sheared * up),
        )

    def _turned(self, moved: tuple[Pair, Pair, Pair], tube: Place, after: Place) -> tuple[Pair, Pair, Pair]:
        """Derivatives as the tilt turns them: by the angle between the unit vectors ê before and after."""
        (a, b, _), (d, e, _), (g, h, _) = self._tilt
        x, y = -tube.sin_lon, tube.cos_lon
        same = after.cos_lon * (d * x + e * y) - after.sin_lon * (a * x + b * y)
        other = (g * x + h * y) / after.cos_lat
        one, two, three = ((dot(same, p, -other, q), dot(other, p, same, q)) for p, q in moved)
        return one, two, three


def _at(read: Place, x: Real, y: Real, z: Real) -> Place:
    """The place in a direction, on the side of the pole of axis 1 of the place that is read."""
    f = read.functions
    cosine = f.copysign(f.hypot(x, y), read.cos_lat)
    return CarriedPlace(read, y / cosine, x / cosine, z, cosine)


def _about(axis: Vector, place: Place) -> Pair:
    """How a rotation about an axis moves a place: Ω · n̂ and −Ω · ê."""
    x, y, z = axis
    c, s = place.cos_lon, place.sin_lon
    ahead = dot(x, c, y, s)
    along = z * place.cos_lat - place.sin_lat * ahead if x or y else z * place.cos_lat
    return along, dot(x, s, -y, c)


def _scaled(sign: float, pair: Pair) -> Pair:
    return pair if sign == 1.0 else (sign * pair[0], sign * pair[1])


def _times(rows: Rows, v: tuple[Real, Real, Real]) -> tuple[Real, Real, Real]:
    x, y, z = v
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _product(rows: Rows, other: Rows) -> Rows:
    one, two, three = (_times(rows, column) for column in zip(*other, strict=True))
    return tuple(zip(one, two, three, strict=True))  # type: ignore[return-value]


def _turn(axis: Vector, angle: float) -> Rows:
    """The rotation by an angle about an axis (Rodrigues)."""
    x, y, z = axis
    s, c = math.sin(angle), math.cos(angle)
    v = 2.0 * math.sin(angle / 2.0) ** 2
    return (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z),
    )
