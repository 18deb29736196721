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

import pointing  # noqa: E402 - of the distribution just verified
from pointing.lazy_names import lazy_names  # noqa: E402 - likewise

if TYPE_CHECKING:
    from clockdrive.answers import Answer, PlanAnswer
    from clockdrive.clock import SystemClock, VirtualClock
    from clockdrive.configuration import Configuration, load
    from clockdrive.errors import ClockdriveError, ConfigurationError, OwnedElsewhere, Refused
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.run_report import RunReport
    from clockdrive.slewing import Progress
    from clockdrive.telescope import Telescope
    from pointing import *  # noqa: F403 - what `pointing` exports is exported here as well

_HOME = dict.fromkeys(pointing.__all__, "pointing") | {
    "Answer": "clockdrive.answers",
    "ClockdriveError": "clockdrive.errors",
    "Configuration": "clockdrive.configuration",
    "ConfigurationError": "clockdrive.errors",
    "OwnedElsewhere": "clockdrive.errors",
    "PlanAnswer": "clockdrive.answers",
    "PointingRuns": "clockdrive.pointing_runs",
    "Progress": "clockdrive.slewing",
    "Refused": "clockdrive.errors",
    "RunReport": "clockdrive.run_report",
    "SystemClock": "clockdrive.clock",
    "Telescope": "clockdrive.telescope",
    "VirtualClock": "clockdrive.clock",
    "load": "clockdrive.configuration",
}

__all__ = [
    "Answer",
    "ClockdriveError",
    "Configuration",
    "ConfigurationError",
    "OwnedElsewhere",
    "PlanAnswer",
    "PointingRuns",
    "Progress",
    "Refused",
    "RunReport",
    "SystemClock",
    "Telescope",
    "VirtualClock",
    "load",
]
__all__ += pointing.__all__


__getattr__ = lazy_names(__name__, _HOME)
