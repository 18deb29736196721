"""The TC410 as the application sees it."""

from collections.abc import Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives.configured import opening
from clockdrive.drives.kind import DEAD_MAN_LOG
from clockdrive.drives.nobody_beside import NobodyBeside
from clockdrive.drives.tc410.figures import Tc410Words
from clockdrive.drives.tc410.gears import gearings, park_counts
from clockdrive.drives.tc410.registers import completed_from, registers
from clockdrive.drives.tc410.sections import drive_of
from clockdrive.drives.tc410.settings import settings, travel
from clockdrive.errors import ConfigurationError
from pointing.plan import Axis, Timing

if TYPE_CHECKING:
    from clockdrive.drives.by_hand import AtRest
    from clockdrive.drives.kind import Remember
    from clockdrive.drives.tc410.by_hand import Tc410ByHand
    from mounts.beside import Guardian
    from mounts.tc410.drive import TC410
    from mounts.tc410.simulator import SimulatedTC410
    from mounts.tc410.unit import Unit
    from transports.link import Clock
    from transports.memory import Device


_SILENCE_S = 0.7  # more than the exchange of one register takes on a slow line, and less than a second with the stop


def axes(configuration: Configuration) -> tuple[Axis, Axis]:
    """Gearing and travel of both axes; the travel is what the soft limit registers can hold."""
    one, two = (
        Axis(f"axis{i + 1}", gearing, *travel(configuration, i), words=Tc410Words())
        for i, gearing in enumerate(gearings(configuration))
    )
    return one, two


def timing(configuration: Configuration) -> Timing:
    """How the configured drive moves by its own law, with nothing learnt."""
    from mounts.tc410.leading import leading_of  # noqa: PLC0415 - a telescope has its models from its drive
    from mounts.tc410.slew import Tc410SlewModel  # noqa: PLC0415 - likewise

    wanted = registers(configuration)
    one, two = (
        Tc410SlewModel(
            acceleration=int(wanted[f"axis{axis}_acceleration"]),
            deceleration=int(wanted[f"axis{axis}_deceleration"]),
            max_velocity=int(wanted[f"axis{axis}_max_speed"]) & ~0xFF,
        )
        for axis in (1, 2)
    )
    return Timing((one, two), together=drive_of(configuration).slew_idle == "both", leading=leading_of((one, two)))


def drive(
    configuration: Configuration,
    clock: "Clock",
    lines: "tuple[Device, ...]",
    memory: Mapping[str, object],
    remember: "Remember",
) -> "tuple[TC410, Configuration]":
    """Make the drive, not yet connected; keys that nobody has given are read from the unit's own registers.

    Raises
    ------
    ConfigurationError, DriveError, TransportError
        The unit contradicts itself or the configuration; nothing answers.
    """
    from mounts.deadman import DeadMan  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.tc410.dead_man_frames import safe_frames  # noqa: PLC0415 - likewise
    from mounts.tc410.drive import TC410  # noqa: PLC0415 - likewise
    from mounts.tc410.unit import Unit  # noqa: PLC0415 - likewise
    from transports.modbus_ascii import ModbusAscii  # noqa: PLC0415 - likewise

    opened = opening(configuration, clock, lines)
    if lines:
        guardian: Guardian = NobodyBeside()
        modbus = ModbusAscii(opened, clock)
    else:
        guardian = dead_man = DeadMan(
            configuration.drive.link,
            safe_frames(),
            program="clockdrive.dead_man",
            silence_s=_SILENCE_S,
            log=configuration.state_directory / DEAD_MAN_LOG,
        )
        modbus = ModbusAscii(dead_man.sharing(opened), clock)
        configuration = _completed(configuration, Unit(modbus))
    return TC410(modbus, settings(configuration), memory, remember, guardian), configuration


def _completed(configuration: Configuration, unit: "Unit") -> Configuration:
    """Take from the unit what nobody has configured; its link is closed where that fails."""
    from mounts.tc410.startup import identify  # noqa: PLC0415 - as in `drive`

    with ExitStack() as failed:
        failed.callback(unit.close)
        if configuration.left_to_the_unit():
            identify(unit)
            configuration = completed_from(configuration, unit)
        if configuration.origins["site.latitude_deg"] == "default":
            text = "[site] latitude_deg and longitude_deg are neither in the file nor in the unit: give both"
            raise ConfigurationError(configuration.source, [text])
        failed.pop_all()
    return configuration


def simulated(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> "SimulatedTC410":
    """A simulated TC410, as it was left or new at its park position."""
    from clockdrive.drives.tc410.simulator import tc410  # noqa: PLC0415 - only where one is used

    return tc410(configuration, time, snapshot)


def memory_at_park(configuration: Configuration, time: float) -> dict[str, object]:
    """What the driver of a simulator never used before remembers: it is synchronised, at park."""
    return {"unsynchronised": "", "position": [float(counts) for counts in park_counts(configuration)], "time": time}


def by_hand(at_rest: "AtRest") -> "Tc410ByHand":
    """The drive in a person's hands."""
    from clockdrive.drives.tc410.by_hand import Tc410ByHand  # noqa: PLC0415 - only where somebody takes it

    return Tc410ByHand(at_rest)
