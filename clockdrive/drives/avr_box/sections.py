"""The sections of a configuration with a stepper box's own keys."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from clockdrive.configuration_sections import AxisSection, DriveSection, SimulatorSection
from clockdrive.drives.own_sections import OwnSections
from clockdrive.gear_teeth import GearTeeth


@dataclass(frozen=True)
class AvrDrive(DriveSection):
    """`[drive]`."""

    move_count: Literal["total", "half"]
    axis_bit: int
    guide_counts: int
    busy: Literal["restart", "ignore"]
    north_reversed: bool
    pec: bool
    encoder_counts_per_turn: int
    max_uninterruptible_s: float
    slew_table: Path | Literal["standard"] | None


@dataclass(frozen=True)
class AvrAxis(AxisSection):
    """`[axis1]` or `[axis2]`."""

    motor_steps: int
    microsteps: int
    main_gear: GearTeeth
    secondary_gear: GearTeeth


@dataclass(frozen=True)
class AvrSimulator(SimulatorSection):
    """`[simulator]`."""

    move_count: Literal["total", "half"]
    axis_bit: int
    guide_counts: int
    reversed1: bool
    reversed2: bool
    north_reversed: bool
    encoder_reversed1: bool
    encoder_reversed2: bool
    encoder_still1: bool
    encoder_still2: bool
    busy: Literal["restart", "ignore"]
    lost_steps: float
    encoder_counts_per_turn: int
    slew_table: Path | Literal["standard"] | None
    table_clocks: Literal["byte+1", "byte"]
    guide_ends: Literal["tick", "whole"]
    fine_compare: int
    interrupted: Literal["lost", "kept"]
    index_pulse: bool
    byte_loss: float
    byte_doubling: float
    hand_every_s: float


_OWN = OwnSections(AvrDrive, AvrAxis, AvrAxis, AvrSimulator)
drive_of, axes_of, simulator_of = _OWN.drive_of, _OWN.axes_of, _OWN.simulator_of
"""These sections of a configuration."""
