"""Over many nights: what stays, what drifts, and the next one predicted better than by the last fit."""

import math
import os
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import ARCSEC, TRUTH, simulated_run, sky_places, star_vectors

from pointing import own_term
from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.nights import fit_nights
from pointing.model.variance_components import Component, RunsModel, independent, random_walk

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
SEEDS = range(5000, 5010 if FULL else 5003)
EVERY = 1 if FULL else 3  # which of the 18 next runs are predicted
TILT = {"fork": ("MA", "ME"), "german": ("MA", "ME"), "altazimuth": ("AN", "AW")}
LATITUDE_DEG = 40.0


def names_of(mount):
    return " ".join(TRUTH[mount])


def nights_of(mount, seed, *, runs=20, n=10, index=2.0, tilt=1.0, jump=0.0):
    """Runs with their true coefficients: index and tilt walk, the index terms jump, arcseconds a run."""
    rng = np.random.default_rng([seed, runs, n])
    true = dict(TRUTH[mount])
    found = []
    for _ in range(runs):
        for name, size in [(name, index) for name in list(true)[:2]] + [(name, tilt) for name in TILT[mount]]:
            true[name] += rng.normal(0.0, size)
        here = true | {name: true[name] + rng.normal(0.0, jump) for name in list(true)[:2]}
        found.append((simulated_run(mount, LATITUDE_DEG, here, n, rng).run, here))
    return found


def blind_rms(model, mount, true, rng):
    """Sky RMS of a model's places over the sky, above 20°, to which no star contributed; arcseconds."""
    latitude = math.radians(LATITUDE_DEG)
    lon, lat = sky_places(mount, latitude, 200, rng, math.radians(20.0))
    v = star_vectors(mount, latitude, true, lon, lat)
    a, b = model.star(lon, lat)
    u = np.array((np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)))
    return float(np.sqrt(np.mean(np.sum((u - v) ** 2, axis=0)))) / ARCSEC


def compared(mount, seed, first=3, **drift):
    """Blind RMS of each next run by four ways; the second pair knows the first stars of the run."""
    runs, rng = nights_of(mount, seed, **drift), np.random.default_rng(seed)
    rows = []
    for i in range(2, len(runs), EVERY):
        run, true = runs[i]
        few = run.subset(np.arange(len(run)) < first)
        last = fit(runs[i - 1][0], names_of(mount)).model
        nights = fit_nights([each for each, _ in runs[:i]], names_of(mount))
        anew = fit(few, last, fixed=names_of(mount).split()[2:]).model
        ways = (last, nights.predict_next().model, anew, nights.predict_next(few).model)
        rows.append([blind_rms(model, mount, true, rng) for model in ways])
    return np.array(rows)


@pytest.mark.campaign
@pytest.mark.parametrize("mount", ["fork", "altazimuth"])
def test_the_next_run_is_predicted_better_than_by_the_last_fit_with_and_without_new_index_terms(mount):
    rows = {seed: compared(mount, seed) for seed in SEEDS}
    for seed, each in (*rows.items(), ("all", np.concatenate(list(rows.values())))):
        last, ours, anew, ours_too = np.median(each, axis=0)
        print(
            f"{mount}, seed {seed}, {len(each)} runs: last fit {last:.2f}″, nights {ours:.2f}″; with 3 stars of the "
            f"run: last fit with new index terms {anew:.2f}″, nights {ours_too:.2f}″"
        )
    assert ours < last  # of all seeds together
    assert ours_too < anew


def test_the_unit_of_weights_is_a_matter_of_taste():
    runs = [run for run, _ in nights_of("fork", 5000, runs=4, n=12)]
    heavy = [replace(run, weight=4.0 * run.weight) for run in runs]
    names = names_of("fork")
    one, other = fit_nights(runs, names), fit_nights(heavy, names)
    few, heavy_few = (run.subset(np.arange(12) < 3) for run in (runs[-1], heavy[-1]))
    print(f"scatter {one.scatter / ARCSEC:.4f}″, with all weights 4 {other.scatter / ARCSEC:.4f}″")
    for a, b in ((one.predict_next(), other.predict_next()), (one.predict_next(few), other.predict_next(heavy_few))):
        assert b.scatter == pytest.approx(a.scatter, rel=1e-9)
        size = np.max(np.abs(a.covariance))
        np.testing.assert_allclose(b.covariance, a.covariance, rtol=1e-3, atol=1e-4 * size)
        assert b.model.coefficients == pytest.approx(a.model.coefficients, abs=1e-3 * ARCSEC)


@pytest.mark.campaign
def test_index_terms_that_jump_are_predicted_by_all_runs_and_set_by_the_first_stars():
    rows = np.concatenate([compared("fork", seed, jump=3.0, index=1.0) for seed in SEEDS])
    last, ours, anew, ours_too = np.median(rows, axis=0)
    print(f"last fit {last:.2f}″, nights {ours:.2f}″; with 3 stars: {anew:.2f}″, {ours_too:.2f}″")
    assert ours < last
    assert ours_too < anew


@pytest.mark.campaign
@pytest.mark.parametrize("before", [5, 10])
def test_the_stated_uncertainty_of_the_next_run_is_that_of_its_coefficients(before):
    squares = []
    for seed in range(5000, 5100 if FULL else 5020):
        runs = nights_of("altazimuth", seed, runs=before + 1, jump=1.0)
        nights = fit_nights([run for run, _ in runs[:-1]], names_of("altazimuth"))
        prediction, true = nights.predict_next(), np.array(list(runs[-1][1].values())) * ARCSEC
        error = np.array(prediction.model.coefficients) - true
        squares.append(error @ np.linalg.solve(prediction.covariance, error) / len(error))
    print(f"mean z² of the coefficients of the next run after {before}: {np.mean(squares):.2f}")
    assert 0.6 < np.mean(squares) < 1.7


def test_what_drifts_and_what_stays_is_found_out():
    runs = nights_of("german", 5000, runs=30, n=20, index=6.0, tilt=4.0, jump=0.0)
    nights = fit_nights([run for run, _ in runs], names_of("german"))
    for each in nights.terms:
        print(
            f"{each.name}: drift {each.drift_arcsec:.2f}″, jump {each.jump_arcsec:.2f}″, σ {each.sigma_arcsec:.2f}″"
        )
    for name, size in {"IH": 6.0, "ID": 6.0, "MA": 4.0, "ME": 4.0}.items():
        assert 0.6 * size < math.hypot(nights[name].drift_arcsec, nights[name].jump_arcsec) < 1.6 * size
    for name in ("CH", "NP", "TF"):
        assert nights[name].drift_arcsec < 0.5
        assert nights[name].sigma_arcsec < 1.0
        assert abs(nights[name].arcsec - TRUTH["german"][name]) < 4.0 * nights[name].sigma_arcsec
    assert "30 runs" in repr(nights)
    assert all(name in nights._repr_html_() for name in TRUTH["german"])


def test_terms_held_to_stay_do_not_drift():
    runs = [run for run, _ in nights_of("fork", 5001, runs=5)]
    nights = fit_nights(runs, names_of("fork"), staying="CH NP TF MA")
    assert nights["MA"].sigma_arcsec < fit_nights(runs, names_of("fork"))["MA"].sigma_arcsec
    assert all(nights[name].stays for name in ("CH", "NP", "TF", "MA"))


def test_terms_are_given_as_to_a_fit_by_name_or_as_they_are():
    runs = [run for run, _ in nights_of("fork", 5006, runs=3, n=20)]
    sag = own_term("SAG", "D", lambda h, d: np.sin(h) ** 2 + 0.0 * d)
    nights = fit_nights(runs, [*TRUTH["fork"], sag], staying=[sag, "CH"])
    assert [each.name for each in nights.terms] == [
        each.name for each in fit(runs[0], [*TRUTH["fork"], sag]).coefficients
    ]
    assert nights["SAG"].stays
    assert abs(nights["SAG"].arcsec) < 4.0 * nights["SAG"].sigma_arcsec  # the telescope has none
    by_name = fit_nights(runs, names_of("fork"))
    assert [each.arcsec for each in fit_nights(runs, list(TRUTH["fork"])).terms] == [
        each.arcsec for each in by_name.terms
    ]


def test_without_drift_all_runs_are_one():
    runs = [run for run, _ in nights_of("fork", 5002, runs=6, n=20, index=0.0, tilt=0.0)]
    nights = fit_nights(runs, names_of("fork"), staying=names_of("fork"))
    joint = fit(joined(runs), names_of("fork"))
    for each in joint.coefficients:
        assert nights[each.name].arcsec == pytest.approx(each.arcsec, abs=1e-3)
    np.testing.assert_allclose(
        np.sqrt(np.diag(nights.predict_next().covariance)), np.sqrt(np.diag(joint.covariance)), rtol=0.05
    )


def joined(runs):
    angles = (np.concatenate([getattr(run, name) for run in runs]) for name in ("star1", "star2", "axis1", "axis2"))
    return type(runs[0])(runs[0].mount, runs[0].latitude, *angles)


def test_runs_too_short_for_a_fit_of_their_own_take_part():
    runs = nights_of("fork", 5003, runs=8, n=15)
    cut = [run if i % 2 else run.subset(np.arange(15) < 2) for i, (run, _) in enumerate(runs)]
    with pytest.raises(PointingError, match="2 observations for 7 free terms"):
        fit(cut[0], names_of("fork"))
    nights = fit_nights(cut, names_of("fork"))
    alone = fit_nights(cut[1::2], names_of("fork"))
    assert nights.n == 4 * 17
    assert nights["CH"].sigma_arcsec < alone["CH"].sigma_arcsec
    error = blind_rms(nights.of_run(0).model, "fork", runs[0][1], np.random.default_rng(5003))
    print(f"a run of 2 stars, within all others: {error:.2f}″")
    assert error < 6.0


def test_stars_that_do_not_belong_are_masked_in_every_run():
    rng = np.random.default_rng(5004)
    runs = [simulated_run("fork", LATITUDE_DEG, TRUTH["fork"], 40, rng, outliers=0.05) for _ in range(4)]
    nights = fit_nights([each.run for each in runs], names_of("fork"), outliers=True)
    assert nights.n == 4 * 38
    assert nights.scatter / ARCSEC == pytest.approx(2.0, rel=0.15)


def test_nights_that_cannot_be_fitted_together_are_refused():
    fork = [run for run, _ in nights_of("fork", 5005, runs=2)]
    other = nights_of("altazimuth", 5005, runs=2)[0][0]
    with pytest.raises(PointingError, match="1 runs; nights need two or more"):
        fit_nights(fork[:1], names_of("fork"))
    with pytest.raises(PointingError, match="run 1 is of an altazimuth mount, run 0 of an equatorial one"):
        fit_nights([fork[0], other], names_of("fork"))
    with pytest.raises(PointingError, match="TX is to stay, but is no term of the model"):
        fit_nights(fork, names_of("fork"), staying="TX")
    with pytest.raises(PointingError, match="none of the 2 runs can be fitted alone"):
        fit_nights([run.subset(np.arange(10) < 1) for run in fork], names_of("fork"))
    nights = fit_nights(fork, names_of("fork"))
    with pytest.raises(PointingError, match="run 2; there are 2, counted from 0"):
        nights.of_run(2)
    with pytest.raises(PointingError, match="the first stars of an altazimuth one"):
        nights.predict_next(other)
    with pytest.raises(KeyError, match="TX is no term of these nights"):
        nights["TX"]


def a_runs_model(rng, runs=6, k=2):
    """Whitened observations of runs whose two coefficients walk, the first jumping besides."""
    rows = np.repeat(np.arange(runs), 4)
    design = rng.normal(size=(rows.size, k))
    each_run = [np.where(rows[:, None] == np.arange(runs), design[:, term, None], 0.0) for term in range(k)]
    components = (
        Component(0, "walk", each_run[0], random_walk(runs)),
        Component(0, "jump", each_run[0], independent(runs)),
        Component(1, "walk", each_run[1], random_walk(runs)),
    )
    return RunsModel(rng.normal(size=rows.size) * 3.0, design, components)


def covariance_of(model, variances, *, mean=0.0):
    """Of observations and of the next run's coefficients, element by element; `mean` the variance of β."""
    n, k = model.design.shape
    both = np.zeros((n + k, n + k))
    for each, variance in zip(model.components, variances, strict=True):
        reach = np.zeros((n + k, len(each.between)))
        reach[:n, :-1] = each.design
        reach[n + each.term, -1] = 1.0
        both += variance * reach @ each.between @ reach.T
    wide = np.concatenate((model.design, np.eye(k)))
    both += mean * wide @ wide.T
    both[:n, :n] += np.eye(n)
    return both


def test_the_restricted_likelihood_is_that_of_contrasts_without_mean_and_its_maximum_is_found():
    rng = np.random.default_rng(5006)
    model = a_runs_model(rng)
    n, k = model.design.shape
    contrast = np.linalg.svd(model.design)[0][:, k:]  # (n, n − k), KᵀX = 0
    seen = contrast.T @ model.observations

    def likelihood(variances):
        v = contrast.T @ covariance_of(model, variances)[:n, :n] @ contrast
        return -0.5 * (np.linalg.slogdet(v)[1] + seen @ np.linalg.solve(v, seen))

    found = model.estimated(np.ones(3))
    best = likelihood(found.variances)
    print(f"variances {found.variances}, ln L {best:.4f}")
    for variances in rng.uniform(0.0, 3.0, (200, 3)) * np.maximum(found.variances, 0.3):
        assert likelihood(variances) <= best + 1e-4
    apart = likelihood(np.ones(3)) - best
    assert model.estimated(np.ones(3)).log_likelihood - type(found)(
        model, np.ones(3)
    ).log_likelihood == pytest.approx(-apart, abs=1e-9)


def test_the_prediction_is_the_mean_of_all_that_agrees_with_the_observations():
    model = a_runs_model(np.random.default_rng(5007))
    variances = np.array([0.7, 0.4, 1.3])
    n = len(model.observations)
    values, covariance = type(model.estimated(variances))(model, variances).coefficients(-1)
    both = covariance_of(model, variances, mean=1e6)  # a mean that may be anything
    gain = both[n:, :n] @ np.linalg.inv(both[:n, :n])
    np.testing.assert_allclose(values, gain @ model.observations, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(covariance, both[n:, n:] - gain @ both[:n, n:], rtol=1e-3, atol=1e-3)
