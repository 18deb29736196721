"""The mathematics of pointing: no clock, no socket; time is given, angles are radians, durations seconds.

The names below are loaded when they are first used, so that `import pointing` costs nothing.
"""

from typing import TYPE_CHECKING

from pointing.lazy_names import lazy_names

if TYPE_CHECKING:
    from pointing.catalogue import find
    from pointing.ephemeris_table import EphemerisTable
    from pointing.errors import PointingError, TargetError, Unreachable
    from pointing.gearing import Gearing
    from pointing.instant import Instant
    from pointing.limits import Horizon, Limits
    from pointing.minor_body import MinorBody
    from pointing.model.own_term import own_term
    from pointing.mount import Mount, MountType
    from pointing.offset import OffsetTarget
    from pointing.plan import Axis, Plan, Start, Timing
    from pointing.planner import Planner
    from pointing.rate_offset import RateOffsetTarget
    from pointing.satellite import Satellite
    from pointing.site import Site, Weather
    from pointing.sky import Sky
    from pointing.solar_system import SolarSystemBody
    from pointing.targets import FixedAltAz, FixedHaDec, Star
    from pointing.tle import read_tle
    from pointing.visibility import Pass, passes

_HOME = {
    "Axis": "pointing.plan",
    "EphemerisTable": "pointing.ephemeris_table",
    "FixedAltAz": "pointing.targets",
    "FixedHaDec": "pointing.targets",
    "Gearing": "pointing.gearing",
    "Horizon": "pointing.limits",
    "Instant": "pointing.instant",
    "Limits": "pointing.limits",
    "MinorBody": "pointing.minor_body",
    "Mount": "pointing.mount",
    "MountType": "pointing.mount",
    "OffsetTarget": "pointing.offset",
    "Pass": "pointing.visibility",
    "Plan": "pointing.plan",
    "Planner": "pointing.planner",
    "PointingError": "pointing.errors",
    "RateOffsetTarget": "pointing.rate_offset",
    "Satellite": "pointing.satellite",
    "Site": "pointing.site",
    "Sky": "pointing.sky",
    "SolarSystemBody": "pointing.solar_system",
    "Star": "pointing.targets",
    "Start": "pointing.plan",
    "TargetError": "pointing.errors",
    "Timing": "pointing.plan",
    "Unreachable": "pointing.errors",
    "Weather": "pointing.site",
    "find": "pointing.catalogue",
    "own_term": "pointing.model.own_term",
    "passes": "pointing.visibility",
    "read_tle": "pointing.tle",
}

__all__ = [
    "Axis",
    "EphemerisTable",
    "FixedAltAz",
    "FixedHaDec",
    "Gearing",
    "Horizon",
    "Instant",
    "Limits",
    "MinorBody",
    "Mount",
    "MountType",
    "OffsetTarget",
    "Pass",
    "Plan",
    "Planner",
    "PointingError",
    "RateOffsetTarget",
    "Satellite",
    "Site",
    "Sky",
    "SolarSystemBody",
    "Star",
    "Start",
    "TargetError",
    "Timing",
    "Unreachable",
    "Weather",
    "find",
    "own_term",
    "passes",
    "read_tle",
]


__getattr__ = lazy_names(__name__, _HOME)
