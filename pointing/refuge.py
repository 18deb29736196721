"""Where a telescope is safe from the Sun for the next hours, and can go from where it is."""

import itertools
import math

from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.mount import POSTURES
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.vectors import azimuth_altitude, from_azimuth_altitude

_FROM_THE_SUN_DEG = (180.0, 135.0, -135.0, 90.0, -90.0)  # in azimuth
_ALTITUDES_DEG = (45.0, 60.0, 30.0, 75.0)
_SAFE_FOR_S = (0.0, 3600.0, 7200.0, 10800.0)


def refuge(planner: Planner, start: Start, timing: Timing) -> Plan:
    """Plan the shortest slew to a place that the Sun's zone does not reach for three hours.

    Raises
    ------
    Unreachable
        There is no such place, or no allowed way to it.
    """
    suns = [planner.sky.at(Instant.from_posix(start.time + seconds)).sun() for seconds in _SAFE_FOR_S]
    azimuth, _ = azimuth_altitude(suns[0])
    plans = []
    for away, altitude in itertools.product(_FROM_THE_SUN_DEG, _ALTITUDES_DEG):
        place = from_azimuth_altitude(azimuth + math.radians(away), math.radians(altitude))
        if (
            planner.limits.horizon.margin(place) < 0.0
            or min(planner.limits.sun_margin(place, sun) for sun in suns) < 0.0
        ):
            continue
        for posture in POSTURES:
            for angles in planner.windings(planner.mount.axes(place, posture), (0.0, 0.0)):
                try:
                    plans.append(planner.plan_axes("refuge from the Sun", angles, start, timing))
                except Unreachable:
                    continue
    if not plans:
        raise Unreachable("no place that is safe from the Sun can be reached from here; cover the telescope")
    return min(plans, key=lambda plan: plan.arrival)
