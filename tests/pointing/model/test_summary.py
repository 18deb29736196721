"""A fit tells a person its coefficients, its statistics and what to beware of."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.model.fit import fit


def fitted(mount="fork", terms=None, n=60, **options):
    noise = options.pop("noise_arcsec", 2.0)
    outliers = options.pop("bad", 0.0)
    lowest = options.pop("lowest_deg", 15.0)
    run = simulated_run(
        mount, 40.0, TRUTH[mount], n, np.random.default_rng(11),
        noise_arcsec=noise, outliers=outliers, lowest_deg=lowest,
    ).run  # fmt: skip
    return fit(run, terms or " ".join(TRUTH[mount]), **options)


def test_each_term_stands_with_value_sigma_and_what_it_is():
    found = fitted()
    text = repr(found)
    print(text)
    for each in found.coefficients:
        line = next(line for line in text.splitlines() if line.split()[0] == each.name)
        assert f"{each.arcsec:+.3f}″" in line
        assert f"{each.sigma_arcsec:.3f}″" in line
    assert "equatorial mount, 60 observations, 7 terms fitted" in text
    assert f"sky RMS {found.sky_rms_arcsec:.3f}″" in text


def test_terms_that_no_published_fit_confirms_are_marked_and_fixed_ones_too():
    found = fitted(fixed={"TF": 40.0})
    rows = {line.split()[0]: line for line in repr(found).splitlines() if line.startswith("  ")}
    assert "unconfirmed" in rows["NP"]
    assert "unconfirmed" not in rows["CH"]
    assert "fixed" in rows["TF"]
    assert any(each.startswith("NP: no published fit") for each in found.warnings)


def test_a_pair_that_is_nearly_inseparable_is_named_with_its_correlation():
    found = fitted("altazimuth", "IA IE CA NPAE AN AW", n=40, lowest_deg=60.0)
    names = [each.name for each in found.coefficients]
    told = [each for each in found.warnings if "nearly inseparable" in each]
    print("\n".join(told))
    correlation = found.correlation[names.index("IA"), names.index("CA")]
    assert abs(correlation) > 0.95
    assert any(each.startswith("IA and CA are") and f"{correlation:+.3f}" in each for each in told)


def test_a_bad_condition_is_told_and_a_good_one_is_not():
    narrow = fitted("altazimuth", "IA IE CA NPAE AN AW", n=40, lowest_deg=75.0)
    print(f"condition {narrow.condition:.0f} above 75°, {fitted('german').condition:.1f} all over, both sides")
    assert narrow.condition > 30.0
    assert any(each.startswith("condition ") for each in narrow.warnings)
    assert not any(each.startswith("condition ") for each in fitted("german").warnings)


def test_few_stars_are_told():
    assert any(each.startswith("9 observations for 7 terms") for each in fitted(n=9).warnings)
    assert not any("observations for" in each for each in fitted(n=14).warnings)


def test_each_masked_observation_is_told_with_its_reason():
    found = fitted(bad=0.05, outliers=True)
    assert len(found.outliers) == 3
    told = [line for line in repr(found).splitlines() if line.startswith("masked: ")]
    assert told == [f"masked: {each.reason}" for each in found.outliers]


def test_a_notebook_shows_the_same_as_a_table():
    found = fitted(bad=0.05, outliers=True)
    html = found._repr_html_()
    assert html.count("<tr>") == 1 + len(found.coefficients)
    assert html.count("<li>") == len(found.warnings) + len(found.outliers)
    assert "unconfirmed" in html


def test_nothing_of_a_caption_gets_into_the_markup():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 30, np.random.default_rng(1)).run
    found = fit(replace(run, caption="<b>M 1 & co"), "IH ID")
    assert "<b>" not in found._repr_html_()
    assert "&lt;b&gt;M 1 &amp; co" in found._repr_html_()


def test_a_single_observation_more_than_half_the_terms_still_has_a_text():
    found = fitted(terms="IH ID CH", n=2)
    assert f"population SD unknown ({found.n} observations for {found.k} terms), condition" in repr(found)
    assert found.popn_sd_arcsec == pytest.approx(np.inf)


@pytest.mark.parametrize(("bumped", "warned"), [(4, False), (9, True)])
def test_many_that_are_masked_are_warned_of_with_how_many_in_succession(bumped, warned):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(12)).run
    axis2 = run.axis2 + np.where((np.arange(60) >= 20) & (np.arange(60) < 20 + bumped), np.radians(0.2), 0.0)
    found = fit(replace(run, axis2=axis2), " ".join(TRUTH["fork"]), outliers=True)
    assert [each.index for each in found.outliers] == list(range(20, 20 + bumped))
    told = [each for each in found.warnings if "were masked" in each]
    print(told)
    assert bool(told) == warned
    if warned:
        assert told[0].startswith("9 of 60 observations were masked, 15% where 10% are many, up to 9 in succession")


def test_one_star_far_off_is_named_and_a_good_run_names_none():
    names = " ".join(TRUTH["fork"])
    run = simulated_run("fork", 40.0, TRUTH["fork"], 54, np.random.default_rng(11)).run
    assert not any("do not belong" in each for each in fit(run, names).warnings)
    axis2 = run.axis2.copy()
    axis2[17] += np.radians(5.0)
    spoilt = replace(run, axis2=axis2, line=np.arange(54) + 4)
    found = fit(spoilt, names)
    print(found.sky_rms_arcsec, found.warnings[0])
    assert found.warnings[0].startswith(
        "1 of 54 observations do not belong to the others: observation 17 (line 21), "
    )
    assert [each.index for each in fit(spoilt, names, outliers=True).outliers] == [17]
    assert not any("do not belong" in each for each in fit(spoilt, names, outliers=True).warnings)


def test_of_many_stars_far_off_three_are_named_with_the_count():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 200, np.random.default_rng(11)).run
    axis1 = run.axis1.copy()
    axis1[10:15] += np.radians(0.1) / np.cos(run.axis2[10:15])
    (said,) = (each for each in fit(replace(run, axis1=axis1), "IH ID CH NP MA ME TF").warnings if "belong" in each)
    print(said)
    assert said.startswith("5 of 200 observations")
    assert said.split("observation ")[1].split(", the")[0].endswith(" and 2 more")
