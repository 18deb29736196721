"""The drive simulators, made from a configuration: embedded for the link `sim:`, or hosted for others."""

from collections.abc import Mapping
from dataclasses import fields
from fractions import Fraction

from clockdrive.configuration import Configuration
from clockdrive.configuration_sections import AxisSection
from clockdrive.tc410_assembly import park_counts, registers
from mounts.tc410.encoders import TURN
from mounts.tc410.registers import CENTRE
from mounts.tc410.simulator import SimulatedTC410
from mounts.tc410.simulator_settings import AxisHardware, SimulatorSettings


def tc410(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> SimulatedTC410:
    """A simulated TC410, as it was left or new at its park position."""
    section = configuration.simulator
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
    section = configuration.axes[index]
    zero_counts = CENTRE if configuration.simulator.encoder_zero_at == "centre" else 0
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


def _counts_per_turn(section: AxisSection) -> Fraction:
    return section.motor_steps * section.counts_per_step / (section.main_gear * section.secondary_gear)


def memory_at_park(configuration: Configuration, time: float) -> dict[str, object]:
    """What the driver of a simulator never used before remembers: it is synchronised, at park."""
    return {"unsynchronised": "", "position": [float(counts) for counts in park_counts(configuration)], "time": time}


class NobodyBeside:
    """In place of a dead-man process for an embedded simulator, which ends with its owner."""

    fate = ""

    def start(self) -> None:
        """Nobody starts."""

    def arm(self) -> None:
        """Nobody will act."""

    def beat(self) -> bool:
        """Nobody needs a sign of life."""
        return True

    def disarm(self) -> None:
        """Nobody would have acted."""

    def close(self) -> None:
        """Nobody ends."""
