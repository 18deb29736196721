"""The sections of a configuration as frozen values, in the units of their names: the keys that all drives have.

What a kind of drives has besides is in sections of its own, which its folder in `clockdrive.drives` derives from
these and takes with `Configuration.section`.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from clockdrive.configuration_keys import DriveKind


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
    """`[drive]`."""

    kind: DriveKind
    link: str


@dataclass(frozen=True)
class AxisSection:
    """`[axis1]` or `[axis2]`."""

    centre_deg: float
    reversed: bool
    min_deg: float
    max_deg: float
    park_deg: float


@dataclass(frozen=True)
class RotatorSection(AxisSection):
    """`[rotator]`: an axis, and what it holds unless a command says otherwise."""

    mode: Literal["sky", "horizon", "mount"]
    position_angle_deg: float


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
    seed: int
