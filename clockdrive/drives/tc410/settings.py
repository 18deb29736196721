"""What a configuration means for a TC410's driver: its settings, and the travel that the unit can hold."""

import math

from clockdrive.configuration import Configuration
from clockdrive.drives import configured
from clockdrive.drives.configured import baud
from clockdrive.drives.tc410.gears import gearings
from clockdrive.drives.tc410.registers import named
from clockdrive.drives.tc410.sections import axes_of, drive_of
from mounts.tc410.encoders import Encoder
from mounts.tc410.registers import CENTRE, of_axis
from mounts.tc410.settings import AxisSettings, TC410Settings

_LAST_COUNT = 2**24 - 1


def settings(configuration: Configuration) -> TC410Settings:
    """What the driver must know."""

    def axis(index: int) -> AxisSettings:
        section, gearing = axes_of(configuration)[index], gearings(configuration)[index]
        ends = sorted(gearing.counts(math.radians(angle)) for angle in (section.min_deg, section.max_deg))
        return AxisSettings(
            gearing=gearing,
            lowest_counts=max(0, math.ceil(ends[0])),
            highest_counts=min(_LAST_COUNT, math.floor(ends[1])),
            counts_per_step=section.counts_per_step,
            encoder=_encoder(configuration, index),
            expected=tuple(
                (name.removeprefix(f"axis{index + 1}_"), value)
                for name, value in named(configuration)
                if name.startswith(f"axis{index + 1}_")
            ),
        )

    return TC410Settings(
        axes=(axis(0), axis(1)),
        position_format=drive_of(configuration).position_format,
        slew_idle=drive_of(configuration).slew_idle,
        baud=baud(configuration),
        meaning=_meaning(configuration),
        expected=tuple((name, value) for name, value in named(configuration) if not name.startswith("axis")),
    )


def travel(configuration: Configuration, index: int) -> tuple[float, float]:
    """Lowest and highest angle of an axis, radians, one count inside what its soft limit registers can hold.

    The registers keep the 16 most significant bits, rounded inward: up to 3.9′ of the configured travel is not had.
    """
    axis = settings(configuration).axes[index]
    low, high = of_axis(index + 1, "negative_limit"), of_axis(index + 1, "positive_limit")
    inside = low.decode(low.encode(axis.lowest_counts)) + 1, high.decode(high.encode(axis.highest_counts)) - 1
    one, two = sorted(axis.gearing.angle(counts) for counts in inside)
    return one, two


def _meaning(configuration: Configuration) -> str:
    """What must not change between a sync and the next goto."""
    axes = (f"{gear.step_deg} {gear.centre_deg!r} {gear.reversed}" for gear in gearings(configuration))
    return configured.meaning(configuration, axes)


def _encoder(configuration: Configuration, index: int) -> Encoder | None:
    section, gearing = axes_of(configuration)[index], gearings(configuration)[index]
    if not section.encoder_bits:
        return None
    return Encoder(
        bits=section.encoder_bits,
        counts_per_turn=360.0 / gearing.step_deg_float,
        zero=section.encoder_zero,
        zero_counts=CENTRE if section.encoder_zero_at == "centre" else 0,
        reversed=section.encoder_reversed,
    )
