"""Where axis 1 points, from looks at stars, while knobs under the mount are turned.

A look gives two numbers: where the telescope was seen to point against where it should, by the mount that is in
force, at what its axes read. What they determine is the attitude of the whole mount, a rotation R of the horizon
frame on top of the mount in force, and the index error of axis 2. The index error of axis 1 is a rotation about axis
1, so R has it, too.

A knob turns the whole mount, R ← exp(t)·R, and neither index. Thus a turn about the vertical carries the zero of axis
1 with it by sin φ of its angle, as it does in truth, and nothing has to be forgotten but the knobs' own angles: they
are known to about their size, while the third component of t is 1 % of the turn, as knobs are not quite about the
vertical and the line from east to west, and carry each other or do not. A turn that was quite another than the one
advised says so (`Turn.free`): looks alone tell its angles then, and collimation nobody knows of is granted.

All looks and turns are solved together by Gauss and Newton's method with the exact rotations, the prior of each turn
being one more observation: the Bayesian estimate that a filter approximates (B. M. Bell 1994, SIAM J. Optim. 4, 626:
the iterated Kalman smoother is Gauss-Newton), with no error of linearisation left behind by the first, large turn.

Where looks disagree by more than chance has it, all covariances grow by their χ² a degree of freedom.

Standard deviations are of one component on the sky, radians.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.mount import Mount, MountType
from pointing.vectors import Vector

Array = NDArray[np.float64]

_ARCSEC = math.radians(1.0 / 3600.0)
_ATTITUDE = math.radians(10.0)  # prior σ of each component; IMPLAUSIBLE looks never come here
_INDEX2 = math.radians(5.0)
_OWN_SIZE = 1.0  # σ of a knob's turn, of what was advised
_UNASKED = 60.0 * _ARCSEC  # and of a turn that was not advised
_CROSS_TALK = 0.01  # of a turn, about the direction for which there is no knob
_CROSS_FLOOR = 0.3 * _ARCSEC
_FREE = math.radians(5.0)  # σ of a knob's turn that was not the one advised
_FREE_FLOOR = 180.0 * _ARCSEC  # and of the third: 3′ of collimation lie about another direction after it
_STEP = 1e-6  # of the derivative by axis 2
_ENOUGH = 1e-13
_ITERATIONS = 30
_STRANGE = 18.4  # χ² of two components that a good look exceeds once in 10⁴
_MISFIT_SIGMAS = 4.0  # of χ², beyond which looks disagree
FEWEST = 3


@dataclass(frozen=True)
class Look:
    """Where the telescope was seen to point.

    Parameters
    ----------
    axis1, axis2 : float
        What its axes read, radians.
    seen : Vector
        Observed direction, horizon frame.
    sigma : float
        Standard deviation of each component of it, what is not modelled included, radians.
    """

    axis1: float
    axis2: float
    seen: Vector
    sigma: float

    def __post_init__(self) -> None:
        if not (self.sigma > 0.0 and all(map(math.isfinite, (self.axis1, self.axis2, *self.seen, self.sigma)))):
            raise PointingError(f"{self}: give finite angles, and a standard deviation above 0, radians")


@dataclass(frozen=True)
class Turn:
    """A turn of the knobs.

    Parameters
    ----------
    advised : tuple of float
        What is known of it: radians by knob, in the order of `knob_axes`.
    free : bool
        Whether not even that: it was quite another one.
    """

    advised: tuple[float, float]
    free: bool = False


@dataclass(frozen=True, eq=False)
class _Solution:
    """Angles (3 + 1 + 3 a turn), their covariance, the derivative of the last attitude by them, and the misfit."""

    angles: Array
    covariance: Array
    attitude: Array
    by_angles: Array
    square: float


@dataclass(frozen=True)
class AxisEstimate:
    """What is known of a mount's attitude; frozen, so that each look and turn gives another one.

    Parameters
    ----------
    mount : Mount
        Geometry in force, by which looks are compared.
    events : tuple of Look or Turn
        In the order of time.
    """

    mount: Mount
    events: tuple[Look | Turn, ...] = ()

    @property
    def looks(self) -> tuple[Look, ...]:
        """All looks."""
        return tuple(each for each in self.events if isinstance(each, Look))

    @property
    def turns(self) -> int:
        """How often the knobs were turned."""
        return len(self.events) - len(self.looks)

    def looked(self, look: Look) -> "AxisEstimate":
        """Learn from a look."""
        return replace(self, events=(*self.events, look))

    def turned(self, advised: tuple[float, float], *, free: bool = False) -> "AxisEstimate":
        """Know that the knobs were turned, and what was advised; `free` where it was quite another turn."""
        return replace(self, events=(*self.events, Turn(advised, free)))

    @property
    def attitude(self) -> Array:
        """R, the rotation of the mount from where the one in force has it: (3, 3), horizon frame."""
        return self._solved.attitude

    @property
    def covariance(self) -> Array:
        """Covariance of the attitude as a rotation vector, horizon frame, square radians: (3, 3)."""
        return _square(self._solved.by_angles, self._covariance)

    @property
    def index2(self) -> float:
        """What axis 2 reads too little, radians."""
        return float(self._solved.angles[3])

    @property
    def pole(self) -> Array:
        """Where the end of axis 1 with increasing axis 2 really is, horizon frame: (3,)."""
        return np.asarray(self.attitude @ np.array(self.mount.pole))

    @property
    def square(self) -> float:
        """χ² of all that was seen and of the priors."""
        return self._solved.square

    @property
    def freedom(self) -> int:
        """Degrees of freedom of it: two a look, less attitude, index and the knobs' own angles."""
        return 2 * len(self.looks) - 4 - 2 * self.turns

    def last_turn(self) -> tuple[Array, Array]:
        """What the knobs really did at the last turn, and its standard deviation, radians: (2,) each.

        Raises
        ------
        PointingError
            There was none.
        """
        if not self.turns:
            raise PointingError("no knob was turned yet: say so with `turned` once it was")
        sigma = np.sqrt(np.diag(self._covariance)[-3:-1])
        return self._solved.angles[-3:-1], sigma

    def predicted(self, look: Look) -> tuple[Array, Array]:
        """Where a look should see, and the covariance of its two components: (3,), (2, 2)."""
        place, by_attitude, by_index2 = self._place(look, self.attitude, self.index2)
        basis = tangent(place)
        design = basis @ by_attitude @ self._solved.by_angles
        design[:, 3] += basis @ by_index2
        return place, _square(design, self._covariance) + (self.disagreement * look.sigma) ** 2 * np.eye(2)

    def strangeness(self, look: Look) -> float:
        """χ², of two components, of what a look saw against what was expected."""
        place, covariance = self.predicted(look)
        off = tangent(place) @ np.array(look.seen)
        return float(off @ np.linalg.solve(covariance, off))

    def belongs(self, look: Look) -> bool:
        """Whether a look is as expected, once there is something to expect."""
        return self.strangeness(look) < _STRANGE

    def information(self, look: Look) -> Array:
        """What a look adds on attitude and index 2: (4, 4), the inverse of a covariance."""
        place, by_attitude, by_index2 = self._place(look, self.attitude, self.index2)
        design = tangent(place) @ np.column_stack((by_attitude, by_index2))
        return np.asarray(design.T @ design / look.sigma**2)

    @property
    def joint(self) -> Array:
        """Covariance of attitude and index 2 together: (4, 4)."""
        index2 = np.zeros(len(self._solved.angles))
        index2[3] = 1.0
        return _square(np.vstack((self._solved.by_angles, index2)), self._covariance)

    @property
    def disagreement(self) -> float:
        """How many times their standard deviations looks are apart; 1 where that can be chance."""
        freedom = self.freedom
        if freedom <= 0 or self.square <= freedom + _MISFIT_SIGMAS * math.sqrt(2.0 * freedom):
            return 1.0
        return math.sqrt(self.square / freedom)

    @property
    def _covariance(self) -> Array:
        """Of all angles."""
        return self._solved.covariance * self.disagreement**2

    @cached_property
    def _solved(self) -> _Solution:
        angles = self._start()
        for _ in range(_ITERATIONS):
            design, residual, attitude, by_angles = self._equations(angles)
            step, *_ = np.linalg.lstsq(design, residual, rcond=None)
            angles = angles + step
            if np.max(np.abs(step)) < _ENOUGH:
                break
        design, residual, attitude, by_angles = self._equations(angles)
        covariance = np.asarray(np.linalg.inv(design.T @ design), np.float64)
        return _Solution(angles, covariance, attitude, by_angles, float(residual @ residual))

    def _start(self) -> Array:
        turns = [(*each.advised, 0.0) for each in self.events if isinstance(each, Turn)]
        return np.array([0.0] * 4 + [angle for turn in turns for angle in turn])

    def _equations(self, angles: Array) -> tuple[Array, Array, Array, Array]:
        """Design and residuals in units of σ; the last attitude and its derivative by the angles."""
        n = angles.size
        rows, residuals = [np.eye(4, n)], [-angles[:4]]
        sigmas = [np.array([_ATTITUDE] * 3 + [_INDEX2])]
        attitude, by_angles = rotation(angles[:3]), np.zeros((3, n))
        by_angles[:, :3] = _left_jacobian(angles[:3])
        at, knobs = 4, knob_axes(self.mount)
        for event in self.events:
            if isinstance(event, Turn):
                own = angles[at : at + 3]
                turn = rotation(knobs @ own)
                attitude, by_angles = turn @ attitude, turn @ by_angles
                by_angles[:, at : at + 3] = _left_jacobian(knobs @ own) @ knobs
                rows.append(np.eye(3, n, at))
                residuals.append(np.array((*event.advised, 0.0)) - own)
                sigmas.append(_turn_sigmas(event, own))
                at += 3
            else:
                place, by_attitude, by_index2 = self._place(event, attitude, float(angles[3]))
                basis = tangent(place)
                row = basis @ by_attitude @ by_angles
                row[:, 3] += basis @ by_index2
                rows.append(row)
                residuals.append(basis @ np.array(event.seen))
                sigmas.append(np.full(2, event.sigma))
        scale = np.concatenate(sigmas)
        return np.vstack(rows) / scale[:, None], np.concatenate(residuals) / scale, attitude, by_angles

    def _place(self, look: Look, attitude: Array, index2: float) -> tuple[Array, Array, Array]:
        """Where a look should see: (3,); its derivatives by a rotation of the mount: (3, 3), and by index 2: (3,)."""
        below, here, above = (
            np.array(self.mount.observed(look.axis1, look.axis2 + index2 + step)) for step in (-_STEP, 0.0, _STEP)
        )
        place = attitude @ here
        return place, -_cross(place), attitude @ (above - below) / (2.0 * _STEP)


def knob_axes(mount: Mount) -> Array:
    """Rotation vectors of the knobs, horizon frame, as columns: two knobs, and what no knob turns: (3, 3).

    The knobs of an equatorial mount raise the visible end of its axis, and turn it eastwards about the vertical;
    those of an altazimuth mount raise the north and the west side of its base.
    """
    if mount.type is MountType.ALTAZ_FORK:
        return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    end = -1.0 if mount.latitude < 0.0 else 1.0
    return np.array([[0.0, 0.0, 1.0], [end, 0.0, 0.0], [0.0, -end, 0.0]])


def rotation(v: Array) -> Array:
    """Active rotation by a vector (3,), radians: Rodrigues' formula."""
    angle, k = float(np.linalg.norm(v)), _cross(v)
    half = np.sinc(angle / math.tau)  # sin(a/2)/(a/2)
    return np.asarray(np.eye(3) + np.sinc(angle / math.pi) * k + 0.5 * half**2 * (k @ k))


def tangent(place: Array) -> Array:
    """Unit vectors across and up at a place, as rows: (2, 3)."""
    x, y, z = place
    level = math.hypot(x, y) or 1e-300
    return np.array([[-y / level, x / level, 0.0], [-z * x / level, -z * y / level, level]])


def _left_jacobian(v: Array) -> Array:
    """The rotation that comes on top of rotation(v) when v changes (T. D. Barfoot 2017, State Estimation, 7.77)."""
    angle, k = float(np.linalg.norm(v)), _cross(v)
    half = np.sinc(angle / math.tau)
    third = (1.0 - np.sinc(angle / math.pi)) / angle**2 if angle > 1e-4 else 1.0 / 6.0
    return np.asarray(np.eye(3) + 0.5 * half**2 * k + third * (k @ k))


def _turn_sigmas(turn: Turn, own: Array) -> Array:
    """Prior standard deviations of a turn, radians: of both knobs, and of what no knob turns."""
    one, two = (_FREE if turn.free else _OWN_SIZE * abs(each) + _UNASKED for each in turn.advised)
    floor = _FREE_FLOOR if turn.free else _CROSS_FLOOR
    return np.array([one, two, _CROSS_TALK * math.hypot(own[0], own[1]) + floor])


def _cross(v: Iterable[float]) -> Array:
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def _square(design: Array, covariance: Array) -> Array:
    return np.asarray(design @ covariance @ design.T)
