"""Refraction: ERFA's forward direction, its derivative, and our exact inverse."""

import math

import erfa
import numpy as np
import pytest

from pointing.refraction import refract, refract_with_rate, refraction, unrefract
from pointing.vectors import from_azimuth_altitude

CONSTANTS = [
    (1013.25, 15.0, 0.5, 0.55),
    (600.0, -12.0, 0.2, 0.8),
    (1040.0, 35.0, 1.0, 0.35),
    (1000.0, 10.0, 0.9, 300.0),
]
ALTITUDES_DEG = [*np.linspace(-89, 89.9, 180), 2.86, 2.87, 3.0, 5.0, 89.99, 89.9999, 89.99995, 90.0]


def erfas(altitude, a, b):
    """ERFA's observed altitude at a site where nothing but refraction acts."""
    astrom = np.zeros((), dtype=erfa.dt_eraASTROM)
    astrom["sphi"], astrom["refa"], astrom["refb"] = 1.0, a, b  # at the pole, declination is altitude
    _, zenith_distance, *_ = erfa.atioq(0.0, altitude, astrom)
    return math.pi / 2 - float(zenith_distance)


@pytest.mark.parametrize("weather", CONSTANTS)
def test_refracts_as_erfa_does_with_its_clamps(weather):
    a, b = erfa.refco(*weather)
    for altitude_deg in ALTITUDES_DEG:
        x, y, z = refract(from_azimuth_altitude(1.0, math.radians(altitude_deg)), a, b)
        assert math.atan2(z, math.hypot(x, y)) == pytest.approx(erfas(math.radians(altitude_deg), a, b), abs=1e-14)


@pytest.mark.parametrize("weather", CONSTANTS)
def test_the_inverse_closes_to_a_picoradian_at_every_altitude(weather):
    a, b = erfa.refco(*weather)
    for altitude_deg in ALTITUDES_DEG:
        v = from_azimuth_altitude(2.0, math.radians(altitude_deg))
        assert math.dist(unrefract(refract(v, a, b), a, b), v) < 1e-12
        assert math.dist(refract(unrefract(v, a, b), a, b), v) < 1e-12


def test_the_amount_is_what_lifts_the_star():
    a, b = erfa.refco(*CONSTANTS[0])
    assert math.degrees(refraction(math.radians(45.0), a, b)) * 3600 == pytest.approx(57.0, abs=1.5)
    assert math.degrees(refraction(math.radians(10.0), a, b)) * 3600 == pytest.approx(313, abs=8)
    assert refraction(math.pi / 2, a, b) == pytest.approx(0.0, abs=1e-15)
    assert refraction(0.3, 0.0, 0.0) == 0.0


@pytest.mark.parametrize("altitude_deg", [-20, 1, 2.8, 2.9, 5, 30, 75, 89, 89.99, 89.9999])
def test_the_rate_is_the_derivative(altitude_deg):
    a, b = erfa.refco(*CONSTANTS[0])
    altitude, h = math.radians(altitude_deg), 1e-7
    for climb in (1.0, 0.0):
        # Either straight up, or level.
        ahead, behind = (from_azimuth_altitude(1.0 + s * h * (1 - climb), altitude + s * h * climb) for s in (1, -1))
        rate = tuple((p - q) / (2 * h) for p, q in zip(ahead, behind, strict=True))
        seen, seen_rate = refract_with_rate(from_azimuth_altitude(1.0, altitude), rate, a, b)
        assert seen == refract(from_azimuth_altitude(1.0, altitude), a, b)
        measured = [(p - q) / (2 * h) for p, q in zip(refract(ahead, a, b), refract(behind, a, b), strict=True)]
        assert seen_rate == pytest.approx(measured, abs=2e-8)
