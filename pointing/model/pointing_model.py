"""A pointing model: terms in their order, and the exact way from the telescope to the star and back.

Telescope → star: the terms one after the other, each at the current, partly corrected place, in TPOINT's order: index
errors, collimation, non-perpendicularity, the tilt of axis 1 (MA then ME, AW then AN), then all others as they are
listed. How a model file lists the first ones does not matter: decision 0003 has the published fits that decide it.
Star → telescope: the same motions undone in reverse order. A term of constant amount is undone in closed form; for
one whose amount changes over the sky the amount is solved for. `star` of what `telescope` returns is the star, within
1e-6″, in both postures. About a pole of axis 1, or of a term's own function, two places of the telescope may point on
one star, or none.

Index errors, collimation, non-perpendicularity and tilt are a rigid mount exactly, as long as collimation or
non-perpendicularity is zero. With both, the latter turns about the horizontal point of the collimated place and not
of the tube: the place is CA · NPAE · sec E higher than a rigid mount's, 0.2″ at 80° for 120″ and 60″.

Coordinates are mechanical: a star seen beyond the pole has lon + 180° and lat 180° − lat (−180° − lat for a southern
equatorial mount).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from pointing.errors import PointingError, Unreachable
from pointing.model.functions import Real, dot, once
from pointing.model.place import Frame, MountKind, Place
from pointing.model.rigid_step import RigidStep, rigid_terms
from pointing.model.term_step import TermStep
from pointing.model.terms import Term, refuse_twice, terms
from pointing.model.undo import undone

_NEWTON_ROUNDS = 6
_LAST_STEP = 3e-7  # rad; what a Newton step leaves is its square, times a coefficient and its frequency squared


@dataclass(frozen=True)
class Jacobian:
    """Derivatives of the star's place: on the sky, radians per radian.

    Parameters
    ----------
    along : tuple
        ∂(cos lat · lon, lat) of the star by (cos lat · lon, lat) of the telescope, row by row: four values.
    by_coefficient : tuple
        ∂(cos lat · lon, lat) of the star by each coefficient: a pair for each term.
    """

    along: tuple[Real, Real, Real, Real]
    by_coefficient: tuple[tuple[Real, Real], ...]


@dataclass(frozen=True)
class PointingModel:
    """Terms with coefficients for one mount.

    Parameters
    ----------
    kind : {"equatorial", "altazimuth"}
        The mount's coordinates.
    latitude : float
        Radians, north positive.
    terms : tuple of Term
        As they are listed.
    coefficients : tuple of float
        One for each term, radians.
    caption : str
        What the model is of.

    Raises
    ------
    PointingError
        The terms are not for this mount, one stands twice, or a coefficient is no number.
    """

    kind: MountKind
    latitude: float
    terms: tuple[Term, ...]
    coefficients: tuple[float, ...]
    caption: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if len(self.terms) != len(self.coefficients):
            raise PointingError(f"{len(self.terms)} pointing terms with {len(self.coefficients)} coefficients")
        if not abs(self.latitude) <= math.pi / 2:
            raise PointingError(f"latitude {math.degrees(self.latitude):g}°: possible are −90° to 90°")
        refuse_twice(self.terms)
        for each in self.terms:
            if self.kind not in each.mounts:
                raise PointingError(f"the pointing term {each.name} is not for an {self.kind} mount")
        self._refuse_impossible()

    def _refuse_impossible(self) -> None:
        for each, coefficient in zip(self.terms, self.coefficients, strict=True):
            if not abs(coefficient) <= math.pi / 4:
                size = f"{math.degrees(coefficient):g}°"
                raise PointingError(f"{each.name} of {size}: possible are −45° to 45°; coefficients are arcseconds")

    @classmethod
    def of(cls, kind: MountKind, latitude_deg: float, caption: str = "", **arcsec: float) -> "PointingModel":
        """Make a model from coefficients in arcseconds by name: `PointingModel.of("equatorial", 40.0, IH=12.0)`.

        Raises
        ------
        PointingError
            As for the class, and for a name that is no term.
        """
        listed = terms(" ".join(arcsec), kind) if arcsec else ()
        values = tuple(math.radians(value / 3600.0) for value in arcsec.values())
        return cls(kind, math.radians(latitude_deg), listed, values, caption)

    @once
    def frame(self) -> Frame:
        """In which the places stand."""
        return Frame(self.kind, self.latitude)

    @property
    def arcsec(self) -> dict[str, float]:
        """The coefficients by name, arcseconds."""
        return {
            each.name: math.degrees(value) * 3600.0 for each, value in zip(self.terms, self.coefficients, strict=True)
        }

    def with_coefficients(self, coefficients: Sequence[float]) -> "PointingModel":
        """Return the same terms with other coefficients, radians."""
        values = tuple(map(float, coefficients))
        if len(values) != len(self.terms):
            return PointingModel(self.kind, self.latitude, self.terms, values, self.caption)
        # a fit asks for this at each step: what was found right of the terms, and worked out of them, still is
        model = object.__new__(PointingModel)
        model.__dict__.update(
            kind=self.kind, latitude=self.latitude, terms=self.terms, coefficients=values, caption=self.caption,
            frame=self.frame, _order=self._order,
        )  # fmt: skip
        model._refuse_impossible()
        return model

    @once
    def _order(self) -> tuple[int, ...]:
        """Positions of the terms as they are applied."""
        return tuple(sorted(range(len(self.terms)), key=lambda i: self.terms[i].rank))

    @once
    def _sequence(self) -> tuple[tuple[int, Term, float], ...]:
        """(position in the model, term, coefficient) as they are applied."""
        return tuple((i, self.terms[i], self.coefficients[i]) for i in self._order)

    @once
    def _last_step2(self) -> float:
        """Square of a Newton step, in units of cos lat, after which no other counts."""
        numbers = (getattr(factor, "number", 1) for each in self.terms for factor in each.factors)
        return (_LAST_STEP / max(numbers, default=1)) ** 2

    @once
    def _steps(self) -> tuple[RigidStep | TermStep, ...]:
        """The terms as they are applied, the rigid ones as one step."""
        reading = [member for member in self._sequence if member[1].rank < 0]
        order = self._sequence[len(reading) :]
        rigid = order[: len(rigid_terms([term for _, term, _ in order]))]
        first, last = ([TermStep(*member) for member in part] for part in (reading, order[len(rigid) :]))
        return (*first, *((RigidStep(rigid),) if rigid else ()), *last)

    def star(self, lon: Real, lat: Real) -> tuple[Real, Real]:
        """Mechanical coordinates of the star on which the telescope points, radians, floats or arrays."""
        place = self.star_place(lon, lat)
        return place.lon, place.lat

    def star_place(self, lon: Real, lat: Real) -> Place:
        """As `star`, with the sines and cosines that are known on the way."""
        place = Place(self.frame, lon, lat)
        for step in self._steps:
            place = step.star(place)
        return place

    def star_and_jacobian(self, lon: Real, lat: Real) -> tuple[Real, Real, Jacobian]:
        """As `star`, with the derivatives, from one pass to the star and one back over the terms."""
        place, jacobian = self.star_place_and_jacobian(lon, lat)
        return place.lon, place.lat, jacobian

    def star_place_and_jacobian(self, lon: Real, lat: Real) -> tuple[Place, Jacobian]:
        """As `star_and_jacobian`, with the sines and cosines that are known on the way."""
        place, passed = Place(self.frame, lon, lat), []
        for step in self._steps:
            place, columns, along = step.passed(place)
            passed.append((columns, along))
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        by_coefficient: list[tuple[Real, Real]] = [(0.0, 0.0)] * len(self.terms)
        last = True  # nothing comes after
        for columns, (e, f, g, h) in reversed(passed):
            for i, (p, q) in columns:
                by_coefficient[i] = (p, q) if last else (dot(a, p, b, q), dot(c, p, d, q))
            if last:
                a, b, c, d, last = e, f, g, h, False
            else:
                a, b, c, d = dot(a, e, b, g), dot(a, f, b, h), dot(c, e, d, g), dot(c, f, d, h)
        return place, Jacobian((a, b, c, d), tuple(by_coefficient))

    def telescope(self, lon: Real, lat: Real) -> tuple[Real, Real]:
        """Mechanical coordinates at which the telescope points on a star: the inverse of `star`.

        Parameters
        ----------
        lon, lat : float or array
            Mechanical coordinates of the star, radians: |lat| > 90° asks for the posture beyond the pole.

        Returns
        -------
        tuple
            Radians, floats or arrays; an array has nan where no place of the telescope points on the star, and where
            the star's own place is not finite.

        Raises
        ------
        PointingError
            The star's place is not finite (floats only).
        Unreachable
            No place of the telescope points on the star (floats only): it is in the blind spot that a term leaves,
            as collimation and non-perpendicularity do about the pole of axis 1. Names the term.
        """
        if isinstance(lat, float):
            if (found := self._newton(lon, lat)) is not None:
                return found[0]
        elif not np.all(finite := np.isfinite(lon) & np.isfinite(lat)):
            lon, lat = np.where(finite, lon, np.nan), np.where(finite, lat, np.nan)
        for _, each, coefficient in reversed(self._sequence):
            if coefficient:
                lon, lat = undone(self.frame, each, coefficient, lon, lat)
                if isinstance(lat, float) and not math.isfinite(lat):
                    _refuse_blind_spot(each, coefficient)
        return lon, lat

    def _newton(self, lon: float, lat: float) -> tuple[tuple[float, float], tuple[float, float, float, float]] | None:
        """Solve for the telescope by Newton's method; with the derivatives there, `Jacobian.along`.

        Each step squares the error, so the derivatives are those of the place to as much as the last step was. None
        where it does not settle on this side of the pole of axis 1: there the terms are undone one by one.
        """
        if not math.isfinite(lon + lat):
            raise PointingError(f"a star at ({lon:g}, {lat:g}) in the mount's frame: give finite angles in radians")
        first = self.star(lon, lat)
        at, up = 2.0 * lon - first[0], 2.0 * lat - first[1]
        for _ in range(_NEWTON_ROUNDS):
            star_lon, star_lat, jacobian = self.star_and_jacobian(at, up)
            a, b, c, d = jacobian.along
            determinant = a * d - b * c
            if not determinant:
                return None
            off1, off2 = math.cos(star_lat) * (lon - star_lon), lat - star_lat
            step1, step2 = (d * off1 - b * off2) / determinant, (a * off2 - c * off1) / determinant
            cosine = math.cos(up)
            at, up = at + step1 / cosine, up + step2
            if step1 * step1 + step2 * step2 < self._last_step2 * cosine * cosine:
                return ((at, up), jacobian.along) if cosine * math.cos(lat) > 0.0 else None
        return None

    def telescope_and_rates(
        self, lon: float, lat: float, lon_rate: float, lat_rate: float
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """Where the telescope points on a star that moves, and how fast its axes must go.

        Parameters
        ----------
        lon, lat : float
            The star's mechanical coordinates, radians.
        lon_rate, lat_rate : float
            cos lat · dlon/dt and dlat/dt of the star, radians per second.

        Returns
        -------
        tuple
            ((lon, lat), (dlon/dt, dlat/dt)) of the telescope.

        Raises
        ------
        Unreachable
            As for `telescope`.
        """
        (lon, lat), (across, upwards) = self.telescope_and_motion(lon, lat, lon_rate, lat_rate)
        return (lon, lat), (across / math.cos(lat), upwards)

    def telescope_and_motion(
        self, lon: float, lat: float, lon_rate: float, lat_rate: float
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """As `telescope_and_rates`, with the telescope's motion on the sky: (cos lat · dlon/dt, dlat/dt)."""
        found = self._newton(lon, lat)
        if found is None:
            lon, lat = self.telescope(lon, lat)
            found = (lon, lat), self.star_and_jacobian(lon, lat)[2].along
        place, (a, b, c, d) = found
        determinant = a * d - b * c
        return place, ((d * lon_rate - b * lat_rate) / determinant, (a * lat_rate - c * lon_rate) / determinant)


def _refuse_blind_spot(term: Term, coefficient: float) -> NoReturn:
    where = "the zenith" if term.result == "Z" else "the pole of axis 1"
    raise Unreachable(
        f"the place is in the blind spot about {where} that {term.name} of {math.degrees(coefficient) * 3600.0:.6g}″ "
        "of the pointing model keeps out of reach: wait until the target has passed"
    )
