"""The sections of a configuration with an AWR Microstep's own keys."""

from dataclasses import dataclass
from typing import Literal

from clockdrive.configuration_sections import AxisSection, DriveSection, SimulatorSection
from clockdrive.drives.own_sections import OwnSections


@dataclass(frozen=True)
class AwrDriveSection(DriveSection):
    """`[drive]`."""

    sidereal_steps_per_s: float
    drive_ra_counts: int | None
    drive_ra_postscaler: int | None
    frequency_unit: float
    acceleration_unit: float
    rate_reference: Literal["motor", "sky"]
    postscaler: Literal["times", "plus-one"]
    reads_ram: bool
    press_jitter_s: float
    event_jitter_s: float
    timeout_s: float


@dataclass(frozen=True)
class AwrAxisSection(AxisSection):
    """`[axis1]`."""

    backlash_arcsec: float | None
    backlash_sigma_arcsec: float


@dataclass(frozen=True)
class DeclinationSection(AwrAxisSection):
    """`[axis2]`."""

    steps_per_degree: float


@dataclass(frozen=True)
class AwrSimulatorSection(SimulatorSection):
    """`[simulator]`."""

    frequency_unit: float
    acceleration_unit: float
    rate_reference: Literal["motor", "sky"]
    postscaler: Literal["times", "plus-one"]
    sidereal_steps_per_s: float
    firmware: float
    reversed1: bool
    reversed2: bool
    press_jitter_s: float
    event_jitter_s: float
    debug: float
    byte_loss: float
    byte_doubling: float
    byte_delay: float
    byte_delay_s: float
    takes_up_backlash: bool
    reads_ram: bool
    reads_plain: bool


_OWN = OwnSections(AwrDriveSection, AwrAxisSection, DeclinationSection, AwrSimulatorSection)
drive_of, axes_of, simulator_of = _OWN.drive_of, _OWN.axes_of, _OWN.simulator_of
"""These sections of a configuration."""
