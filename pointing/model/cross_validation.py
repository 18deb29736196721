"""What subsets of a model's terms are worth on a run: BIC, and patches of the sky predicted by a fit without them.

All is had from normal equations, one set a patch, gathered once: a subset of the terms is a part of the equations, a
fit without a patch their difference. That is linear in what changes; the first model should be near.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pointing.model.design import blocks
from pointing.model.fit import fewest, fit
from pointing.model.normal_equations import NormalEquations
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.model.sky_blocks import largest, sky_blocks
from pointing.model.terms import Term

Array = NDArray[np.float64]

_PATCHES = 8
_ARCSEC = math.degrees(1.0) * 3600.0


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """A run's normal equations by patches of the sky, counted from coefficients of zero.

    Parameters
    ----------
    patches : tuple of NormalEquations
        Of each patch, of all terms.
    n : int
        Observations that take part.
    weight : float
        Sum of their weights.
    """

    patches: tuple[NormalEquations, ...]
    n: int
    weight: float

    @classmethod
    def of(cls, run: PointingRun, model: PointingModel, patches: int = _PATCHES) -> "CrossValidation":
        """Gather the equations of all terms of a model at its coefficients."""
        label = sky_blocks(run, patches)
        gathered = [NormalEquations.empty(len(model.terms)) for _ in range(label.max() + 1)]
        for block in blocks(run, model):
            for patch in np.unique(label[block.where]):
                if patch >= 0:
                    there = np.flatnonzero(label[block.where] == patch)
                    gathered[patch] = gathered[patch].added(
                        block.residual[:, there], block.design[:, there], run.weight[block.where][there]
                    )
        used = label >= 0
        zero = -np.array(model.coefficients)
        return cls(
            tuple(each.after(zero) for each in gathered), int(np.count_nonzero(used)), float(run.weight[used].sum())
        )

    @cached_property
    def whole(self) -> NormalEquations:
        """Of all observations."""
        return NormalEquations(
            np.sum([each.matrix for each in self.patches], axis=0),
            np.sum([each.right for each in self.patches], axis=0),
            sum(each.square for each in self.patches),
        )

    def separable(self, chosen: Sequence[int]) -> bool:
        """Whether the run tells these terms apart."""
        return 2 * self.n > len(chosen) and self.whole.part(chosen).inseparable() is None

    def sky_rms_arcsec(self, chosen: Sequence[int]) -> float:
        """Sky RMS of a fit of these terms."""
        return math.sqrt(self._square(chosen) / self.weight) * _ARCSEC

    def bic(self, chosen: Sequence[int]) -> float:
        """2n ln(Σd²/2n) + k ln 2n; only differences on one run mean something."""
        components = 2 * self.n
        return components * math.log(self._square(chosen) / components) + len(chosen) * math.log(components)

    def cv_sky_rms_arcsec(self, chosen: Sequence[int]) -> float:
        """Sky RMS of every patch predicted by a fit without it; infinite where such a fit is not possible."""
        whole = self.whole.part(chosen)
        square = 0.0
        for patch in (each.part(chosen) for each in self.patches):
            others = whole.without(patch)
            if others.inseparable() is not None:
                return math.inf
            square += patch.square_after(others.solution())
        return math.sqrt(square / self.weight) * _ARCSEC

    def _square(self, chosen: Sequence[int]) -> float:
        equations = self.whole.part(chosen)
        # the residuals of nothing but exact places vanish to rounding; a logarithm wants them positive
        return max(equations.square_after(equations.solution()), 1e-16 * equations.square, 1e-300)


def fewest_predicted(k: int, patches: int = _PATCHES) -> int:
    """Observations of which each patch can be predicted by a fit of `k` free terms to all others."""
    n = fewest(k) + 1
    while n - largest(n, patches) < fewest(k):
        n += 1
    return n


def cv_sky_rms_arcsec(run: PointingRun, model: str | Sequence[Term] | PointingModel) -> float:
    """Fit a model; return the sky RMS of patches of the sky predicted by a fit of all others.

    Infinite where such a fit is not possible.

    Raises
    ------
    PointingError
        As for `fit`.
    """
    fitted = fit(run, model).model
    return CrossValidation.of(run, fitted).cv_sky_rms_arcsec(range(len(fitted.terms)))
