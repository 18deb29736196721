"""A header is right or there is none."""

import math

import numpy as np
import pytest
from astropy.coordinates import EarthLocation, SkyCoord
from astropy.io import fits
from astropy.time import Time
from astropy.wcs import WCS
from telescope_bench import star_at, telescope

from clockdrive.errors import Refused
from clockdrive.fits_header import cards


def test_cards_say_where_the_telescope_points_at_the_second_they_name(tmp_path):
    with telescope(tmp_path) as scope:
        target = star_at(scope, 75.0, 30.0)
        scope.goto(target)
        scope.wait(20.0)
        status = scope.status()
        header = cards(status.json, scope.configuration)
    assert header["RA"] == pytest.approx(math.degrees(target.ra) % 360.0, abs=0.5 / 3600.0)
    assert header["DEC"] == pytest.approx(math.degrees(target.dec), abs=0.5 / 3600.0)
    assert Time(header["DATE-OBS"], scale="utc").mjd == pytest.approx(header["MJD-OBS"], abs=1e-9)
    assert header["MJD-OBS"] == pytest.approx(Time(scope._session.reading.time, format="unix").mjd, abs=2e-8)
    assert header["AIRMASS"] == pytest.approx(1.0 / math.sin(math.radians(header["ALTITUDE"])), rel=0.01)
    assert header["OBJECT"] == target.name
    fits.PrimaryHDU(header=header).verify("exception")


def test_with_the_cameras_cards_astropy_finds_the_target_on_the_reference_pixel(tmp_path):
    with telescope(tmp_path) as scope:
        target = star_at(scope, 75.0, 30.0)
        scope.goto(target)
        header = cards(scope.status().json, scope.configuration)
    scale = 0.5 / 3600.0
    header.update({"CRPIX1": 512.5, "CRPIX2": 256.5, "CD1_1": -scale, "CD1_2": 0.0, "CD2_1": 0.0, "CD2_2": scale})
    image = fits.PrimaryHDU(np.zeros((512, 1024), np.uint8), header).header
    wcs = WCS(image)  # warns, and so fails, where a card needs mending
    there = SkyCoord(target.ra, target.dec, unit="rad")
    centre = wcs.pixel_to_world(511.5, 255.5)
    off = centre.separation(there).arcsec
    print(f"{off:.2f}″ between the reference pixel and the target")
    assert wcs.wcs.radesys == "ICRS"
    assert off < 1.0
    east = wcs.pixel_to_world(501.5, 255.5)
    assert centre.position_angle(east).deg == pytest.approx(90.0, abs=0.01)
    assert centre.separation(east).arcsec == pytest.approx(5.0, abs=1e-3)


def test_the_observatory_stands_where_it_was_configured(tmp_path):
    with telescope(tmp_path) as scope:
        header, site = cards(scope.status().json, scope.configuration), scope.configuration.site
    place = EarthLocation.from_geodetic(site.longitude_deg, site.latitude_deg, site.height_m)
    found = EarthLocation.from_geocentric(*(header[f"OBSGEO-{name}"] for name in "XYZ"), unit="m")
    assert [getattr(found, name).to_value("m") for name in "xyz"] == pytest.approx(
        [getattr(place, name).to_value("m") for name in "xyz"], abs=1e-3
    )
    assert header["OBSGEO-B"] == pytest.approx(site.latitude_deg, abs=1e-5)
    assert header["OBSGEO-H"] == pytest.approx(site.height_m, abs=6.0)


def test_the_parallactic_angle_is_the_direction_to_the_zenith(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto(star_at(scope, 75.0, 30.0))
        status = scope.status().json
        header, latitude = cards(status, scope.configuration), scope.configuration.site.latitude_deg
    # On the sphere of hour angles, which grow to the west, so that right ascension is their negative.
    here = SkyCoord(-status["observed"]["hour_angle_deg"], status["observed"]["declination_deg"], unit="deg")
    zenith = SkyCoord(0.0, latitude, unit="deg")
    assert header["PARANGLE"] == pytest.approx(here.position_angle(zenith).wrap_at("180d").deg, abs=1e-6)


@pytest.mark.parametrize(("mount", "side"), [("german", {"EAST", "WEST"}), ("altaz-fork", {None})])
def test_only_a_german_mount_has_a_side_of_its_pier(mount, side, tmp_path):
    with telescope(tmp_path, mount__type=mount) as scope:
        header = cards(scope.status().json, scope.configuration)
    assert header.get("PIERSIDE") in side


def test_a_telescope_that_does_not_know_where_it_points_writes_none(tmp_path):
    with telescope(tmp_path) as scope:
        scope.simulator.power_cycle()
        scope.wait(5.0)
        with pytest.raises(Refused, match="no header: the position is not synchronised"):
            cards(scope.status().json, scope.configuration)
