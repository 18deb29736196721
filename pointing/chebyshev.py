"""Paths in space as polynomials: a record holds one for each of x, y and z over a stretch of time.

Chebyshev series, in which ephemerides are published, become powers of u ∈ [−1, 1] once; Horner's rule then gives
value and derivative together. Up to degree 15, with coefficients that fall as an ephemeris's do, powers lose no digit
that matters.
"""

from functools import cache

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly, chebvander

from pointing.vectors import Vector

Record = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]  # x, y, z; the highest power first
State = tuple[Vector, Vector]  # a place, and its derivative per second


def record_of_series(coefficients: np.ndarray) -> Record:
    """Powers of three Chebyshev series, shape (3, n), the constant first."""
    return _record(coefficients @ _to_powers(coefficients.shape[1]))


def record_of_values(values: np.ndarray) -> Record:
    """Powers of the polynomials through values at `nodes(n)`, shape (n, 3)."""
    count = len(values)
    series = np.linalg.solve(chebvander(nodes(count), count - 1), values)
    return record_of_series(series.T)


def nodes(count: int) -> np.ndarray:
    """The zeros of the Chebyshev polynomial of degree `count`, where a polynomial through values errs least."""
    return np.cos(np.pi * (np.arange(count) + 0.5) / count)


def state_of(record: Record, u: float, u_per_s: float) -> State:
    """Place and derivative per second at u, which grows by `u_per_s`."""
    (x, dx), (y, dy), (z, dz) = _horner(record[0], u), _horner(record[1], u), _horner(record[2], u)
    return (x, y, z), (dx * u_per_s, dy * u_per_s, dz * u_per_s)


def _horner(powers: tuple[float, ...], u: float) -> tuple[float, float]:
    value = rate = 0.0
    for power in powers:
        rate = rate * u + value
        value = value * u + power
    return value, rate


def _record(powers: np.ndarray) -> Record:
    x, y, z = (tuple(row[::-1]) for row in powers.tolist())
    return x, y, z


@cache
def _to_powers(count: int) -> np.ndarray:
    """Row k: the powers of the Chebyshev polynomial of degree k."""
    matrix = np.zeros((count, count))
    for k, unit in enumerate(np.eye(count)):
        powers = cheb2poly(unit)
        matrix[k, : len(powers)] = powers
    return matrix
