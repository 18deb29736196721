"""A fitted model that learns from one star at a time.

    current = SequentialFit.of(fit(run, "IH ID CH NP MA ME TF"), forgetting=0.99)
    current, verdict = current.learned(star)

The recursive least squares of the fit's own normal equations: with P = (MᵀWM)⁻¹, the star's residual r (2) and its
derivatives J (2×k),

    S = I/w + JPJᵀ,  x ← x + PJᵀS⁻¹r,  P ← P − PJᵀS⁻¹JP,  Σ ← Σ + rᵀS⁻¹r,

which costs O(k²). Before each star P is divided by the *forgetting* factor λ and Σ and n are multiplied by it, so
that what is m stars old weighs λᵐ; 1 forgets nothing.

Earlier stars keep the derivatives at the coefficients with which they were learned. What this leaves against a fit of
all stars at once is of second order: with a change of c″ in a coefficient and residuals of ρ″ up to about
1e-4·c·(c + ρ)″, thus below 1e-6″ where c is below 0.01″ (ρ 1″), 0.003″ for 5″, and 1″ for 100″: then fit anew.

A star that does not belong is not learned: it is tested as in `pointing.model.outliers`.
"""

import math
from dataclasses import dataclass, replace
from html import escape

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.design import blocks
from pointing.model.fitted import Fit
from pointing.model.outliers import chance_so_far_off, rejection_level
from pointing.model.pointing_model import PointingModel
from pointing.model.prediction import Prediction
from pointing.model.run import PointingRun

Array = NDArray[np.float64]

_ARCSEC = math.degrees(1.0) * 3600.0


@dataclass(frozen=True)
class Verdict:
    """What became of a star.

    Parameters
    ----------
    taken : bool
        Whether it was learned.
    distance_arcsec : float
        From where the model predicted it.
    sigmas : float
        The same in units of its standard deviation, the model's own uncertainty included.
    probability : float
        That a good star lies so far off.
    why : str
        One sentence.
    """

    taken: bool
    distance_arcsec: float
    sigmas: float
    probability: float
    why: str


@dataclass(frozen=True, eq=False)
class SequentialFit:
    """A model, what it knows, and how fast it forgets.

    Parameters
    ----------
    model : PointingModel
        The model.
    free : tuple of bool
        Which of its terms are learned.
    cofactor : (k, k) array
        (MᵀWM)⁻¹ of the free terms, the older stars weighing less.
    square : float
        Weighted sum of the squared residuals, square radians, likewise.
    n : float
        Number of observations, likewise.
    weight : float
        Sum of their weights, likewise.
    forgetting : float
        λ, above 0 and up to 1.
    """

    model: PointingModel
    free: tuple[bool, ...]
    cofactor: Array
    square: float
    n: float
    weight: float
    forgetting: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 < self.forgetting <= 1.0:
            raise PointingError(f"forgetting {self.forgetting:g}; possible are numbers above 0 up to 1, as 0.99")

    @classmethod
    def of(cls, fit: Fit, forgetting: float = 1.0) -> "SequentialFit":
        """Go on from a fit.

        Raises
        ------
        PointingError
            The forgetting factor is not above 0 and up to 1, or the fit left no residuals to judge a star by.
        """
        if 2 * fit.n <= fit.k:
            raise PointingError(
                f"{fit.n} observations leave nothing of {fit.k} terms to judge a star by: observe more"
            )
        weight = float(fit.weight.sum())
        return cls(fit.model, fit.free, fit.equations.inverse, fit.square, float(fit.n), weight, forgetting)

    @property
    def k(self) -> int:
        """Number of terms that are learned."""
        return sum(self.free)

    @property
    def variance(self) -> float:
        """Of one component of an observation of weight one, square radians."""
        return self.square / max(2.0 * self.n - self.k, 1.0)

    @property
    def covariance(self) -> Array:
        """Covariance of the free coefficients, square radians: (k, k)."""
        return self.cofactor * self.variance

    @property
    def prediction(self) -> Prediction:
        """The model with the uncertainty of its coefficients, and the scatter of an observation of mean weight."""
        return Prediction(self.model, self.free, self.covariance, math.sqrt(self.variance * self.n / self.weight))

    def learned(self, star: PointingRun, *, gate: bool = True) -> tuple["SequentialFit", Verdict]:
        """Learn from one star.

        Parameters
        ----------
        star : PointingRun
            One observation.
        gate : bool
            Whether a star that does not belong is left alone.

        Returns
        -------
        tuple
            The fit after it, the same one where the star was not taken, and what became of the star.

        Raises
        ------
        PointingError
            It is not one observation, is masked or has no weight, or is of another mount or latitude.
        """
        self._refuse(star)
        (block,) = blocks(star, self.model)
        residual, design = block.residual[:, 0], block.design[:, 0][:, np.array(self.free, bool)]
        aged = replace(
            self,
            cofactor=self.cofactor / self.forgetting,
            square=self.square * self.forgetting,
            n=self.n * self.forgetting,
            weight=self.weight * self.forgetting,
        )
        gain = aged.cofactor @ design.T
        inverse = np.linalg.inv(np.eye(2) / star.weight[0] + design @ gain)
        verdict = _judged(aged, residual, float(residual @ inverse @ residual))
        if gate and not verdict.taken:
            return self, verdict
        coefficients = np.array(self.model.coefficients)
        coefficients[np.array(self.free, bool)] += gain @ inverse @ residual
        after = replace(
            aged,
            model=self.model.with_coefficients(coefficients.tolist()),
            cofactor=aged.cofactor - gain @ inverse @ gain.T,
            square=aged.square + float(residual @ inverse @ residual),
            n=aged.n + 1.0,
            weight=aged.weight + float(star.weight[0]),
        )
        return after, verdict if verdict.taken else replace(
            verdict, taken=True, why=f"taken all the same: {verdict.why}"
        )

    def _refuse(self, star: PointingRun) -> None:
        if len(star) != 1:
            raise PointingError(f"{len(star)} observations; give one at a time: run.subset picks one")
        if not star.kept[0] or not star.weight[0] > 0.0:
            raise PointingError("the star is masked or weighs nothing: there is nothing to learn")
        if star.mount != self.model.kind:
            raise PointingError(f"the model is for an {self.model.kind} mount, the star is of an {star.mount} one")
        if abs(star.latitude - self.model.latitude) > 1e-6:
            here, there = math.degrees(star.latitude), math.degrees(self.model.latitude)
            raise PointingError(
                f"the star is of latitude {here:.5f}°, the model of {there:.5f}°: fit anew at the new site"
            )

    def __repr__(self) -> str:
        listed = " ".join(f"{name} {value:.2f}″" for name, value in self.model.arcsec.items())
        return f"SequentialFit({listed}; {self.n:.1f} stars, forgetting {self.forgetting:g})"

    def _repr_html_(self) -> str:
        sigma = iter(np.sqrt(np.diag(self.covariance)) * _ARCSEC)
        rows = "".join(
            f"<tr><td>{name}</td><td>{value:.2f}″</td><td>{next(sigma) if is_free else 0.0:.2f}″</td></tr>"
            for (name, value), is_free in zip(self.model.arcsec.items(), self.free, strict=True)
        )
        caption = f"<caption>{escape(f'{self.n:.1f} stars, forgetting {self.forgetting:g}')}</caption>"
        return f"<table>{caption}<tr><th>term</th><th>value</th><th>σ</th></tr>{rows}</table>"


def _judged(before: SequentialFit, residual: Array, square: float) -> Verdict:
    """The outlier test of a star that was not fitted."""
    freedom = max(2.0 * before.n - before.k, 1.0)
    t2 = square / max(before.variance, 1e-30)
    probability = float(chance_so_far_off(t2, freedom))
    level = rejection_level(before.n + 1.0)
    distance = float(np.hypot(*residual)) * _ARCSEC
    good = probability >= level
    why = (
        f"{distance:.1f}″ from its prediction, {math.sqrt(t2):.1f}σ; chance {probability:.1e}, "
        f"{'above' if good else 'below'} {level:.1e}: {'it belongs' if good else 'it does not belong'}"
    )
    return Verdict(good, distance, math.sqrt(t2), probability, why)
