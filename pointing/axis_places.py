"""Which stars tell most of where axis 1 points: those after which its covariance is smallest."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pointing.axis_estimate import AxisEstimate, Look
from pointing.errors import PointingError
from pointing.geometry import Geometry
from pointing.run_plan import RunPlace, place_angles

Array = NDArray[np.float64]

CANDIDATES = 48
"""Places that are worth while to choose from: 17296 threes, a fraction of a second."""


def telling_places(
    geometry: Geometry, candidates: Sequence[RunPlace], estimate: AxisEstimate, n: int, sigma: float
) -> tuple[RunPlace, ...]:
    """Choose the n places, all in one posture, that leave axis 1 surest.

    One posture, as from one side to the other a collimation that no model knows would bend what is found.

    Parameters
    ----------
    geometry : Geometry
        Gives the axis angles of a place.
    candidates : sequence of RunPlace
        Inside all limits, as `spread_places` gives them.
    estimate : AxisEstimate
        What is known already.
    n : int
        How many; 1 to 3.
    sigma : float
        Standard deviation of a component of a look, radians.

    Raises
    ------
    PointingError
        No posture has so many candidates.
    """
    known = np.linalg.inv(estimate.joint)
    turned = _axis_by_rotation(estimate)
    best: tuple[float, tuple[RunPlace, ...]] = (math.inf, ())
    for posture in dict.fromkeys(place.posture for place in candidates):
        places = [place for place in candidates if place.posture == posture]
        if len(places) < n:
            continue
        gains = np.array([estimate.information(_look(geometry, place, sigma)) for place in places])
        sets = np.array(list(combinations(range(len(places)), n)))
        joint = np.linalg.inv(known + gains[sets].sum(axis=1))
        variance = np.einsum("ij,sjk,ik->s", turned, joint, turned)
        first = int(np.argmin(variance))
        if variance[first] < best[0]:
            best = float(variance[first]), tuple(places[i] for i in sets[first])
    if not best[1]:
        raise PointingError(
            f"the telescope reaches no {n} places in one posture: look at [limits], min_deg and max_deg"
        )
    return best[1]


def _look(geometry: Geometry, place: RunPlace, sigma: float) -> Look:
    return Look(*place_angles(geometry, place), place.direction, sigma)


def _axis_by_rotation(estimate: AxisEstimate) -> Array:
    """Derivative of where axis 1 points by a rotation of the mount and by index 2: (3, 4)."""
    x, y, z = estimate.pole
    return np.array([[0.0, z, -y, 0.0], [-z, 0.0, x, 0.0], [y, -x, 0.0, 0.0]])
