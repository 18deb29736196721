"""What a configuration means for an AWR Microstep: steps a degree, and what its driver must know."""

from fractions import Fraction
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives import configured
from clockdrive.drives.awr.sections import axes_of, drive_of
from clockdrive.drives.configured import parked
from pointing.gearing import Gearing

if TYPE_CHECKING:
    from mounts.awr.settings import AwrSettings

SIDEREAL_DEG_S = 360.0 / 86164.0905
FASTEST_DEG_S = 4.0 * SIDEREAL_DEG_S  # of a drive, which goes on so when its program is gone: 1° a minute
_NEAR_DEG = 5.0  # of a goto before anybody has seen that keys move the axes as configured


def steps_per_degree(configuration: Configuration) -> tuple[float, float]:
    """Motor steps a degree of each axis: of axis 1 by the sidereal rate of the factory sheet."""
    return drive_of(configuration).sidereal_steps_per_s / SIDEREAL_DEG_S, axes_of(configuration)[1].steps_per_degree


def gearings(configuration: Configuration) -> tuple[Gearing, Gearing]:
    """How steps become axis angle; step 0 is where the axis stands at `centre_deg`."""
    one, two = (
        Gearing(1 / Fraction(steps), 0, section.centre_deg, section.reversed)
        for steps, section in zip(steps_per_degree(configuration), axes_of(configuration), strict=True)
    )
    return one, two


def park_counts(configuration: Configuration) -> tuple[int, int]:
    """Where the axes stand when parked."""
    return parked(gearings(configuration), axes_of(configuration))


def settings(configuration: Configuration) -> "AwrSettings":
    """What the driver must know."""
    from mounts.awr.settings import AwrSettings  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.awr.uncertainty import Jitter  # noqa: PLC0415 - likewise

    drive = drive_of(configuration)
    one, two = per_degree = steps_per_degree(configuration)
    sections = axes_of(configuration)
    play1, play2 = (
        None if section.backlash_arcsec is None else section.backlash_arcsec / 3600.0 * steps
        for section, steps in zip(sections, per_degree, strict=True)
    )
    sigma1, sigma2 = (
        section.backlash_sigma_arcsec / 3600.0 * steps for section, steps in zip(sections, per_degree, strict=True)
    )
    return AwrSettings(
        sidereal_steps_per_s=drive.sidereal_steps_per_s,
        frequency_unit=drive.frequency_unit,
        acceleration_unit=drive.acceleration_unit,
        rate_reference=drive.rate_reference,
        drive_ra=(drive.drive_ra_counts, drive.drive_ra_postscaler),
        postscaler=drive.postscaler,
        reads_ram=drive.reads_ram,
        jitter=Jitter(drive.press_jitter_s, drive.event_jitter_s),
        near=(one * _NEAR_DEG, two * _NEAR_DEG),
        fastest=(one * FASTEST_DEG_S, two * FASTEST_DEG_S),
        meaning=meaning(configuration),
        plays=(play1, play2),
        play_sigmas=(sigma1, sigma2),
    )


def meaning(configuration: Configuration) -> str:
    """What must not change between a sync and the next goto."""
    axes = (f"{gear.counts_per_radian!r} {gear.centre_deg!r} {gear.reversed}" for gear in gearings(configuration))
    return configured.meaning(configuration, axes)
