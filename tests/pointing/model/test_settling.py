"""A fit settles where terms are hardly told apart, and with nothing free at all."""

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.model.fit import fit

SIX = "IA IE CA NPAE AN AW"


@pytest.mark.parametrize("lowest_deg", [60.0, 75.0])
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_a_fit_near_the_zenith_settles_in_its_minimum(lowest_deg, seed):
    """Six terms of condition above 100, and a flexure that none of them is for."""
    rng = np.random.default_rng(seed)
    run = simulated_run("altazimuth", 40.0, TRUTH["altazimuth"], 40, rng, lowest_deg=lowest_deg).run
    found = fit(run, SIX)
    around = [
        fit(run, SIX, fixed={name: found[name].arcsec + sign * found[name].sigma_arcsec}).square
        for name in ("CA", "NPAE")
        for sign in (-1.0, 1.0)
    ]
    print(f"from {lowest_deg}°: condition {found.condition:.0f}, sky RMS {found.sky_rms_arcsec:.3f}″")
    assert found.condition > 100.0
    assert min(around) > found.square


def test_nothing_free_leaves_the_run_as_the_fixed_terms_have_it():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1), noise_arcsec=0.0).run
    found = fit(run, " ".join(TRUTH["fork"]), fixed=TRUTH["fork"])
    assert found.k == 0
    assert found.sky_rms_arcsec < 1e-6
    assert np.all(found.predicted_sigma(run.axis1, run.axis2) == 0.0)
    assert np.all(found.leverage == 0.0)
