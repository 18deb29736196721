"""Answers are plain values in the units of their names; a notebook can show them."""

import json
import math

import numpy as np
import pytest
from astropy import units
from astropy.coordinates import SkyCoord
from astropy.utils import iers
from orbit import Overhead
from telescope_bench import T0, star_at, telescope

from clockdrive.answers import Answer, observed
from clockdrive.drives.tc410.figures import velocity_register
from clockdrive.refusal import refusal
from clockdrive.utc import utc

WELL_KNOWN = 1_700_040_000.0  # the Earth's orientation of that day is observed, not predicted


@pytest.mark.parametrize(
    ("time", "text"),
    [
        (0.0, "1970-01-01T00:00:00.000Z"),
        (T0 + 0.0004, "2027-01-15T08:00:00.000Z"),
        (T0 + 0.9996, "2027-01-15T08:00:01.000Z"),  # rounds into the next second
        (T0 + 0.1235, "2027-01-15T08:00:00.123Z"),
    ],
)
def test_moments_are_utc_to_the_millisecond(time, text):
    assert utc(time) in {text, text.replace(".123", ".124")}


def test_a_direction_is_given_over_horizon_and_equator():
    latitude = math.radians(-42.4)
    place = observed((-math.cos(latitude), 0.0, math.sin(latitude)), latitude)  # the north celestial pole
    assert place["altitude_deg"] == pytest.approx(-42.4)
    assert place["declination_deg"] == pytest.approx(90.0)
    assert observed((0.0, 0.0, 1.0), latitude)["declination_deg"] == pytest.approx(-42.4)


def test_a_refusal_says_when_it_can_be_done_only_where_that_is_known():
    assert refusal("below") == {"ok": False, "reason": "below"}
    assert refusal("below", T0)["reachable_utc"] == utc(T0)


def test_the_sidereal_rate_in_the_manuals_gearing_is_its_velocity_register():
    assert velocity_register(360.0 * 3600.0 / 86164.0905 / 0.9094736842105263) == 13873


def test_a_plan_is_json_a_line_a_table_and_astropys_quantities(tmp_path):
    with telescope(tmp_path) as scope:
        plan = scope.plan("best")
        arrival = scope.goto("best")
        status = scope.status()
    for answer in (plan, arrival, status):
        assert json.loads(json.dumps(answer.json)) == answer.json
        assert answer._repr_html_().startswith("<table>")
    assert plan["arrival_utc"] in str(plan)
    assert plan.eta.to_value(units.s) == pytest.approx(plan["eta_s"], abs=1e-6)
    assert plan.arrival.unix - plan.plan.start == pytest.approx(plan["eta_s"], abs=1e-4)


def test_a_table_for_notebooks_escapes_what_it_shows():
    assert Answer({"a": "<b>", "c": [], "d": {"e": 1.23456789}})._repr_html_() == (
        "<table><tr><th>a</th><td>&lt;b&gt;</td></tr><tr><th>c</th><td>–</td></tr>"
        "<tr><th>d</th><td><table><tr><th>e</th><td>1.23457</td></tr></table></td></tr></table>"
    )


def test_observed_places_are_those_of_astropys_own_chain(tmp_path):
    star = SkyCoord(10.684, -57.236, unit="deg")
    with telescope(tmp_path, WELL_KNOWN) as scope, iers.conf.set_temp("auto_download", value=False):
        for answer in (scope.rates(star), scope.plan(star)):
            theirs = star.transform_to(answer.observed.frame)
            apart = theirs.separation(answer.observed).to_value("arcsec")
            print(f"{type(answer).__name__}: {apart:.5f}″ from astropy's chain at {answer.observed.alt.deg:.0f}°")
            assert apart < 0.001
            assert answer.observed.alt.deg == pytest.approx(answer["observed"]["altitude_deg"], abs=1e-9)
            assert answer.observed.az.deg == pytest.approx(answer["observed"]["azimuth_deg"], abs=1e-9)


def test_angles_and_rates_are_quantities_of_both_axes(tmp_path):
    with telescope(tmp_path) as scope:
        for answer in (scope.rates("best"), scope.plan("best")):
            axes = answer["axes"]
            assert answer.angles.to_value("deg") == pytest.approx([axis["angle_deg"] for axis in axes])
            assert answer.rates.to_value("deg/s") == pytest.approx([axis["rate_deg_s"] for axis in axes])
            assert answer.rates.unit == units.arcsec / units.s


def test_the_field_of_an_altazimuth_mount_turns_as_textbooks_say(tmp_path):
    with telescope(tmp_path, mount__type="altaz-fork", site__weather__refraction=False) as scope:
        for answer in (scope.rates("best"), scope.plan("best")):
            place, latitude = answer.observed, math.radians(scope.configuration.site.latitude_deg)
            turn = math.cos(latitude) * math.cos(place.az.rad) / math.cos(place.alt.rad) * 360.0 / 23.9344696
            print(f"{answer.field_rotation:.5f}, ω cos φ cos A / cos E {turn:.5f} deg / h")
            assert answer.field_rotation.to_value("deg/h") == pytest.approx(turn, rel=1e-4)  # nutation, aberration
        ahead = scope.plan(Overhead(T0 + 900.0, math.radians(60.0), math.radians(3.0)))
        assert math.isnan(ahead.field_rotation.value)


def test_the_true_place_of_the_simulator_is_compared_with_a_target_in_one_frame(tmp_path):
    with telescope(tmp_path, simulator__collimation_arcsec=180.0) as scope:
        star = star_at(scope, 120.0, 50.0)
        scope.goto(star)
        scope.wait(5.0)
        assert scope.true_place().is_equivalent_frame(scope.rates(star).observed)
        apart = scope.true_place().separation(scope.rates(star).observed)
        assert apart.to_value("arcsec") == pytest.approx(180.0, abs=1.0)


def test_the_way_of_a_pass_is_a_table_whose_rates_are_the_slopes_of_its_angles(tmp_path):
    with telescope(tmp_path, mount__type="altaz-fork") as scope:
        ahead = scope.plan(Overhead(T0 + 900.0, math.radians(60.0), math.radians(3.0)))
        way = ahead.way(0.5)
    budget = ahead["budget"]  # of the moment at which it goes along
    known = [each["arcsec"] for each in budget["sources"] if each["arcsec"] is not None]
    print(f"budget of the pass: {budget['total_arcsec']}″")
    assert 0.0 < budget["total_arcsec"] == pytest.approx(math.hypot(*known), abs=0.01)
    assert way["time"][0].unix == pytest.approx(ahead.moment.unix, abs=1e-6)
    assert way["time"][-1].unix == pytest.approx(ahead.ends.unix, abs=1e-6)
    for axis in ("axis1", "axis2"):
        slope = np.gradient(way[axis].to_value("deg"), way["time"].unix)[2:-2]
        off = np.abs(slope - way[f"{axis}_rate"].to_value("deg/s")[2:-2])
        print(f"{axis}: rate off its slope by {off.max():.2e} deg/s at most, 0.5 s apart")
        assert off.max() < 5e-3 * np.abs(slope).max()
    assert np.allclose(way["azimuth"].to_value("deg") % 360.0, way["axis1"].to_value("deg") % 360.0, atol=1e-6)
    assert np.allclose(way["altitude"].to_value("deg"), way["axis2"].to_value("deg"), atol=1e-6)
