"""The stars that are chosen tell more of axis 1 than others do, and are in one posture."""

import math
import random

import numpy as np
import pytest
from planning_bench import MIDNIGHT, planner

from pointing.axis_estimate import AxisEstimate, Look
from pointing.axis_places import telling_places
from pointing.errors import PointingError
from pointing.mount import MountType
from pointing.run_plan import place_angles, spread_places

SIGMA = math.radians(2.0 / 3600.0)


def sigma_of_axis(subject, estimate, places):
    """Root mean square of where axis 1 is found after looks at places, arcseconds."""
    for place in places:
        estimate = estimate.looked(Look(*place_angles(subject, place), place.direction, SIGMA))
    pole = estimate.pole
    moved = np.array([np.cross(axis, pole) for axis in np.eye(3)]).T
    return math.degrees(math.sqrt(np.trace(moved @ estimate.covariance @ moved.T))) * 3600.0


@pytest.mark.parametrize("kind", [MountType.EQUATORIAL_FORK, MountType.GERMAN, MountType.ALTAZ_FORK])
def test_three_chosen_stars_and_a_fourth_beat_stars_at_random(kind):
    subject = planner(kind, -42.4)
    candidates = spread_places(subject, 24, MIDNIGHT)
    blank = AxisEstimate(subject.mount)
    chosen = telling_places(subject, candidates, blank, 3, SIGMA)
    assert len({place.posture for place in chosen}) == 1
    same = [place for place in candidates if place.posture == chosen[0].posture]
    chance = random.Random(4)  # noqa: S311
    others = [sigma_of_axis(subject, blank, chance.sample(same, 3)) for _ in range(60)]
    best = sigma_of_axis(subject, blank, chosen)
    print(f"\n{kind.text}: axis to {best:.2f}″ with the three chosen, {np.median(others):.2f}″ with any three")
    assert best <= min(others) * 1.001
    assert best < 0.7 * np.median(others)


def test_more_places_than_there_are_is_refused():
    subject = planner(MountType.EQUATORIAL_FORK, -42.4)
    two = spread_places(subject, 24, MIDNIGHT)[:1]
    with pytest.raises(PointingError, match="no 3 places"):
        telling_places(subject, two, AxisEstimate(subject.mount), 3, SIGMA)
