"""The residual table says where on the sky a star was, on either side of the pier, and what became of it."""

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.table import QTable
from simulated_runs import TRUTH, simulated_run

from pointing.model.fit import fit
from pointing.model.residual_table import residual_table, write_residuals
from pointing.model.run import PointingRun

ARCSEC = np.radians(1.0 / 3600.0)
DIRECTIONS = {"fork": ("west", "north"), "german": ("west", "north"), "altazimuth": ("right", "up")}


def displaced(mount, across_arcsec, up_arcsec):
    """A perfect telescope whose stars are all displaced on the sky, and its fit of nothing."""
    clean = simulated_run(mount, 40.0, {}, 40, np.random.default_rng(2), noise_arcsec=0.0).run
    star1 = clean.star1 + across_arcsec * ARCSEC / np.cos(clean.star2)
    run = PointingRun(clean.mount, clean.latitude, star1, clean.star2 + up_arcsec * ARCSEC, clean.axis1, clean.axis2)
    index = ("IA", "IE") if mount == "altazimuth" else ("IH", "ID")
    return fit(run, " ".join(index), fixed=dict.fromkeys(index, 0.0))


@pytest.mark.parametrize("mount", DIRECTIONS)
def test_a_star_to_the_west_and_north_is_said_to_be_there_on_either_side_of_the_pier(mount):
    table = residual_table(displaced(mount, 5.0, 3.0))
    across, up = DIRECTIONS[mount]
    assert np.allclose(table[across].to_value("arcsec"), 5.0, atol=0.01)
    assert np.allclose(table[up].to_value("arcsec"), 3.0, atol=0.01)
    assert np.allclose(table["distance"].to_value("arcsec"), np.hypot(5.0, 3.0), atol=0.01)
    side = np.where(table["posture"] == "beyond", -1.0, 1.0)
    assert np.allclose(table["dx"].to_value("arcsec"), 5.0 * side, atol=0.01)
    assert len(set(table["posture"])) == (2 if mount == "german" else 1)


@pytest.mark.parametrize("mount", DIRECTIONS)
def test_distances_are_those_that_astropy_finds_between_star_and_prediction(mount):
    simulated = simulated_run(mount, -35.0, TRUTH[mount], 60, np.random.default_rng(3), noise_arcsec=20.0)
    found = fit(simulated.run, " ".join(TRUTH[mount]))
    table = residual_table(found)
    lon, lat = found.model.star(found.run.axis1, found.run.axis2)
    v = np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    predicted = SkyCoord(*v, representation_type="cartesian")
    star = SkyCoord(found.run.star1, found.run.star2, unit="rad")
    apart = star.separation(SkyCoord(predicted.spherical.lon, predicted.spherical.lat))
    off = np.max(np.abs((table["distance"] - apart).to_value("arcsec")))
    print(f"{mount}: {off:.1e}″ of up to {table['distance'].max():.0f}")
    assert off < 1e-5


def test_every_observation_that_took_no_part_says_why():
    simulated = simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(4), outliers=0.04)
    weight = np.ones(60)
    good = np.flatnonzero(~simulated.outlier)
    weight[good[0]] = 0.0
    run = PointingRun(
        "equatorial", simulated.run.latitude, simulated.run.star1, simulated.run.star2,
        simulated.run.axis1, simulated.run.axis2, weight=weight, line=np.arange(60) + 10,
    ).masked([int(good[1])])  # fmt: skip
    table = residual_table(fit(run, " ".join(TRUTH["fork"]), outliers=True))
    assert table["reason"][good[0]] == "weight 0"
    assert table["reason"][good[1]] == "masked by the user"
    for i in np.flatnonzero(simulated.outlier):
        assert table["masked"][i]
        assert f"observation {i} (line {i + 10})" in table["reason"][i]
        assert table["sigmas"][i] > 4.0
    others = good[2:]
    assert not table["masked"][others].any()
    assert not any(table["reason"][others])
    assert table["sigmas"][others].max() < 5.0


def test_a_robust_fit_says_what_it_weighed_down():
    simulated = simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(5), outliers=0.04)
    table = residual_table(fit(simulated.run, " ".join(TRUTH["fork"]), robust=True))
    far = np.flatnonzero(simulated.outlier)
    assert all("weighed down to 0." in table["reason"][i] for i in far)
    assert all(table["weight"][far] < 0.3)


def test_the_distances_in_sigmas_of_a_good_run_are_spread_as_they_should_be():
    simulated = simulated_run("altazimuth", 20.0, TRUTH["altazimuth"], 1000, np.random.default_rng(6))
    t = residual_table(fit(simulated.run, " ".join(TRUTH["altazimuth"])))["sigmas"]
    print(f"mean square {np.mean(t**2):.3f} of two components, {np.mean(t < np.sqrt(2.0 * np.log(2.0))):.3f} within")
    assert np.mean(t**2) == pytest.approx(2.0, abs=0.2)  # χ² of two; 3 σ of its mean
    assert np.mean(t < np.sqrt(2.0 * np.log(2.0))) == pytest.approx(0.5, abs=0.05)


def test_the_file_reads_back_with_units_and_statistics(tmp_path):
    found = displaced("german", 5.0, 3.0)
    path = tmp_path / "residuals.ecsv"
    write_residuals(found, path)
    read = QTable.read(path, format="ascii.ecsv")
    assert read["west"].unit == u.arcsec
    assert read["telescope_declination"].unit == u.deg
    assert np.allclose(read["dx"].value, residual_table(found)["dx"].value)
    assert read.meta["n"] == 40
    assert read.meta["coefficients_arcsec"] == {"IH": 0.0, "ID": 0.0}
    assert read.meta["sky_rms_arcsec"] == pytest.approx(np.hypot(5.0, 3.0), abs=0.01)
