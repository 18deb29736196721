"""A small model fitted to first order, for questions about the data: its answers are no pointing model.

Zero points, collimation, non-perpendicularity, axis tilt and tube flexure are what any telescope has. What they
cannot explain, something else did. Partials in mechanical angles, so that both postures are fitted together.
"""

import math
from dataclasses import dataclass

import numpy as np

from pointing.model.run import Array, PointingRun

SMALL_MODEL = 7  # columns of `design`


@dataclass(frozen=True)
class FirstOrderFit:
    """What a linear fit found.

    Attributes
    ----------
    coefficients, sigmas : (k,) array
        Radians where a column is an angle; the extra columns come last.
    across, along : (n,) array
        Residuals on the sky along axis 1 and axis 2, radians.
    rms : float
        Residual on the sky, radians: the root of the mean over observations.
    """

    coefficients: Array
    sigmas: Array
    across: Array
    along: Array
    rms: float


def design(run: PointingRun) -> Array:
    """Partials on the sky, (2n, 7): IH ID CH NP MA ME TF, or IA IE CA NPAE AN AW TF with other signs of their own."""
    first, second = run.mechanical_star()
    s1, c1, s2, c2 = np.sin(first), np.cos(first), np.sin(second), np.cos(second)
    one, nought = np.ones(len(run)), np.zeros(len(run))
    if run.mount == "equatorial":
        sine, cosine = math.sin(run.latitude), math.cos(run.latitude)
        flexure = (cosine * s1, cosine * c1 * s2 - sine * c2)
    else:
        flexure = (nought, -c2)
    columns = (
        (c2, nought), (nought, one), (one, nought), (s2, nought), (-c1 * s2, s1), (s1 * s2, c1), flexure,
    )  # fmt: skip
    return np.array([np.concatenate(column) for column in columns]).T


def fit_first_order(run: PointingRun, extra: Array | None = None) -> FirstOrderFit:
    """Fit the small model, and perhaps extra columns (2n, m), to all observations of a run.

    Columns that the others contain already get a coefficient of least size and an infinite standard deviation.
    """
    matrix = design(run) if extra is None else np.column_stack([design(run), extra])
    first, second = run.offsets()
    seen = np.concatenate([first * np.cos(run.mechanical_star()[1]), second])
    u, size, vt = np.linalg.svd(matrix, full_matrices=False)
    known = size > size[0] * 1e-10 if size.size else np.zeros(0, bool)
    inverse = np.where(known, 1.0 / np.where(known, size, 1.0), 0.0)
    coefficients = vt.T @ (inverse * (u.T @ seen))
    left = seen - matrix @ coefficients
    free = max(len(seen) - int(np.count_nonzero(known)), 1)
    spread = math.sqrt(float(left @ left) / free)
    sigmas = spread * np.sqrt(np.sum((vt.T * inverse) ** 2, axis=1))
    undetermined = np.sqrt(np.sum(vt.T[:, ~known] ** 2, axis=1)) > 1e-6
    n = len(run)
    return FirstOrderFit(
        coefficients, np.where(undetermined, np.inf, sigmas), left[:n], left[n:],
        math.sqrt(float(left @ left) / n) if n else 0.0,
    )  # fmt: skip
