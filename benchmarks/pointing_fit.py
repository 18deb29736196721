"""Fitting a pointing model, beside katpoint's fit of the same run."""

import math
import time
import tracemalloc
import warnings

import numpy as np
from numpy.typing import NDArray

from benchmarks.benchmark import benchmark
from pointing.model.fit import fit
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun

TERMS = "IA IE CA NPAE AN AW TF"
KATPOINT = (1, 7, 4, 3, 5, 6, 8)  # its parameters of the same meaning, in this order
SIGNS = (-1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0)  # of its formulas against those of the terms

_TRUE = {"IA": -140.0, "IE": -115.0, "CA": 85.0, "NPAE": -30.0, "AN": -60.0, "AW": 75.0, "TF": 45.0}
_STARS, _LEAST_TURNS = 300_000, 7  # fitted in all; turns of long runs
_NOISE = math.radians(2.0 / 3600.0)


def run_of(n: int) -> PointingRun:
    """Return an altazimuth run of n stars, 15° to 85° high, with 2″ of noise in each component."""
    rng = np.random.default_rng(n)
    azimuth = rng.uniform(0.0, math.tau, n)
    elevation = np.arcsin(rng.uniform(math.sin(math.radians(15.0)), math.sin(math.radians(85.0)), n))
    star1, star2 = PointingModel.of("altazimuth", 40.0, **_TRUE).star(azimuth, elevation)
    along, up = rng.normal(0.0, _NOISE, (2, n))
    return PointingRun(
        "altazimuth", math.radians(40.0), star1 + along / np.cos(star2), star2 + up, azimuth, elevation
    )


def katpoint_fit(run: PointingRun) -> NDArray[np.float64]:
    """Fit the same run with katpoint; return the terms' coefficients in the order of `TERMS`, arcseconds."""
    from katpoint import PointingModel as Katpoint  # noqa: PLC0415 - an optional peer

    offsets = run.offsets()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # about its own future way with parameters that are not fitted
        found, _ = Katpoint().fit(run.axis1, run.axis2, *offsets, enabled_params=KATPOINT)
    return np.degrees([sign * found[number - 1] for sign, number in zip(SIGNS, KATPOINT, strict=True)]) * 3600.0


def seconds(n: int) -> tuple[float, float]:
    """Return the seconds of our fit and of katpoint's, of n stars: the least of single calls in turns.

    What disturbs a measurement only ever adds to it, and in turns it disturbs both alike.
    """
    run, best = run_of(n), [math.inf, math.inf]
    for _ in range(max(_LEAST_TURNS, _STARS // n)):
        for i, call in enumerate((lambda: fit(run, TERMS), lambda: katpoint_fit(run))):
            started = time.perf_counter()
            call()
            best[i] = min(best[i], time.perf_counter() - started)
    return best[0], best[1]


def peak_mb(n: int) -> float:
    """Return the most memory that a fit of n stars takes beyond its input, megabytes."""
    run = run_of(n)
    fit(run, TERMS)  # what is made once and kept
    tracemalloc.start()
    try:
        fit(run, TERMS)
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def _beside_katpoint(n: int) -> tuple[float, str]:
    ours, theirs = seconds(n)
    return 1e3 * ours, f"katpoint's linear fit {1e3 * theirs:.3g} ms"


@benchmark("rigorous fit of 7 terms to 100 stars", unit="ms")
def fit_100_stars() -> tuple[float, str]:
    """Fit a short run."""
    return _beside_katpoint(100)


@benchmark("rigorous fit of 7 terms to 1000 stars", unit="ms")
def fit_1000_stars() -> tuple[float, str]:
    """Fit a long run."""
    return _beside_katpoint(1000)


@benchmark("rigorous fit of 7 terms to 100 000 stars", unit="ms", at_most=250.0)
def fit_100000_stars() -> tuple[float, str]:
    """Fit a very long run."""
    return _beside_katpoint(100_000)


@benchmark("rigorous fit of 7 terms to 100 000 stars, in units of katpoint's linear one", unit="", at_most=1.0)
def fit_against_katpoint() -> float:
    """Fit a very long run with both."""
    ours, theirs = seconds(100_000)
    return ours / theirs


@benchmark("rigorous fit of 7 terms to 1000 stars, in units of katpoint's linear one", unit="", at_most=1.0)
def short_fit_against_katpoint() -> float:
    """Fit a run of a thousand stars with both."""
    ours, theirs = seconds(1000)
    return ours / theirs


@benchmark("memory of a fit of 7 terms to 100 000 stars, beyond its input", unit="MB", at_most=8.0)
def memory_of_a_fit() -> float:
    """Fit a very long run under tracemalloc."""
    return peak_mb(100_000)
