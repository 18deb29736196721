"""The error budget: each source against what its error does to the place, tried out."""

import math
from dataclasses import replace

import numpy as np
import pytest
from planning_bench import planner

from pointing.error_budget import Stated, error_budget
from pointing.instant import Instant
from pointing.limits import separation
from pointing.model.fit import fit
from pointing.model.model_on_file import ModelOnFile
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.mount import MountType
from pointing.sky import Sky
from pointing.targets import Star

ARCSEC = math.pi / 648_000.0
TIME = 1_800_000_000.0
AXES = (0.5, -0.3)
SIDEREAL = math.tau / 86164.0905
TRACKED = (AXES[0], SIDEREAL), (AXES[1], 0.0)
STATED = Stated(1.0, 1.0, "measured", 0.1, "chrony", (2.0, 3.0))
TERMS = {"IH": 12.0, "ID": -9.0, "CH": 45.0, "NP": -20.0, "MA": -60.0, "ME": 90.0, "TF": 15.0}
SIGMAS = (0.8, 0.7, 0.6, 1.1, 0.9, 1.0, 1.2)  # arcseconds


def telescope(model=None):
    subject = planner(MountType.EQUATORIAL_FORK)
    subject.mount = replace(subject.mount, model=model)
    return subject


def on_file(**changes):
    model = PointingModel.of("equatorial", -42.4, **TERMS)
    known = {"n": 39, "sky_rms": 2.9 * ARCSEC, "sigmas": tuple(sigma * ARCSEC for sigma in SIGMAS)}
    return ModelOnFile(model.kind, model.latitude, model.terms, model.coefficients, **{**known, **changes})


def source(budget, name):
    return next(each for each in budget.sources if each.name == name)


@pytest.mark.parametrize("one_sided", [False, True])
def test_the_models_share_is_the_uncertainty_of_the_fitted_place_where_the_stars_stood(one_sided):
    """On one pier side IH and CH share what they explain: as if uncorrelated, they would say six times it."""
    rng = np.random.default_rng(3)
    model = PointingModel.of("equatorial", -42.4, **TERMS)
    axis1 = rng.uniform(-1.2, -0.1 if one_sided else 1.2, 39)
    axis2 = rng.uniform(-1.2, 0.3, 39)
    star1, star2 = model.star(axis1, axis2)
    noise = rng.normal(0.0, 2.0 * ARCSEC, (2, 39))
    run = PointingRun("equatorial", model.latitude, star1 + noise[0] / np.cos(star2), star2 + noise[1], axis1, axis2)
    fitted = fit(run, " ".join(TERMS))
    truly = math.sqrt(float(np.mean(fitted.predicted_sigma(axis1, axis2) ** 2)))
    sigmas = tuple(each.sigma_arcsec * ARCSEC for each in fitted.coefficients)
    subject = telescope(on_file(n=39, sky_rms=fitted.sky_rms_arcsec * ARCSEC, sigmas=sigmas))
    stated = source(error_budget(subject, TRACKED, TIME, STATED), "pointing model").error
    print(f"stated {stated / ARCSEC:.3f}″, by the covariance of the fit {truly / ARCSEC:.3f}″")
    assert stated == pytest.approx(truly, rel=0.01)


def test_refraction_is_what_other_air_does_to_the_altitude():
    subject = telescope()
    budget = error_budget(subject, TRACKED, TIME, STATED)
    altitude = math.asin(subject.mount.observed(*AXES)[2])
    site, air = subject.sky.site, subject.sky.site.weather

    def lifted(**changes):
        return Sky(replace(site, weather=replace(air, **changes))).refraction(altitude)

    pressure = lifted(pressure_hpa=air.pressure_hpa + 1.0) - subject.sky.refraction(altitude)
    temperature = lifted(temperature_c=air.temperature_c + 1.0) - subject.sky.refraction(altitude)
    assert source(budget, "refraction").error == pytest.approx(math.hypot(pressure, temperature), rel=0.05)


def test_clock_and_earth_are_what_a_later_moment_does_to_a_star():
    subject = telescope()
    budget = error_budget(subject, TRACKED, TIME, STATED)
    frame, later = (subject.sky.at(Instant.from_posix(TIME + seconds)) for seconds in (0.0, 0.1))
    x, y, z = frame.astrometric(subject.mount.observed(*AXES))
    star = Star.from_degrees(math.degrees(math.atan2(y, x)), math.degrees(math.asin(z)))
    moved = separation(star.observed(frame), star.observed(later))
    assert source(budget, "clock").error == pytest.approx(moved, rel=0.01)  # refraction carries a little of it
    earth = frame.earth_orientation.dut1_error
    assert source(budget, "UT1").error == pytest.approx(moved * earth / 0.1, rel=0.01)
    assert earth > 0.005  # January 2027 is a prediction


def test_the_clock_matters_as_fast_as_the_target_goes_and_the_earth_no_faster_than_it_turns():
    subject = telescope()
    fast = (AXES[0], math.radians(1.0)), (AXES[1], 0.0)
    budget = error_budget(subject, fast, TIME, STATED)
    assert source(budget, "clock").error == pytest.approx(0.1 * math.radians(1.0) * math.cos(AXES[1]))
    star = error_budget(subject, TRACKED, TIME, STATED)
    assert source(budget, "UT1").error == pytest.approx(source(star, "UT1").error, rel=1e-3)
    fixed = error_budget(subject, ((AXES[0], 0.0), (AXES[1], 0.0)), TIME, STATED)
    assert source(fixed, "clock").error == source(fixed, "UT1").error == 0.0


def test_a_drive_in_degrees_rounds_nothing():
    subject = telescope()
    one, two = subject.axes
    subject.axes = replace(one, units="degrees"), replace(two, units="degrees")
    budget = error_budget(subject, TRACKED, TIME, STATED)
    assert source(budget, "counts").error == 0.0


def test_counts_and_drive_are_what_steps_of_the_axes_do_to_the_place():
    subject = telescope()
    budget = error_budget(subject, TRACKED, TIME, STATED)
    step = 1.0 / abs(subject.axes[0].gearing.counts_per_radian)
    here = subject.mount.observed(*AXES)
    one = separation(subject.mount.observed(AXES[0] + step, AXES[1]), here)
    two = separation(subject.mount.observed(AXES[0], AXES[1] + step), here)
    assert source(budget, "drive").error == pytest.approx(math.hypot(2.0 * one, 3.0 * two), rel=1e-4)
    assert source(budget, "counts").error == pytest.approx(math.hypot(one, two) / math.sqrt(12.0), rel=1e-4)


def test_the_total_is_the_root_of_the_squares_and_what_nobody_knows_is_named():
    budget = error_budget(telescope(on_file()), TRACKED, TIME, STATED)
    assert budget.unknown == ()
    assert budget.total == pytest.approx(math.sqrt(sum(each.error**2 for each in budget.sources)))
    assert source(budget, "what the model leaves").error == pytest.approx(2.9 * ARCSEC)
    blind = error_budget(telescope(), TRACKED, TIME, replace(STATED, clock_s=None))
    assert blind.unknown == ("pointing model", "clock")
    assert 0.0 < blind.total < budget.total


@pytest.mark.parametrize("changes", [{"sky_rms": 0.0}, {"n": 3}])
def test_a_file_that_does_not_say_of_its_fit_leaves_the_models_share_unknown(changes):
    budget = error_budget(telescope(on_file(**changes)), TRACKED, TIME, STATED)
    assert "pointing model" in budget.unknown


def test_a_drive_that_was_not_asked_is_not_taken_as_sure():
    assert error_budget(telescope(), TRACKED, TIME, replace(STATED, counts=None)).unknown == (
        "pointing model",
        "drive",
    )


def test_no_refraction_has_no_error():
    subject = telescope()
    site = subject.sky.site
    subject.sky = Sky(replace(site, weather=replace(site.weather, refraction=False)))
    assert source(error_budget(subject, TRACKED, TIME, STATED), "refraction").error == 0.0
