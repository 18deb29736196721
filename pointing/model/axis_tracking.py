"""Axis 1 of a mount whose knobs are being turned, followed star by star.

A few stars tell index errors and tilt. Then a knob turns the whole mount on the ground, by a rotation K about two
fixed lines: what the model said of a reading of the axes is turned by K. After each turn one star tells K, for its
place has two coordinates; what is known of the model from before goes on, uncertainty included, and every later look
improves both. This is an extended Kalman filter whose state are the coefficients and the two angles of K, iterated at
each star so that degrees are exact. Flexure, which follows the ground, is taken to turn with the mount: 0.4″ for 20″
of it and one degree.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.design import blocks
from pointing.model.fit import fit
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.polar_alignment import (
    TILTS,
    AxisTilt,
    PolarAlignment,
    Registers,
    advice,
    end_of_axis,
    registers,
    to_turn,
)
from pointing.model.run import PointingRun
from pointing.model.terms import terms
from pointing.model.words import Pole
from pointing.site import Weather
from pointing.vectors import (
    Vector,
    azimuth_altitude,
    equatorial_to_horizon,
    from_azimuth_altitude,
    from_hour_angle_declination,
    horizon_to_equatorial,
    hour_angle_declination,
)

Array = NDArray[np.float64]

FEWEST = 3
"""Stars that tell index errors and tilt, with something left to judge them by."""
INDEX: dict[MountKind, tuple[str, str]] = {"equatorial": ("IH", "ID"), "altazimuth": ("IA", "IE")}
_ARCSEC = math.radians(1.0 / 3600.0)
_ANYTHING = math.radians(10.0)  # by which a knob may have been turned, when nobody says
_ROUNDS = 20
_SETTLED = 1e-10
_NUDGE = 1e-6  # rad, for derivatives of what has no closed form
_LINES: dict[MountKind, tuple[Vector, Vector]] = {
    # about which a positive angle raises the north end, and moves it east; or raises the north, and the west side
    "equatorial": ((0.0, 1.0, 0.0), (0.0, 0.0, -1.0)),
    "altazimuth": ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)),
}
_BELONGS_SIGMAS = 5.0
_SPREAD1 = np.array((0.0, 2.0, 4.0, 1.0, 5.0, 3.0))  # axis 1 and 2, radians: anywhere will do
_SPREAD2 = np.array((0.1, 0.5, -0.4, 0.9, -0.8, 0.3))


@dataclass(frozen=True, eq=False)
class AxisTracking:
    """What is known of axis 1.

    Parameters
    ----------
    model : PointingModel
        Of the mount before its knobs were turned.
    free : tuple of int
        Which of its terms are uncertain: index errors and tilt.
    turned : tuple of float
        By how much the knobs have turned the mount since, radians: its north end raised and moved east, or its north
        and its west side raised.
    covariance : (k + 2, k + 2) array
        Of the free coefficients and of `turned`, square radians.
    stars : int
        How many looks it rests on.
    """

    model: PointingModel
    free: tuple[int, ...]
    turned: tuple[float, float]
    covariance: Array
    stars: int

    @classmethod
    def of(cls, run: PointingRun, sigma_arcsec: float, others: PointingModel | None = None) -> "AxisTracking":
        """Begin with at least three stars.

        Parameters
        ----------
        run : PointingRun
            Of the stars.
        sigma_arcsec : float
            How far off a look is on the sky, root mean square.
        others : PointingModel, optional
            A model whose terms, but for index errors and tilt, hold here as well.

        Raises
        ------
        PointingError
            Fewer than three stars, or stars that do not tell the tilt.
        """
        if int(np.count_nonzero(run.kept)) < FEWEST:
            raise PointingError(f"{int(np.count_nonzero(run.kept))} stars: {FEWEST} or more tell how axis 1 leans")
        own = (*INDEX[run.mount], *TILTS[run.mount])
        kept = () if others is None else tuple(each for each in others.terms if each.name not in own)
        start = PointingModel(
            run.mount, run.latitude, (*terms(own, run.mount), *kept),
            (*([0.0] * len(own)), *(_coefficient(others, each.name) for each in kept)),
        )  # fmt: skip
        found = fit(run, start, fixed=[each.name for each in kept])
        free = tuple(i for i, each in enumerate(found.model.terms) if each.name in own)
        # the scatter that the stars show is told by too few of them: at least what is known of a look
        degrees = max(2 * found.n - found.k, 1)
        variance = max((sigma_arcsec * _ARCSEC) ** 2 / 2.0, found.square / degrees if degrees > FEWEST else 0.0)
        covariance = np.zeros((len(free) + 2, len(free) + 2))
        covariance[:-2, :-2] = found.equations.inverse * variance
        return cls(found.model, free, (0.0, 0.0), covariance, found.n)

    @property
    def kind(self) -> MountKind:
        """What the axes measure."""
        return self.model.kind

    def knobs_turned(self) -> "AxisTracking":
        """Somebody has turned the knobs, nobody knows how far."""
        covariance = self.covariance.copy()
        covariance[-2:, :] = covariance[:, -2:] = 0.0
        covariance[-2:, -2:] = np.eye(2) * _ANYTHING**2
        return replace(self, covariance=covariance)

    def seen(self, star: PointingRun, sigma_arcsec: float) -> "AxisTracking":
        """Learn from a look at one star.

        Raises
        ------
        PointingError
            It is not one observation, or lies where nothing that is known of the mount can put it.
        """
        if len(star) != 1 or star.mount != self.kind:
            raise PointingError("give one observation of this kind of mount at a time")
        noise = np.eye(2) * (sigma_arcsec * _ARCSEC) ** 2 / 2.0
        before = np.array((*(self.model.coefficients[i] for i in self.free), *self.turned))
        state, design = before, np.empty(0)
        for _ in range(_ROUNDS):
            here = self._at(state)
            residual, design = here._residual(star)  # noqa: SLF001 - one of us
            spread = design @ self.covariance @ design.T + noise
            gain = self.covariance @ design.T @ np.linalg.inv(spread)
            after = before + gain @ (residual - design @ (before - state))
            step, state = float(np.abs(after - state).max()), after
            if step < _SETTLED:
                break
        off = self._at(before)._residual(star)[0]  # noqa: SLF001
        distance = math.sqrt(float(off @ np.linalg.solve(spread, off)))
        if distance > _BELONGS_SIGMAS:
            far = float(np.hypot(*off)) / _ARCSEC
            raise PointingError(
                f"the star is {far:.0f}″ from where the mount can point, {distance:.0f} standard deviations: it is "
                "another star, or something but the knobs has moved; look again"
            )
        kept = np.eye(len(before)) - gain @ design
        covariance = kept @ self.covariance @ kept.T + gain @ noise @ gain.T
        return replace(self._at(state), covariance=covariance, stars=self.stars + 1)

    @cached_property
    def end(self) -> Vector:
        """Where the end of axis 1 at the visible pole, or at the zenith, is: horizon frame."""
        x, y, z = (float(each) for each in self._rotation @ np.array(end_of_axis(self.model)))
        return x, y, z

    def advice(self, pole: Pole = "true", weather: Weather | None = None) -> PolarAlignment | AxisTilt:
        """What to turn, with its standard deviation."""
        here = np.array(to_turn(self.kind, self.end))
        slopes = np.array([np.array(to_turn(self.kind, each.end)) - here for each in self._nudged()]).T / _NUDGE
        one, other = np.sqrt(np.diag(slopes @ self.covariance @ slopes.T)) / _ARCSEC
        air = weather or Weather.standard(0.0)
        sigmas = float(one), float(other)
        return advice(self.kind, self.model.latitude, self.end, sigmas, self.registers, pole, air)

    @property
    def registers(self) -> Registers:
        """The lean of axis 1 in the mount's registers, whole, and the index error that goes with it."""
        if self.turned == (0.0, 0.0):
            return registers(self.model)
        return registers(self.as_model)

    @cached_property
    def as_model(self) -> PointingModel:
        """A model of the mount as it stands now, with the index errors that K gives the axes."""
        places = [self._direction(*axes) for axes in zip(_SPREAD1, _SPREAD2, strict=True)]
        stars = np.array([_coordinates(self.kind, self.model.latitude, place) for place in places])
        run = PointingRun(self.kind, self.model.latitude, stars[:, 0], stars[:, 1], _SPREAD1, _SPREAD2)
        others = [each.name for i, each in enumerate(self.model.terms) if i not in self.free]
        return fit(run, self.model, fixed=others).model

    @property
    def off_arcsec(self) -> float:
        """How far the end of axis 1 is from where it belongs, by the true pole or the zenith, on the sky."""
        south, east, up = self.end
        if self.kind == "altazimuth":
            return math.hypot(math.atan2(south, up), math.atan2(east, up)) / _ARCSEC
        latitude = abs(self.model.latitude)
        x, y, z = math.copysign(math.cos(latitude), -self.model.latitude), 0.0, math.sin(latitude)
        cross = math.hypot(south * z - up * x, east * z - up * y, south * y - east * x)
        return math.asin(min(1.0, cross)) / _ARCSEC

    def field_shift(self, axis1: float, axis2: float, first: float, second: float) -> tuple[float, float]:
        """How a star at the middle of the field moves in it when the knobs are turned so far, east and north.

        Parameters
        ----------
        axis1, axis2 : float
            Of the telescope, radians.
        first, second : float
            By how much to turn, arcseconds.

        Returns
        -------
        tuple of float
            Arcseconds.
        """
        one, other = _LINES[self.kind]
        here = self._direction(axis1, axis2)
        turned = _about(other, second * _ARCSEC) @ _about(one, first * _ARCSEC) @ here
        pole = np.array((-math.cos(self.model.latitude), 0.0, math.sin(self.model.latitude)))
        east = np.cross(pole, here)
        east /= np.linalg.norm(east)
        moved = here - turned
        return float(moved @ east) / _ARCSEC, float(moved @ np.cross(here, east)) / _ARCSEC

    @cached_property
    def _rotation(self) -> Array:
        """K, in the horizon frame: the second knob turns about a line that the first has not moved."""
        first, second = _LINES[self.kind]
        return _about(second, self.turned[1]) @ _about(first, self.turned[0])

    def _direction(self, axis1: float, axis2: float) -> Array:
        """Where a reading of the axes looks now, horizon frame."""
        return np.asarray(self._rotation @ _place(self.model, axis1, axis2))

    def _at(self, state: Array) -> "AxisTracking":
        coefficients = list(self.model.coefficients)
        for i, value in zip(self.free, state, strict=False):
            coefficients[i] = float(value)
        return replace(
            self,
            model=self.model.with_coefficients(coefficients),
            turned=(float(state[-2]), float(state[-1])),
        )

    def _nudged(self) -> list["AxisTracking"]:
        """With each part of the state a little larger."""
        state = np.array((*(self.model.coefficients[i] for i in self.free), *self.turned))
        return [self._at(state + _NUDGE * row) for row in np.eye(len(state))]

    def _residual(self, star: PointingRun) -> tuple[Array, Array]:
        """Star minus prediction on the sky, across and up, and the derivatives of the prediction by the state."""
        axis1, axis2 = float(star.axis1[0]), float(star.axis2[0])
        here = self._direction(axis1, axis2)
        across, up = _tangents(here)
        there = np.array(_observed(self.kind, self.model.latitude, float(star.star1[0]), float(star.star2[0])))
        moved = [each._direction(axis1, axis2) - here for each in self._nudged()]  # noqa: SLF001
        design = np.array([[across @ each, up @ each] for each in moved]).T / _NUDGE
        return np.array([across @ there, up @ there]), design


def best_stars(kind: MountKind, latitude: float, axis1: Array, axis2: Array, count: int = FEWEST) -> tuple[int, ...]:
    """Choose those places that tell the tilt best, the one that tells most alone last.

    Parameters
    ----------
    kind, latitude
        Of the mount.
    axis1, axis2 : (n,) array
        Mechanical angles of the places.
    count : int
        How many to take.
    """
    names = (*INDEX[kind], *TILTS[kind])
    model = PointingModel(kind, latitude, terms(names, kind), (0.0,) * len(names))
    run = PointingRun(kind, latitude, axis1, axis2, axis1, axis2)
    (design,) = (block.design for block in blocks(run, model))
    normal = np.einsum("cnj,cnk->njk", design, design)
    alone = np.array([_trace(each[2:, 2:], 0) for each in normal])
    chosen = [int(np.argmin(alone))]
    while len(chosen) < min(count, len(axis1)):
        total = sum(normal[i] for i in chosen)
        left = [i for i in range(len(axis1)) if i not in chosen]
        chosen.append(min(left, key=lambda i, total=total: _trace(total + normal[i] + np.eye(4) * 1e-9, 2)))  # type: ignore[misc]
    return tuple(reversed(chosen))


def _trace(matrix: Array, first: int) -> float:
    """Sum of the variances from one on; large where they are not told."""
    if np.linalg.cond(matrix) > 1e14:
        return math.inf
    return float(np.diag(np.linalg.inv(matrix))[first:].sum())


def _coefficient(model: PointingModel | None, name: str) -> float:
    return 0.0 if model is None else model.arcsec[name] * _ARCSEC


def _nudged_model(model: PointingModel, index: int) -> PointingModel:
    return model.with_coefficients([c + _NUDGE * (i == index) for i, c in enumerate(model.coefficients)])


def _place(model: PointingModel, axis1: float, axis2: float) -> Array:
    """Where a model sees a reading of the axes, horizon frame."""
    one, two = model.star(axis1, axis2)
    return np.array(_observed(model.kind, model.latitude, float(one), float(two)))


def _observed(kind: MountKind, latitude: float, one: float, two: float) -> Vector:
    if kind == "altazimuth":
        return from_azimuth_altitude(one, two)
    return equatorial_to_horizon(from_hour_angle_declination(one, two), latitude)


def _coordinates(kind: MountKind, latitude: float, direction: Array) -> tuple[float, float]:
    """The inverse of `_observed`."""
    x, y, z = (float(each) for each in direction)
    if kind == "altazimuth":
        return azimuth_altitude((x, y, z))
    return hour_angle_declination(horizon_to_equatorial((x, y, z), latitude))


def _tangents(direction: Array) -> tuple[Array, Array]:
    """Two unit vectors across a direction, square to each other."""
    aside = np.array((0.0, 0.0, 1.0)) if abs(direction[2]) < 0.9 else np.array((1.0, 0.0, 0.0))
    across = np.cross(aside, direction)
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)


def _about(line: Vector, angle: float) -> Array:
    """Active rotation about a unit vector: Rodrigues' formula."""
    x, y, z = line
    k = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.asarray(np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k))
