"""The same formulas for one place and for arrays of places: elementary functions from `math` or from NumPy."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

T = TypeVar("T")
Real = Any  # float or numpy.ndarray of float64: every formula of this package takes both


@dataclass(frozen=True)
class Functions:
    """What the formulas need."""

    sin: Callable[[Real], Real]
    cos: Callable[[Real], Real]
    atan2: Callable[[Real, Real], Real]
    hypot: Callable[[Real, Real], Real]
    root: Callable[[Real], Real]  # nan of a negative number
    copysign: Callable[[Real, Real], Real]
    at_least: Callable[[Real, float], Real]
    between: Callable[[Real, Real, Real], Real]  # low, value, high: the value, held within
    ratio: Callable[[Real, Real], Real]  # 0 where the divisor is 0
    nearest: Callable[[Real, Real], Real]  # angle, middle: the angle in the turn about the middle
    only: Callable[[Real, Real], Real]  # condition, value: nan where the condition does not hold


def _root(value: float) -> float:
    return math.sqrt(value) if value >= 0.0 else math.nan


def _roots(values: Real) -> Real:
    return np.sqrt(np.where(values >= 0.0, values, np.nan))


def _between(low: float, value: float, high: float) -> float:
    return value if math.isnan(value) else min(max(value, low), high)


def _all_between(low: Real, values: Real, high: Real) -> Real:
    return np.clip(values, low, high)


def _ratio(one: float, other: float) -> float:
    return one / other if other else 0.0


def _ratios(ones: Real, others: Real) -> Real:
    there = others != 0.0
    return np.where(there, ones / np.where(there, others, 1.0), 0.0)


def _nearest(angle: float, middle: float) -> float:
    return angle if abs(angle - middle) <= math.pi else middle + math.remainder(angle - middle, math.tau)


def _all_nearest(angles: Real, middle: Real) -> Real:
    return angles - math.tau * np.rint((angles - middle) / math.tau)


def _only(condition: bool, value: float) -> float:
    return value if condition else math.nan


def _all_only(condition: Real, values: Real) -> Real:
    return np.where(condition, values, np.nan)


SCALAR = Functions(
    math.sin, math.cos, math.atan2, math.hypot, _root, math.copysign, max, _between, _ratio, _nearest, _only
)
ARRAY = Functions(
    np.sin,
    np.cos,
    np.arctan2,
    np.hypot,
    _roots,
    np.copysign,
    np.maximum,
    _all_between,
    _ratios,
    _all_nearest,
    _all_only,
)


def functions_of(value: Real) -> Functions:
    """Return the functions that take this value."""
    return ARRAY if isinstance(value, np.ndarray) else SCALAR


def dot(a: Real, p: Real, b: Real, q: Real) -> Real:
    """Return a p + b q; of arrays, products with the numbers 0 and 1 are not computed."""
    if type(p) is float and type(a) is float and type(q) is float and type(b) is float:
        return a * p + b * q
    one, other = product(a, p), product(b, q)
    if type(one) is float and not one:
        return other
    return one if type(other) is float and not other else one + other


def product(a: Real, p: Real) -> Real:
    """Return a p; of arrays, products with the numbers 0 and 1 are not computed."""
    if type(a) is float:
        if not a:
            return 0.0
        if a == 1.0:
            return p
    if type(p) is float:
        if not p:
            return 0.0
        if p == 1.0:
            return a
    return a * p


def ratio(a: Real, p: Real) -> Real:
    """Return a / p; with the number 0 nothing is computed."""
    return 0.0 if type(a) is float and not a else a / p


class once(Generic[T]):  # noqa: N801 - a decorator
    """A property computed when it is first asked for; `functools.cached_property` takes a lock in Python 3.11."""

    def __init__(self, function: Callable[[Any], T]) -> None:
        self._function = function
        self._name = function.__name__
        self.__doc__ = function.__doc__

    def __get__(self, instance: object, owner: type | None = None) -> T:
        value = instance.__dict__[self._name] = self._function(instance)
        return value
