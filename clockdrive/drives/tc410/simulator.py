"""A simulated TC410, made from a configuration."""

from collections.abc import Mapping
from dataclasses import fields
from fractions import Fraction

from clockdrive.configuration import Configuration
from clockdrive.drives.tc410.gears import park_counts
from clockdrive.drives.tc410.registers import registers
from clockdrive.drives.tc410.sections import Tc410Axis, axes_of, simulator_of
from mounts.tc410.encoders import TURN
from mounts.tc410.registers import CENTRE
from mounts.tc410.simulator import SimulatedTC410
from mounts.tc410.simulator_settings import AxisHardware, SimulatorSettings


def tc410(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> SimulatedTC410:
    """A simulated TC410, as it was left or new at its park position."""
    section = simulator_of(configuration)
    known = {field.name for field in fields(SimulatorSettings)}
    unit = SimulatedTC410(
        SimulatorSettings(**{name: value for name, value in vars(section).items() if name in known}),
        time,
        (_hardware(configuration, 0), _hardware(configuration, 1)),
        dict(registers(configuration)),
        park_counts(configuration),
    )
    if snapshot is not None:
        unit.restore(snapshot)
        unit.advance(time)
    return unit


def _hardware(configuration: Configuration, index: int) -> AxisHardware:
    section = axes_of(configuration)[index]
    zero_counts = CENTRE if simulator_of(configuration).encoder_zero_at == "centre" else 0
    turned = float((CENTRE - zero_counts) / _counts_per_turn(section)) * (-1.0 if section.encoder_reversed else 1.0)
    return AxisHardware(
        motor_steps=section.motor_steps,
        main_gear=section.main_gear,
        secondary_gear=section.secondary_gear,
        drive_type=section.drive_type,
        encoder_bits=section.encoder_bits,
        encoder_at_centre=round(section.encoder_zero + turned * TURN) % TURN,
        encoder_reversed=section.encoder_reversed,
    )


def _counts_per_turn(section: Tc410Axis) -> Fraction:
    return section.motor_steps * section.counts_per_step / (section.main_gear * section.secondary_gear)
