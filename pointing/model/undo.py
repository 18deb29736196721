"""Undo one term: where the telescope was before it, from where it is after it.

With the amount γ known every motion has a closed inverse. The amount of a term that changes over the sky is the one
that the term has at the place to which it leads back: one equation in the one unknown γ, whatever the motion is.
"""

import math

from pointing.model.amount import largest
from pointing.model.functions import Real
from pointing.model.place import Frame, Place
from pointing.model.root import solve
from pointing.model.terms import Term


def undone(frame: Frame, term: Term, coefficient: float, lon: Real, lat: Real) -> tuple[Real, Real]:
    """Return the coordinates before a term; nan where no place leads to the one after it.

    Where several places do, as within the coefficient's reach of a pole, it is one of them: the nearest mostly.
    """
    after, back = Place(frame, lon, lat), term.moves.back
    if not term.factors:
        return back(after, coefficient * term.amount(after)[0])

    def short(place: Place, gamma: Real, size: Real) -> Real:
        """What the amount at the place before has more than the amount it was found with."""
        return size * term.amount(Place(frame, *back(place, gamma)))[0] - gamma

    reach = min(abs(coefficient) * largest(term.factors), math.pi / 2.0)
    start = after.functions.between(-reach, coefficient * term.amount(after)[0], reach)
    return back(after, solve(short, after, coefficient, start, (-reach, reach)))
