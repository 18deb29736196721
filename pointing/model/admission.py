"""Which terms a run can carry: limits of condition, of correlation with the geometric terms, and of stars a term.

What goes beyond them may lower BIC and predict patches left out well, and yet make coefficients meaningless: two
terms that nearly cancel run away together, and with an index error or a tilt among them the advice of what to turn is
wrong.
"""

from collections.abc import Sequence

import numpy as np

from pointing.model.candidates import geometric
from pointing.model.normal_equations import NormalEquations
from pointing.model.terms import Term

# The seven usual terms of real runs have 4 to 62 and must be allowed; where coefficients ran away it was 1202.
CONDITION = 100.0
CORRELATION = 0.99  # √(1 − r²) = 0.14: the geometric term's σ is seven times what it is alone
NUMBERS_A_TERM = 5  # of the two that each star gives; BIC is an expansion for many


def refusal(model: Sequence[Term], equations: NormalEquations, n: int) -> str | None:
    """Return why these terms go beyond what n stars carry, or None.

    Parameters
    ----------
    model : sequence of Term
        All terms, the new ones in it.
    equations : NormalEquations
        Theirs.
    n : int
        Stars.
    """
    base = np.array([geometric(each) for each in model], bool)
    if not base.all() and 2 * n < NUMBERS_A_TERM * len(model):
        return (
            f"{n} stars give {2 * n} numbers and carry {2 * n // NUMBERS_A_TERM} terms, {NUMBERS_A_TERM} numbers "
            "each: observe more stars"
        )
    if equations.condition > CONDITION:
        return f"the condition would be {equations.condition:.0f}, above {CONDITION:.0f}: terms would share an effect"
    sigma = np.sqrt(np.diag(equations.inverse))
    shared = np.abs(equations.inverse / np.outer(sigma, sigma)) * np.outer(base, ~base)
    i, j = (int(each) for each in np.unravel_index(np.argmax(shared), shared.shape))
    if shared[i, j] > CORRELATION:
        return (
            f"{model[i].name} and {model[j].name} would be correlated by {shared[i, j]:.4f}, above {CORRELATION}: "
            f"{model[i].name} is geometry and stays as it is"
        )
    return None
