"""The runs of a telescope as a person uses them: list, fit, mask, import, export, append, with syncs in between."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run
from sky_bench import Sky
from telescope_bench import QUICK, star_at, telescope

from clockdrive import PointingRuns
from clockdrive.configuration import load
from clockdrive.errors import ArgumentError, ClockdriveError, InputError, Refused
from clockdrive.fitting import Wanted
from clockdrive.run_report import stored_of
from clockdrive.witness import WitnessError
from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.run_file import read_run
from pointing.model.tpoint_file import write_tpoint
from pointing.vectors import from_azimuth_altitude, horizon_to_equatorial, hour_angle_declination

TERMS = "IH ID CH NP MA ME TF"


@pytest.fixture
def runs(tmp_path):
    configuration = load(None, overrides={"drive.link": "sim:", "mount.type": "german", "state.path": str(tmp_path)})
    with PointingRuns.open(configuration) as opened:
        yield opened


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.dat"
    write_tpoint(simulated_run("german", -42.4, TRUTH["german"], 40, np.random.default_rng(5)).run, path)
    return path


def test_a_tpoint_file_is_taken_in_and_its_fit_is_that_of_the_file(runs, file):
    runs.take_in(file, "old", 1.8e9, places="observed")
    ours = runs.report("old", Wanted(TERMS)).fit
    theirs = fit(read_run(file, places="observed"), TERMS)
    off = max(abs(a.arcsec - b.arcsec) for a, b in zip(ours.coefficients, theirs.coefficients, strict=True))
    print(f"largest difference of a coefficient {off:.1e}″")
    assert off < 1e-5
    assert runs["old"].settings["imported"].endswith("run.dat")
    assert runs.names == ("old",)


@pytest.mark.parametrize("name", ["gem_cgx-l", "apo_2017-12-10", "auxtel_2022-04"])
def test_runs_of_other_people_are_taken_in_without_loss(name, runs, shared):
    """Whole files, with all their digits: the fit through the store is the fit of the file."""
    path = shared / "data" / "tpoint" / f"{name}.dat"
    direct = read_run(path, places="apparent")
    runs.take_in(path, name, 1.8e9, places="apparent")
    names = TERMS if direct.mount == "equatorial" else "IA IE CA NPAE AN AW TF"
    kept, there = fit(runs.observations(name), names), fit(direct, names)
    off = max(abs(a.arcsec - b.arcsec) for a, b in zip(kept.coefficients, there.coefficients, strict=True))
    print(
        f"{name}: {kept.n} stars, sky RMS {kept.sky_rms_arcsec:.3f}″, largest difference of a coefficient {off:.1e}″"
    )
    assert kept.n == there.n
    assert off < 1e-5


@pytest.mark.parametrize("ending", ["ecsv", "dat"])
def test_a_run_is_written_and_read_back_to_the_same_fit_with_its_masks(runs, file, ending, tmp_path):
    runs.take_in(file, "old", 1.8e9, places="observed")
    runs.mask("old", [3, 11])
    runs.write("old", tmp_path / f"out.{ending}")
    back = read_run(tmp_path / f"out.{ending}", places="observed")
    assert int(back.kept.sum()) == 38
    one, two = fit(runs.observations("old"), TERMS), fit(back, TERMS)
    off = max(abs(a.arcsec - b.arcsec) for a, b in zip(one.coefficients, two.coefficients, strict=True))
    print(f"{ending}: largest difference of a coefficient {off:.1e}″")
    assert off < 1e-4


def test_masked_stars_take_no_part_until_they_are_unmasked(runs, file):
    runs.take_in(file, "old", 1.8e9, places="observed")
    runs.mask("old", [0, 5], "a gust")
    assert runs.report("old", Wanted(TERMS)).fit.n == 38
    runs.unmask("old", [0])
    assert runs.report("old", Wanted(TERMS)).fit.n == 39
    assert runs["old"].observations[5].masked == "a gust"


def test_the_worst_go_one_by_one_and_the_fit_gets_better(runs, file):
    runs.take_in(file, "old", 1.8e9, places="observed")
    rms = [runs.report("old").fit.sky_rms_arcsec]
    gone = []
    for _ in range(3):
        gone += runs.mask_worst("old")
        rms.append(runs.report("old").fit.sky_rms_arcsec)
    print(f"masked {gone}: sky RMS {', '.join(f'{each:.3f}″' for each in rms)}")
    assert len(set(gone)) == 3
    assert rms == sorted(rms, reverse=True)


def test_what_cannot_be_taken_in_or_written_is_said(runs, file, tmp_path):
    runs.take_in(file, "old", 1.8e9, places="observed")
    with pytest.raises(InputError, match="there is a pointing run 'old' already"):
        runs.take_in(file, "old", 1.8e9, places="observed")
    with pytest.raises(PointingError, match="the frame of its RA and Dec is not told"):
        runs.take_in(file, "new", 1.8e9)
    with pytest.raises(InputError, match=r"name a file that ends in .ecsv, with weights and times, or in .dat"):
        runs.write("old", tmp_path / "out.csv")
    assert runs.names == ("old",)


CROOKED = {
    "mount__type": "german",
    "simulator__misalignment_x_arcsec": 900.0,
    "simulator__misalignment_y_arcsec": -600.0,
    "simulator__collimation_arcsec": 180.0,
    **QUICK,
}


def synchronised_beside(scope, arcsec):
    """Put the position wrong, as a careless sync does: on a place beside the one that is in the field."""
    scope.goto(star_at(scope, 75.0, 52.0))
    scope.wait(5.0)
    seen = Sky(scope).solution()
    scope.sync(type(seen)("beside", seen.ra, seen.dec + math.radians(arcsec / 3600.0), epoch=seen.epoch))
    scope.stop()


def test_a_run_that_is_appended_to_after_a_sync_uses_all_its_stars_and_the_model_points_today(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.pointing_run(6, name="long")
        synchronised_beside(scope, 700.0)
        report = scope.pointing_run(6, name="long", append=True)
        assert report.fit.n == 12
        assert len({(each.place.azimuth, each.place.altitude) for each in report.stored.places}) == 12
        scope.use_model(report)
        star = star_at(scope, 60.0, 40.0)
        scope.goto(star)
        scope.wait(5.0)
        off = math.hypot(*Sky(scope).off(star))
    moved = [each.in_force["zero"]["moved_deg"] for each in report.stored.observations]
    print(f"sky RMS {report.fit.sky_rms_arcsec:.2f}″ over a sync of {moved[-1]}°; a goto then {off:.2f}″ off")
    assert moved[0] == [0.0, 0.0]
    assert max(map(abs, moved[-1])) * 3600.0 > 300.0
    assert report.fit.sky_rms_arcsec < 2.0
    assert off < 2.0


def test_a_model_of_an_old_run_is_fitted_for_todays_zero_points(tmp_path):
    """Run, then a sync that is wrong by 700″, then a fit: it takes the sync back, and the telescope points."""
    with telescope(tmp_path, **CROOKED) as scope:
        scope.pointing_run(6, name="old")
        synchronised_beside(scope, 700.0)
        scope.use_model(scope.runs.report("old"))
        star = star_at(scope, 60.0, 40.0)
        scope.goto(star)
        scope.wait(5.0)
        off = math.hypot(*Sky(scope).off(star))
    print(f"{off:.2f}″ off")
    assert off < 2.0


def test_stars_from_before_a_power_cycle_take_no_part_as_nobody_knows_what_their_angles_mean_now(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.pointing_run(6, name="long")
        scope.simulator.power_cycle()
        scope.wait(5.0)
        with pytest.raises(Refused, match="not synchronised"):
            scope.pointing_run(6, name="long", append=True)
        assert len(scope.runs["long"].places) == 6
        scope.sync(Sky(scope).solution(), force=True)
        alone = scope.runs.report("long")
        report = scope.pointing_run(6, name="long", append=True)
    assert any("put its model in force, then `sync` on a star" in each for each in alone.recommendation)
    assert alone.fit.n == 6
    assert report.fit.run.kept.tolist() == [False] * 6 + [True] * 6
    assert any("left out: 6 stars, seen before the position was lost" in each for each in report.recommendation)


def test_runs_are_refused_where_they_would_mean_nothing(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        with pytest.raises(InputError, match="resume or append"):
            scope.pointing_run(8, resume=True, append=True)
        with pytest.raises(InputError, match="this telescope has no pointing runs"):
            scope.pointing_run(resume=True)
        with pytest.raises(ArgumentError, match="a run of 0 stars"):
            scope.pointing_run(0)
        scope.park()
        with pytest.raises(Refused, match="parked"):
            scope.pointing_run(8)
        assert scope.runs.names == ()


def test_a_run_on_an_origin_beside_the_tube_is_refused_as_a_model_is_one_of_the_tube(tmp_path):
    with telescope(tmp_path, **CROOKED, instruments__guide__x_arcsec=600.0) as scope:
        with pytest.raises(ClockdriveError, match=r"0.167° beside .*: choose an instrument at 0, 0 first"):
            scope.pointing_run(8)
        with pytest.raises(Refused, match=r"targets are put 0.167° beside the tube's axis: choose an instrument"):
            scope.pointing_run(8, scope.true_sky)


def test_the_worst_is_the_outlier_that_the_fit_has_found_and_no_good_star(runs):
    """Of 50 stars number 17 is 12′ off; a run of that size is fitted without outliers by default."""
    run = simulated_run("german", -42.4, TRUTH["german"], 50, np.random.default_rng(3), noise_arcsec=2.0).run
    good = stored_of(run, "night", 1.8e9)
    bad = replace(good.observations[17], altitude_deg=good.observations[17].altitude_deg + 0.2)
    runs.store.begin(replace(good, observations=(*good.observations[:17], bad, *good.observations[18:])))
    assert [each.index for each in runs.report("night").fit.outliers] == [17]
    assert runs.mask_worst("night") == (17,)
    assert runs.mask_worst("night") != (17,)


def test_an_exported_run_has_the_places_of_the_sky_whatever_registers_are_in_force(tmp_path):
    registers = {"mount__mount_x_mas": 900_000, "mount__mount_y_mas": -600_000}
    with telescope(tmp_path, **CROOKED, **registers) as scope:
        scope.pointing_run(8, name="here")
        seen = scope.runs["here"].observations
        scope.runs.write("here", tmp_path / "out.ecsv")
        scope.runs.take_in(tmp_path / "out.ecsv", "back", 1.8e9)
        here, back = (scope.runs.report(name).fit.coefficients for name in ("here", "back"))
    file = read_run(tmp_path / "out.ecsv")
    places = [hour_angle_declination(horizon_to_equatorial(
        from_azimuth_altitude(math.radians(each.azimuth_deg), math.radians(each.altitude_deg)), file.latitude))
        for each in seen]  # fmt: skip
    off = np.abs(np.exp(1j * np.array(places)) - np.exp(1j * np.array([file.star1, file.star2]).T)).max()
    apart = max(abs(a.arcsec - b.arcsec) for a, b in zip(here, back, strict=True))
    print(f"places {math.degrees(off) * 3600.0:.1e}″ from where they were seen; coefficients {apart:.1e}″ apart")
    assert math.degrees(off) * 3600.0 < 1e-6
    assert apart < 0.01


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (
            {"site__latitude_deg": -42.1},
            r"is of latitude -42.4000°, the telescope stands at -42.1000°: take a new",
        ),
        (
            {"mount__type": "equatorial-fork"},
            r"is one of a mount german, this one is equatorial-fork: take a new",
        ),
    ],
    ids=["site", "mount"],
)
@pytest.mark.parametrize("how", ["append", "resume"])
def test_a_run_of_another_site_or_mount_is_not_gone_on_with(other, said, how, tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.pointing_run(6, name="here")
    with (
        telescope(tmp_path, start=scope.clock.now() + 60.0, **{**CROOKED, **other}) as elsewhere,
        pytest.raises(Refused, match=said),
    ):
        elsewhere.pointing_run(6, name="here", **{how: True})


@pytest.mark.parametrize("settle_s", [-30.0, 1e6])
def test_settling_for_an_impossible_time_is_refused_before_anything_moves(settle_s, tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        with pytest.raises(InputError, match=r"settling for .* s: give 0 to 600"):
            scope.pointing_run(6, settle_s=settle_s)
        assert scope.runs.names == ()


def test_a_witness_of_ones_own_is_kept_by_the_name_of_its_class(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        report = scope.pointing_run(6, scope.true_sky)
    assert report.stored.settings["witness"] == "SimulatedSky"


@pytest.mark.parametrize("count", [0, -1, 35, 40, 1000])
def test_the_worst_leave_what_a_fit_needs_and_are_not_none(runs, file, count):
    runs.take_in(file, "old", 1.8e9, places="observed")
    with pytest.raises(InputError, match="1 to 34 can be masked, as a fit needs 6 stars"):
        runs.mask_worst("old", count)
    assert all(not each.masked for each in runs["old"].observations)


@pytest.mark.parametrize(
    ("given", "error", "says"),
    [
        ({"stars": 0}, ArgumentError, "1 to 1000"),
        ({"stars": -3}, ArgumentError, "1 to 1000"),
        ({"stars": 100000}, ArgumentError, "1 to 1000"),
        ({"stars": 6.5}, ArgumentError, "a whole number"),
        ({"settle_s": math.nan}, InputError, "settling for nan"),
        ({"name": "a\nb"}, InputError, "printable"),
        ({"name": " "}, InputError, "printable"),
        ({"witness": "command:no-such-program-anywhere 5"}, WitnessError, "no program 'no-such-program-anywhere'"),
        ({"witness": "command:"}, WitnessError, "name a program"),
        ({"witness": "nobody"}, WitnessError, "there is simulator, command:PROGRAM, typed$"),
    ],
)
def test_what_cannot_be_is_refused_before_a_run_is_stored(tmp_path, given, error, says):
    with telescope(tmp_path) as scope:
        with pytest.raises(error, match=says):
            scope.pointing_run(**{"stars": 6, **given})
        assert scope.runs.names == ()
