"""The air to refract with at a moment: measured or as configured, and always with its age.

Refraction follows pressure and temperature: at 45° altitude it changes by 0.06″ a hectopascal and 0.2″ a degree.
"""

import math
from dataclasses import dataclass, replace

from pointing.refraction import refraction
from pointing.site import Site, Weather
from pointing.sky import Sky

_ARCSEC = 180.0 / math.pi * 3600.0


@dataclass(frozen=True)
class WeatherReading:
    """A measurement that was found good.

    Parameters
    ----------
    weather : Weather
        The air; what the source does not measure is as configured.
    time : float
        When it was measured, POSIX seconds.
    origin : str
        The source, and what of it is as configured.
    """

    weather: Weather
    time: float
    origin: str

    def age_s(self, now: float) -> float:
        """Seconds since it was measured."""
        return max(0.0, now - self.time)


@dataclass(frozen=True)
class Air:
    """What to refract with at a moment.

    Parameters
    ----------
    weather : Weather
        The air.
    reading : WeatherReading or None
        Where it is from; None for the configured air.
    age_s : float or None
        Age of the reading.
    trouble : str
        Why no newer one is there: value, bound, remedy; empty when all is well.
    """

    weather: Weather
    reading: WeatherReading | None = None
    age_s: float | None = None
    trouble: str = ""

    @property
    def origin(self) -> str:
        """The air in words, with where it is from and its age."""
        air = self.weather
        if not air.refraction:
            return "switched off in [site.weather]"
        values = f"{air.pressure_hpa:.1f} hPa, {air.temperature_c:.1f} °C, humidity {air.relative_humidity:.2f}"
        if self.reading is None or self.age_s is None:
            return f"{values}, as configured"
        return f"{values}, from {self.reading.origin}, {ago(self.age_s)} old"


def effect_arcsec(site: Site, reading: WeatherReading, altitude: float) -> float:
    """How much higher a target is seen with a reading's air than with the configured, arcseconds.

    Parameters
    ----------
    site : Site
        With the configured air.
    reading : WeatherReading
        The measured air.
    altitude : float
        Observed altitude, radians.
    """
    measured, configured = (
        refraction(altitude, *air.refraction_constants()) for air in (reading.weather, site.weather)
    )
    return (measured - configured) * _ARCSEC


def sky_with(sky: Sky, weather: Weather) -> Sky:
    """The same sky with other air; the same object while the air is the same."""
    return sky if weather == sky.site.weather else Sky(replace(sky.site, weather=weather), sky.earth_orientation)


def ago(seconds: float) -> str:
    """An age in words."""
    for unit_s, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * unit_s:
            return f"{seconds / unit_s:.3g} {unit}"
    return f"{seconds:.0f} s"
