"""The stepper box as the application sees it."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from clockdrive.clock import SystemClock
from clockdrive.configuration import Configuration
from clockdrive.drives.avr_box.figures import AvrBoxWords
from clockdrive.drives.avr_box.sections import axes_of
from clockdrive.drives.avr_box.settings import gearings, meaning, park_counts, settings, slew_table
from clockdrive.drives.configured import baud, opening
from pointing.plan import Axis, ShortMoves, Timing, Trims

if TYPE_CHECKING:
    from clockdrive.drives.avr_box.by_hand import AvrBoxByHand
    from clockdrive.drives.by_hand import AtRest
    from clockdrive.drives.kind import Remember
    from mounts.avr_box.drive import AvrBoxDrive
    from mounts.avr_box.simulator import SimulatedAvrBox
    from transports.link import Clock
    from transports.memory import Device


def axes(configuration: Configuration) -> tuple[Axis, Axis]:
    """Both axes in microsteps, with the travel that the configuration allows them: the box knows no limits."""
    from mounts.avr_box.following import LAGS_S, MOST_BESIDE_ARCSEC_S  # noqa: PLC0415 - by kind

    one, two = (
        Axis(
            f"axis{i + 1}",
            gearing,
            math.radians(section.min_deg),
            math.radians(section.max_deg),
            units="microsteps",
            trims=_trims(configuration) if i == 0 else None,
            short_moves=ShortMoves(math.radians(MOST_BESIDE_ARCSEC_S / 3600.0), LAGS_S[i]),
            words=AvrBoxWords(),
        )
        for i, (gearing, section) in enumerate(zip(gearings(configuration), axes_of(configuration), strict=True))
    )
    return one, two


def _trims(configuration: Configuration) -> Trims:
    """What `-`, nothing and `+` make of the tracking of axis 1."""
    from mounts.avr_box.guiding import EVERY_S, GuideRates  # noqa: PLC0415 - by kind
    from mounts.avr_box.timers import TICK_S  # noqa: PLC0415 - likewise

    wanted = settings(configuration)
    rates = GuideRates.of(wanted.own_rate, wanted.guide_counts)
    sign = wanted.signs[0]
    return Trims(sign * rates.slower, sign * rates.own, sign * rates.faster, EVERY_S, TICK_S)


def timing(configuration: Configuration) -> Timing:
    """How the configured box moves, with a crystal as it should be."""
    from mounts.avr_box.slew_table import laws  # noqa: PLC0415 - a telescope has its models from its drive

    wanted, (one, two) = settings(configuration), laws(slew_table(configuration))
    return Timing((wanted.slew_model(0, one), wanted.slew_model(1, two)), together=False)


def drive(
    configuration: Configuration,
    clock: "Clock",
    lines: "tuple[Device, ...]",
    memory: Mapping[str, object],
    remember: "Remember",
) -> "tuple[AvrBoxDrive, Configuration]":
    """Make the drive, not yet connected; the box holds no keys of the configuration.

    Its moves are timed by a clock that nobody sets: none may be sent into the one before it.
    """
    from clockdrive.clock_watch import running_time  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.avr_box.box import Box  # noqa: PLC0415 - likewise
    from mounts.avr_box.drive import AvrBoxDrive  # noqa: PLC0415 - likewise
    from mounts.steady import SteadyClock  # noqa: PLC0415 - likewise

    if isinstance(clock, SystemClock) and not lines:
        clock = SteadyClock(clock, running_time)
    box = Box(opening(configuration, clock, lines), clock, baud(configuration))
    return AvrBoxDrive(box, settings(configuration), memory, remember), configuration


def simulated(configuration: Configuration, time: float, snapshot: Mapping[str, object] | None) -> "SimulatedAvrBox":
    """A simulated box, as it was left or new at its park position."""
    from clockdrive.drives.avr_box.simulator import stepper_box  # noqa: PLC0415 - only where one is used

    return stepper_box(configuration, time, snapshot)


def memory_at_park(configuration: Configuration, time: float) -> dict[str, object]:
    """What the driver of a simulator never used before remembers: it is synchronised, at park."""
    from mounts.avr_box.memory import at_park  # noqa: PLC0415 - as in `drive`

    return at_park(park_counts(configuration), time, meaning(configuration))


def by_hand(at_rest: "AtRest") -> "AvrBoxByHand":
    """The drive in a person's hands."""
    from clockdrive.drives.avr_box.by_hand import AvrBoxByHand  # noqa: PLC0415 - only where somebody takes it

    return AvrBoxByHand(at_rest)
