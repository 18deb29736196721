"""What a fit cannot do with what it is given is refused with the reason and the remedy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.model.terms import term


def run_of(n: int, **others) -> PointingRun:
    rng = np.random.default_rng(4)
    lon, lat = rng.uniform(-1.5, 1.5, n), rng.uniform(-0.3, 1.2, n)
    star1, star2 = PointingModel.of("equatorial", 40.0, IH=100.0, ID=-60.0).star(lon, lat)
    return PointingRun("equatorial", math.radians(40.0), star1, star2, lon, lat, **others)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_fewer_observations_than_the_terms_need_are_refused_with_how_many_it_takes(n):
    with pytest.raises(PointingError, match=f"{n} observations for 6 free terms: at least 4 are needed, and 12"):
        fit(run_of(n), "IH ID CH NP MA ME")


@pytest.mark.parametrize(
    "others", [{"kept": np.zeros(9, bool)}, {"weight": np.zeros(9)}], ids=["all masked", "all of weight zero"]
)
@pytest.mark.parametrize("how", [{}, {"robust": True}, {"outliers": True}], ids=["plain", "robust", "outliers"])
def test_a_run_with_nothing_left_in_it_is_refused(others, how):
    with pytest.raises(PointingError, match="0 observations for 2 free terms: at least 2 are needed"):
        fit(run_of(9, **others), "IH ID", **how)


@pytest.mark.parametrize("terms", ["", " , ", []])
def test_a_fit_of_no_terms_is_refused(terms):
    with pytest.raises(PointingError, match="no pointing terms are named: give some"):
        fit(run_of(9), terms)


def test_masked_observations_and_those_of_weight_zero_take_no_part():
    weight, kept = np.ones(12), np.ones(12, bool)
    weight[3], kept[5] = 0.0, False
    run = run_of(12, weight=weight, kept=kept)
    star2 = run.star2.copy()
    star2[[3, 5]] += 0.01
    spoilt = PointingRun("equatorial", run.latitude, run.star1, star2, run.axis1, run.axis2, weight=weight, kept=kept)
    found = fit(spoilt, "IH ID")
    assert found.n == 10
    assert found.model.arcsec == pytest.approx({"IH": 100.0, "ID": -60.0}, abs=1e-9)


def test_what_is_no_run_or_no_terms_is_refused_with_what_is_wanted():
    with pytest.raises(PointingError, match=r"'run\.dat' is no PointingRun: read one with read_run\(path\)"):
        fit("run.dat", "IH")
    for none in (None, 3.0):
        with pytest.raises(PointingError, match=f'{none} are no terms: give names as in "IH ID CH"'):
            fit(run_of(9), none)


def test_one_star_over_and_over_is_told_as_that():
    run = run_of(9).subset(np.arange(9) == 4)
    columns = (run.star1, run.star2, run.axis1, run.axis2)
    again = PointingRun(run.mount, run.latitude, *(np.repeat(column, 20) for column in columns))
    with pytest.raises(PointingError, match="20 observations are of 1 place: observe at least 4 places for 6 free"):
        fit(again, "IH ID CH NP MA ME")


@pytest.mark.parametrize("weight", [-1.0, math.nan, math.inf])
def test_a_weight_that_is_none_is_refused(weight):
    weights = np.ones(5)
    weights[3] = weight
    with pytest.raises(PointingError, match=f"weight {weight:g}; possible are numbers from 0"):
        run_of(5, weight=weights)


def test_an_angle_that_is_none_is_refused_with_its_place():
    angles = np.zeros(4)
    bad = np.array([0.0, 0.0, math.nan, 0.0])
    with pytest.raises(PointingError, match=r"axis2\[2\] is nan; give a finite angle"):
        PointingRun("equatorial", 0.7, angles, angles, angles, bad)


def test_a_fixed_term_that_is_not_in_the_model_is_refused():
    with pytest.raises(PointingError, match="NP is to be held fixed, but is no term of the model: IH ID CH"):
        fit(run_of(9), "IH ID CH", fixed="CH, np")
    with pytest.raises(PointingError, match="XY is to be held fixed"):
        fit(run_of(9), "IH ID CH", fixed={"xy": 3.0})


@pytest.mark.parametrize("value", [math.nan, 1e9, 1e5, -36001.0])
def test_a_fixed_coefficient_that_no_telescope_has_is_refused(value):
    with pytest.raises(PointingError, match=r"CH is to be held at .*″, .*°: possible are −10° to 10°; .* arcseconds"):
        fit(run_of(9), "IH ID CH", fixed={"ch": value})
    with pytest.raises(PointingError, match=r"IH is to be held at .*: possible are −45° to 45°"):
        fit(run_of(9), "IH ID CH", fixed={"IH": 10.0 * value})


def test_a_term_named_twice_is_refused_however_it_is_given():
    for twice in ("IH ID IH", ["IH", "ID", "ih"], [term("IH", "equatorial")] * 2):
        with pytest.raises(PointingError, match="the pointing term IH is named twice: name each once"):
            fit(run_of(9), twice)


def test_a_model_of_the_other_mount_or_of_its_terms_is_refused():
    with pytest.raises(PointingError, match="the model is for an altazimuth mount, the run is of an equatorial one"):
        fit(run_of(9), PointingModel.of("altazimuth", 40.0, IA=0.0))
    with pytest.raises(PointingError, match=r"the term CA .* is for an altazimuth mount, this is an equatorial one"):
        fit(run_of(9), "IH ID CA")
    with pytest.raises(PointingError, match="the pointing term CA is not for an equatorial mount"):
        fit(run_of(9), [term("CA", "altazimuth")])


def test_index_errors_by_pier_side_need_both_sides():
    with pytest.raises(PointingError, match="need observations on both: leave by_pier out"):
        fit(run_of(9), "IH ID", by_pier=True)


@pytest.mark.parametrize("robust", [False, True])
def test_leverages_add_up_to_the_number_of_terms_whatever_the_weights(robust):
    true = TRUTH["fork"]
    run = simulated_run("fork", 40.0, true, 30, np.random.default_rng(8)).run
    weighted = replace(run, weight=np.linspace(0.5, 8.0, 30), kept=np.arange(30) != 4)
    found = fit(weighted, " ".join(true), robust=robust)
    total = float(np.sum(found.leverage[[0, 2]]))
    print(f"{found.k} terms, leverage {total:.9f}")
    assert total == pytest.approx(found.k, abs=1e-6)  # the equations are those before the last step of the fit
    assert np.all(found.leverage[:, 4] == 0.0)


def test_a_fit_of_nothing_tells_the_scatter_about_a_given_model():
    run = run_of(9)
    model = PointingModel.of("equatorial", 40.0, IH=100.0, ID=-57.0)
    found = fit(run, model, fixed="IH ID")
    assert (found.k, found.n, found.condition) == (0, 9, 1.0)
    assert found.sky_rms_arcsec == pytest.approx(3.0, abs=1e-9)
    assert found.popn_sd_arcsec == pytest.approx(3.0, abs=1e-9)
    assert [each.sigma_arcsec for each in found.coefficients] == [0.0, 0.0]
    assert found.predicted_sigma(0.3, 0.4) == 0.0
    assert np.array_equal(found.predicted_sigma(run.axis1, run.axis2), np.zeros(9))
    assert np.array_equal(found.leverage, np.zeros((3, 9)))
    assert fit(run, model, fixed="IH ID", outliers=True).outliers == ()


def test_columns_that_were_swapped_end_in_a_sentence():
    run = run_of(20)
    with pytest.raises(PointingError, match=r"look (for|at) "):
        fit(PointingRun("equatorial", run.latitude, run.star2, run.star1, run.axis1, run.axis2), "IH ID CH NP MA ME")


def test_as_many_terms_as_numbers_leave_no_scatter_and_say_so():
    found = fit(run_of(3), "IH ID CH MA")
    assert found.popn_sd_arcsec == math.inf
    assert fit(run_of(2), "IH ID").sky_rms_arcsec < 1e-6
