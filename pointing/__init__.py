"""The mathematics of pointing: no clock, no socket; time is given, angles are radians, durations seconds.

The names below are loaded when they are first used, so that `import pointing` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pointing.catalogue import find
    from pointing.ephemeris_table import EphemerisTable
    from pointing.errors import PointingError, TargetError, Unreachable
    from pointing.gearing import Gearing
    from pointing.instant import Instant
    from pointing.limits import Horizon, Limits
    from pointing.minor_body import MinorBody
    from pointing.mount import Mount, MountType
    from pointing.offset import OffsetTarget
    from pointing.plan import Axis, Plan, Start, Timing
    from pointing.planner import Planner
    from pointing.rate_offset import RateOffsetTarget
    from pointing.site import Site, Weather
    from pointing.sky import Sky
    from pointing.targets import FixedAltAz, FixedHaDec, Star

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
    "Plan": "pointing.plan",
    "Planner": "pointing.planner",
    "PointingError": "pointing.errors",
    "RateOffsetTarget": "pointing.rate_offset",
    "Site": "pointing.site",
    "Sky": "pointing.sky",
    "Star": "pointing.targets",
    "Start": "pointing.plan",
    "TargetError": "pointing.errors",
    "Timing": "pointing.plan",
    "Unreachable": "pointing.errors",
    "Weather": "pointing.site",
    "find": "pointing.catalogue",
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
    "Plan",
    "Planner",
    "PointingError",
    "RateOffsetTarget",
    "Site",
    "Sky",
    "Star",
    "Start",
    "TargetError",
    "Timing",
    "Unreachable",
    "Weather",
    "find",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'pointing' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
