"""One term's motion with its exact derivatives on the sky: for floats and arrays.

What is the number 0 or 1 whatever the place stays a float, and costs nothing with arrays.
"""

from collections.abc import Sequence
from typing import NamedTuple

from pointing.model.functions import Real, dot, product, ratio
from pointing.model.place import Place
from pointing.model.terms import Term

Pair = tuple[Real, Real]
Along = tuple[Real, Real, Real, Real]

NOWHERE: Along = (1.0, 0.0, 0.0, 1.0)


class Passed(NamedTuple):
    """What a step did to a place.

    Parameters
    ----------
    place : Place
        After it.
    columns : sequence
        (position in the model, derivative of the place on the sky by the coefficient) of each of its terms.
    along : tuple
        ∂(cos lat · lon, lat) after by (cos lat · lon, lat) before, row by row: four values.
    """

    place: Place
    columns: Sequence[tuple[int, Pair]]
    along: Along


class TermStep:
    """The motion of one term.

    Parameters
    ----------
    position : int
        In the model.
    term : Term
        The term.
    coefficient : float
        Radians.
    """

    def __init__(self, position: int, term: Term, coefficient: float) -> None:
        self._position, self._term, self._coefficient = position, term, coefficient

    def star(self, place: Place) -> Place:
        """Return the place after the term."""
        return self._term.forward(place, self._coefficient) if self._coefficient else place

    def passed(self, place: Place) -> Passed:
        """As `star`, with the derivatives."""
        each, coefficient = self._term, self._coefficient
        unit, by_lon, by_lat = each.amount(place)
        step = each.moves.forward(place, coefficient * unit)
        after = step.to if coefficient else place
        by_amount = product(after.cos_lat, step.lon_amount), step.lat_amount
        columns = ((self._position, (product(by_amount[0], unit), product(by_amount[1], unit))),)
        if not coefficient:
            return Passed(after, columns, NOWHERE)
        by_lon, by_lat = product(coefficient, by_lon), product(coefficient, by_lat)
        cosine = after.cos_lat / place.cos_lat
        lat_lon = dot(step.lat_amount, by_lon, step.lat_lon, 1.0)
        along = (
            product(cosine, dot(step.lon_amount, by_lon, step.lon_lon, 1.0)),
            product(after.cos_lat, dot(step.lon_amount, by_lat, step.lon_lat, 1.0)),
            ratio(lat_lon, place.cos_lat),
            dot(step.lat_amount, by_lat, step.lat_lat, 1.0),
        )
        return Passed(after, columns, along)
