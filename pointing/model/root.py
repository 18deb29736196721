"""Solve one equation in one unknown at each of many places: by secants, and by a search where these lose the way.

The equation is in the form of a fixed point, x = g(x), and its residual g(x) − x. What pointing models ask for has a
small, smooth g nearly everywhere, and two to four secants do. Close to a pole, where one second of arc turns the
hour angle by degrees, g is steep, of several solutions or of none: there an interval is searched for a change of
sign, ever closer about its best point; what has a residual is one piece of the interval.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pointing.model.functions import Real, functions_of
from pointing.model.place import Place

Array = NDArray[np.float64]
Residual = Callable[[Place, Real, Real], Real]

TOLERANCE = 1e-13  # rad, 2e-8″: residual of what counts as a solution
_SETTLED = 1e-15  # rad; residual at which secants stop
_SECANTS = 12
_POINTS = 97  # of a search
_CLOSER = 3  # searches, each within two steps of the one before
_HALVINGS = 100
_DENSE_AT_THE_ENDS = np.cos(np.linspace(0.0, math.pi, _POINTS))  # where the way back leads onto a pole


def solve(residual: Residual, place: Place, parameter: Real, start: Real, bounds: tuple[Real, Real]) -> Real:
    """Return x with residual(place, x, parameter) = 0, within bounds; nan where there is none.

    Parameters
    ----------
    residual : callable
        (place, x, parameter) → g(x) − x, nan where x has no meaning; for one place and for arrays.
    place : Place
        One place or arrays.
    parameter : float or array
        Of the equation.
    start : float or array
        Near which x is expected; of several solutions the search takes the nearest.
    bounds : pair of float or array
        Between which x is searched for.
    """
    x, left = _secants(residual, place, parameter, start, bounds)
    if isinstance(x, float):
        return x if abs(left) <= TOLERANCE else _search(residual, place, parameter, start, bounds)
    lost = np.flatnonzero(~(np.abs(left) <= TOLERANCE))
    if lost.size:
        each = np.broadcast_arrays(place.lon, place.lat, parameter, start, *bounds, x)
        lon, lat, parameter, start, low, high, x = (np.array(values, float).ravel() for values in each)
        for i in lost:
            one = Place(place.frame, float(lon[i]), float(lat[i]))
            x[i] = _search(residual, one, float(parameter[i]), float(start[i]), (float(low[i]), float(high[i])))
        x = x.reshape(each[0].shape)
    return x


def _secants(
    residual: Residual, place: Place, parameter: Real, start: Real, bounds: tuple[Real, Real]
) -> tuple[Real, Real]:
    """The last point of an iteration by secants, and the residual there."""
    f = functions_of(place.lat)
    low, high = bounds
    x, left = start, residual(place, start, parameter)
    step = left
    for _ in range(_SECANTS):
        new = f.between(low, x + step, high)
        left_there = residual(place, new, parameter)
        step = f.ratio(left_there * (new - x), left - left_there)
        x, left = new, left_there
        if not np.any(abs(left) > _SETTLED):  # nan is not above: the search takes it up
            break
    return x, left


def _search(residual: Residual, place: Place, parameter: float, start: float, bounds: tuple[float, float]) -> float:
    """The solution nearest to the start, at one place; nan if none is found."""

    def at(x: float) -> float:
        return float(residual(place, x, parameter))

    def sampled(points: Array) -> Array:
        many = Place(place.frame, np.full(points.shape, place.lon), np.full(points.shape, place.lat))
        return np.asarray(residual(many, points, np.full(points.shape, parameter)))

    points = np.linspace(*bounds, _POINTS)
    there = points[np.isfinite(sampled(points))]
    if not there.size:
        return math.nan
    low, high = (_edge(at, float(inside), bound) for inside, bound in zip((there[0], there[-1]), bounds, strict=True))
    for _ in range(_CLOSER):
        points = 0.5 * (low + high) - 0.5 * (high - low) * _DENSE_AT_THE_ENDS
        left = sampled(points)
        changes = np.flatnonzero(left[:-1] * left[1:] <= 0.0)  # nan is no change
        for i in sorted(changes, key=lambda i: abs(points[i] - start)):
            x = _halved(at, float(points[i]), float(points[i + 1]))
            if abs(at(x)) <= TOLERANCE:  # a jump through zero is no solution
                return x
        best = int(np.argmin(np.where(np.isfinite(left), np.abs(left), np.inf)))
        low, high = float(points[max(best - 2, 0)]), float(points[min(best + 2, _POINTS - 1)])
    return math.nan


def _edge(at: Callable[[float], float], inside: float, outside: float) -> float:
    """The last point towards `outside` at which there is a residual."""
    if math.isfinite(at(outside)):
        return outside
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        if middle in {inside, outside}:
            break
        inside, outside = (middle, outside) if math.isfinite(at(middle)) else (inside, middle)
    return inside


def _halved(residual: Callable[[float], float], low: float, high: float) -> float:
    """Halve an interval down to a change of sign."""
    at_low = residual(low)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if middle in {low, high}:
            break
        at_middle = residual(middle)
        if at_middle == 0.0:
            return middle
        if (at_middle > 0.0) == (at_low > 0.0):
            low, at_low = middle, at_middle
        else:
            high = middle
    return min((low, high), key=lambda x: abs(residual(x)))
