"""What a Gauss-Newton round leaves: how far the next one would still go.

Let a whole step x lead from coefficients with derivatives M and residuals r to others with M′ and r′. The next step
is N⁻¹ M′ᵀ W r′ with N = M′ᵀ W M′. As Mᵀ W (r − M x) = 0, its part N⁻¹ Mᵀ W r′ comes of what r′ is beyond r − M x, and
grows with x²; the other, N⁻¹ (M′ − M)ᵀ W r′, comes of residuals that no model removes, and grows with x.

Lengths are √(xᵀ N x), what a change moves on the sky: in them the linear part is a symmetric matrix times x, whatever
the units of the coefficients and however badly some are seen.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pointing.model.normal_equations import NormalEquations

Array = NDArray[np.float64]

_SURE = 300.0  # times what one direction shows: others are worse; 30 was too little for 2 runs of 216, 100 for none


class Contraction(NamedTuple):
    """By how much a round brings coefficients nearer to where they settle.

    Parameters
    ----------
    linear : float
        What is left of a small change, against it.
    quadratic : float
        What is left besides, against the square of the change.
    """

    linear: float = 1.0
    quadratic: float = 0.0

    def bent(self, length: float, second: float) -> "Contraction":
        """Return it where a step of one length was followed by a second one of another, with the same derivatives."""
        return self._replace(quadratic=_SURE * second / length**2)

    def turned(self, equations: NormalEquations, projected: Array, step: Array) -> "Contraction":
        """Return it with the linear part that two rounds show.

        Parameters
        ----------
        equations : NormalEquations
            After a step.
        projected : (k,) array
            Mᵀ W r′: the residuals after the step on the derivatives before it.
        step : (k,) array
            Change of the coefficients, radians.
        """
        length = equations.length(step)
        if not length:
            return self
        return self._replace(
            linear=_SURE * equations.length(equations.inverse @ (equations.right - projected)) / length
        )

    def at_most(self, length: float, previous: float) -> "Contraction":
        """Return it where a change of one length was seen after one of another."""
        return self if self.left(previous) <= length else Contraction(length / previous)

    def left(self, length: float) -> float:
        """Length of the change that the next round would make after one of this length."""
        return self.linear * length + self.quadratic * length**2
