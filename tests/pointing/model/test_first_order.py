"""The small model's columns are what its terms do to first order, wherever a run looks."""

import math

import numpy as np
import pytest
from simulated_runs import ARCSEC, MOUNTS, TRUTH, simulated_run, star_vectors, tangents

from pointing.model.first_order import SMALL_MODEL, design
from pointing.model.run import PointingRun


@pytest.mark.parametrize("latitude_deg", [40.0, -40.0])
@pytest.mark.parametrize("mount", MOUNTS)
def test_each_column_is_the_effect_of_its_term_as_vectors_that_are_turned_have_it(mount, latitude_deg):
    """Central differences of 10″ about no error; across and along the tube, which turns over beyond the pole."""
    run = simulated_run(mount, latitude_deg, TRUTH[mount], 40, np.random.default_rng(3)).run
    lon, lat = run.mechanical_star()
    names, step = tuple(TRUTH[mount]), 10.0
    assert len(names) == SMALL_MODEL
    up, down = (
        [star_vectors(mount, run.latitude, {name: each}, lon, lat) for name in names] for each in (step, -step)
    )
    axes = np.where(run.beyond, -1.0, 1.0) * np.array(tangents(star_vectors(mount, run.latitude, {}, lon, lat)))
    effects = [np.sum((a - b) * axes, axis=1).ravel() for a, b in zip(up, down, strict=True)]
    apart = np.abs(design(run) - np.array(effects).T / (2.0 * step * ARCSEC))
    print(
        f"{mount}: " + ", ".join(f"{name} {worst:.1e}" for name, worst in zip(names, apart.max(axis=0), strict=True))
    )
    assert np.max(apart) < 1e-6


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
def test_zenith_and_pole_have_finite_columns(mount):
    latitude = math.radians(40.0)
    lat = np.array([latitude, math.pi / 2.0])
    found = design(PointingRun(mount, latitude, np.zeros(2), lat, np.zeros(2), lat))
    assert np.all(np.isfinite(found))
    assert np.max(np.abs(found)) < 1.0 + 1e-9
