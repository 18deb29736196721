"""Faults of a run are told before a fit, each with its numbers; good runs, simulated and real, are left in peace."""

import datetime as dt
import math
from dataclasses import replace

import erfa
import numpy as np
import pytest

from pointing.errors import PointingError
from pointing.model.diagnosis import RANGE_CHECKS, RESIDUAL_CHECKS, diagnose
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run

ARCSEC = math.pi / 648000.0
DAY = (2461151.5, 0.5)  # 2026 April 21, noon
TT = (2461151.5, 0.5 + 69.184 / 86400.0)
REAL = {
    "apo_2016-08-18": None, "apo_2017-12-10": None, "auxtel_2020-02": None, "auxtel_2022-04": None,
    "spk_altaz": None, "spk_equat": None, "gem_cgx-l": "apparent", "gem_warp": "icrs",
}  # fmt: skip


def simulated(mount="equatorial", latitude_deg=39.0, n=60, seed=5, german=True):
    """A run all over the sky above 15°, of a telescope with errors of minutes of arc and 5″ of noise."""
    rng = np.random.default_rng(seed)
    latitude = math.radians(latitude_deg)
    azimuth, sine = rng.uniform(0.0, math.tau, 4 * n), rng.uniform(math.sin(math.radians(15.0)), 0.98, 4 * n)
    elevation = np.arcsin(sine)
    star1, star2, beyond = azimuth, elevation, np.zeros(4 * n, bool)
    if mount == "equatorial":
        star1, star2 = erfa.ae2hd(azimuth, elevation, latitude)
        beyond = german & (star1 > 0.0)
    easy = np.abs(star2) < math.radians(80.0)
    star1, star2, beyond = star1[easy][:n], star2[easy][:n], beyond[easy][:n]
    first, second = np.where(beyond, star1 + math.pi, star1), np.where(beyond, math.pi - star2, star2)
    cos1, sin1, cos2, tan2 = np.cos(first), np.sin(first), np.cos(second), np.tan(second)
    sign = 1.0 if mount == "equatorial" else -1.0
    error1 = sign * (300.0 + 120.0 / cos2 + 40.0 * tan2) + (90.0 * cos1 + 60.0 * sin1) * tan2
    error2 = -200.0 - 90.0 * sin1 + 60.0 * cos1
    noise1, noise2 = rng.normal(0.0, 5.0, (2, star1.size))
    return PointingRun(
        mount, latitude, star1, star2, first - (error1 + noise1 / cos2) * ARCSEC, second - (error2 + noise2) * ARCSEC,
        sidereal_time=np.linspace(2.0, 4.0, n), date=dt.date(2026, 4, 21), places="apparent",
        line=np.arange(5, n + 5),
    )  # fmt: skip


def names(run, **options):
    found = diagnose(run, **options)
    for finding in found:
        print(finding)
    return [(finding.name, finding.severity) for finding in found]


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
@pytest.mark.parametrize("seed", range(5))
def test_a_good_run_gives_no_finding(mount, seed):
    assert names(simulated(mount, seed=seed)) == []
    assert names(simulated(mount, latitude_deg=-30.0, seed=seed)) == []
    assert names(simulated(mount, n=14, seed=seed)) == []


def turned(v, axis, angle):
    """Vectors (3, n) turned by an angle about x (0) or y (1)."""
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[[1, 0, 0], [0, c, -s], [0, s, c]], [[c, 0, s], [0, 1, 0], [-s, 0, c]]][axis])
    return turn @ v


def rigid(seed, size_arcmin, mount="equatorial"):
    """A run with a telescope of rigid parts: tilted axis, exact collimation cone, larger zero points."""
    rng = np.random.default_rng(seed)
    run = simulated(mount, latitude_deg=rng.uniform(-60.0, 60.0), n=int(rng.integers(15, 120)), seed=seed)
    west, up, cone, skew = rng.normal(0.0, size_arcmin * 60.0 * ARCSEC, 4)
    zero1, zero2 = rng.normal(0.0, 3.0 * size_arcmin * 60.0 * ARCSEC, 2)
    a, b = run.mechanical_star()
    x, y, z = turned(turned(np.array([np.cos(b) * np.cos(a), -np.cos(b) * np.sin(a), np.sin(b)]), 1, up), 0, west)
    first, second = np.where(run.beyond, np.arctan2(-y, x) + math.pi, np.arctan2(-y, x)), np.arcsin(z)
    second = np.where(run.beyond, math.pi - second, second)
    aside = (math.sin(cone) + math.sin(skew) * np.sin(second)) / np.cos(second)
    noise1, noise2 = rng.normal(0.0, 5.0, (2, len(run))) * ARCSEC
    first = first - np.arcsin(np.clip(aside, -1.0, 1.0)) - zero1 + noise1 / np.cos(second)
    night = np.sort(rng.uniform(0.0, rng.uniform(1.0, 6.0), len(run)))
    return replace(run, axis1=first, axis2=second - zero2 + noise2, sidereal_time=night)


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
@pytest.mark.parametrize("size_arcmin", [1.0, 20.0, 60.0])
def test_a_rigid_telescope_with_large_errors_gives_no_finding(mount, size_arcmin):
    found = [finding for seed in range(25) for finding in diagnose(rigid(seed, size_arcmin, mount))]
    assert [str(finding) for finding in found if finding.name != "constant-offset"] == []
    assert len(found) < 2  # an index error above 10° is that large


def test_places_of_j2000_are_told_whatever_the_errors_of_the_telescope():
    told = [
        any(finding.name == "wrong-frame" for finding in diagnose(confused(rigid(seed, size_arcmin))))
        for seed in range(10) for size_arcmin in (1.0, 20.0, 60.0) for confused in (places_of_j2000, places_of_date)
    ]  # fmt: skip
    print(f"{sum(told)} of {len(told)} told")
    assert sum(told) >= 0.95 * len(told)


@pytest.mark.parametrize("name", REAL)
def test_a_good_real_run_gives_no_finding(shared, name):
    assert names(read_run(shared / "data" / "tpoint" / f"{name}.dat", places=REAL[name])) == []


def test_degrees_and_radians_are_not_taken_for_each_other():
    for run in (simulated(), simulated("altazimuth")):
        angles = (run.star1, run.star2, run.axis1, run.axis2)
        degrees = PointingRun(run.mount, run.latitude, *(np.degrees(angle) for angle in angles))
        assert names(degrees) == [("degrees", "refuse")]
        radians = PointingRun.from_degrees(run.mount, 39.0, *angles)
        assert names(radians) == [("radians", "refuse")]


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
def test_exchanged_columns_are_told(mount):
    run = simulated(mount)
    swapped = replace(run, star1=run.star2, star2=run.star1)
    assert ("exchanged-coordinates", "refuse") in names(swapped)
    near = run.subset(np.abs(np.sin(run.star1 / 2.0)) < 0.6)
    near = replace(near, star1=(near.star1 + math.pi) % math.tau - math.pi)
    swapped = replace(near, star1=near.star2, star2=near.star1)
    assert names(swapped) == [("exchanged-coordinates", "refuse")]


def test_all_columns_exchanged_are_told_by_what_is_left():
    run = simulated(n=80, german=False)
    run = run.subset(np.abs(run.star1) < 1.5)
    both = replace(run, star1=run.star2, star2=run.star1, axis1=run.axis2, axis2=run.axis1)
    assert ("exchanged-coordinates", "warn") in names(both)


def test_star_and_telescope_exchanged_are_told_beyond_the_pole():
    run = simulated()
    assert names(replace(run, star1=run.axis1, star2=run.axis2, axis1=run.star1, axis2=run.star2)) == [
        ("exchanged-star-and-telescope", "refuse")
    ]


@pytest.mark.parametrize("latitude_deg", [39.0, -30.0])
def test_the_wrong_sign_of_the_latitude_is_told_by_the_horizon(latitude_deg):
    run = simulated(latitude_deg=latitude_deg)
    found = diagnose(replace(run, latitude=-run.latitude))
    assert [(finding.name, finding.severity) for finding in found] == [("latitude-sign", "refuse")]
    assert f"none at {latitude_deg:+.4f}°" in found[0].text


def test_stars_below_the_horizon_are_told_with_their_lines():
    run = simulated("altazimuth")
    low = run.star2.copy()
    low[[3, 8]] = math.radians(-20.0)
    found = diagnose(replace(run, star2=low, axis2=np.where(low < 0.0, low, run.axis2)))
    assert ("below-horizon", "warn") in [(finding.name, finding.severity) for finding in found]
    assert "2 of 60 stars are below the horizon (line 8, 13)" in found[0].text


def test_a_run_most_of_whose_stars_are_below_the_horizon_is_refused():
    run = simulated("altazimuth")
    for count, severity in ((30, "warn"), (31, "refuse"), (60, "refuse")):
        side = np.where(np.arange(60) < count, -1.0, 1.0)
        found = diagnose(replace(run, star2=side * run.star2, axis2=side * run.axis2))
        assert found[0].text.startswith(f"{count} of 60 stars are below the horizon")
        assert (found[0].name, found[0].severity) == ("below-horizon", severity)


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
@pytest.mark.parametrize(("by", "way"), [(1, "after its own"), (-1, "before its own")])
def test_stars_that_stand_with_the_next_reading_are_told(mount, by, way):
    run = simulated(mount)
    found = diagnose(replace(run, star1=np.roll(run.star1, by), star2=np.roll(run.star2, by)))
    print(found[0])
    assert (found[0].name, found[0].severity) == ("shifted-stars", "refuse")
    assert way in found[0].text


@pytest.mark.parametrize("mount", ["equatorial", "altazimuth"])
@pytest.mark.parametrize("seed", range(3))
def test_stars_with_the_readings_of_any_others_are_refused(mount, seed):
    run = simulated(mount, seed=seed)
    any_other = np.random.default_rng(seed).permutation(len(run))
    found = diagnose(replace(run, star1=run.star1[any_other], star2=run.star2[any_other]))
    assert "refuse" in {finding.severity for finding in found}
    print(found[0])


def test_hour_angles_in_hours_are_told_by_what_is_left():
    run = simulated()
    fork = simulated(german=False)  # beyond the pole 12 h would have to be told from degrees
    for confused in (
        replace(run, star1=run.star1 / 15.0, axis1=run.axis1 / 15.0),
        replace(fork, star1=fork.star1 / 15.0),
        replace(fork, axis1=fork.axis1 / 15.0),
    ):
        found = diagnose(confused)
        print(found[0])
        assert ("hours", "refuse") in [(finding.name, finding.severity) for finding in found]


def test_zenith_distances_for_elevations_are_told_by_what_is_left():
    run = simulated("altazimuth")
    turned2 = {"star2": math.pi / 2.0 - run.star2, "axis2": math.pi / 2.0 - run.axis2}
    for columns, severity in ((["star2"], "refuse"), (["axis2"], "refuse"), (["star2", "axis2"], "warn")):
        found = diagnose(replace(run, **{name: turned2[name] for name in columns}))
        print(found)
        assert [(finding.name, finding.severity) for finding in found] == [("zenith-distance", severity)]


@pytest.mark.parametrize("count", [1, 3])
def test_a_few_stars_far_off_are_no_mix_up_of_the_run(count):
    run = simulated()
    axis2 = run.axis2.copy()
    axis2[:count] -= math.radians(5.0)
    assert not any(finding.severity == "refuse" for finding in diagnose(replace(run, axis2=axis2)))


def places_of_j2000(run):
    """The same stars with the places a catalogue of J2000 has for them, ERFA's, taken as those of date."""
    ra, dec, _ = erfa.atic13(run.sidereal_time - run.star1 + erfa.eo06a(*TT), run.star2, *TT)
    return replace(run, star1=run.sidereal_time - ra, star2=dec)


def places_of_date(run):
    """The same stars with their places of date, ERFA's, taken as those of J2000, precessed once more."""
    ra, dec, origins = erfa.atci13(run.sidereal_time - run.star1, run.star2, 0.0, 0.0, 0.0, 0.0, *TT)
    return replace(run, star1=run.sidereal_time - (ra - origins), star2=dec, places="icrs")


@pytest.mark.parametrize(
    ("confused", "said"),
    [(places_of_j2000, "J2000 places read as apparent"), (places_of_date, "apparent places read as J2000")],
)
@pytest.mark.parametrize("seed", range(3))
def test_places_in_another_frame_are_told_with_their_amplitude(confused, said, seed):
    found = diagnose(confused(simulated(seed=seed)))
    assert [finding.name for finding in found] == ["wrong-frame"]
    print(found[0])
    assert said in found[0].text
    amplitude = float(found[0].text.split("amplitude ")[1].split(" ")[0])
    assert amplitude == pytest.approx(1.0, abs=0.15)


def test_the_published_german_run_in_j2000_is_told(shared):
    """One of the two was published as read in plain apparent places; it fits better in those of J2000."""
    run = read_run(shared / "data" / "tpoint" / "gem_warp.dat", places="apparent")
    assert names(run) == [("wrong-frame", "warn")]


def test_repeated_stars_are_counted():
    run = simulated()
    index = [*range(60), 4, 4, 9]
    columns = ("star1", "star2", "axis1", "axis2", "sidereal_time", "line")
    twice = PointingRun(run.mount, run.latitude, **{name: getattr(run, name)[index] for name in columns})
    found = diagnose(twice)
    assert [(finding.name, finding.severity) for finding in found] == [("duplicates", "warn")]
    assert "3 of 63 observations repeat another" in found[0].text


def test_two_runs_in_one_are_told_with_the_line_and_the_jump():
    run = simulated()
    later = np.arange(60) >= 40
    found = diagnose(replace(run, axis1=run.axis1 - later * 400.0 * ARCSEC, axis2=run.axis2 + later * 250.0 * ARCSEC))
    print(found[0])
    assert [(finding.name, finding.severity) for finding in found] == [("second-run", "warn")]
    assert "from line 45 on" in found[0].text
    jump1, jump2 = (
        float(word.split("″")[0]) for word in found[0].text.split("zero points are ")[1].split(" and ")[:2]
    )
    assert (jump1, jump2) == pytest.approx((400.0, -250.0), abs=10.0)


def test_a_wrong_side_of_the_pier_is_told_with_its_observations():
    run = simulated()
    axis1 = run.axis1.copy()
    axis1[[2, 7]] += math.pi
    found = diagnose(replace(run, axis1=axis1))
    assert [(finding.name, finding.severity) for finding in found] == [("half-turn", "refuse")]
    assert "in 2 of 60 observations (line 7, 12)" in found[0].text
    assert names(replace(run, axis1=run.axis1 + math.pi)) == [("half-turn", "refuse")]


def test_whole_turns_are_a_wound_axis_and_no_fault():
    run = simulated("altazimuth")
    assert names(replace(run, axis1=run.axis1 - math.tau * (np.arange(60) % 3))) == []


def test_an_axis_an_hour_off_is_told_in_hours():
    run = simulated()
    found = diagnose(replace(run, axis1=run.axis1 - math.radians(15.0)))
    assert [(finding.name, finding.severity) for finding in found] == [("constant-offset", "warn")]
    assert "h) from the star in the middle" in found[0].text
    assert float(found[0].text.split("(")[1].split(" h")[0]) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("n", "terms", "severity"), [(3, 6, "refuse"), (4, 6, "warn"), (0, 6, "refuse"), (7, 8, "warn")]
)
def test_too_few_stars_for_the_terms_are_told(n, terms, severity):
    found = diagnose(simulated().subset(np.arange(60) < n), terms)
    assert [(finding.name, finding.severity) for finding in found] == [("too-few-stars", severity)]
    print(found[0])
    assert f"{n} stars" in found[0].text
    assert names(simulated().subset(np.arange(60) < terms), terms=terms) == []


def test_one_star_is_told_as_one():
    (found,) = diagnose(simulated().subset(np.arange(60) < 1), 2)
    assert found.text.startswith("1 star gives 2 numbers for 2 terms")


def test_masked_observations_are_not_looked_at():
    run = simulated()
    axis1 = run.axis1.copy()
    axis1[2] += math.pi
    assert names(replace(run, axis1=axis1).masked([2])) == []
    assert names(run.masked(range(57))) == [("too-few-stars", "refuse")]


def test_every_check_holds_for_any_run_and_a_model_needs_a_term():
    rng = np.random.default_rng(1)
    for n in (1, 2, 12, 13):
        for scale in (0.0, 1.0, 7.0, 400.0):
            run = PointingRun("equatorial", 0.5, *(scale * rng.uniform(-1.0, 1.0, (4, n))), sidereal_time=np.zeros(n),
                              date=dt.date(2026, 4, 21))  # fmt: skip
            for check in (*RANGE_CHECKS, *RESIDUAL_CHECKS):
                assert all(finding.text for finding in check(run))
    with pytest.raises(PointingError, match="0 terms; a model has at least 1"):
        diagnose(simulated(), 0)
    assert diagnose(simulated().masked(range(60)))[0]._repr_html_().startswith("<p><b>refuse: too-few-stars</b>")
