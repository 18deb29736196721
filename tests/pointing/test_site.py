"""Sites and weather: the standard atmosphere, astropy's types, refusals."""

import math
import random

import erfa
import pytest

from pointing.errors import PointingError
from pointing.site import Site, Weather


@pytest.mark.parametrize(
    ("height_m", "pressure_hpa", "temperature_c"),
    [(0, 1013.25, 15.0), (1000, 898.76, 8.5), (4200, 600.5, -12.3), (11000, 226.32, -56.5), (15000, 120.45, -56.5)],
)
def test_standard_weather_is_the_isa_table(height_m, pressure_hpa, temperature_c):
    weather = Weather.standard(height_m)
    assert weather.pressure_hpa == pytest.approx(pressure_hpa, rel=3e-4)
    assert weather.temperature_c == pytest.approx(temperature_c)
    assert weather.relative_humidity == 0.5


def test_refraction_constants_are_erfas_or_nothing():
    assert Weather().refraction_constants() == erfa.refco(1013.25, 15.0, 0.5, 0.55)
    assert Weather(refraction=False).refraction_constants() == (0.0, 0.0)


def test_astropys_earth_location_goes_both_ways():
    rng = random.Random(6)  # noqa: S311 - nothing secret
    for _ in range(20):
        site = Site.from_degrees(rng.uniform(-90, 90), rng.uniform(-180, 180), rng.uniform(0, 5000))
        again = Site.from_earth_location(site.earth_location(), site.weather, "there")
        assert again.latitude == pytest.approx(site.latitude, abs=1e-14)
        assert math.sin(again.longitude - site.longitude) == pytest.approx(0.0, abs=1e-14)
        assert again.height_m == pytest.approx(site.height_m, abs=1e-7)
        assert again.name == "there"


@pytest.mark.parametrize(
    ("values", "name"),
    [((91, 0), "latitude"), ((-90.001, 0), "latitude"), ((math.nan, 0), "latitude"), ((0, 361), "longitude"),
     ((0, -181), "longitude"), ((0, 0, 1e6), "height_m"), ((0, 0, -1e3), "height_m")],
)  # fmt: skip
def test_an_impossible_site_is_refused(values, name):
    with pytest.raises(PointingError, match=rf"{name} is .*; possible are .*: give"):
        Site.from_degrees(*values)


@pytest.mark.parametrize(
    ("key", "value"),
    [("pressure_hpa", -1), ("pressure_hpa", 101325), ("temperature_c", 288), ("relative_humidity", 60),
     ("wavelength_um", 2e6), ("wavelength_um", 0)],
)  # fmt: skip
def test_impossible_weather_is_refused(key, value):
    with pytest.raises(PointingError, match=key):
        Weather(**{key: value})
