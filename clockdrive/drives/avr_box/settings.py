"""What a configuration means for a stepper box: its gears, its slew table, and what its driver must know."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives import configured
from clockdrive.drives.avr_box.sections import AvrAxis, axes_of, drive_of, simulator_of
from clockdrive.drives.configured import parked
from clockdrive.errors import ConfigurationError
from pointing.gearing import Gearing

if TYPE_CHECKING:
    from mounts.avr_box.settings import AvrSettings


def gearings(configuration: Configuration) -> tuple[Gearing, Gearing]:
    """How microsteps become axis angle; microstep 0 is where the axis stands at `centre_deg`."""
    one, two = (
        Gearing.of_motor(
            section.motor_steps,
            section.main_gear,
            section.secondary_gear,
            section.microsteps,
            centre_counts=0,
            centre_deg=section.centre_deg,
            reversed=section.reversed,
        )
        for section in axes_of(configuration)
    )
    return one, two


def steps_per_turn(section: AvrAxis) -> float:
    """Microsteps of the motor for a turn of the axis."""
    return float(section.motor_steps * section.microsteps / (section.main_gear * section.secondary_gear))


def worm_steps(section: AvrAxis) -> float:
    """Microsteps of the motor for a turn of the worm."""
    return float(section.motor_steps * section.microsteps / section.secondary_gear)


def signs(configuration: Configuration) -> tuple[int, int]:
    """+1 where the counts of an axis rise with its angle, −1 where they fall."""
    one, two = (-1 if section.reversed else 1 for section in axes_of(configuration))
    return one, two


def park_counts(configuration: Configuration) -> tuple[int, int]:
    """Where the axes stand when parked."""
    return parked(gearings(configuration), axes_of(configuration))


def slew_table(configuration: Configuration) -> tuple[int, ...]:
    """The box's slew table: the standard one, or that of the configured file.

    Raises
    ------
    ConfigurationError
        The file is no slew table.
    """
    return _table(configuration, "drive.slew_table", drive_of(configuration).slew_table)


def simulated_slew_table(configuration: Configuration) -> tuple[int, ...]:
    """That of the simulator, where it is another one.

    Raises
    ------
    ConfigurationError
        The file is no slew table.
    """
    path = simulator_of(configuration).slew_table
    return slew_table(configuration) if path is None else _table(configuration, "simulator.slew_table", path)


def _table(configuration: Configuration, key: str, path: Path | str | None) -> tuple[int, ...]:
    from mounts.avr_box.slew_table import SlewTableError, read_slew_table, standard  # noqa: PLC0415 - by kind

    if not isinstance(path, Path):
        return standard()
    try:
        return read_slew_table(path)
    except SlewTableError as error:
        raise ConfigurationError(configuration.source, [f"{key}: {error}"]) from error


def _encoder_counts(configuration: Configuration) -> int:
    """Encoder counts a turn, so few that no way within an axis's travel is longer than an answer can say."""
    from mounts.avr_box.answers import MOST_COUNTS  # noqa: PLC0415 - as in `settings`

    counts = drive_of(configuration).encoder_counts_per_turn
    travel_deg = max(section.max_deg - section.min_deg for section in axes_of(configuration))
    most = math.floor(MOST_COUNTS * 360.0 / travel_deg)
    if counts > most:
        text = (
            f"drive.encoder_counts_per_turn = {counts}: an answer of the box has five digits, and within "
            f"{travel_deg:g}° of travel its encoders would count beyond that: at most {most}, or 0 for none"
        )
        raise ConfigurationError(configuration.source, [text])
    return counts


def settings(configuration: Configuration) -> "AvrSettings":
    """What the driver must know.

    Raises
    ------
    ConfigurationError
        The slew table is none; the encoders count farther than they can say.
    """
    from mounts.avr_box.settings import AvrSettings  # noqa: PLC0415 - a plan alone needs no drive

    drive, (one, two) = drive_of(configuration), axes_of(configuration)
    return AvrSettings(
        steps_per_turn=(steps_per_turn(one), steps_per_turn(two)),
        signs=signs(configuration),
        slew_table=slew_table(configuration),
        move_count=drive.move_count,
        axis_bit=drive.axis_bit,
        guide_counts=drive.guide_counts,
        busy=drive.busy,
        north_reversed=drive.north_reversed,
        pec=drive.pec,
        encoder_counts_per_turn=_encoder_counts(configuration),
        longest_s=drive.max_uninterruptible_s,
        meaning=meaning(configuration),
    )


def meaning(configuration: Configuration) -> str:
    """What must not change between a sync and the next goto."""
    axes = (f"{gear.step_deg} {gear.centre_deg!r} {gear.reversed}" for gear in gearings(configuration))
    return configured.meaning(configuration, axes)
