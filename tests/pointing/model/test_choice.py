"""Terms are chosen as the telescope has them, and no more than a run carries."""

import math
from itertools import product

import numpy as np
import pytest
from simulated_runs import MOUNTS, TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model import choice
from pointing.model.choice import choose_terms
from pointing.model.cross_validation import CrossValidation, cv_sky_rms_arcsec
from pointing.model.fit import fit
from pointing.model.polar_alignment import TILTS
from pointing.model.sky_blocks import largest, sky_blocks

TWENTY = {  # of which a run of six terms needs six
    "fork": "IH ID CH NP MA ME TF TX FO HF DCES DCEC X2HC HXSH2 HDSH HDSH2 HDCH2 HHSH2 HDSD2 HXCH",
    "altazimuth": "IA IE CA NPAE AN AW TF TX ACES ACEC ECES HESA HECA HESA2 HECA2 HASA2 HACA2 HSSA HSCA HESE2",
}


def six_terms(mount, seed, n, **others):
    """A run of a telescope with six terms, and what they are: one of the seven is absent, never an index error."""
    rng = np.random.default_rng([seed, n])
    absent = list(TRUTH[mount])[2 + rng.integers(5)]
    true = {name: value for name, value in TRUTH[mount].items() if name != absent}
    return simulated_run(mount, -35.0 if seed % 2 else 40.0, true, n, rng, **others), true


@pytest.mark.parametrize("n", [40, 150])
def test_the_six_terms_of_a_telescope_are_chosen_with_both_tilts_and_seldom_one_more(n):
    exact = []
    for mount, seed in product(MOUNTS, range(5000, 5004)):
        simulated, true = six_terms(mount, seed, n)
        chosen = set(choose_terms(simulated.run).terms.split())
        told = fit(simulated.run, " ".join(true))
        tilts = set(TILTS["altazimuth" if mount == "altazimuth" else "equatorial"])
        assert not tilts & set(true) or len(tilts & chosen) == 2
        missing, more = set(true) - chosen, chosen - set(true) - tilts  # where one is absent it comes with the other
        assert all(abs(told[name].arcsec) < 3.0 * told[name].sigma_arcsec for name in missing), (mount, seed, missing)
        assert len(more) <= 1
        exact.append(not more and not missing)
        print(
            f"{mount}, {n} stars, seed {seed}: {' '.join(more) or 'none'} more, {' '.join(missing) or 'none'} missing"
        )
    assert sum(exact) >= 0.75 * len(exact)


@pytest.mark.parametrize("mount", TWENTY)
def test_twenty_terms_for_thirty_stars_are_caught_by_the_patches_left_out(mount):
    simulated, true = six_terms(mount, 5001, 30)
    chosen = choose_terms(simulated.run)
    over = fit(simulated.run, TWENTY[mount])
    cv = cv_sky_rms_arcsec(simulated.run, TWENTY[mount])
    print(
        f"{mount}: 20 terms {over.sky_rms_arcsec:.2f}″ in the sample, {cv:.2f}″ left out; "
        f"{chosen.terms}: {chosen.fit.sky_rms_arcsec:.2f}″, {chosen.cv_sky_rms_arcsec:.2f}″"
    )
    assert over.sky_rms_arcsec < chosen.fit.sky_rms_arcsec
    assert cv > 1.5 * chosen.cv_sky_rms_arcsec
    assert chosen.cv_sky_rms_arcsec < 1.5 * cv_sky_rms_arcsec(simulated.run, " ".join(true))


def test_noise_alone_asks_for_no_term_beyond_the_index_errors():
    rng = np.random.default_rng(5000)
    run = simulated_run("fork", 40.0, {"IH": 40.0, "ID": -30.0}, 100, rng).run
    assert choose_terms(run).terms == "IH ID"


def test_collimation_and_non_perpendicularity_are_found_where_only_both_together_help():
    true = {"IH": 100.0, "ID": 50.0, "CH": 200.0, "NP": -200.0}
    rng = np.random.default_rng(5007)
    chosen = choose_terms(simulated_run("fork", 40.0, true, 30, rng, noise_arcsec=2.0, lowest_deg=40.0).run)
    assert {"CH", "NP"} <= set(chosen.terms.split())


def test_stars_that_do_not_belong_do_not_choose_terms():
    simulated, true = six_terms("german", 5003, 100, outliers=0.05)
    chosen = choose_terms(simulated.run, outliers=True)
    print(chosen, [each.reason for each in chosen.fit.outliers])
    assert set(true) <= set(chosen.terms.split())
    np.testing.assert_array_equal(chosen.fit.run.kept, ~simulated.outlier)


def test_what_is_said_of_a_step_is_what_separate_fits_give():
    simulated, _ = six_terms("altazimuth", 5002, 60)
    chosen = choose_terms(simulated.run)
    so_far, bic = [], math.nan
    for step in chosen.path:
        if step.action not in ("begun with", "taken"):
            break
        so_far += step.term.split()
        result = fit(simulated.run, " ".join(so_far))
        components = 2 * result.n
        before, bic = bic, components * math.log(result.square / components) + result.k * math.log(components)
        assert step.sky_rms_arcsec == pytest.approx(result.sky_rms_arcsec, rel=1e-3)
        if not math.isnan(before):
            assert step.delta_bic == pytest.approx(bic - before, abs=0.5)  # linear where the step was judged
        assert step.cv_sky_rms_arcsec == pytest.approx(by_hand(simulated.run, " ".join(so_far)), rel=2e-3)
    assert len(so_far) > 4


def by_hand(run, names):
    """Sky RMS of patches predicted by rigorous fits of all others."""
    label = sky_blocks(run, 8)
    square = 0.0
    for patch in range(label.max() + 1):
        model = fit(run.subset(label != patch), names).model
        there = run.subset(label == patch)
        lon, lat = model.star(there.axis1, there.axis2)
        cosine = np.sin(lat) * np.sin(there.star2) + np.cos(lat) * np.cos(there.star2) * np.cos(lon - there.star1)
        square += float(np.sum(np.degrees(np.arccos(np.minimum(cosine, 1.0))) ** 2))
    return math.sqrt(square / len(run)) * 3600.0


def test_every_candidate_is_taken_or_left_with_a_reason():
    simulated, _ = six_terms("fork", 5000, 60)
    chosen = choose_terms(simulated.run, "CH NP MA ME TF HCEC DAF FO HDCH")
    told = {name for step in (*chosen.path, *chosen.left) for name in step.term.split()}
    assert told == {"IH", "ID", "CH", "NP", "MA", "ME", "TF", "HCEC", "DAF", "FO", "HDCH"}
    assert all(step.why for step in (*chosen.path, *chosen.left))
    html = chosen._repr_html_()
    assert all(step.why.replace("″", "") in html.replace("″", "") for step in chosen.left if "'" not in step.why)
    assert "of patches left out" in repr(chosen)


def test_what_is_left_needs_no_fit_of_its_own(monkeypatch):
    simulated, _ = six_terms("fork", 5000, 60)
    fits = []

    def counted(run, model, **options):
        fits.append(model)
        return fit(run, model, **options)

    monkeypatch.setattr(choice, "fit", counted)
    chosen = choose_terms(simulated.run, "CH NP MA ME TF DCES DCEC HDCH HXCH2")
    print(f"{len(fits)} fits for {len(chosen.path)} steps, {len(chosen.left)} candidates left")
    assert len(chosen.left) >= 4
    assert len(fits) == len(chosen.path)


def test_terms_that_are_the_same_are_never_chosen_together():
    true = {"IA": 20.0, "IE": 30.0, "TF": 60.0}
    run = simulated_run("altazimuth", 40.0, true, 80, np.random.default_rng(5005)).run
    chosen = choose_terms(run, "TF ECEC FLOP CA")
    assert len({"TF", "ECEC"} & set(chosen.terms.split())) == 1
    reasons = {step.term: step.why for step in chosen.left}
    assert "cannot be told apart" in reasons["FLOP"]
    assert "cannot be told apart" in reasons[({"TF", "ECEC"} & set(reasons)).pop()]


def test_the_choice_is_the_same_every_time():
    simulated, _ = six_terms("german", 5002, 60)
    assert choose_terms(simulated.run).path == choose_terms(simulated.run).path


def test_patches_are_whole_disjoint_and_smaller_than_what_chance_would_make():
    simulated, _ = six_terms("fork", 5001, 160)
    run = simulated.run.masked([3, 4])
    label = sky_blocks(run, 8)
    assert np.all(label[[3, 4]] == -1)
    counts = np.bincount(label[label >= 0])
    assert counts.size == 8
    assert counts.max() - counts.min() <= 1
    v = np.array((np.cos(run.star2) * np.cos(run.star1), np.cos(run.star2) * np.sin(run.star1), np.sin(run.star2)))
    extent = [np.sqrt(np.var(v[:, label == patch], axis=1).sum()) for patch in range(8)]
    assert max(extent) < 0.6 * np.sqrt(np.var(v, axis=1).sum())


def test_a_run_too_short_to_be_divided_chooses_nothing_and_says_so():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 3, np.random.default_rng(5002)).run
    chosen = choose_terms(run)
    assert chosen.terms == "IH ID"
    assert all(step.why for step in chosen.left)


def test_an_unknown_candidate_is_refused():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 30, np.random.default_rng(5002)).run
    with pytest.raises(PointingError, match="there is no pointing term 'XYZ'"):
        choose_terms(run, "CH XYZ")


def test_equations_by_patches_add_up_to_those_of_the_fit():
    simulated, _ = six_terms("fork", 5000, 60)
    result = fit(simulated.run, "IH ID CH NP MA ME TF")
    whole = CrossValidation.of(simulated.run, result.model)
    assert whole.sky_rms_arcsec(range(7)) == pytest.approx(result.sky_rms_arcsec, rel=1e-6)
    np.testing.assert_allclose(whole.whole.solution(), result.model.coefficients, rtol=1e-6)


@pytest.mark.parametrize("count", [1, 4, 8])
def test_the_largest_patch_holds_as_many_as_its_number_says(count):
    for n in range(1, 40):
        run = simulated_run("fork", 51.5, {"IH": 10.0}, n, np.random.default_rng(n), noise_arcsec=1.0).run
        assert np.bincount(sky_blocks(run, count)).max() == largest(n, count), n
