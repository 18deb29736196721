"""Weighted normal equations, gathered block by block, and what they say about the terms.

Columns are scaled to unit length before anything is decided: the condition is then that of the geometry of the run
and not of the units, and σ and correlations come from the same decomposition as the solution.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pointing.model.functions import once

Array = NDArray[np.float64]

SINGULAR = 1e-10  # smallest eigenvalue of the scaled normal matrix, against the largest, that still tells terms apart
_PLAINLY = 0.1  # of a limit: what is below needs no decomposition to be seen
_HARDER = 3.0


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """MᵀWM, MᵀWr and rᵀWr of k terms.

    Parameters
    ----------
    matrix : (k, k) array
        MᵀWM.
    right : (k,) array
        MᵀWr, radians.
    square : float
        rᵀWr, square radians.
    """

    matrix: Array
    right: Array
    square: float

    @classmethod
    def empty(cls, k: int) -> "NormalEquations":
        """Return those of no observation."""
        return cls(np.zeros((k, k)), np.zeros(k), 0.0)

    def added(self, residual: Array, design: Array, weight: Array) -> "NormalEquations":
        """Return them with more observations: residual (2, n), design (2, n, k), weight (n,)."""
        flat = design.reshape(residual.size, design.shape[-1])
        weights = np.concatenate((weight, weight))
        weighted = flat * weights[:, None]
        r = residual.ravel()
        return NormalEquations(
            self.matrix + weighted.T @ flat, self.right + weighted.T @ r, self.square + float(r @ (weights * r))
        )

    def part(self, chosen: Sequence[int]) -> "NormalEquations":
        """Return those of some of the terms, the others left out of the model."""
        which = np.asarray(chosen, int)
        return NormalEquations(self.matrix[np.ix_(which, which)], self.right[which], self.square)

    def without(self, other: "NormalEquations") -> "NormalEquations":
        """Return them without the observations of others."""
        return NormalEquations(self.matrix - other.matrix, self.right - other.right, self.square - other.square)

    def after(self, change: Array) -> "NormalEquations":
        """Return them at coefficients changed by so much, to first order."""
        return NormalEquations(self.matrix, self.right - self.matrix @ change, self.square_after(change))

    def square_after(self, change: Array) -> float:
        """Weighted sum of squared residuals after a change of the coefficients, to first order."""
        return float(self.square - change @ (2.0 * self.right - self.matrix @ change))

    @once
    def scale(self) -> Array:
        """Length of each column of √W M; 1 for a column of zeros."""
        length = np.sqrt(self.matrix.diagonal())
        return np.where(length > 0.0, length, 1.0)

    @once
    def _eigen(self) -> tuple[Array, Array]:
        values, vectors = np.linalg.eigh(self._scaled)
        return values, vectors

    @property
    def condition(self) -> float:
        """Condition of the scaled design matrix; infinite where terms cannot be told apart."""
        if not self.scale.size:
            return 1.0
        values, _ = self._eigen
        return float(np.sqrt(values[-1] / values[0])) if values[0] > 0.0 else float("inf")

    def inseparable(self) -> Array | None:
        """Return the share of each term in the combinations that the observations do not see, or None."""
        if not self.scale.size:
            return None
        try:
            if _square(self._scaled) * _square(self._scaled_inverse) < (_PLAINLY / SINGULAR) ** 2:
                return None
        except np.linalg.LinAlgError:
            pass
        values, vectors = self._eigen
        if values[0] >= SINGULAR * values[-1]:
            return None
        return np.asarray(np.linalg.norm(vectors[:, values < SINGULAR * values[-1]], axis=1))

    @once
    def inverse(self) -> Array:
        """(MᵀWM)⁻¹."""
        return np.asarray(self._scaled_inverse / (self.scale[:, None] * self.scale))

    @once
    def _scaled(self) -> Array:
        return np.asarray(self.matrix / (self.scale[:, None] * self.scale))

    @once
    def _scaled_inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self._scaled))

    @property
    def least_seen(self) -> float:
        """Most that a coefficient changes, radians, in a change of length 1."""
        return math.sqrt(float(self.inverse.diagonal().max(initial=0.0)))

    def length(self, change: Array) -> float:
        """√(xᵀ MᵀWM x) of a change x of the coefficients: what it moves on the sky, over all observations."""
        return math.sqrt(max(float(change @ self.matrix @ change), 0.0))

    def solution(self, damping: float = 0.0) -> Array:
        """Return the coefficients' change, radians.

        Parameters
        ----------
        damping : float
            Added to the eigenvalues of the scaled matrix, so that what is seen badly changes less.
        """
        if damping == 0.0:
            return np.asarray(self.inverse @ self.right)
        values, vectors = self._eigen
        return np.asarray(vectors @ ((vectors.T @ (self.right / self.scale)) / (values + damping)) / self.scale)

    def next_damping(self, damping: float) -> float:
        """Return a damping that is felt by what is seen worst, or more than the present one."""
        return max(_HARDER * damping, float(self._eigen[0][0]))

    def reverses(self, before: Array, change: Array) -> bool:
        """Whether a change takes back more than half of the one before, both scaled."""
        one, other = before * self.scale, change * self.scale
        return bool(one @ other < -0.5 * (one @ one))


def _square(matrix: Array) -> float:
    """Sum of the squared elements, not below the square of the largest eigenvalue."""
    return float(np.vdot(matrix, matrix))
