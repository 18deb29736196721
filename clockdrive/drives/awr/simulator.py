"""A simulated AWR Microstep, made from a configuration."""

from collections.abc import Mapping

from clockdrive.configuration import Configuration
from clockdrive.drives.awr.sections import axes_of, drive_of, simulator_of
from clockdrive.drives.awr.settings import park_counts, steps_per_degree
from mounts.awr.factory import factory
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings

_WORM_TURNS = 360.0  # of axis 1, of which it has an index


def microstep(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> SimulatedAwr:
    """A simulated unit, as it was left or new at its park position, where it stands."""
    unit = SimulatedAwr(_settings(configuration), time, park_counts(configuration))
    if snapshot is None:
        unit.stand()
    else:
        unit.restore(snapshot)
        unit.advance(time)
    return unit


def _settings(configuration: Configuration) -> SimulatorSettings:
    """One unit, of which a person's own differ by the keys of `[simulator]`."""
    section, drive, (one, _) = simulator_of(configuration), drive_of(configuration), axes_of(configuration)
    per_degree = steps_per_degree(configuration)
    play1, play2 = (round(section.backlash_arcsec / 3600.0 * steps) for steps in per_degree)
    words = factory(
        drive.sidereal_steps_per_s,
        frequency_unit=section.frequency_unit,
        acceleration_unit=section.acceleration_unit,
        reversed1=one.reversed,
        rate_reference=section.rate_reference,
        backlash=(play1, play2) if section.takes_up_backlash else (0, 0),
    )
    return SimulatorSettings(
        sidereal_steps_per_s=section.sidereal_steps_per_s,
        frequency_unit=section.frequency_unit,
        acceleration_unit=section.acceleration_unit,
        rate_reference=section.rate_reference,
        postscaler=section.postscaler,
        words=words,
        firmware=section.firmware,
        sense1=-1 if section.reversed1 else 1,
        sense2=-1 if section.reversed2 else 1,
        execution_jitter_s=section.press_jitter_s,
        stamp_jitter_s=section.event_jitter_s,
        clock_drift_ppm=section.clock_drift_ppm,
        acceleration_error=section.acceleration_error,
        debug=section.debug,
        byte_loss=section.byte_loss,
        byte_doubling=section.byte_doubling,
        byte_delay=section.byte_delay,
        byte_delay_s=section.byte_delay_s,
        reads_ram=section.reads_ram,
        reads_plain=section.reads_plain,
        plays=(play1, play2),
        worm_steps=per_degree[0] * 360.0 / _WORM_TURNS,
        seed=section.seed,
    )
