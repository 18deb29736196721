"""From the configuration to the parts of a telescope: sky, mount, axes, limits."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives import kind_of
from clockdrive.errors import ConfigurationError, WeatherError
from clockdrive.instruments import Instruments
from clockdrive.rotating import rotator_of
from clockdrive.surroundings import Surroundings
from pointing.errors import PointingError
from pointing.limits import Horizon, Limits
from pointing.mount import Mount, MountType
from pointing.planner import Planner
from pointing.site import Site, Weather
from pointing.sky import Sky

if TYPE_CHECKING:
    from pointing.model.pointing_model import PointingModel
    from transports.link import Clock

_MAS = math.pi / 648_000_000.0


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
    site = configuration.site
    mount = configuration.mount
    kind = MountType.from_text(mount.type)
    place = Site.from_degrees(
        site.latitude_deg, site.longitude_deg, site.height_m, weather=_weather(configuration), name=site.name
    )
    planned = Planner(
        Sky(place),
        Mount(
            kind,
            place.latitude,
            mount.mount_x_mas * _MAS,
            mount.mount_y_mas * _MAS,
            model=_model(configuration, kind, place.latitude),
        ),
        kind_of(configuration).axes(configuration),
        _limits(configuration),
        math.radians(configuration.limits.hour_angle_past_meridian_deg),
    )
    planned.rotator = rotator_of(configuration)
    return planned


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


def _weather(configuration: Configuration) -> Weather:
    air = configuration.weather
    return Weather(air.refraction, air.pressure_hpa, air.temperature_c, air.relative_humidity, air.wavelength_um)


def _limits(configuration: Configuration) -> Limits:
    limits = configuration.limits
    horizon = Horizon.level(limits.horizon_deg) if limits.horizon is None else Horizon.read(limits.horizon)
    return Limits(horizon, math.radians(limits.sun_avoidance_deg))
