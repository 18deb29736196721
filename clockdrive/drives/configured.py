"""What a configuration means alike for kinds of drives: the line, what counts mean, where an axis is parked."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from pointing.gearing import Gearing

if TYPE_CHECKING:
    from collections.abc import Callable

    from clockdrive.configuration import Configuration
    from clockdrive.configuration_sections import AxisSection
    from transports.link import Clock, Link
    from transports.memory import Device

_DEFAULT_BAUD = 9600


def baud_of(link: str) -> int | None:
    """Bits per second of a line by its address; None for one that takes no time."""
    if link.startswith("tcp:"):
        return None
    _, _, options = link.partition("baud=")
    return int(options) if options else _DEFAULT_BAUD


def baud(configuration: "Configuration") -> int | None:
    """Bits per second of the line of the drive, or of its simulator; None for one that takes no time."""
    return configuration.simulator.baud or None if configuration.simulated else baud_of(configuration.drive.link)


def opening(configuration: "Configuration", clock: "Clock", lines: "Sequence[Device]") -> "Callable[[], Link]":
    """What opens the link of a drive with one line: to the embedded simulator where that has `lines`."""
    from transports.memory import MemoryLink  # noqa: PLC0415 - a plan alone needs no drive
    from transports.open_link import open_link  # noqa: PLC0415 - likewise

    if not lines:
        return lambda: open_link(configuration.drive.link, clock)
    latency_s, speed = configuration.simulator.latency_s, baud(configuration)
    return lambda: MemoryLink(lines[0], clock, latency_s=latency_s, baud=speed)


def meaning(configuration: "Configuration", axes: Iterable[str]) -> str:
    """What must not change between a sync and the next goto, with what each axis's counts mean.

    The embedded simulator changes with it.
    """
    if configuration.simulated:
        return ""
    site = configuration.site
    return "; ".join((configuration.mount.type, f"{site.latitude_deg:.3f} {site.longitude_deg:.3f}", *axes))


def parked(gearings: Sequence[Gearing], sections: "Sequence[AxisSection]") -> tuple[int, int]:
    """The counts of both axes when parked."""
    one, two = (
        round(gearing.counts(math.radians(section.park_deg)))
        for gearing, section in zip(gearings, sections, strict=True)
    )
    return one, two
