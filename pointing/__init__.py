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
    from pointing.model.choice import choose_terms
    from pointing.model.diagnosis import diagnose
    from pointing.model.fit import fit
    from pointing.model.fitted import Fit
    from pointing.model.model_on_file import read_model
    from pointing.model.nights import fit_nights
    from pointing.model.own_term import own_term
    from pointing.model.pointing_model import PointingModel
    from pointing.model.run import PointingRun
    from pointing.model.run_file import read_run
    from pointing.model.sequential import SequentialFit
    from pointing.model.terms import worm_terms
    from pointing.model.tpoint_file import read_tpoint, read_tpoint_all
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
    "Fit": "pointing.model.fitted",
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
    "PointingModel": "pointing.model.pointing_model",
    "PointingRun": "pointing.model.run",
    "RateOffsetTarget": "pointing.rate_offset",
    "Satellite": "pointing.satellite",
    "SequentialFit": "pointing.model.sequential",
    "Site": "pointing.site",
    "Sky": "pointing.sky",
    "SolarSystemBody": "pointing.solar_system",
    "Star": "pointing.targets",
    "Start": "pointing.plan",
    "TargetError": "pointing.errors",
    "Timing": "pointing.plan",
    "Unreachable": "pointing.errors",
    "Weather": "pointing.site",
    "choose_terms": "pointing.model.choice",
    "diagnose": "pointing.model.diagnosis",
    "find": "pointing.catalogue",
    "fit": "pointing.model.fit",
    "fit_nights": "pointing.model.nights",
    "own_term": "pointing.model.own_term",
    "passes": "pointing.visibility",
    "read_model": "pointing.model.model_on_file",
    "read_run": "pointing.model.run_file",
    "read_tle": "pointing.tle",
    "read_tpoint": "pointing.model.tpoint_file",
    "read_tpoint_all": "pointing.model.tpoint_file",
    "worm_terms": "pointing.model.terms",
}

__all__ = [
    "Axis",
    "EphemerisTable",
    "Fit",
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
    "PointingModel",
    "PointingRun",
    "RateOffsetTarget",
    "Satellite",
    "SequentialFit",
    "Site",
    "Sky",
    "SolarSystemBody",
    "Star",
    "Start",
    "TargetError",
    "Timing",
    "Unreachable",
    "Weather",
    "choose_terms",
    "diagnose",
    "find",
    "fit",
    "fit_nights",
    "own_term",
    "passes",
    "read_model",
    "read_run",
    "read_tle",
    "read_tpoint",
    "read_tpoint_all",
    "worm_terms",
]


__getattr__ = lazy_names(__name__, _HOME)
