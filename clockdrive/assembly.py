"""From the configuration to the parts of a telescope: sky, mount, axes, limits, drive.

What this version cannot apply is refused here with a sentence, never left out silently.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.configuration_keys import DRIVEN, NO_OTHER_DRIVE
from clockdrive.errors import ConfigurationError
from clockdrive.instruments import Instruments
from clockdrive.surroundings import Surroundings
from clockdrive.tc410_assembly import completed_from, gearings, registers, settings, travel
from clockdrive.weather_sources import WeatherError
from pointing.errors import PointingError
from pointing.limits import Horizon, Limits
from pointing.mount import Mount, MountType
from pointing.plan import Axis, Timing
from pointing.planner import Planner
from pointing.site import Site, Weather
from pointing.sky import Sky

if TYPE_CHECKING:
    from mounts.drive import Drive
    from mounts.tc410.direct import Guardian
    from mounts.tc410.unit import Unit
    from pointing.model.pointing_model import PointingModel
    from transports.link import Clock
    from transports.memory import Device

_MAS = math.pi / 648_000_000.0
DEAD_MAN_LOG = "dead-man.log"
_SILENCE_S = 0.7  # more than the exchange of one register takes on a slow line, and less than a second with the stop


def planner(configuration: Configuration, instrument: str | None = None) -> Planner:
    """Everything that plans; nothing is contacted.

    Raises
    ------
    ConfigurationError, Refused
        As for `instruments`.
    """
    return instruments(configuration, instrument).planner


def instruments(configuration: Configuration, name: str | None = None) -> Instruments:
    """The planner with its pointing origins, that of one instrument in force, by default `main` or the first.

    Raises
    ------
    ConfigurationError
        The configuration asks for what this version does not do, or for a pointing model that is none of this mount.
    Refused
        There is no such instrument.
    """
    return Instruments(_along_the_tube(configuration), configuration.instruments, name)


def _along_the_tube(configuration: Configuration) -> Planner:
    refuse_what_is_not_there(configuration)
    site = configuration.site
    mount = configuration.mount
    kind = MountType.from_text(mount.type)
    place = Site.from_degrees(
        site.latitude_deg, site.longitude_deg, site.height_m, weather=_weather(configuration), name=site.name
    )
    gears = gearings(configuration)
    axes = tuple(Axis(f"axis{i + 1}", gears[i], *travel(configuration, i)) for i in (0, 1))
    return Planner(
        Sky(place),
        Mount(
            kind,
            place.latitude,
            mount.mount_x_mas * _MAS,
            mount.mount_y_mas * _MAS,
            model=_model(configuration, kind, place.latitude),
        ),
        (axes[0], axes[1]),
        _limits(configuration),
        math.radians(configuration.limits.hour_angle_past_meridian_deg),
    )


def _model(configuration: Configuration, kind: MountType, latitude: float) -> "PointingModel | None":
    path = configuration.mount.pointing_model
    if path is None:
        return None
    from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - only where one is configured

    try:
        return ModelOnFile.read(path, kind.kind, latitude)
    except PointingError as error:
        raise ConfigurationError(configuration.source, [f"mount.pointing_model: {error}"]) from error


def surroundings(configuration: Configuration, planned: Planner, clock: "Clock") -> Surroundings:
    """Make what the telescope must know of clock and air.

    Raises
    ------
    ConfigurationError
        The weather source is none.
    """
    try:
        return Surroundings(planned, clock, configuration.weather.source, Path(configuration.source).parent)
    except WeatherError as error:
        raise ConfigurationError(configuration.source, [f"site.weather.source: {error}"]) from error


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
    return Timing((one, two), together=configuration.drive.slew_idle == "both", leading=leading_of((one, two)))


def drive(
    configuration: Configuration,
    clock: "Clock",
    device: "Device | None",
    memory: Mapping[str, object],
    remember: Callable[[Mapping[str, object]], None],
) -> "tuple[Drive, Configuration]":
    """Make the drive of a configuration, not yet connected, and complete the configuration from the unit.

    Parameters
    ----------
    configuration : Configuration
        Which drive, and where. Keys that nobody has given are read from the unit's own registers.
    clock : Clock
        Stamps the link's times.
    device : Device or None
        The embedded simulator, for the link `sim:`.
    memory : Mapping
        What the drive asked to be given back.
    remember : callable
        Keeps such a memory.

    Raises
    ------
    ConfigurationError, DriveError, TransportError
        This version does not drive it; the unit contradicts itself; nothing answers.
    """
    from clockdrive.simulators import NobodyBeside  # noqa: PLC0415 - a plan alone needs no drive
    from mounts.deadman import DeadMan  # noqa: PLC0415 - likewise
    from mounts.tc410.dead_man_frames import safe_frames  # noqa: PLC0415 - likewise
    from mounts.tc410.drive import TC410  # noqa: PLC0415 - likewise
    from mounts.tc410.unit import Unit  # noqa: PLC0415 - likewise
    from transports.memory import MemoryLink  # noqa: PLC0415 - likewise
    from transports.modbus_ascii import ModbusAscii  # noqa: PLC0415 - likewise
    from transports.open_link import open_link  # noqa: PLC0415 - likewise

    refuse_what_is_not_there(configuration)
    if device is not None:
        latency, baud = configuration.simulator.latency_s, configuration.simulator.baud or None
        guardian: Guardian = NobodyBeside()
        modbus = ModbusAscii(lambda: MemoryLink(device, clock, latency_s=latency, baud=baud), clock)
    else:
        guardian = dead_man = DeadMan(
            configuration.drive.link,
            safe_frames(),
            program="clockdrive.dead_man",
            silence_s=_SILENCE_S,
            log=configuration.state_directory / DEAD_MAN_LOG,
        )
        modbus = ModbusAscii(dead_man.sharing(lambda: open_link(configuration.drive.link, clock)), clock)
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


def refuse_what_is_not_there(configuration: Configuration) -> None:
    """Refuse what this version cannot apply.

    Raises
    ------
    ConfigurationError
        All of it at once.
    """
    problems = []
    kind = configuration.drive.kind
    if kind not in DRIVEN:
        problems.append(f'[drive] kind = "{kind}": {NO_OTHER_DRIVE}; its keys are checked all the same')
    if problems:
        raise ConfigurationError(configuration.source, problems)


def _weather(configuration: Configuration) -> Weather:
    air = configuration.weather
    return Weather(air.refraction, air.pressure_hpa, air.temperature_c, air.relative_humidity, air.wavelength_um)


def _limits(configuration: Configuration) -> Limits:
    limits = configuration.limits
    horizon = Horizon.level(limits.horizon_deg) if limits.horizon is None else Horizon.read(limits.horizon)
    return Limits(horizon, math.radians(limits.sun_avoidance_deg))
