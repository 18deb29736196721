"""The sections of a configuration with a TC410's own keys."""

from dataclasses import dataclass
from typing import Literal

from clockdrive.configuration_keys import TC410_MICROSTEPS
from clockdrive.configuration_sections import AxisSection, DriveSection, SimulatorSection
from clockdrive.drives.own_sections import OwnSections
from clockdrive.gear_teeth import GearTeeth


@dataclass(frozen=True)
class Tc410Drive(DriveSection):
    """`[drive]`."""

    position_format: Literal["auto", "right", "left"]
    slew_idle: Literal["both", "per-axis"]
    joystick_mode: int
    autoguider_mode: int
    fan_start_c: float
    fan_stop_c: float


@dataclass(frozen=True)
class Tc410Axis(AxisSection):
    """`[axis1]` or `[axis2]`."""

    motor_steps: int
    main_gear: GearTeeth
    secondary_gear: GearTeeth
    drive_type: Literal["gecko", "ims"]
    acceleration_register: int
    deceleration_register: int
    max_speed_deg_s: float
    motor_current_a: float
    motor_wiring: str
    motor_rated_a: float | None
    motor_rating: Literal["per-phase", "bipolar"]
    encoder_bits: Literal[0, 14, 16]
    encoder_reversed: bool
    encoder_zero: int
    encoder_zero_at: Literal["centre", "zero"]

    @property
    def counts_per_step(self) -> int:
        """Units a TC410 reports for a full step of its motor."""
        return TC410_MICROSTEPS[self.drive_type]


@dataclass(frozen=True)
class Tc410Simulator(SimulatorSection):
    """`[simulator]`."""

    position_format: Literal["right", "left"]
    slew_idle: Literal["both", "per-axis"]
    landing_counts: int
    slew_bit_clears: bool
    limit_shift: int
    speed_shift: int
    encoder_zero_at: Literal["centre", "zero"]
    volatile_targets: bool
    power_at_boot: bool
    standby_steps: float
    dead_zone: int
    guide_velocity: int


_OWN = OwnSections(Tc410Drive, Tc410Axis, Tc410Axis, Tc410Simulator)
drive_of, axes_of, simulator_of = _OWN.drive_of, _OWN.axes_of, _OWN.simulator_of
"""These sections of a configuration."""
