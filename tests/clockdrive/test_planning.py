"""Targets and moments in every form that people have them; plans without any drive."""

import math
import re
from datetime import UTC, datetime

import pytest
from astropy import units
from astropy.coordinates import SkyCoord
from astropy.time import Time
from telescope_bench import ARCSEC_PER_COUNT, QUICK, T0, Witness, star_at, telescope

from clockdrive import assembly
from clockdrive.best import best
from clockdrive.cli.display import arrival_text, rates_text
from clockdrive.configuration import load
from clockdrive.errors import ConfigurationError, InputError, Refused
from clockdrive.parse import Sources
from clockdrive.planning import drift_of, plan_from, posix, rates_at, rates_of, resolve
from pointing.ephemeris_table import EphemerisTable
from pointing.errors import TargetError, Unreachable
from pointing.instant import Instant
from pointing.rate_offset import RateOffsetTarget
from pointing.targets import FixedAltAz, FixedHaDec, Star

CENTRE = (0x800000, 0x800000)


@pytest.fixture(scope="module")
def configuration():
    return load(None, {}, {"limits.sun_avoidance_deg": 0.0})


@pytest.fixture(scope="module")
def planner(configuration):
    return assembly.planner(configuration)


def test_one_place_in_every_form_is_the_same_plan(configuration):
    place = "05:34:31.9 -22:00:52"
    forms = [place, SkyCoord(place, unit=(units.hourangle, units.deg)), Star.from_degrees(83.632917, -22.014444)]
    targets = [
        [axis.target_counts for axis in plan_from(configuration, form, T0 + 7200.0, CENTRE).plan.axes]
        for form in forms
    ]
    assert max(abs(a - b) for one in targets for a, b in zip(one, targets[0], strict=True)) <= 1


def test_every_form_of_a_moment_is_the_same_second():
    forms = [T0, int(T0), datetime.fromtimestamp(T0, UTC), Time(T0, format="unix"), "2027-01-15T08:00:00Z"]
    assert [posix(form) for form in forms] == pytest.approx([T0] * len(forms), abs=1e-6)
    with pytest.raises(InputError, match="no moment"):
        posix("soon")


@pytest.mark.parametrize("given", [None, 42, object(), ["M1"]])
def test_what_is_no_target_is_refused(given, planner):
    with pytest.raises(TargetError, match="is no target"):
        resolve(given, planner, T0, Sources())


def test_a_plan_without_a_drive_is_the_one_that_the_telescope_makes(tmp_path):
    with telescope(tmp_path) as scope:
        made = scope.plan("Canopus", at=T0)
        alone = plan_from(scope.configuration, "Canopus", T0, CENTRE)
    for one, two in zip(made.plan.axes, alone.plan.axes, strict=True):
        assert abs(one.target_counts - two.target_counts) <= 3  # the drive adds its latency
    assert made["posture"] == alone["posture"]


def test_a_plan_that_asks_no_unit_says_what_it_took_for_granted():
    link = {"drive.link": "tcp://127.0.0.1:1", "limits.sun_avoidance_deg": 0.0}
    site = {"site.latitude_deg": -42.4, "site.longitude_deg": 173.7}
    with pytest.raises(ConfigurationError, match="latitude_deg and longitude_deg: give both"):
        plan_from(load(None, {}, link), "Canopus", T0, CENTRE)
    notes = plan_from(load(None, {}, {**link, **site, "axis1.main_gear": "1/285"}), "Canopus", T0, CENTRE)["notes"]
    assert "axis2.main_gear" in notes[-1]
    assert "axis1.main_gear" not in notes[-1]


def test_rates_are_given_below_the_horizon_too(planner):
    rates = rates_of(planner, FixedAltAz(0.0, -0.5), T0)
    assert [axis["rate_deg_s"] for axis in rates["axes"]] == [0.0, 0.0]


def test_the_moon_is_met_where_it_will_be_and_followed(tmp_path):
    risen = posix("2027-01-15T09:00:00Z")
    with telescope(tmp_path, start=risen) as scope:
        arrival = scope.goto("Moon")
        scope.wait(600.0)
        off_arcsec = scope.status()["error_arcsec"]
    print(f"Moon: {arrival['arrival_error_arcsec']:.2f}″ off on landing, {off_arcsec:.3f}″ after ten minutes")
    assert arrival["slews"] == 1
    assert arrival["arrival_error_arcsec"] < 2.0
    assert off_arcsec < 0.5
    assert not any("Moon" in note for note in arrival["notes"])


def test_what_stands_in_for_a_kernel_is_told_under_plans_rates_and_arrivals(tmp_path):
    late = posix("2060-01-01T12:00:00Z")
    with telescope(tmp_path, start=late) as scope:
        answers = [
            scope.plan("Saturn"),
            scope.rates("Saturn"),
            scope.goto("Saturn"),
            plan_from(scope.configuration, "Saturn", late, CENTRE),
        ]
        scope.offset(60.0, 0.0)
        answers.append(scope.plan("Saturn"))
    for answer in answers:
        assert any(re.match(r"Saturn: kernel de421.bsp covers .* off: up to 130″", note) for note in answer["notes"])
    assert "\n  note: Saturn: kernel de421.bsp" in arrival_text(answers[2].json)
    assert "\n  note: Saturn: kernel de421.bsp" in rates_text(answers[1].json)


def test_the_sun_is_refused_by_its_own_zone():
    noon = posix("2027-01-15T00:30:00Z")
    with pytest.raises(Unreachable, match=r"Sun: 0.0° from the Sun .* inside its zone of 20.0°"):
        plan_from(load(None, {}, {}), "Sun", noon, CENTRE)
    allowed = plan_from(load(None, {}, {"limits.sun_avoidance_deg": 0.0}), "Sun", noon, CENTRE)
    assert allowed["observed"]["altitude_deg"] > 60.0


def test_the_best_object_is_bright_high_and_stays_allowed(planner):
    for hours in range(0, 24, 5):
        time = T0 + 3600.0 * hours
        found = best(planner, time)
        assert planner.allowed(found, time)
        assert planner.allowed(found, time + 1800.0)


def test_no_best_object_is_a_sentence():
    narrow = load(None, {}, {"limits.horizon_deg": 89.9, "limits.sun_avoidance_deg": 0.0})
    with pytest.raises(Refused, match=r"no bright star.*\[limits\]"):
        best(assembly.planner(narrow), T0)


def test_what_is_out_of_reach_says_by_how_much(configuration):
    with pytest.raises(Unreachable, match=r"30\.00° below the horizon limit of 15\.00°"):
        plan_from(configuration, "altaz:10,-15", T0, CENTRE)


def test_rates_of_ones_own_are_added_to_those_of_the_target(configuration):
    """On the equator and the meridian, axis 1 of an equatorial mount turns east as right ascension grows."""
    target = FixedHaDec(0.0, 0.0)
    still = rates_at(configuration, target, T0)
    moving = rates_at(configuration, target, T0, drift=drift_of((3.6, -7.2), None))
    gained = [
        (after["rate_deg_s"] - before["rate_deg_s"]) * 3600.0
        for before, after in zip(still["axes"], moving["axes"], strict=True)
    ]
    assert gained == pytest.approx([-3.6, -7.2], abs=1e-6)


def test_rates_begin_at_the_start_unless_a_moment_is_given(configuration):
    target = FixedHaDec(0.0, 0.0)
    plans = [
        plan_from(configuration, target, T0, CENTRE, drift=drift_of(*rates))["observed"]["declination_deg"]
        for rates in ((None, None), ((0.0, 36.0), None), ((0.0, 36.0), T0 - 100.0))
    ]
    eta = plan_from(configuration, target, T0, CENTRE, drift=drift_of((0.0, 36.0), None)).plan.eta
    assert plans[1] - plans[0] == pytest.approx(0.01 * eta, abs=0.001)
    assert plans[2] - plans[1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("rates", "error", "said"),
    [
        ((None, T0), InputError, "a time of rates without rates"),
        (((1.0,), None), InputError, "give two numbers, east and north"),
        ((("a", 1.0), None), InputError, "give two numbers, east and north"),
        (((1.0, 1.0), "soon"), InputError, "no moment"),
        (((4e4, 0.0), None), TargetError, "together at most 36000″/s"),
        (((float("nan"), 0.0), None), TargetError, "together at most 36000″/s"),
        (((100.0, 0.0), T0 - 86400.0), TargetError, "a drift of 2400.0° since 2027-01-14T08:00:00Z: at most 180°"),
    ],
)
def test_impossible_rates_are_told(configuration, rates, error, said):
    with pytest.raises(error) as refused:
        rates_at(configuration, FixedHaDec(0.0, 0.0), T0, drift=drift_of(*rates))
    assert said in str(refused.value)


def test_the_telescope_takes_rates_and_follows_them(tmp_path):
    with telescope(tmp_path, **{name.replace(".", "__"): value for name, value in QUICK.items()}) as scope:
        star = star_at(scope, 90.0, 50.0)
        witness, begin = Witness(scope), scope.clock.now()
        plain = scope.rates(star)["axes"]
        rated = scope.rates(star, rate_arcsec_s=(0.0, 7.2))["axes"]
        assert (rated[1]["rate_deg_s"] - plain[1]["rate_deg_s"]) * 3600.0 == pytest.approx(7.2, rel=1e-3)
        assert scope.plan(star, rate_arcsec_s=(0.0, 7.2), rate_from=begin - 500.0)["ok"]
        scope.goto(star, rate_arcsec_s=(5.0, 7.2))
        scope.wait(200.0)
        now = scope.clock.now()
        away = witness.on_sky_arcsec(star, witness.now(), now)
        drift = RateOffsetTarget(star, math.radians(5.0 / 3600), math.radians(7.2 / 3600), Instant.from_posix(begin))
        off = witness.on_sky_arcsec(drift, witness.now(), now)
    print(f"after {now - begin:.0f} s {away:.1f}″ from the star, {off:.2f}″ from where it should be by then")
    assert away == pytest.approx(math.hypot(5.0, 7.2) * (now - begin), rel=1e-3)
    assert off < 2.0 * ARCSEC_PER_COUNT


def test_a_table_is_planned_to_its_end_although_nobody_knows_how_long_it_could_be_tracked(configuration, planner):
    up = planner.sky.at(Instant.from_posix(T0)).astrometric(FixedAltAz(1.0, 1.0).observed(None))
    table = EphemerisTable("Rock", tuple(Instant.from_posix(T0 + 600.0 * k) for k in range(8)), (up,) * 8)
    assert plan_from(configuration, table, T0 + 3900.0, CENTRE).plan.arrival < T0 + 4200.0


def test_a_table_that_ends_is_refused_beyond_its_end_and_says_no_later_moment(configuration):
    times = tuple(Instant.from_posix(T0 + 600.0 * k) for k in range(8))
    table = EphemerisTable("Rock", times, ((0.5, 0.5, math.sqrt(0.5)),) * 8)
    with pytest.raises(TargetError, match=r"Rock: its table holds 2027-01-15T08:00:00.000Z to 2027-01-15T09:10"):
        plan_from(configuration, table, T0 + 5000.0, CENTRE)
    with pytest.raises(Unreachable, match=r"Rock: .*horizon") as refused:
        plan_from(configuration, table, T0 + 600.0, CENTRE)
    assert refused.value.reachable is None
