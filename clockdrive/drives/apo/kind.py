"""The axis controllers as the application sees them: `apo`, a line an axis, and `sdss`, all axes on one line."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, cast

from clockdrive.configuration import Configuration
from clockdrive.drives.apo.settings import call_s, gearing, number, park_degrees, sections, settings, travel
from clockdrive.drives.configured import baud, baud_of
from clockdrive.errors import ConfigurationError
from mounts.apo.settings import LEAD_S
from pointing.plan import Axis, Timing

if TYPE_CHECKING:
    from clockdrive.drives.apo.by_hand import ApoByHand
    from clockdrive.drives.by_hand import AtRest
    from clockdrive.drives.kind import Remember
    from mounts.apo.controller import AxisSelect
    from mounts.apo.drive import ApoDrive
    from mounts.apo.line import Line
    from mounts.apo.simulator import SimulatedObservatory
    from transports.link import Clock, Link
    from transports.memory import Device


def axes(configuration: Configuration) -> tuple[Axis, Axis]:
    """Both pointing axes in degrees, with the travel that the configuration allows them."""
    one, two = (
        Axis(
            section,
            gearing(configuration, section),
            *travel(configuration, section),
            units="degrees",
            fastest=math.radians(number(configuration, f"{section}.max_speed_deg_s")),
        )
        for section in ("axis1", "axis2")
    )
    return one, two


def timing(configuration: Configuration) -> Timing:
    """How the configured axes move: each as soon as it can, and with the velocity of what it meets."""
    from mounts.apo.slew_model import models_of  # noqa: PLC0415 - a telescope has its models from its drive

    wanted = settings(configuration)
    one, two, *others = models_of(wanted)
    return Timing((one, two), latency=LEAD_S, together=wanted.together, rotator=next(iter(others), None))


def drive(
    configuration: Configuration,
    clock: "Clock",
    lines: "tuple[Device, ...]",
    memory: Mapping[str, object],
    remember: "Remember",
) -> "tuple[ApoDrive, Configuration]":
    """Make the drive, not yet connected; the controllers hold no keys of the configuration."""
    from mounts.apo.axis import ControlledAxis  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.apo.controller import Controller  # noqa: PLC0415 - likewise
    from mounts.apo.drive import ApoDrive  # noqa: PLC0415 - likewise

    wanted = settings(configuration)
    shared = wanted.kind == "sdss"
    opened = _simulated_lines(configuration, clock, lines) if lines else _lines(configuration, clock)
    controllers = (
        ControlledAxis(
            Controller(
                opened[0] if shared else opened[i],
                wanted.kind,
                axis.word if shared else "",
                axis_select=cast("AxisSelect", configuration.values.get("drive.axis_select", "prefix")),
                limits_command=str(configuration.values["drive.limits_command"]),
            ),
            axis,
            wanted.kind,
        )
        for i, axis in enumerate(wanted.axes)
    )
    return ApoDrive(tuple(controllers), wanted, memory, remember), configuration


def simulated(
    configuration: Configuration, time: float, snapshot: Mapping[str, object] | None
) -> "SimulatedObservatory":
    """Simulated controllers, as they were left or new at their park positions."""
    from clockdrive.drives.apo.simulator import observatory  # noqa: PLC0415 - only where one is used

    return observatory(configuration, time, snapshot)


def memory_at_park(configuration: Configuration, time: float) -> dict[str, object]:
    """What the driver of a simulator never used before remembers: it is synchronised, at park."""
    return {"unsynchronised": "", "position": list(park_degrees(configuration)), "time": time}


def by_hand(at_rest: "AtRest") -> "ApoByHand":
    """The drive in a person's hands."""
    from clockdrive.drives.apo.by_hand import ApoByHand  # noqa: PLC0415 - only where somebody takes it

    return ApoByHand(at_rest)


def _lines(configuration: Configuration, clock: "Clock") -> "list[Line]":
    from transports.open_link import open_link  # noqa: PLC0415 - only where a link is opened

    return [_line(url, partial(open_link, url, clock), clock, configuration) for url in links(configuration)]


def links(configuration: Configuration) -> tuple[str, ...]:
    """The addresses of the lines: one an axis, or the one they share.

    Raises
    ------
    ConfigurationError
        An axis has no line of its own.
    """
    if configuration.drive.kind == "sdss":
        return (configuration.drive.link,)
    found = {section: configuration.values[f"{section}.link"] for section in sections(configuration)}
    if problems := [
        f"{section}.link: give it, each axis has a line of its own" for section in found if not found[section]
    ]:
        raise ConfigurationError(configuration.source, problems)
    return tuple(map(str, found.values()))


def _line(url: str, opening: "Callable[[], Link]", clock: "Clock", configuration: Configuration) -> "Line":
    return _patient(opening, clock, baud_of(url), configuration)


def _simulated_lines(configuration: Configuration, clock: "Clock", devices: "tuple[Device, ...]") -> "list[Line]":
    from transports.memory import MemoryLink  # noqa: PLC0415 - only where one is used

    latency, speed = configuration.simulator.latency_s, baud(configuration)
    links = [
        partial(MemoryLink, device, clock, latency_s=latency, baud=speed, name=f"sim:{i + 1}")
        for i, device in enumerate(devices)
    ]
    return [_patient(opening, clock, speed, configuration) for opening in links]


def _patient(
    opening: "Callable[[], Link]", clock: "Clock", speed: int | None, configuration: Configuration
) -> "Line":
    from mounts.apo.line import Line  # noqa: PLC0415 - a plan alone needs none

    timeout_s = number(configuration, "drive.timeout_s")
    return Line(opening, clock, baud=speed, timeout_s=timeout_s, deadline_s=call_s(configuration))
