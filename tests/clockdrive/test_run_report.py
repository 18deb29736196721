"""From kept observations to a fit and a recommendation, at any later time.

Runs are made by `simulated_runs`, whose telescope is worked out by turning unit vectors, and put into the store's
form here.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from clockdrive.fitting import Wanted
from clockdrive.run_report import TooFewStars, pointing_run, report_of, stored_of, worst
from clockdrive.run_store import PlacedStar
from clockdrive.state import Zero
from pointing.errors import PointingError
from pointing.mount import Mount, MountType
from pointing.run_plan import RunPlace

LATITUDES = (-42.4, 51.5)
KINDS = {"fork": MountType.EQUATORIAL_FORK, "german": MountType.GERMAN, "altazimuth": MountType.ALTAZ_FORK}


def kept(mount="german", n=50, latitude=-42.4, seed=3, noise=2.0, terms=None):
    """A run in the store's form, as if it had been observed here."""
    truth, rng = TRUTH[mount] if terms is None else terms, np.random.default_rng(seed)
    run = simulated_run(mount, latitude, truth, n, rng, noise_arcsec=noise).run
    stored = stored_of(run, "night", 1.8e9)
    return replace(
        stored,
        observations=tuple(
            replace(each, counts=(0.0, 0.0), in_force={"zero": vars(Zero())}) for each in stored.observations
        ),
    )


def counted_from(stored, which, zero):
    """The same run, some of whose readings were made when a sync had moved the zero points that far."""
    return replace(
        stored,
        observations=tuple(
            replace(
                each,
                axes_deg=tuple(a + by for a, by in zip(each.axes_deg, zero.moved_deg, strict=True)),
                in_force={"zero": vars(zero)},
            )
            if i in which
            else each
            for i, each in enumerate(stored.observations)
        ),
    )


def arcsec(report):
    return {each.name: each.arcsec for each in report.fit.coefficients}


@pytest.mark.parametrize("latitude", LATITUDES)
@pytest.mark.parametrize("mount", list(KINDS))
def test_the_fit_of_a_kept_run_is_the_telescope(mount, latitude):
    report = report_of(kept(mount, latitude=latitude))
    off = {name: found - TRUTH[mount].get(name, 0.0) for name, found in arcsec(report).items()}
    sigma = {each.name: each.sigma_arcsec for each in report.fit.coefficients}
    print(f"{mount} at {latitude}°: {', '.join(f'{name} {by:+.2f}″' for name, by in off.items())}")
    assert all(abs(by) < 4.0 * sigma[name] for name, by in off.items() if name in TRUTH[mount])
    assert report.fit.sky_rms_arcsec < report.cross_validation_arcsec < 1.5 * report.fit.sky_rms_arcsec
    assert report.before_arcsec > 20.0 * report.fit.sky_rms_arcsec


def test_stars_from_before_a_sync_count_from_todays_zero_points():
    """The sync moved the readings by 0.3° and −0.2°; the fit of all is that of readings which nothing had moved."""
    stored = kept()
    moved = Zero(0, (0.3, -0.2))
    undisturbed = report_of(stored)
    later = counted_from(stored, range(20, 50), moved)
    back_then = report_of(later, zero=Zero())
    assert arcsec(back_then) == pytest.approx(arcsec(undisturbed), abs=1e-6)
    today = report_of(later, zero=moved)
    without = report_of(later)  # nobody says what today is: that of the last star
    expected = {**arcsec(undisturbed)}
    expected["IH"] -= 0.3 * 3600.0
    expected["ID"] += 0.2 * 3600.0
    print({name: f"{found - expected[name]:+.2f}″" for name, found in arcsec(today).items()})
    assert arcsec(today) == pytest.approx(arcsec(without), abs=1e-9)
    assert today.fit.n == undisturbed.fit.n
    assert today.fit.sky_rms_arcsec == pytest.approx(undisturbed.fit.sky_rms_arcsec, abs=1e-3)
    assert arcsec(today) == pytest.approx(expected, abs=1e-2)


def test_stars_from_before_the_position_was_lost_take_no_part_and_that_is_said():
    stored = counted_from(kept(), range(20, 50), Zero(1, (0.0, 0.0)))
    report = report_of(stored, zero=Zero(1))
    assert report.fit.run.kept[:20].sum() == 0
    assert report.fit.run.kept[20:].sum() >= 29
    assert any("left out: 20 stars, seen before the position was lost" in each for each in report.recommendation)


def test_a_position_that_was_lost_since_asks_for_a_sync_with_the_model_in_force():
    report = report_of(kept(), zero=Zero(2))
    assert report.fit.n >= 48
    assert any("put its model in force, then `sync` on a star" in each for each in report.recommendation)


def test_the_model_comes_on_top_of_the_mount_registers_that_are_in_force():
    """Registers that hold the whole tilt leave nothing of it to the model."""
    x, y = (math.radians(each / 3600.0) for each in (-180.0, 95.0))  # MA = −X, ME = −Y
    found = arcsec(report_of(kept(), (x, y), Wanted("IH ID CH NP MA ME TF")))
    print({name: f"{value:+.2f}″" for name, value in found.items()})
    assert abs(found["MA"]) < 3.0
    assert abs(found["ME"]) < 3.0
    assert found["CH"] == pytest.approx(TRUTH["german"]["CH"], abs=3.0)


def test_a_run_of_few_stars_is_fitted_by_the_usual_terms_and_says_that_it_is_short():
    report = report_of(kept(n=9))
    assert list(arcsec(report)) == ["IH", "ID", "CH", "NP", "MA", "ME", "TF"]
    assert "9 stars tell little apart: append 11 or more" in report.recommendation


def test_too_few_stars_are_not_fitted_and_the_masked_do_not_count():
    stored = kept(n=8)
    masked = tuple(replace(each, masked="a gust") if i < 3 else each for i, each in enumerate(stored.observations))
    with pytest.raises(TooFewStars, match=r"the run night has 5 stars to fit, 0 places skipped; a fit"):
        report_of(replace(stored, observations=masked))
    with pytest.raises(TooFewStars, match="has 0 stars"):
        report_of(replace(stored, observations=()))


@pytest.mark.parametrize(
    ("terms", "fixed", "needed"),
    [
        ("IH ID", {}, 4),
        ("IH ID CH", {}, 4),
        ("IH ID CH", {"CH": 0.0}, 4),
        ("", {}, 6),
        ("IH ID CH NP MA ME TF HDSH2 HDCH2", {}, 7),
    ],
)
def test_the_least_number_of_stars_follows_from_the_terms_and_lets_each_patch_be_predicted(terms, fixed, needed):
    wanted, found = Wanted(terms=terms, fixed=fixed), []
    for seed in range(5):
        with pytest.raises(TooFewStars, match=rf"{needed - 1} stars .* needs {needed}, "):
            report_of(kept(n=needed - 1, seed=seed), wanted=wanted)
        found.append(report_of(kept(n=needed, seed=seed), wanted=wanted).cross_validation_arcsec)
    print(f"{terms or 'usual terms'}: predicted to {min(found):.1f}″ to {max(found):.1f}″")
    assert max(found) < math.inf


def test_a_run_of_nonsense_is_refused_with_what_is_wrong():
    stored = kept(n=30)
    mixed = tuple(replace(each, azimuth_deg=(37.0 * i) % 360.0) for i, each in enumerate(stored.observations))
    with pytest.raises(PointingError):
        report_of(replace(stored, observations=mixed))


def test_a_star_that_does_not_belong_is_masked_by_the_fit_and_found_as_the_worst():
    stored = kept()
    bad = replace(stored.observations[17], altitude_deg=stored.observations[17].altitude_deg + 0.2)
    spoilt = replace(stored, observations=(*stored.observations[:17], bad, *stored.observations[18:]))
    report = report_of(spoilt)
    assert 17 in {each.index for each in report.fit.outliers}
    assert worst(report_of(spoilt, wanted=Wanted("IH ID CH NP MA ME TF")), 1) == (17,)


def test_the_recommendation_says_terms_rms_what_to_align_first_what_was_skipped_and_how_to_go_on():
    stored = kept(terms={**TRUTH["german"], "ME": -3600.0})
    skipped = (PlacedStar(1, RunPlace(0.0, 1.0, "normal"), "skipped", "a cloud", 2),)
    report = report_of(replace(stored, places=skipped))
    said = "\n".join(report.recommendation)
    print(report.text)
    assert f"{report.fit.sky_rms_arcsec:.1f}″ RMS on these {report.fit.n} stars" in said
    assert f"{report.cross_validation_arcsec:.1f}″ where none was observed" in said
    assert "the polar axis is 1.0" in said
    assert "skipped: 1 place; `pointing-run show night` says why" in said
    assert "`pointing-run fit night -o model.mod` writes the model, which `[mount] pointing_model` puts" in said
    html = report._repr_html_()
    assert "<li>" in html
    assert "polar axis is" in html
    assert report.json["recommendation"] == list(report.recommendation)
    assert report.json["run"]["skipped"][0]["reason"] == "a cloud"


@pytest.mark.parametrize("mount", list(KINDS))
def test_star_and_axes_of_the_run_are_those_of_the_observations_by_the_mount_itself(mount):
    stored = kept(mount, noise=0.0, terms={})
    run = pointing_run(stored)
    tube = Mount(KINDS[mount], math.radians(-42.4))
    for i, each in enumerate(stored.observations):
        x, y, z = tube.observed(float(run.axis1[i]), float(run.axis2[i]))
        assert math.degrees(math.atan2(y, -x)) % 360.0 == pytest.approx(each.azimuth_deg, abs=1e-7)
        assert math.degrees(math.asin(z)) == pytest.approx(each.altitude_deg, abs=1e-7)


def test_a_look_counts_by_its_own_scatter_and_that_of_any_star():
    run = simulated_run("german", -42.4, TRUTH["german"], 12, np.random.default_rng(3)).run
    stored = stored_of(run, "night", 1.8e9)
    assert pointing_run(stored).weight.tolist() == [1.0] * 12
    sigmas = [0.0, 4.0, 30.0] * 4
    unequal = tuple(replace(each, sigma_arcsec=s) for each, s in zip(stored.observations, sigmas, strict=True))
    weight = pointing_run(replace(stored, observations=unequal)).weight
    assert weight[:3] == pytest.approx([1.0, 4.0 / 20.0, 4.0 / 904.0])


def test_the_weights_of_a_file_are_those_of_the_fit():
    run = simulated_run("german", -42.4, TRUTH["german"], 12, np.random.default_rng(3)).run
    weight = np.linspace(0.1, 1.0, 12)
    kept = pointing_run(stored_of(replace(run, weight=weight), "night", 1.8e9))
    assert kept.weight == pytest.approx(weight)


def test_the_polar_axis_is_as_far_off_as_its_end_is_on_the_sky():
    """2546″ sideways and 2546″ in elevation are 1.000° on the sky, though 0.958° about the vertical."""
    report = report_of(kept(terms={**TRUTH["german"], "MA": -2546.0, "ME": 2546.0}))
    (said,) = [each for each in report.recommendation if each.startswith("the polar axis")]
    print(said)
    assert said.startswith("the polar axis is 1.00")


def test_a_scatter_beyond_that_of_the_witness_says_what_sigmas_mean():
    runs = [kept(noise=noise) for noise in (2.0, 20.0)]
    runs = [replace(each, observations=tuple(replace(seen, sigma_arcsec=2.0) for seen in each.observations))
            for each in runs]  # fmt: skip
    worm = [[text for text in report_of(each).recommendation if "mistrust terms below 6 ±" in text] for each in runs]
    assert [len(each) for each in worm] == [0, 1]
    assert "where their witness is good to 2.0″" in worm[1][0]
