"""What a fit gives: coefficients with their uncertainty, residuals, and TPOINT's and ordinary statistics.

Tables, maps, advice and plots are made by modules of their own, loaded when they are first asked for.
"""

# The methods that hand over import where they are called: astropy and matplotlib are not needed for a fit.
# ruff: noqa: PLC0415

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pointing.model.design import blocks, residuals
from pointing.model.functions import Real
from pointing.model.normal_equations import NormalEquations
from pointing.model.outliers import Outlier
from pointing.model.pointing_model import PointingModel
from pointing.model.prediction import Prediction
from pointing.model.run import PointingRun

if TYPE_CHECKING:
    from astropy.table import QTable

    from pointing.model.error_map import ErrorMap
    from pointing.model.polar_alignment import AxisTilt, PolarAlignment
    from pointing.model.predicted_place import PredictedPlace
    from pointing.model.words import Pole
    from pointing.mount import Posture
    from pointing.site import Weather

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

    @property
    def leverage(self) -> Array:
        """W M(MᵀWM)⁻¹Mᵀ of each observation, by how much it draws its own prediction: (3, n), elements XX, XY, YY.

        XX + YY of all observations add up to k.
        """
        return self.weight * self.place_cofactor

    @cached_property
    def place_cofactor(self) -> Array:
        """M(MᵀWM)⁻¹Mᵀ of each observation, masked ones too: (3, n), elements XX, XY, YY."""
        free = np.array(self.free, bool)
        found = np.empty((3, len(self.run)))
        for block in blocks(self.run, self.model):
            along, up = block.design[:, :, free]
            spread = along @ self.equations.inverse
            found[0, block.where] = np.sum(spread * along, axis=1)
            found[1, block.where] = np.sum(spread * up, axis=1)
            found[2, block.where] = np.sum((up @ self.equations.inverse) * up, axis=1)
        return found

    @property
    def prediction(self) -> Prediction:
        """The model with the uncertainty of its coefficients, for places and observations on the sky."""
        return Prediction(self.model, self.free, self.covariance, self.component_sd_arcsec / _ARCSEC)

    def predicted_sigma(self, lon: Real, lat: Real, *, observation: bool = False) -> Real:
        """Standard deviation of the model's place on the sky, √(σ_X² + σ_Y²), at mechanical coordinates.

        Parameters
        ----------
        lon, lat : float or array
            Of the telescope's axes, radians.
        observation : bool
            Of a single observation instead, its scatter included.

        Returns
        -------
        float or array
            Radians: what the coefficients' uncertainty leaves. `pointing.model.prediction` says what it covers.
        """
        return self.prediction.sigma(lon, lat, observation=observation)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to beware of, a sentence each."""
        from pointing.model.summary import warnings

        return warnings(self)

    def __repr__(self) -> str:
        from pointing.model.summary import text

        return text(self)

    def _repr_html_(self) -> str:
        from pointing.model.summary import html

        return html(self)

    def residual_table(self) -> "QTable":
        """Return one row an observation, with units; `pointing.model.residual_table` says what columns it has."""
        from pointing.model.residual_table import residual_table

        return residual_table(self)

    def write_residuals(self, path: str | Path) -> None:
        """Write the residual table as ECSV."""
        from pointing.model.residual_table import write_residuals

        write_residuals(self, path)

    def predict(
        self,
        first: Any,  # noqa: ANN401 - a quantity, or a SkyCoord
        second: Any = None,  # noqa: ANN401
        *,
        posture: "Posture" = "normal",
    ) -> "PredictedPlace":
        """Predict the telescope's angles for observed places, with units; see `pointing.model.predicted_place`.

        Raises
        ------
        PointingError
            As there.
        """
        from pointing.model.predicted_place import predict

        return predict(self, first, second, posture=posture)

    def error_map(self, step_deg: float = 5.0, lowest_deg: float = 15.0) -> "ErrorMap":
        """Return the standard deviation of the model's places over the sky; see `pointing.model.error_map`.

        Raises
        ------
        PointingError
            As there.
        """
        from pointing.model.error_map import error_map

        return error_map(self, step_deg, lowest_deg)

    def polar_alignment(self, pole: "Pole" = "true", weather: "Weather | None" = None) -> "PolarAlignment | AxisTilt":
        """Return what to turn so that axis 1 points where it should; see `pointing.model.polar_alignment`.

        Raises
        ------
        PointingError
            As there.
        """
        from pointing.model.polar_alignment import polar_alignment

        return polar_alignment(self, pole, weather)

    def save(self, path: str | Path) -> None:
        """Write the model as a TPOINT model file, which `pointing.read_model` reads back.

        Raises
        ------
        PointingError
            It has a term of one's own or none at all, or the file cannot be written.
        """
        from pointing.model.saved_model import save

        save(self, path)

    def plot_residuals(self, axes: Any = None) -> Any:  # noqa: ANN401 - matplotlib's axes
        """Draw the nine panels of residuals; needs matplotlib. `pointing.model.plots` has more drawings.

        Raises
        ------
        PointingError
            matplotlib is not installed.
        """
        from pointing.model.plots import plot_panels

        return plot_panels(self, axes)
