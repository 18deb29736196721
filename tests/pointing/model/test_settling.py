"""A fit settles where terms are hardly told apart, and with nothing free at all."""

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.model.design import blocks
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


@pytest.mark.parametrize("mount", list(TRUTH))
@pytest.mark.parametrize(
    ("n", "noise_arcsec"), [(12, 1.0), (12, 60.0), (100, 2.0), (100, 60.0), (1000, 20.0), (4000, 5.0)]
)
def test_a_round_more_would_change_no_coefficient_by_2e_5_arcseconds(mount, n, noise_arcsec):
    """Whatever the noise, also when what the last round left was only foretold."""
    worst = 0.0
    for seed in range(4 if n <= 1000 else 1):
        rng = np.random.default_rng([n, seed])
        run = simulated_run(mount, 40.0, TRUTH[mount], n, rng, noise_arcsec=noise_arcsec).run
        found = fit(run, " ".join(TRUTH[mount]))
        parts = [
            (block.residual.ravel(), block.design.reshape(2 * block.residual.shape[1], -1))
            for block in blocks(run, found.model)
        ]
        residual, design = (np.concatenate(part) for part in zip(*parts, strict=True))
        worst = max(worst, np.max(np.abs(np.linalg.lstsq(design, residual)[0])))
    print(f"{mount}, {n} stars, {noise_arcsec}″: {np.degrees(worst) * 3600.0:.1e}″")
    assert np.degrees(worst) * 3600.0 < 2e-5
