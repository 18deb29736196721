"""Simulated axis controllers, made from a configuration."""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from clockdrive.configuration import Configuration
from clockdrive.drives.apo.settings import park_degrees, settings
from mounts.apo.settings import AxisSettings
from mounts.apo.simulator import SimulatedObservatory
from mounts.apo.simulator_clock import ControllerClock
from mounts.apo.simulator_settings import HARDWARE, AxisHardware, SimulatorSettings

_SECTION = "simulator."


def observatory(
    configuration: Configuration, time: float, snapshot: Mapping[str, object] | None
) -> SimulatedObservatory:
    """Simulated controllers, as they were left or new at their park positions."""
    wanted, park = settings(configuration), park_degrees(configuration)
    bolted = [
        _hardware(axis, known, stow)
        for axis, known, stow in zip(wanted.axes, HARDWARE[wanted.kind], park, strict=False)
    ]
    made = SimulatedObservatory(wanted.kind, _settings(configuration), time, bolted, park)
    if snapshot is not None and (stood := _stood_later(snapshot, time)):
        return SimulatedObservatory(wanted.kind, _settings(configuration), time, bolted, stood)
    if snapshot is not None:
        made.restore(snapshot)
        made.advance(time)
    return made


def _stood_later(snapshot: Mapping[str, Any], time: float) -> tuple[float, ...]:
    """Where the axes stood in a snapshot of a later time: the clock was set back since, and they start anew there."""
    seen = [(ControllerClock(**axis["clock"]), axis["servo"]["at"]) for axis in snapshot["axes"]]
    later = any(clock.posix(count) > time for clock, (_, _, count) in seen)
    return tuple(position for _, (position, _, _) in seen) if later else ()


def _settings(configuration: Configuration) -> SimulatorSettings:
    values = {
        field.name: configuration.values[_SECTION + field.name]
        for field in fields(SimulatorSettings)
        if _SECTION + field.name in configuration.values
    }
    return SimulatorSettings(**values)  # type: ignore[arg-type]  # the keys were checked


def _hardware(axis: AxisSettings, known: AxisHardware, stow: float) -> AxisHardware:
    """The axis as it is configured, with the fiducials of the telescope that it stands for."""
    return replace(
        known,
        lowest_deg=axis.lowest_deg,
        highest_deg=axis.highest_deg,
        velocity=axis.max_speed_deg_s,
        acceleration=axis.acceleration_deg_s2,
        jerk=axis.jerk_deg_s3,
        stow_deg=stow,
    )
