"""Answers are plain values in the units of their names; a notebook can show them."""

import json
import math

import pytest
from astropy import units
from telescope_bench import T0, telescope

from clockdrive.answers import Answer, observed, refusal, utc
from clockdrive.figures import velocity_register


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
