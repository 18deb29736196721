"""A place in a mount's frame: the way over the pole, and angles of axes that are wound."""

import math

import numpy as np
import pytest

from pointing.model.fit import fit
from pointing.model.own_term import own_term
from pointing.model.place import Frame
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.mount import Mount, MountType

KINDS = ("equatorial", "altazimuth")
LATITUDES_DEG = (51.5, -42.4)

kinds = pytest.mark.parametrize("kind", KINDS)
latitudes = pytest.mark.parametrize("latitude_deg", LATITUDES_DEG)


def vector(lon, lat):
    return np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))


@kinds
@latitudes
def test_run_model_and_mount_go_beyond_the_pole_alike_and_over_the_visible_one(kind, latitude_deg):
    frame = Frame(kind, math.radians(latitude_deg))
    lon, lat = np.radians([-120.0, 10.0, 75.0]), np.radians([-30.0, 20.0, 60.0])
    over = frame.beyond_the_pole(lon, lat)
    assert np.allclose(vector(*over), vector(lon, lat), atol=1e-15)
    visible = -1.0 if kind == "equatorial" and latitude_deg < 0.0 else 1.0
    assert np.all(visible * over[1] > math.pi / 2.0)
    run = PointingRun(kind, frame.latitude, lon, lat, *over)
    assert np.array_equal(run.mechanical_star(), over)
    mount = Mount(MountType.ALTAZ_FORK if kind == "altazimuth" else MountType.EQUATORIAL_FORK, frame.latitude)
    for one, two, *there in zip(lon.tolist(), lat.tolist(), *over, strict=True):
        assert frame.beyond_the_pole(one, two) == tuple(there)
        found = mount.axes(mount.observed(one, two), "beyond")
        assert math.remainder(found[0] - there[0], math.tau) == pytest.approx(0.0, abs=1e-14)
        assert found[1] == pytest.approx(there[1], abs=1e-14)


@kinds
@latitudes
@pytest.mark.parametrize("beyond", [False, True])
def test_the_own_angles_are_in_the_turn_of_the_posture_however_the_axes_are_wound(kind, latitude_deg, beyond):
    """Exact to rounding, single places as arrays, and continuous over the posture: from leap to leap of lon."""
    frame = Frame(kind, math.radians(latitude_deg))
    leap_deg = 0.0 if kind == "altazimuth" else -180.0
    places = np.meshgrid(np.arange(0.5, 360.0, 8.0) + leap_deg, np.arange(-80.0, 81.0, 20.0))
    lon, lat = (np.radians(each.ravel()) for each in places)
    if beyond:
        lon, lat = frame.beyond_the_pole(lon, lat)
    for one in range(-2, 3):
        for two in range(-2, 3):
            place = frame.place(lon + one * math.tau, lat + two * math.tau)
            assert np.max(np.abs(np.array(place.own) - (lon, lat))) < 1e-14
    for one, two, *own in zip(lon + math.tau, lat - math.tau, lon, lat, strict=True):
        assert frame.place(float(one), float(two)).own == pytest.approx(tuple(own), abs=1e-14)


@kinds
def test_azimuth_from_south_is_one_and_the_same_on_both_kinds_of_mount(kind):
    azimuth, elevation = np.radians([5.0, 90.0, 179.0, 181.0, 355.0]), np.radians([30.0, 50.0, 20.0, 60.0, 10.0])
    at = Frame("altazimuth", math.radians(51.5)).place(azimuth, elevation)
    if kind == "equatorial":
        at = Frame("equatorial", math.radians(51.5)).place(at.angle("H")[0], at.angle("D")[0])
    assert np.degrees(at.angle("A")[0]) == pytest.approx([175.0, 90.0, 1.0, -1.0, -175.0], abs=1e-10)


@pytest.mark.parametrize("latitude_deg", LATITUDES_DEG)
def test_a_german_run_with_readings_wrapped_at_half_a_turn_fits_the_powers_that_are_true(latitude_deg):
    """Each reading in the turn of TPOINT's equatorial files, −180° to 180°, as stars pass the meridian."""
    frame = Frame("equatorial", math.radians(latitude_deg))
    lon, lat = np.radians(np.meshgrid(np.arange(-80.0, 21.0, 9.7), np.arange(-35.0, 36.0, 11.3)))
    axes = tuple(each.ravel() for each in frame.beyond_the_pole(lon, lat))
    true = {"IH": 40.0, "ID": -30.0, "PXH1": 20.0, "PDD1": -15.0}
    star = PointingModel.of("equatorial", latitude_deg, **true).star(*axes)
    over = star[0] - math.pi, math.copysign(math.pi, latitude_deg) - star[1]
    wrapped = tuple(np.remainder(each + math.pi, math.tau) - math.pi for each in axes)
    found = fit(PointingRun("equatorial", frame.latitude, *over, *wrapped), " ".join(true))
    print(f"{latitude_deg}°: " + ", ".join(f"{each.name} {each.arcsec:.6f}″" for each in found.coefficients))
    for each in found.coefficients:
        assert each.arcsec == pytest.approx(true[each.name], abs=1e-6)
    own = own_term("LEVER", "X", lambda h, d: h * np.cos(d))
    straight, turned = (
        PointingModel("equatorial", frame.latitude, (own,), (1e-4,)).star(*at) for at in (axes, wrapped)
    )
    for one, other, turns in zip(straight, turned, np.subtract(wrapped, axes), strict=True):
        assert np.max(np.abs(other - one - turns)) < 1e-14
