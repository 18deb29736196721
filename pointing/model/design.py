"""Residuals of a run against a model, and their derivatives, block by block.

An observation's residual is star minus prediction as a vector on the sky, at the predicted place: dX = cos lat · Δlon
and dY = Δlat, both mechanical, thus in the frame of the tube: beyond the pole cos lat is negative, and both point the
other way on the sky. The square summed over a run is what a fit minimises, and the model's Jacobian gives its exact
derivatives. Blocks keep the memory constant, whatever the size of the run.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pointing.model.place import Place
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun

Array = NDArray[np.float64]

_BLOCK = 2048  # observations; what a block needs stays in a processor's cache


class Block(NamedTuple):
    """A block of n observations with k terms.

    Parameters
    ----------
    where : slice
        Of the run.
    residual : (2, n) array
        dX, dY in radians.
    design : (2, n, k) array
        Derivatives of the predicted place by the coefficients.
    """

    where: slice
    residual: Array
    design: Array


def blocks(run: PointingRun, model: PointingModel, size: int = _BLOCK) -> Iterator[Block]:
    """Yield a run's residuals and design matrix against a model."""
    for where in _slices(len(run), size):
        place, jacobian = model.star_place_and_jacobian(run.axis1[where], run.axis2[where])
        residual = _residual(run, where, place)
        columns = np.empty((len(model.terms), *residual.shape))  # a term's derivatives lie together
        for column, (along, up) in zip(columns, jacobian.by_coefficient, strict=True):
            column[0], column[1] = along, up
        yield Block(where, residual, columns.transpose(1, 2, 0))


def residuals(run: PointingRun, model: PointingModel) -> Array:
    """Return (2, n) residuals dX, dY, radians."""
    found = np.empty((2, len(run)))
    for where in _slices(len(run), _BLOCK):
        found[:, where] = _residual(run, where, model.star_place(run.axis1[where], run.axis2[where]))
    return found


def _slices(n: int, size: int) -> Iterator[slice]:
    return (slice(begin, min(begin + size, n)) for begin in range(0, n, size))


def _residual(run: PointingRun, where: slice, place: Place) -> Array:
    """Components of the star's direction along the unit vectors of the predicted place."""
    x, y, z = run.star_direction[:, where]
    residual = np.empty((2, x.size))
    residual[0] = y * place.cos_lon - x * place.sin_lon
    residual[1] = z * place.cos_lat - (x * place.cos_lon + y * place.sin_lon) * place.sin_lat
    return residual
