"""A simulated stepper box, made from a configuration."""

from collections.abc import Mapping
from dataclasses import fields

from clockdrive.configuration import Configuration
from clockdrive.drives.avr_box.sections import axes_of, drive_of, simulator_of
from clockdrive.drives.avr_box.settings import park_counts, signs, simulated_slew_table, steps_per_turn, worm_steps
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.simulator_settings import SimulatorSettings


def stepper_box(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> SimulatedAvrBox:
    """A simulated box, as it was left or new at its park position."""
    one, two = axes_of(configuration)
    turned, park = signs(configuration), park_counts(configuration)
    unit = SimulatedAvrBox(
        _settings(configuration),
        time,
        (steps_per_turn(one), steps_per_turn(two)),
        worm_steps(one),
        (turned[0] * park[0], turned[1] * park[1]),
        turned,
    )
    if snapshot is not None:
        unit.restore(snapshot)
        unit.advance(time)
    return unit


def _settings(configuration: Configuration) -> SimulatorSettings:
    """One unit; its moves go as configured, unless it is told to be wired the other way."""
    section, (one, two) = simulator_of(configuration), axes_of(configuration)
    known = {field.name for field in fields(SimulatorSettings)}
    given = {name: value for name, value in vars(section).items() if name in known}
    return SimulatorSettings(
        **given
        | {
            "reversed1": section.reversed1 != one.reversed,
            "north_reversed": section.north_reversed != drive_of(configuration).north_reversed,
            "reversed2": section.reversed2 != two.reversed,
            "encoder_counts_per_turn": section.encoder_counts_per_turn
            or drive_of(configuration).encoder_counts_per_turn,
            "slew_table": simulated_slew_table(configuration),
        }
    )
