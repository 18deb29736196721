"""The periodic error of a worm, fitted from stars."""

import math

import numpy as np
import pytest

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.model.terms import worm_terms


def test_periodic_error_is_found_where_the_polar_axis_is_tilted():
    """The worm turns with the axis's reading: its phase must not feel a tilt of many worm turns' tenths."""
    chance = np.random.default_rng(5)
    teeth, tilt_arcsec = 360, 900.0
    axis1, axis2 = chance.uniform(-1.2, 1.2, 300), chance.uniform(-0.3, 1.2, 300)
    amplitude, phase = math.radians(12.0 / 3600.0), 0.7
    base = PointingModel.of("equatorial", 42.0, IH=40.0, ID=-30.0, ME=tilt_arcsec)
    star1, star2 = base.star(axis1 + amplitude * np.sin(teeth * axis1 + phase), axis2)
    noise = math.radians(0.5 / 3600.0)
    run = PointingRun(
        "equatorial",
        math.radians(42.0),
        star1 + chance.normal(0.0, noise, 300) / np.cos(star2),
        star2 + chance.normal(0.0, noise, 300),
        axis1,
        axis2,
    )
    result = fit(run, f"IH ID ME {worm_terms('H', teeth)}")
    sine, cosine = result["WHS360"], result["WHC360"]
    found = math.hypot(sine.arcsec, cosine.arcsec)
    print(f"amplitude {found:.2f}″ ± {sine.sigma_arcsec:.2f}, rms {result.sky_rms_arcsec:.2f}″")
    assert found == pytest.approx(12.0, abs=4.0 * sine.sigma_arcsec)
    assert math.atan2(cosine.arcsec, sine.arcsec) == pytest.approx(phase, abs=4.0 * sine.sigma_arcsec / 12.0)
    assert result.sky_rms_arcsec < 0.8


def test_the_harmonics_of_a_worm_are_named():
    assert worm_terms("A", 180, 2) == "WAS180 WAC180 WAS360 WAC360"
    with pytest.raises(PointingError, match="0 teeth"):
        worm_terms("A", 0)
