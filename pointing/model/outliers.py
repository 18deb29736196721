"""Observations that do not belong to a run: a robust start, then an explicit test of each.

An observation is tested against the model fitted without it. With its residual r, leverage H (2×2) and the variance
s² of the others, t² = rᵀ(I − H)⁻¹r / s² of a good one follows 2·F(2, ν), ν = 2(n − 1) − k, whose tail is closed:
(1 + t²/ν)^(−ν/2). What is rarer than `_FALSE_ALARM` shared over all observations is masked. After Cook & Weisberg
1982, *Residuals and Influence in Regression*, ch. 2, for residuals of two components.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pointing.model.functions import Real
from pointing.model.run import PointingRun

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

Array = NDArray[np.float64]

_FALSE_ALARM = 0.05  # chance that any observation of a good run is masked
_HUBER = 2.0  # σ of one component beyond which an observation counts less
_MEDIAN = math.sqrt(2.0 * math.log(2.0))  # σ; median length of a residual of two normal components
_ROUNDS = 30


@dataclass(frozen=True)
class Outlier:
    """One observation that was masked.

    Parameters
    ----------
    index : int
        In the run, from 0.
    line : int
        Of its file; 0 where it has none.
    distance_arcsec : float
        From the place that the others predict.
    sigmas : float
        The same in units of its standard deviation.
    probability : float
        That a good observation lies so far off.
    """

    index: int
    line: int
    distance_arcsec: float
    sigmas: float
    probability: float

    @property
    def reason(self) -> str:
        """Why it was masked."""
        where = f" (line {self.line})" if self.line else ""
        return (
            f"observation {self.index}{where}: {self.distance_arcsec:.1f}″ from where the others predict it, "
            f"{self.sigmas:.1f}σ; chance {self.probability:.1e}"
        )


def rejection_level(n: float) -> float:
    """Chance below which one of n observations does not belong."""
    return _FALSE_ALARM / max(n, 1.0)


def chance_so_far_off(t2: Real, freedom: Real) -> Real:
    """Chance that a good observation has a larger t²: the tail of 2·F(2, ν), ν = `freedom`."""
    return (1.0 + t2 / freedom) ** (-freedom / 2.0)


def huber_weights(residual: Array, weight: Array, k: int) -> Array:
    """Weights (n,) after Huber: 1 near, falling with the distance beyond `_HUBER` robust σ.

    Parameters
    ----------
    residual : (2, n) array
        Radians.
    weight : (n,) array
        What the observations weigh; none at 0.
    k : int
        Fitted terms.
    """
    distance = np.hypot(*residual) * np.sqrt(weight)
    used = distance[weight > 0.0]
    freedom = max(2.0 * used.size - k, 1.0) / (2.0 * used.size)
    near = _HUBER * float(np.median(used)) / (_MEDIAN * math.sqrt(freedom))
    return np.asarray(near / np.maximum(distance, near)) if near > 0.0 else np.ones_like(distance)


def find_outliers(
    run: PointingRun, fitted: Callable[[PointingRun, bool], "Fit"], good: NDArray[np.bool_] | None = None
) -> tuple[PointingRun, tuple[Outlier, ...]]:
    """Mask the observations that do not belong.

    Parameters
    ----------
    run : PointingRun
        The run.
    fitted : callable
        (run, robust) → fit of it.
    good : (n,) array, optional
        What belongs by an earlier test; absent, a robust fit of all begins.

    Returns
    -------
    tuple
        The run with them masked, and the outliers.
    """
    offered = run.kept & (run.weight > 0.0)
    level = rejection_level(int(np.count_nonzero(offered)))
    if good is None:
        current = fitted(run, True)  # noqa: FBT003 - robust
        good = offered & ~(_rough(current, offered) < level)
    else:
        current = fitted(replace(run, kept=good), False)  # noqa: FBT003 - plain
    seen: set[bytes] = set()
    for _ in range(_ROUNDS):
        if 2 * int(np.count_nonzero(good)) <= current.k + 1:
            break
        current = fitted(replace(run, kept=good), False)  # noqa: FBT003 - plain
        t2, probability = _tested(current, good)
        new = offered & ~(probability < level)
        if np.array_equal(new, good) or new.tobytes() in seen:
            break
        seen.add(new.tobytes())
        good = new
    return replace(run, kept=good), _outliers(current, offered & ~good, t2, probability)


def far_off(fit: "Fit") -> tuple[Outlier, ...]:
    """Observations of a fit that the test would mask, in one round without a fit anew; the farthest first.

    Where many do not belong they hide each other, and `find_outliers` tells more.
    """
    used = fit.weight > 0.0
    n = int(np.count_nonzero(used))
    if 2 * (n - 1) <= fit.k + 1 or not np.array_equal(fit.weight[used], fit.run.weight[used]):
        return ()  # too few to judge one by the others, or weighed down already
    t2, probability = _tested(fit, used)
    found = _outliers(fit, used & (probability < rejection_level(n)), t2, probability)
    return tuple(sorted(found, key=lambda each: -each.sigmas))


def _outliers(fit: "Fit", which: NDArray[np.bool_], t2: Array, probability: Array) -> tuple[Outlier, ...]:
    distance = np.degrees(np.hypot(*fit.residuals)) * 3600.0
    return tuple(
        Outlier(int(i), int(fit.run.line[i]), float(distance[i]), math.sqrt(t2[i]), float(probability[i]))
        for i in np.flatnonzero(which)
    )


def _rough(fit: "Fit", offered: NDArray[np.bool_]) -> Array:
    """Chance of each observation by its distance from a robust fit alone."""
    distance = np.hypot(*fit.residuals) * np.sqrt(fit.run.weight)
    used = distance[offered]
    freedom = max(2.0 * used.size - fit.k, 1.0) / (2.0 * used.size)
    s = float(np.median(used)) / (_MEDIAN * math.sqrt(freedom))
    nu = max(2 * (used.size - 1) - fit.k, 1)
    return np.asarray(chance_so_far_off((distance / max(s, 1e-15)) ** 2, nu))


def _tested(fit: "Fit", good: NDArray[np.bool_]) -> tuple[Array, Array]:
    """t² of each observation against the model of all other good ones, and its chance."""
    weight = fit.run.weight
    leverage = fit.place_cofactor * weight
    sign = np.where(good, -1.0, 1.0)  # one that was fitted is drawn to; one that was not is predicted
    a, b, d = 1.0 + sign * leverage[0], sign * leverage[1], 1.0 + sign * leverage[2]
    x, y = fit.residuals
    square = weight * (d * x * x - 2.0 * b * x * y + a * y * y) / np.maximum(a * d - b * b, 1e-12)
    n = int(np.count_nonzero(good))
    freedom = np.where(good, 2.0 * (n - 1) - fit.k, 2.0 * n - fit.k)
    rest = fit.square - np.where(good, square, 0.0)
    variance = np.maximum(rest, 1e-30) / np.maximum(freedom, 1.0)
    t2 = square / variance
    return t2, np.asarray(chance_so_far_off(t2, np.maximum(freedom, 1.0)))


def sigmas_off(fit: "Fit") -> Array:
    """How far each observation is from where the others predict it, in units of its standard deviation: (n,)."""
    return np.sqrt(_tested(fit, fit.weight > 0.0)[0])
