"""A header is right or there is none."""

import math

import pytest
from astropy.io import fits
from astropy.time import Time
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
    assert header["PIERSIDE"] in {"EAST", "WEST"}
    fits.PrimaryHDU(header=header).verify("exception")


def test_a_telescope_that_does_not_know_where_it_points_writes_none(tmp_path):
    with telescope(tmp_path) as scope:
        scope.simulator.power_cycle()
        scope.wait(5.0)
        with pytest.raises(Refused, match="no header: the position is not synchronised"):
            cards(scope.status().json, scope.configuration)
