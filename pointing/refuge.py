"""Where a telescope is safe from the Sun for the next hours, and can go from where it is."""

import itertools
import math
from collections.abc import Iterator
from contextlib import suppress

from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.mount import POSTURES
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.vectors import Vector, from_azimuth_altitude

_AZIMUTHS_DEG = range(0, 360, 20)
_ALTITUDES_DEG = range(5, 90, 12)
_SPANS_S = (10_800.0, 3_600.0, 1_200.0)  # for which a refuge is to be safe: three hours, or at least twenty minutes
_LOOKS = 4  # in that time


def refuge(planner: Planner, start: Start, timing: Timing) -> Plan:
    """Plan a slew to the nearest place that the Sun's zone does not reach for hours, by an allowed way.

    Raises
    ------
    Unreachable
        There is no such place, or no allowed way to it.
    """
    here = planner.angles(start.counts)

    def way(angles: tuple[float, float]) -> float:
        return max(abs(angles[0] - here[0]), abs(angles[1] - here[1]))

    for span in _SPANS_S:
        for angles in sorted(_safe(planner, start.time, span), key=way):
            try:
                return planner.plan_axes("refuge from the Sun", angles, start, timing)
            except Unreachable:
                continue
    raise Unreachable("no place that is safe from the Sun can be reached from here; cover the telescope")


def _safe(planner: Planner, time: float, span: float) -> Iterator[tuple[float, float]]:
    """Axis angles of all places that keep clear of horizon and Sun for a time."""
    moments = [time + span * k / _LOOKS for k in range(_LOOKS + 1)]
    suns: list[Vector] = [planner.sky.at(Instant.from_posix(moment)).sun() for moment in moments]
    for azimuth, altitude in itertools.product(_AZIMUTHS_DEG, _ALTITUDES_DEG):
        place = from_azimuth_altitude(math.radians(azimuth), math.radians(altitude))
        limits = planner.limits
        if limits.horizon.margin(place) < 0.0 or any(limits.sun_margin(place, sun) < 0.0 for sun in suns):
            continue
        with suppress(Unreachable):  # next to the pole of axis 1, where the tube does not come
            for posture in POSTURES:
                yield from planner.windings(planner.mount.axes(place, posture), (0.0, 0.0))
