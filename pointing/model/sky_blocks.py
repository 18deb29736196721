"""Contiguous patches of the sky by which a run is divided.

Stars chosen at random have neighbours among those that remain, and a model with too many terms still predicts them. A
whole patch left out has none: predicting it shows what the model is worth where nobody has looked.
"""

import numpy as np
from numpy.typing import NDArray

from pointing.model.run import PointingRun


def sky_blocks(run: PointingRun, count: int) -> NDArray[np.intp]:
    """Return the patch of each observation, (n,), from 0; −1 for those that take no part.

    The stars' directions in the mount's frame are halved again and again across their longest extent, so that the
    patches hold equally many. Both postures on one place of the sky share a patch.

    Parameters
    ----------
    run : PointingRun
        The run.
    count : int
        How many patches; a power of two is reached, up to one a star.
    """
    cosine = np.cos(run.star2)
    places = np.stack((cosine * np.cos(run.star1), cosine * np.sin(run.star1), np.sin(run.star2)), axis=1)
    parts = [np.flatnonzero(run.kept & (run.weight > 0.0))]
    while len(parts) < count and all(part.size > 1 for part in parts):
        parts = [half for part in parts for half in _halves(places, part)]
    label = np.full(len(run), -1)
    for number, part in enumerate(parts):
        label[part] = number
    return label


def largest(n: int, count: int) -> int:
    """How many of `n` observations the largest of the patches holds."""
    halvings = min(count.bit_length() - 1, n.bit_length() - 1)
    return -(-n >> halvings)


def _halves(places: NDArray[np.float64], part: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Divide at the median along the direction in which the places extend most."""
    apart = places[part] - places[part].mean(axis=0)
    _, vectors = np.linalg.eigh(apart.T @ apart)
    longest = vectors[:, -1] * np.sign(vectors[np.argmax(np.abs(vectors[:, -1])), -1])  # eigenvectors have no sign
    order = part[np.argsort(apart @ longest, kind="stable")]
    return order[: order.size // 2], order[order.size // 2 :]
