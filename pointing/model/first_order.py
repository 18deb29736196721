"""A small model fitted to first order, for questions about the data: its answers are no pointing model.

Zero points, collimation, non-perpendicularity, axis tilt and tube flexure are what any telescope has. What they
cannot explain, something else did. Partials in mechanical angles, so that both postures are fitted together.
"""

import math
from dataclasses import dataclass

import numpy as np

from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.run import Array, PointingRun
from pointing.model.terms import Term, terms

_SMALL: dict[MountKind, tuple[Term, ...]] = {
    "equatorial": terms("IH ID CH NP MA ME TF", "equatorial"),
    "altazimuth": terms("IA IE CA NPAE AN AW TF", "altazimuth"),
}
SMALL_MODEL = len(_SMALL["equatorial"])  # columns of `design`


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
    """Partials on the sky, (2n, 7): those of `_SMALL` at coefficients of zero."""
    listed = _SMALL[run.mount]
    small = PointingModel(run.mount, run.latitude, listed, (0.0,) * len(listed))
    columns = small.star_and_jacobian(*run.mechanical_star())[2].by_coefficient
    return (
        np.array([[np.broadcast_to(part, len(run)) for part in column] for column in columns])
        .reshape(len(listed), -1)
        .T
    )


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
