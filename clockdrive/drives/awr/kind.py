"""The AWR Microstep as the application sees it."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from clockdrive.clock import SystemClock
from clockdrive.clock_watch import running_time
from clockdrive.configuration import Configuration
from clockdrive.drives.awr.figures import AwrWords
from clockdrive.drives.awr.sections import axes_of, drive_of, simulator_of
from clockdrive.drives.awr.settings import FASTEST_DEG_S, gearings, meaning, park_counts, settings
from clockdrive.drives.configured import baud, opening
from clockdrive.drives.kind import DEAD_MAN_LOG
from clockdrive.drives.nobody_beside import NobodyBeside
from pointing.plan import Axis, Timing

if TYPE_CHECKING:
    from clockdrive.drives.awr.by_hand import AwrByHand
    from clockdrive.drives.by_hand import AtRest
    from clockdrive.drives.kind import Remember
    from mounts.awr.drive import AwrDrive
    from mounts.awr.simulator import SimulatedAwr
    from mounts.beside import Guardian
    from transports.link import Clock
    from transports.memory import Device

_SILENCE_S = 0.7  # of an owner between two looks
_EASY_S = 10.0  # likewise while only the drives go: 15' at most, at six times sidereal
_HASTY_S = 0.12  # likewise while a release is near: with what the release takes, less than 0.2 s


def axes(configuration: Configuration) -> tuple[Axis, Axis]:
    """Both axes in motor steps, with the travel that the configuration allows them: the unit knows no limits."""
    drive = drive_of(configuration)
    one, two = (
        Axis(
            f"axis{i + 1}",
            gearing,
            math.radians(section.min_deg),
            math.radians(section.max_deg),
            units="steps",
            fastest=math.radians(FASTEST_DEG_S),
            words=AwrWords(i, drive.sidereal_steps_per_s, drive.drive_ra_counts, drive.drive_ra_postscaler),
        )
        for i, (gearing, section) in enumerate(zip(gearings(configuration), axes_of(configuration), strict=True))
    )
    return one, two


def timing(configuration: Configuration) -> Timing:
    """How a unit as it comes moves; one that is connected has its own speeds."""
    from mounts.awr.factory import factory  # noqa: PLC0415 - a telescope has its models from its drive
    from mounts.awr.ladder import exchange_s  # noqa: PLC0415 - likewise
    from mounts.awr.slew_model import AwrSlewModel  # noqa: PLC0415 - likewise
    from mounts.awr.speeds import Speeds  # noqa: PLC0415 - likewise
    from transports.memory import BITS_PER_BYTE  # noqa: PLC0415 - likewise

    wanted = settings(configuration)
    words = factory(
        wanted.sidereal_steps_per_s,
        frequency_unit=wanted.frequency_unit,
        acceleration_unit=wanted.acceleration_unit,
        reversed1=axes_of(configuration)[0].reversed,
        rate_reference=wanted.rate_reference,
    )
    line = baud(configuration)
    apart_s = exchange_s(wanted.jitter, BITS_PER_BYTE / line if line else 0.0)
    ladder = Speeds(wanted, words, words).ladder(apart_s)
    ladder = ladder.slewing_at(ladder.careful_rates)
    return Timing((AwrSlewModel(ladder, 0), AwrSlewModel(ladder, 1)), together=False)


def drive(
    configuration: Configuration,
    clock: "Clock",
    lines: "tuple[Device, ...]",
    memory: Mapping[str, object],
    remember: "Remember",
) -> "tuple[AwrDrive, Configuration]":
    """Make the drive, not yet connected; the unit holds no keys of the configuration."""
    from mounts.awr.dead_man_frames import safe_frames  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.awr.drive import AwrDrive  # noqa: PLC0415 - likewise
    from mounts.awr.unit import Unit  # noqa: PLC0415 - likewise
    from mounts.deadman import DeadMan  # noqa: PLC0415 - likewise
    from mounts.steady import SteadyClock  # noqa: PLC0415 - likewise

    timeout_s = drive_of(configuration).timeout_s
    if lines:
        guardian: Guardian = NobodyBeside()
        opened = opening(configuration, clock, lines)
    else:
        guardian = dead_man = DeadMan(
            configuration.drive.link,
            safe_frames(timeout_s),
            program="clockdrive.dead_man",
            silence_s=_SILENCE_S,
            hasty_s=_HASTY_S,
            easy_s=_EASY_S,
            log=configuration.state_directory / DEAD_MAN_LOG,
        )
        clock = SteadyClock(clock, running_time) if isinstance(clock, SystemClock) else clock
        opened = dead_man.sharing(opening(configuration, clock, lines))
    unit = Unit(opened, clock, baud(configuration), timeout_s)
    return AwrDrive(unit, settings(configuration), memory, remember, guardian), configuration


def simulated(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> "SimulatedAwr":
    """A simulated unit, as it was left or new at its park position."""
    from clockdrive.drives.awr.simulator import microstep  # noqa: PLC0415 - only where one is used

    return microstep(configuration, time, snapshot)


def memory_at_park(configuration: Configuration, time: float) -> dict[str, object]:
    """What the driver of a simulator never used before remembers: it is synchronised, at park.

    Its keys were seen to move it as configured, where they do: who has a unit that is otherwise has not seen that.
    """
    from mounts.awr.memory import Shown, at_park  # noqa: PLC0415 - as in `drive`

    unit, drive = simulator_of(configuration), drive_of(configuration)
    alike = all(
        getattr(unit, name) == getattr(drive, name)
        for name in ("frequency_unit", "acceleration_unit", "sidereal_steps_per_s")
    )
    seen = alike and not unit.reversed1, alike and not unit.reversed2
    referenced, scaled = unit.rate_reference == drive.rate_reference, unit.postscaler == drive.postscaler
    shown = Shown(settings(configuration).assumed, seen, referenced=referenced, scaled=scaled)
    sides = -1.0 if unit.reversed1 else 1.0, -1.0 if unit.reversed2 else 1.0
    return at_park(park_counts(configuration), time, meaning(configuration), shown, sides)


def by_hand(at_rest: "AtRest") -> "AwrByHand":
    """The drive in a person's hands."""
    from clockdrive.drives.awr.by_hand import AwrByHand  # noqa: PLC0415 - only where somebody takes it

    return AwrByHand(at_rest)
