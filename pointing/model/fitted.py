"""What a fit gives: coefficients with their uncertainty, residuals, and TPOINT's and ordinary statistics."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pointing.model.design import blocks, residuals
from pointing.model.functions import Real
from pointing.model.normal_equations import NormalEquations
from pointing.model.outliers import Outlier
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun

Array = NDArray[np.float64]

_ARCSEC = math.degrees(1.0) * 3600.0


@dataclass(frozen=True)
class Coefficient:
    """One term of a fit, arcseconds; σ is TPOINT's, 0 for a fixed term."""

    name: str
    arcsec: float
    sigma_arcsec: float
    fixed: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted pointing model.

    Parameters
    ----------
    model : PointingModel
        The model.
    free : tuple of bool
        Which of its terms were fitted.
    run : PointingRun
        The run, with what was masked.
    weight : (n,) array
        What each observation counted, Huber's weight in it.
    equations : NormalEquations
        Of the free terms, at the solution.
    outliers : tuple of Outlier
        What the outlier test masked.
    """

    model: PointingModel
    free: tuple[bool, ...]
    run: PointingRun
    weight: Array
    equations: NormalEquations
    outliers: tuple[Outlier, ...] = field(default=())

    @property
    def k(self) -> int:
        """Number of fitted terms."""
        return sum(self.free)

    @cached_property
    def n(self) -> int:
        """Number of observations that took part."""
        return int(np.count_nonzero(self.weight > 0.0))

    @property
    def square(self) -> float:
        """Weighted sum of the squared residuals, square radians."""
        return self.equations.square

    @cached_property
    def residuals(self) -> Array:
        """Star minus prediction of every observation, radians: (2, n), dX along axis 1 and dY along axis 2."""
        return residuals(self.run, self.model)

    @cached_property
    def _mean_square(self) -> float:
        """Weighted mean of the squared distances, square radians."""
        return self.square / float(self.weight.sum())

    @property
    def sky_rms_arcsec(self) -> float:
        """TPOINT's sky RMS: √(Σ(dX² + dY²)/n)."""
        return math.sqrt(self._mean_square) * _ARCSEC

    @property
    def popn_sd_arcsec(self) -> float:
        """TPOINT's population standard deviation: sky RMS · √(n/(n − k)); infinite where n does not exceed k."""
        return self.sky_rms_arcsec * math.sqrt(self.n / (self.n - self.k)) if self.n > self.k else math.inf

    @property
    def component_sd_arcsec(self) -> float:
        """Standard deviation of one component of an observation, unbiased: √(Σ(dX² + dY²)/(2n − k))."""
        freedom = 2 * self.n - self.k
        return math.sqrt(self._mean_square * self.n / freedom) * _ARCSEC if freedom > 0 else math.inf

    @cached_property
    def _cofactor(self) -> Array:
        """(MᵀWM)⁻¹ with weights of mean one."""
        return self.equations.inverse * (float(self.weight.sum()) / self.n)

    @property
    def covariance(self) -> Array:
        """Covariance of the free coefficients, square radians: (k, k), from the component's standard deviation."""
        return self._cofactor * (self.component_sd_arcsec / _ARCSEC) ** 2

    @cached_property
    def correlation(self) -> Array:
        """Correlation of the free coefficients: (k, k)."""
        s = np.sqrt(np.diag(self.equations.inverse))
        return np.asarray(self.equations.inverse / np.outer(s, s))

    @property
    def condition(self) -> float:
        """Condition of the design matrix with columns of unit length."""
        return self.equations.condition

    @cached_property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The terms in their order; σ_j = sky RMS · √([(MᵀM)⁻¹]_jj), TPOINT's convention."""
        spread = iter(np.sqrt(np.diag(self._cofactor)) * self.sky_rms_arcsec)
        return tuple(
            Coefficient(each.name, value * _ARCSEC, float(next(spread)) if is_free else 0.0, not is_free)
            for each, value, is_free in zip(self.model.terms, self.model.coefficients, self.free, strict=True)
        )

    def __getitem__(self, name: str) -> Coefficient:
        """Return the coefficient of a term."""
        for each in self.coefficients:
            if each.name == name.upper():
                return each
        raise KeyError(f"{name} is no term of this model: {' '.join(each.name for each in self.coefficients)}")

    @cached_property
    def leverage(self) -> Array:
        """M(MᵀWM)⁻¹Mᵀ of each observation: (3, n), the elements XX, XY, YY."""
        free = np.array(self.free, bool)
        found = np.empty((3, len(self.run)))
        for block in blocks(self.run, self.model):
            along, up = block.design[:, :, free]
            spread = along @ self.equations.inverse
            found[0, block.where] = np.sum(spread * along, axis=1)
            found[1, block.where] = np.sum(spread * up, axis=1)
            found[2, block.where] = np.sum((up @ self.equations.inverse) * up, axis=1)
        return found

    def predicted_sigma(self, lon: Real, lat: Real) -> Real:
        """Standard deviation of the model's place on the sky, √(σ_X² + σ_Y²), at mechanical coordinates.

        Parameters
        ----------
        lon, lat : float or array
            Of the telescope's axes, radians.

        Returns
        -------
        float or array
            Radians; what the coefficients' uncertainty leaves, without the scatter of a single observation.
        """
        _, _, jacobian = self.model.star_and_jacobian(lon, lat)
        free = [pair for pair, is_free in zip(jacobian.by_coefficient, self.free, strict=True) if is_free]
        shape = np.shape(lat)
        if not free:
            return np.zeros(shape)
        rows = np.array([[np.broadcast_to(part, shape) for part in pair] for pair in free])  # (k, 2, …)
        variance = np.einsum("ic...,ij,jc...->...", rows, self.covariance, rows)
        return np.sqrt(variance)
