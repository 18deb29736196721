"""Published fits come out again: TPOINT's to its last digits, SPK's, and the joint ones of German mounts."""

import pytest
from published_fits import (
    GERMAN,
    GERMAN_TERMS,
    PUBLISHED,
    ZERO_POINTS,
    Published,
    fitted,
    run_of,
    without_the_rule,
)

from pointing.model.fit import fit
from pointing.model.model_file import read_model_file

ALL = [pytest.param(each, id=each.run) for each in PUBLISHED]
WITH_SIGMAS = [pytest.param(each, id=each.run) for each in PUBLISHED if each.sigmas]
WITH_RMS = [pytest.param(each, id=each.run) for each in PUBLISHED if each.sky_rms]
WITH_SD = [pytest.param(each, id=each.run) for each in PUBLISHED if each.popn_sd]


@pytest.mark.parametrize("published", ALL)
def test_every_coefficient_is_the_published_one(shared, published: Published):
    found = fitted(shared, published)
    off = {name: found[name].arcsec - value for name, value in published.coefficients.items()}
    print(published.run, {name: f"{value:+.4f}″" for name, value in off.items()}, f"within {published.within}″")
    assert max(map(abs, off.values())) < published.within


@pytest.mark.parametrize("published", WITH_SIGMAS)
def test_every_standard_deviation_is_the_published_one_to_half_a_percent(shared, published: Published):
    found = fitted(shared, published)
    off = {name: found[name].sigma_arcsec / value - 1.0 for name, value in published.sigmas.items()}
    print(published.run, {name: f"{100.0 * value:+.3f} %" for name, value in off.items()})
    assert max(map(abs, off.values())) < 0.005


@pytest.mark.parametrize("published", WITH_RMS)
def test_the_sky_rms_is_the_published_one(shared, published: Published):
    found = fitted(shared, published).sky_rms_arcsec
    print(published.run, f"{found:.4f}″, published {published.sky_rms}″")
    assert found == pytest.approx(published.sky_rms, abs=0.002)


@pytest.mark.parametrize("published", WITH_SD)
def test_the_population_standard_deviation_is_the_published_one(shared, published: Published):
    found = fitted(shared, published).popn_sd_arcsec
    print(published.run, f"{found:.4f}″, published {published.popn_sd}″")
    assert found == pytest.approx(published.popn_sd, abs=0.007)  # the last digit printed is worth 0.001″ or 0.01″


@pytest.mark.parametrize("name", ZERO_POINTS)
def test_zero_points_alone_leave_what_was_published(shared, name):
    terms, published = ZERO_POINTS[name]
    found = fit(run_of(shared, name), terms).popn_sd_arcsec
    print(name, f"{found:.3f}″, published {published}″")
    assert found == pytest.approx(published, abs=0.02)


@pytest.mark.parametrize("name", GERMAN)
def test_one_joint_fit_takes_both_sides_of_the_pier(shared, name):
    published, _ = GERMAN[name]
    found = fit(run_of(shared, name), GERMAN_TERMS).sky_rms_arcsec
    print(name, f"{found:.2f}″, published {published}″")
    assert found == pytest.approx(published, abs=0.5)


@pytest.mark.parametrize("name", GERMAN)
def test_without_the_rule_beyond_the_pole_the_joint_fit_fails_as_published(shared, name):
    _, published = GERMAN[name]
    found = fit(without_the_rule(run_of(shared, name)), GERMAN_TERMS).sky_rms_arcsec
    print(name, f"{found:.1f}″, published {published}″")
    assert found == pytest.approx(published, rel=0.0015)


@pytest.mark.parametrize("name", ["auxtel_2022-04", "auxtel_2020-02"])
def test_the_table_of_published_fits_is_that_of_the_model_files(shared, name):
    file = read_model_file(shared / "data" / "tpoint" / f"{name}.mod")
    published = next(each for each in PUBLISHED if each.run == name)
    assert {row.name: row.arcsec for row in file.rows} == {**published.coefficients, **published.fixed}
    assert {row.name: row.sigma_arcsec for row in file.rows if not row.fixed} == published.sigmas
    assert file.sky_rms_arcsec == published.sky_rms
