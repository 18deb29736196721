"""Cubic splines through points, continuous with two derivatives; numpy alone, for one tridiagonal system.

End conditions are not-a-knot: the first two and the last two pieces are each one cubic, so that a spline through
points of a cubic is that cubic, and the error is of the fourth order up to the ends (de Boor, A Practical Guide to
Splines, 1978, chapter IV).
"""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

LEAST_POINTS = 4


class Spline:
    """A vector that changes with time, known at moments.

    Parameters
    ----------
    times : sequence of n floats
        Strictly increasing, n ≥ 4.
    values : array of shape (n, k)
        The vector at these times.
    """

    def __init__(self, times: Sequence[float], values: NDArray[np.float64]) -> None:
        self._times = list(times)
        slopes = _slopes(np.asarray(times, float), values)
        steps = np.diff(times)[:, None]
        chords = np.diff(values, axis=0) / steps
        self._pieces: list[tuple[tuple[float, float, float, float], ...]] = [
            tuple(zip(*piece, strict=True))
            for piece in zip(
                values[:-1].tolist(),
                slopes[:-1].tolist(),
                ((3.0 * chords - 2.0 * slopes[:-1] - slopes[1:]) / steps).tolist(),
                ((slopes[:-1] + slopes[1:] - 2.0 * chords) / steps**2).tolist(),
                strict=True,
            )
        ]

    def at(self, time: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the vector at a time and its derivative; beyond the ends the last pieces go on."""
        i = min(max(bisect_right(self._times, time) - 1, 0), len(self._pieces) - 1)
        t = time - self._times[i]
        piece = self._pieces[i]
        return (
            tuple([((d * t + c) * t + b) * t + a for a, b, c, d in piece]),
            tuple([(3.0 * d * t + 2.0 * c) * t + b for _, b, c, d in piece]),
        )


def _slopes(times: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """First derivatives at the points, which make the second ones continuous."""
    n, h = len(times), np.diff(times)
    chords = np.diff(values, axis=0) / h[:, None]
    below, middle, above = np.zeros(n), np.zeros(n), np.zeros(n)
    right = np.zeros_like(values)
    below[1:-1], middle[1:-1], above[1:-1] = h[1:], 2.0 * (h[:-1] + h[1:]), h[:-1]
    right[1:-1] = 3.0 * (h[1:, None] * chords[:-1] + h[:-1, None] * chords[1:])
    # Not-a-knot, with the row beside it made use of so that the system stays tridiagonal.
    for end, near, step, next_step, chord, next_chord in (
        (0, above, h[0], h[1], chords[0], chords[1]),
        (n - 1, below, h[-1], h[-2], chords[-1], chords[-2]),
    ):
        both = step + next_step
        middle[end], near[end] = next_step, both
        right[end] = ((step + 2.0 * both) * next_step * chord + step * step * next_chord) / both
    for i in range(1, n):  # Thomas's elimination
        factor = below[i] / middle[i - 1]
        middle[i] -= factor * above[i - 1]
        right[i] -= factor * right[i - 1]
    right[-1] /= middle[-1]
    for i in range(n - 2, -1, -1):
        right[i] = (right[i] - above[i] * right[i + 1]) / middle[i]
    return right
