"""Clockdrive points telescopes.

    from clockdrive import Telescope
    with Telescope.open("telescope.toml") as scope:      # or Telescope.simulated("tc410")
        plan = scope.plan("M1")
        arrival = scope.goto("M1")

The names below are loaded when they are first used, so that `import clockdrive` costs nothing.
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
    from clockdrive.slewing import Progress
    from clockdrive.telescope import Telescope
    from pointing.model.fit import fit
    from pointing.model.pointing_model import PointingModel
    from pointing.model.run_file import read_run
    from pointing.model.tpoint_file import read_tpoint

_HOME = {
    "Answer": "clockdrive.answers",
    "ClockdriveError": "clockdrive.errors",
    "Configuration": "clockdrive.configuration",
    "ConfigurationError": "clockdrive.errors",
    "OwnedElsewhere": "clockdrive.errors",
    "PlanAnswer": "clockdrive.answers",
    "PointingModel": "pointing.model.pointing_model",
    "Progress": "clockdrive.slewing",
    "Refused": "clockdrive.errors",
    "SystemClock": "clockdrive.clock",
    "Telescope": "clockdrive.telescope",
    "VirtualClock": "clockdrive.clock",
    "fit": "pointing.model.fit",
    "load": "clockdrive.configuration",
    "read_run": "pointing.model.run_file",
    "read_tpoint": "pointing.model.tpoint_file",
}

__all__ = [
    "Answer",
    "ClockdriveError",
    "Configuration",
    "ConfigurationError",
    "OwnedElsewhere",
    "PlanAnswer",
    "PointingModel",
    "Progress",
    "Refused",
    "SystemClock",
    "Telescope",
    "VirtualClock",
    "fit",
    "load",
    "read_run",
    "read_tpoint",
]


__getattr__ = lazy_names(__name__, _HOME)
