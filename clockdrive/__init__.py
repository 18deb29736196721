"""Clockdrive points telescopes.

    from clockdrive import Telescope
    with Telescope.open("telescope.toml") as scope:      # or Telescope.simulated("tc410")
        plan = scope.plan("M1")
        arrival = scope.goto("M1")

The names below, those that `pointing` exports among them, are loaded when they are first used, so that
`import clockdrive` costs nothing.
"""

from typing import TYPE_CHECKING

from clockdrive.distribution import verify

verify()

from pointing.lazy_names import lazy_names  # noqa: E402 - of the distribution just verified

if TYPE_CHECKING:
    from clockdrive.answers import Answer, PlanAnswer
    from clockdrive.clock import SystemClock, VirtualClock
    from clockdrive.configuration import Configuration, load
    from clockdrive.errors import ClockdriveError, ConfigurationError, OwnedElsewhere, Refused
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.run_report import RunReport
    from clockdrive.slewing import Progress
    from clockdrive.telescope import Telescope
    from pointing import (
        Axis,
        EphemerisTable,
        Fit,
        FixedAltAz,
        FixedHaDec,
        Gearing,
        Horizon,
        Instant,
        Limits,
        MinorBody,
        Mount,
        MountType,
        OffsetTarget,
        Pass,
        Plan,
        Planner,
        PointingError,
        PointingModel,
        PointingRun,
        RateOffsetTarget,
        Satellite,
        SequentialFit,
        Site,
        Sky,
        SolarSystemBody,
        Star,
        Start,
        TargetError,
        Timing,
        Unreachable,
        Weather,
        choose_terms,
        diagnose,
        find,
        fit,
        fit_nights,
        own_term,
        passes,
        read_model,
        read_run,
        read_tle,
        read_tpoint,
        read_tpoint_all,
        worm_terms,
    )

_HOME = {
    "Answer": "clockdrive.answers",
    "Axis": "pointing",
    "ClockdriveError": "clockdrive.errors",
    "Configuration": "clockdrive.configuration",
    "ConfigurationError": "clockdrive.errors",
    "EphemerisTable": "pointing",
    "Fit": "pointing",
    "FixedAltAz": "pointing",
    "FixedHaDec": "pointing",
    "Gearing": "pointing",
    "Horizon": "pointing",
    "Instant": "pointing",
    "Limits": "pointing",
    "MinorBody": "pointing",
    "Mount": "pointing",
    "MountType": "pointing",
    "OffsetTarget": "pointing",
    "OwnedElsewhere": "clockdrive.errors",
    "Pass": "pointing",
    "Plan": "pointing",
    "PlanAnswer": "clockdrive.answers",
    "Planner": "pointing",
    "PointingError": "pointing",
    "PointingModel": "pointing",
    "PointingRun": "pointing",
    "PointingRuns": "clockdrive.pointing_runs",
    "Progress": "clockdrive.slewing",
    "RateOffsetTarget": "pointing",
    "Refused": "clockdrive.errors",
    "RunReport": "clockdrive.run_report",
    "Satellite": "pointing",
    "SequentialFit": "pointing",
    "Site": "pointing",
    "Sky": "pointing",
    "SolarSystemBody": "pointing",
    "Star": "pointing",
    "Start": "pointing",
    "SystemClock": "clockdrive.clock",
    "TargetError": "pointing",
    "Telescope": "clockdrive.telescope",
    "Timing": "pointing",
    "Unreachable": "pointing",
    "VirtualClock": "clockdrive.clock",
    "Weather": "pointing",
    "choose_terms": "pointing",
    "diagnose": "pointing",
    "find": "pointing",
    "fit": "pointing",
    "fit_nights": "pointing",
    "load": "clockdrive.configuration",
    "own_term": "pointing",
    "passes": "pointing",
    "read_model": "pointing",
    "read_run": "pointing",
    "read_tle": "pointing",
    "read_tpoint": "pointing",
    "read_tpoint_all": "pointing",
    "worm_terms": "pointing",
}

__all__ = [
    "Answer",
    "Axis",
    "ClockdriveError",
    "Configuration",
    "ConfigurationError",
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
    "OwnedElsewhere",
    "Pass",
    "Plan",
    "PlanAnswer",
    "Planner",
    "PointingError",
    "PointingModel",
    "PointingRun",
    "PointingRuns",
    "Progress",
    "RateOffsetTarget",
    "Refused",
    "RunReport",
    "Satellite",
    "SequentialFit",
    "Site",
    "Sky",
    "SolarSystemBody",
    "Star",
    "Start",
    "SystemClock",
    "TargetError",
    "Telescope",
    "Timing",
    "Unreachable",
    "VirtualClock",
    "Weather",
    "choose_terms",
    "diagnose",
    "find",
    "fit",
    "fit_nights",
    "load",
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
