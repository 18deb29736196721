"""A model that learns star after star stays with a fit of all of them, and takes no star that does not belong."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import ARCSEC, MOUNTS, TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.run import PointingRun
from pointing.model.sequential import SequentialFit

ANGLES = ("star1", "star2", "axis1", "axis2")


def a_run(mount, n, seed, *, noise_arcsec=2.0, **more):
    """A run of a telescope whose coefficients are larger by `more`, arcseconds."""
    true = {name: value + more.get(name, 0.0) for name, value in TRUTH[mount].items()}
    return simulated_run(mount, 40.0, true, n, np.random.default_rng([seed, n]), noise_arcsec=noise_arcsec).run


def joined(*runs, weight=None):
    """The observations of several runs."""
    angles = (np.concatenate([getattr(run, name) for run in runs]) for name in ANGLES)
    weight = np.concatenate([run.weight for run in runs]) if weight is None else weight
    return PointingRun(runs[0].mount, runs[0].latitude, *angles, weight=weight)


def stars(run):
    return [run.subset(np.arange(len(run)) == i) for i in range(len(run))]


def learned(current, run, **options):
    verdicts = []
    for star in stars(run):
        current, verdict = current.learned(star, **options)
        verdicts.append(verdict)
    return current, verdicts


def difference(current, batch):
    return float(np.max(np.abs(np.array(current.model.coefficients) - batch.model.coefficients))) / ARCSEC


@pytest.mark.parametrize("mount", MOUNTS)
def test_learning_star_after_star_is_a_fit_of_all_of_them(mount):
    names = " ".join(TRUTH[mount])
    first, more = a_run(mount, 200, 5000, noise_arcsec=0.05), a_run(mount, 5, 5001, noise_arcsec=0.05)
    current, _ = learned(SequentialFit.of(fit(first, names)), more)
    batch = fit(joined(first, more), names)
    moved = difference(SequentialFit.of(fit(first, names)), batch)
    print(f"{mount}: moved {moved:.4f}″, differs from the fit of all by {difference(current, batch):.1e}″")
    assert difference(current, batch) < 1e-6
    np.testing.assert_allclose(current.covariance, batch.covariance, rtol=1e-5, atol=1e-5 * np.max(batch.covariance))
    assert current.n == batch.n
    assert current.square == pytest.approx(batch.square, rel=1e-6)


@pytest.mark.parametrize("drift_arcsec", [1.0, 10.0, 100.0])
def test_larger_changes_differ_in_second_order_only(drift_arcsec):
    names, noise = " ".join(TRUTH["fork"]), 1.0
    first = a_run("fork", 60, 5002, noise_arcsec=noise)
    more = a_run("fork", 5, 5003, noise_arcsec=noise, IH=drift_arcsec, ME=drift_arcsec)
    before = SequentialFit.of(fit(first, names))
    current, _ = learned(before, more, gate=False)
    batch = fit(joined(first, more), names)
    moved, left = difference(before, batch), difference(current, batch)
    print(f"{drift_arcsec:g}″: moved {moved:.2f}″, left {left:.1e}″, {left / moved / (moved + noise):.1e} c(c + ρ)")
    assert left < 1e-4 * moved * (moved + noise)


@pytest.mark.parametrize("forgetting", [1.0, 0.97])
def test_the_unit_of_weights_is_a_matter_of_taste(forgetting):
    names = " ".join(TRUTH["fork"])
    first, more = a_run("fork", 40, 5010), a_run("fork", 5, 5011)
    heavy, heavy_more = (replace(run, weight=4.0 * run.weight) for run in (first, more))
    one, _ = learned(SequentialFit.of(fit(first, names), forgetting), more)
    other, _ = learned(SequentialFit.of(fit(heavy, names), forgetting), heavy_more)
    print(f"scatter {one.prediction.scatter / ARCSEC:.4f}″, weights 4 {other.prediction.scatter / ARCSEC:.4f}″")
    assert other.prediction.scatter == pytest.approx(one.prediction.scatter, rel=1e-9)
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-9)
    begun = SequentialFit.of(fit(heavy, names), forgetting)
    assert begun.prediction.scatter == pytest.approx(fit(heavy, names).prediction.scatter, rel=1e-12)


def test_forgetting_weighs_a_star_by_its_age():
    names, forgetting = " ".join(TRUTH["german"]), 0.97
    first, more = a_run("german", 100, 5004, noise_arcsec=0.05), a_run("german", 20, 5005, noise_arcsec=0.05)
    current, _ = learned(SequentialFit.of(fit(first, names), forgetting), more)
    weight = forgetting ** np.concatenate((np.full(100, 20.0), np.arange(19.0, -1.0, -1.0)))
    batch = fit(joined(first, more, weight=weight), names)
    assert difference(current, batch) < 1e-6
    assert current.n == pytest.approx(weight.sum(), rel=1e-12)
    assert current.square == pytest.approx(batch.square, rel=1e-5)
    np.testing.assert_allclose(current.cofactor, batch.equations.inverse, rtol=1e-4, atol=1e-7)


def test_forgetting_follows_a_tilt_that_changes():
    names = " ".join(TRUTH["fork"])
    start = fit(a_run("fork", 60, 5006), names)
    later = a_run("fork", 60, 5007, ME=20.0)
    gone, followed = (learned(SequentialFit.of(start, factor), later, gate=False)[0] for factor in (1.0, 0.93))
    true = TRUTH["fork"]["ME"] + 20.0
    errors = [each.model.arcsec["ME"] - true for each in (gone, followed)]
    print(f"after 60 stars with ME 20″ larger: off by {errors[0]:.1f}″ with forgetting 1, {errors[1]:.1f}″ with 0.93")
    assert abs(errors[1]) < 3.0 < abs(errors[0])


@pytest.mark.parametrize("mount", MOUNTS)
def test_a_star_that_does_not_belong_is_not_taken_and_told_why(mount):
    rng = np.random.default_rng(5008)
    current = SequentialFit.of(fit(a_run(mount, 60, 5008), " ".join(TRUTH[mount])))
    simulated = simulated_run(mount, 40.0, TRUTH[mount], 60, rng, outliers=0.1)
    for star, bad in zip(stars(simulated.run), simulated.outlier, strict=True):
        after, verdict = current.learned(star)
        assert verdict.taken == (not bad), verdict.why
        assert (after is current) == bad
        assert ("does not belong" in verdict.why) == bad
        current = after
    forced, verdict = current.learned(stars(simulated.run)[int(np.flatnonzero(simulated.outlier)[0])], gate=False)
    assert verdict.taken
    assert verdict.why.startswith("taken all the same")
    assert forced is not current


def test_the_gate_is_the_outlier_test_of_the_fit():
    names = " ".join(TRUTH["fork"])
    simulated = simulated_run("fork", 40.0, TRUTH["fork"], 50, np.random.default_rng(5009), outliers=0.02)
    batch = fit(simulated.run, names, outliers=True)
    (outlier,) = batch.outliers
    others = fit(simulated.run.subset(~simulated.outlier), names)
    _, verdict = SequentialFit.of(others).learned(simulated.run.subset(simulated.outlier))
    assert verdict.sigmas == pytest.approx(outlier.sigmas, rel=1e-6)
    assert verdict.probability == pytest.approx(outlier.probability, rel=1e-4)
    assert verdict.distance_arcsec == pytest.approx(outlier.distance_arcsec, rel=1e-6)


def test_fixed_terms_stay():
    names = " ".join(TRUTH["fork"])
    start = fit(a_run("fork", 60, 5010), names, fixed={"CH": 91.0, "TF": 40.0})
    current, _ = learned(SequentialFit.of(start), a_run("fork", 5, 5011, IH=3.0))
    assert current.model.arcsec["CH"] == pytest.approx(91.0, abs=1e-9)
    assert current.model.arcsec["TF"] == pytest.approx(40.0, abs=1e-9)
    assert current.k == 5
    assert current.model.arcsec["IH"] != start.model.arcsec["IH"]


def test_the_prediction_grows_surer_with_every_star():
    names = " ".join(TRUTH["altazimuth"])
    current = SequentialFit.of(fit(a_run("altazimuth", 30, 5012), names))
    before = current.cofactor
    for star in stars(a_run("altazimuth", 10, 5013)):
        current, _ = current.learned(star)
        assert np.all(np.linalg.eigvalsh(before - current.cofactor) > -1e-9)
        before = current.cofactor
    assert 0.0 < current.prediction.sigma(1.0, 0.8) < current.prediction.sigma(1.0, 0.8, observation=True)
    assert "forgetting 1" in repr(current)
    assert all(name in current._repr_html_() for name in TRUTH["altazimuth"])


def test_what_cannot_be_learned_is_refused():
    names = " ".join(TRUTH["fork"])
    run = a_run("fork", 30, 5014)
    current = SequentialFit.of(fit(run, names))
    one = run.subset(np.arange(30) == 0)
    with pytest.raises(PointingError, match="30 observations; give one at a time"):
        current.learned(run)
    with pytest.raises(PointingError, match="masked or weighs nothing"):
        current.learned(one.masked([0]))
    with pytest.raises(PointingError, match="the star is of an altazimuth one"):
        current.learned(a_run("altazimuth", 1, 5015))
    with pytest.raises(PointingError, match=r"latitude 41\.00000°, the model of 40\.00000°"):
        current.learned(replace(one, latitude=math.radians(41.0)))
    with pytest.raises(PointingError, match="forgetting 0; possible are"):
        SequentialFit.of(fit(run, names), 0.0)
