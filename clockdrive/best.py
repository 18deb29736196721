"""`best`: the best-placed bright object at a time."""

import math

from clockdrive.errors import Refused
from pointing.catalogue import bright_stars
from pointing.instant import Instant
from pointing.planner import Planner
from pointing.targets import Star

_HIGHEST = math.radians(80.0)  # above it an altazimuth mount has to hurry
_STAYS_S = 1800.0  # for which it must remain allowed


def best(planner: Planner, time: float) -> Star:
    """The bright star that stands highest, not too near the zenith, and stays allowed for half an hour.

    Raises
    ------
    Refused
        No bright star is allowed now.
    """
    frame = planner.sky.at(Instant.from_posix(time))
    altitudes = [(math.asin(star.observed(frame)[2]), star) for star in bright_stars()]
    for altitude, star in sorted(altitudes, key=lambda pair: -pair[0]):
        if altitude <= _HIGHEST and planner.allowed(star, time) and planner.allowed(star, time + _STAYS_S):
            return star
    raise Refused(
        "no bright star stands within the limits now; give a target, or look at [limits] and the axis limits"
    )
