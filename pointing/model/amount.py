"""How much of a term there is at a place: a product of sines, cosines, tangents and powers of the place's angles."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, reduce

import numpy as np

from pointing.model.functions import Real, dot, product
from pointing.model.place import OWN_TURNS, Angle, Place

_HORIZON = math.cos(math.radians(89.0))  # least cosine of a tangent
_EVERY_7_5 = [np.linspace(low, high, 1 + round((high - low) / math.radians(7.5))) for low, high in OWN_TURNS]
_STEP = 1e-5  # rad, of the central differences by which a user's function is differentiated: error 1e-10 of it


@dataclass(frozen=True)
class Factor:
    """One factor: a function of a multiple of one angle, or the angle's power.

    Parameters
    ----------
    function : {"S", "C", "T", "P"}
        Sine, cosine, tangent; P is the power. The tangent is sin/cos with a cosine not below that of 89°: beyond it,
        and below a horizon, it is 57.3 times the sine.
    letter : str
        The angle: H, D, A, E, Z or Q.
    number : int
        The multiple of the angle, or the power.
    """

    function: str
    letter: str
    number: int = 1

    @property
    def text(self) -> str:
        """As it stands in a formula."""
        times = "" if self.number == 1 else str(self.number)
        if self.function == "P":
            return f"{self.letter}{times and '^'}{times}"
        return f"{_WORDS[self.function]} {times}{self.letter}"

    @property
    def largest(self) -> float:
        """Of its absolute values, angles as `Place.angle` gives them: none is more than a turn."""
        return {"P": math.tau**self.number, "T": 1.0 / _HORIZON}.get(self.function, 1.0)

    def __call__(self, place: Place) -> Angle:
        """Value and gradient (∂/∂lon, ∂/∂lat) at a place."""
        angle, by_lon, by_lat = place.angle(self.letter)
        f, n = place.functions, self.number
        if self.function == "P":
            value, slope = angle**n, n * angle ** (n - 1)
        elif self.function == "S":
            value, slope = f.sin(n * angle), n * f.cos(n * angle)
        elif self.function == "C":
            value, slope = f.cos(n * angle), -n * f.sin(n * angle)
        else:
            sine, cosine = f.sin(n * angle), f.cos(n * angle)
            held = f.at_least(cosine, _HORIZON)
            value = sine / held
            slope = n * (cosine / held + value * value * (cosine > _HORIZON))
        return value, product(slope, by_lon), product(slope, by_lat)


_WORDS = {"S": "sin", "C": "cos", "T": "tan"}


@dataclass(frozen=True)
class OwnFunction:
    """A user's function of `Place.own`, the mechanical coordinates in one turn, for floats and arrays alike."""

    function: Callable[[Real, Real], Real]
    text: str = "a function of the user's"

    @cached_property
    def largest(self) -> float:
        """Of its absolute values, half as much again as there is at places 7.5° apart."""
        lon, lat = np.meshgrid(*_EVERY_7_5)
        return 1.5 * float(np.nanmax(np.abs(self.function(lon, lat))))

    def __call__(self, place: Place) -> Angle:
        """Value and gradient at a place, the gradient by central differences."""
        (lon, lat), h = place.own, _STEP
        by_lon = (self.function(lon + h, lat) - self.function(lon - h, lat)) / (2.0 * h)
        by_lat = (self.function(lon, lat + h) - self.function(lon, lat - h)) / (2.0 * h)
        return self.function(lon, lat), by_lon, by_lat


@dataclass(frozen=True)
class Beyond:
    """One beyond the pole, else nothing: what differs between the sides of a pier."""

    text: str = "beyond the pole"
    largest: float = 1.0

    def __call__(self, place: Place) -> Angle:
        """Value and gradient at a place."""
        return place.beyond, 0.0, 0.0


Factors = tuple[Factor | OwnFunction | Beyond, ...]


def amount(factors: Factors, place: Place) -> Angle:
    """Product of the factors, with its gradient."""
    first = factors[0](place)
    return first if len(factors) == 1 else reduce(_times, (factor(place) for factor in factors[1:]), first)


def largest(factors: Factors) -> float:
    """Bound of the product's absolute values."""
    return math.prod(factor.largest for factor in factors)


def _times(one: Angle, other: Angle) -> Angle:
    (value, *slopes), (factor, *others) = one, other
    by_lon, by_lat = (dot(a, factor, value, b) for a, b in zip(slopes, others, strict=True))
    return value * factor, by_lon, by_lat
