"""How the axes of a configuration turn a TC410's counts into angle."""

from clockdrive.configuration import Configuration
from clockdrive.drives.configured import parked
from clockdrive.drives.tc410.sections import axes_of
from mounts.tc410.registers import CENTRE
from pointing.gearing import Gearing


def gearings(configuration: Configuration) -> tuple[Gearing, Gearing]:
    """How the axes of a configuration turn counts into angle."""
    one, two = (
        Gearing.of_motor(
            section.motor_steps,
            section.main_gear,
            section.secondary_gear,
            section.counts_per_step,
            centre_counts=CENTRE,
            centre_deg=section.centre_deg,
            reversed=section.reversed,
        )
        for section in axes_of(configuration)
    )
    return one, two


def park_counts(configuration: Configuration) -> tuple[int, int]:
    """Where the axes stand when parked."""
    return parked(gearings(configuration), axes_of(configuration))
