"""The fit beside another program's: the same coefficients where first order is enough, and what it costs."""

import math
import os
import subprocess
import sys
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.model.fit import fit

CHECKOUT = Path(__file__).resolve().parents[3]

# katpoint's parameter of each term, and the sign between its formula and POINTING_MATH's
PARAMETERS = {"IA": (1, -1), "IE": (7, 1), "CA": (4, 1), "NPAE": (3, -1), "AN": (5, -1), "AW": (6, 1), "TF": (8, -1)}


def test_small_coefficients_are_those_of_katpoint():
    from katpoint import PointingModel as Katpoint

    small = {name: value / 100.0 for name, value in TRUTH["altazimuth"].items()}
    run = simulated_run("altazimuth", 40.0, small, 300, np.random.default_rng(5000), noise_arcsec=0.01).run
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # about its own future way with parameters that are not fitted
        found, _ = Katpoint().fit(
            run.axis1, run.axis2, *run.offsets(), enabled_params=[number for number, _ in PARAMETERS.values()]
        )
    ours = fit(run, " ".join(PARAMETERS))
    for name, (number, sign) in PARAMETERS.items():
        theirs = sign * math.degrees(found[number - 1]) * 3600.0
        print(f"{name}: {ours[name].arcsec:.4f}″, katpoint {theirs:.4f}″")
        assert ours[name].arcsec == pytest.approx(theirs, abs=1e-3)


def test_a_fit_of_100000_stars_needs_less_than_8_mb_beyond_its_input():
    run = simulated_run("altazimuth", 40.0, TRUTH["altazimuth"], 100_000, np.random.default_rng(5001)).run
    fit(run.subset(np.arange(len(run)) < 100), " ".join(TRUTH["altazimuth"]))  # what is made once and kept
    tracemalloc.start()
    try:
        fit(run, " ".join(TRUTH["altazimuth"]))
        peak = tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()
    print(f"{peak:.1f} MB")
    assert peak <= 8.0


@pytest.mark.checkout
def test_the_promised_time_and_memory_of_a_long_fit_are_kept():
    names = ["fit_100000_stars", "fit_against_katpoint", "short_fit_against_katpoint", "memory_of_a_fit"]
    as_promised = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *names],
        cwd=CHECKOUT,
        env=as_promised,
        capture_output=True,
        text=True,
        check=False,
    )
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
