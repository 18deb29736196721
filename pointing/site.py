"""Where the telescope stands and what air is above it.

Longitude is positive to the east, latitude geodetic (WGS84) and positive to the north. Impossible values are refused
where a site is made, so nothing behind has to ask again.
"""

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import erfa

from pointing.errors import PointingError

if TYPE_CHECKING:
    from astropy.coordinates import EarthLocation

_ZERO_CELSIUS_K = 273.15
_COLUMN_M_K = 287.053 / 9.80665  # the gas constant of dry air by gravity (ISO 2533)


@dataclass(frozen=True)
class Weather:
    """The air at the telescope, which refracts.

    Parameters
    ----------
    refraction : bool
        False leaves refraction out.
    pressure_hpa : float
        Station pressure, not reduced to sea level.
    temperature_c : float
        Degrees Celsius.
    relative_humidity : float
        0 to 1.
    wavelength_um : float
        Effective wavelength; above 100 µm the formula for radio holds.
    """

    refraction: bool = True
    pressure_hpa: float = 1013.25
    temperature_c: float = 15.0
    relative_humidity: float = 0.5
    wavelength_um: float = 0.55

    def __post_init__(self) -> None:
        _refuse_outside("pressure_hpa", self.pressure_hpa, 0.0, 1200.0, "give the station pressure in hPa")
        _refuse_outside("temperature_c", self.temperature_c, -100.0, 70.0, "give degrees Celsius")
        _refuse_outside("relative_humidity", self.relative_humidity, 0.0, 1.0, "give a fraction, not percent")
        _refuse_outside("wavelength_um", self.wavelength_um, 0.1, 1e6, "give micrometres")

    @classmethod
    def standard(cls, height_m: float, *, refraction: bool = True, wavelength_um: float = 0.55) -> "Weather":
        """Return the ISA atmosphere (ISO 2533) at a height, with humidity 0.5."""
        troposphere = min(max(height_m, -500.0), 11000.0)
        temperature_k = 288.15 - 0.0065 * troposphere
        pressure = 1013.25 * (temperature_k / 288.15) ** 5.255876
        pressure *= math.exp((troposphere - max(height_m, troposphere)) / 6341.62)
        return cls(refraction, pressure, temperature_k - _ZERO_CELSIUS_K, 0.5, wavelength_um)

    def as_dict(self) -> dict[str, float | bool]:
        """The fields by name, of which `Weather(**fields)` is this air again."""
        return asdict(self)

    def refraction_constants(self) -> tuple[float, float]:
        """A and B of ΔZ = A tan Z + B tan³ Z, radians, from ERFA's refco; zero without refraction."""
        if not self.refraction:
            return 0.0, 0.0
        a, b = erfa.refco(self.pressure_hpa, self.temperature_c, self.relative_humidity, self.wavelength_um)
        return float(a), float(b)

    def column_m(self) -> float:
        """Height of the air, were it as dense throughout as it is here: R T / g, whatever its layers."""
        return _COLUMN_M_K * (self.temperature_c + _ZERO_CELSIUS_K)


@dataclass(frozen=True)
class Site:
    """A place on the Earth.

    Parameters
    ----------
    latitude, longitude : float
        Geodetic, radians; north and east positive.
    height_m : float
        Above the WGS84 ellipsoid.
    weather : Weather
        The air there.
    name : str
        For people.
    """

    latitude: float
    longitude: float
    height_m: float = 0.0
    weather: Weather = field(default_factory=Weather)
    name: str = ""

    def __post_init__(self) -> None:
        _refuse_outside("latitude", math.degrees(self.latitude), -90.0, 90.0, "give degrees, north positive")
        _refuse_outside("longitude", math.degrees(self.longitude), -180.0, 360.0, "give degrees, east positive")
        _refuse_outside("height_m", self.height_m, -500.0, 50000.0, "give metres above the ellipsoid")

    @classmethod
    def from_degrees(
        cls,
        latitude_deg: float,
        longitude_deg: float,
        height_m: float = 0.0,
        weather: Weather | None = None,
        name: str = "",
    ) -> "Site":
        """Make a site from degrees; without weather, the ISA atmosphere at its height.

        Raises
        ------
        PointingError
            A value is impossible.
        """
        air = Weather.standard(height_m) if weather is None else weather
        return cls(math.radians(latitude_deg), math.radians(longitude_deg), height_m, air, name)

    @classmethod
    def from_earth_location(cls, location: "EarthLocation", weather: Weather | None = None, name: str = "") -> "Site":
        """Make a site from astropy's `EarthLocation`."""
        place = location.to_geodetic("WGS84")
        known_as = name or getattr(location.info, "name", "") or ""
        return cls.from_degrees(
            float(place.lat.deg), float(place.lon.deg), float(place.height.to_value("m")), weather, known_as
        )

    def earth_location(self) -> "EarthLocation":
        """Return the site as astropy's `EarthLocation`."""
        from astropy import units  # noqa: PLC0415 - astropy takes 0.8 s to import; only its users pay
        from astropy.coordinates import EarthLocation  # noqa: PLC0415 - as above

        return EarthLocation.from_geodetic(
            self.longitude * units.rad, self.latitude * units.rad, self.height_m * units.m
        )


def _refuse_outside(name: str, value: float, low: float, high: float, remedy: str) -> None:
    if not low <= value <= high:
        raise PointingError(f"{name} is {value:.10g}; possible are {low:g} to {high:g}: {remedy}")
