"""The sections of a configuration as frozen values, in the units of their names.

The sections of drive and axes carry the keys of all drives and those of the TC410; the keys of other drives are in
`Configuration.values`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from clockdrive.configuration_keys import TC410_MICROSTEPS
from clockdrive.gear_teeth import GearTeeth


@dataclass(frozen=True)
class WeatherSection:
    """`[site.weather]`."""

    source: str | None
    refraction: bool
    pressure_hpa: float
    temperature_c: float
    relative_humidity: float
    wavelength_um: float


@dataclass(frozen=True)
class SiteSection:
    """`[site]`."""

    name: str
    latitude_deg: float
    longitude_deg: float
    height_m: float


@dataclass(frozen=True)
class MountSection:
    """`[mount]`."""

    type: Literal["equatorial-fork", "german", "altaz-fork"]
    mount_x_mas: int
    mount_y_mas: int
    pointing_model: Path | None
    flip: Literal["command", "auto"]
    guide_rate: float


@dataclass(frozen=True)
class DriveSection:
    """`[drive]`: keys of all drives and of the TC410."""

    kind: Literal["tc410", "avr-box", "apo", "sdss", "awr"]
    link: str
    position_format: Literal["auto", "right", "left"]
    slew_idle: Literal["both", "per-axis"]
    joystick_mode: int
    autoguider_mode: int
    fan_start_c: float
    fan_stop_c: float


@dataclass(frozen=True)
class AxisSection:
    """`[axis1]` or `[axis2]`: keys of all drives and of the TC410."""

    centre_deg: float
    reversed: bool
    min_deg: float
    max_deg: float
    park_deg: float
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
class LimitsSection:
    """`[limits]`; a `horizon` file stands in place of `horizon_deg`."""

    horizon_deg: float
    horizon: Path | None
    sun_escape: Literal["stop", "away"]
    sun_avoidance_deg: float
    hour_angle_past_meridian_deg: float


@dataclass(frozen=True)
class InstrumentSection:
    """`[instruments.NAME]`: a pointing origin in the focal plane."""

    x_arcsec: float
    y_arcsec: float


@dataclass(frozen=True)
class TargetsSection:
    """`[targets]`: files from which targets come."""

    kernel: Path | None


@dataclass(frozen=True)
class SimulatorSection:
    """`[simulator]`: what the simulated telescope really does."""

    misalignment_x_arcsec: float
    misalignment_y_arcsec: float
    collimation_arcsec: float
    nonperpendicularity_arcsec: float
    flexure_arcsec: float
    periodic_error_arcsec: float
    backlash_arcsec: float
    encoder_noise_arcsec: float
    sky_noise_arcsec: float
    acceleration_error: float
    landing_s: float
    clock_drift_ppm: float
    latency_s: float
    baud: int
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
    seed: int
