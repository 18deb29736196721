"""A telescope with a rotator from command to sky: a second star 1° off the axis stays where it is in the field."""

import math
import os
from datetime import datetime

import numpy as np
import pytest
from apo_bench import ApoWitness, apo_telescope
from rotator_bench import across_the_field
from telescope_bench import star_at

from clockdrive.errors import ArgumentError, Refused
from pointing.errors import Unreachable

SPAN_S = 3600.0 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 240.0
KINDS = ("apo", "sdss")


@pytest.mark.campaign
@pytest.mark.timeout(600)  # an hour of tracking takes a minute of a free core
@pytest.mark.parametrize("kind", KINDS)
def test_the_field_is_held_to_a_tenth_of_an_arcsecond_1_degree_off_axis(kind, tmp_path):
    with apo_telescope(kind, tmp_path, rotator__mode="sky") as scope:
        witness = ApoWitness(scope)
        star = star_at(scope, 140.0, 60.0, scope.clock.now() + 60.0)
        arrival = scope.goto(star, position_angle_deg=40.0)
        assert arrival["rotator"]["held_deg"] == pytest.approx(40.0)
        across = []
        for _ in range(20):
            across.append(across_the_field(scope, star, 40.0))
            scope.wait(SPAN_S / 20)
        print(f"{kind}: in {SPAN_S:g} s a star 1° off leaves its direction by {np.abs(across).max():.4f}″ at most")
        assert np.abs(across).max() < 0.1
        found = scope.status()
        assert found["rotator"]["position_angle_deg"] == pytest.approx(40.0, abs=1e-4)
        assert found["rotator"]["rate_deg_s"] == pytest.approx(found["field_rotation_deg_s"], rel=0.02)
        assert not witness.dry()
        assert not found["trouble"]


def test_what_is_not_asked_for_is_as_configured_and_park_takes_the_rotator_along(tmp_path):
    with apo_telescope(
        "apo", tmp_path, rotator__mode="horizon", rotator__position_angle_deg=25.0, rotator__park_deg=-60.0
    ) as scope:
        star = star_at(scope, 200.0, 50.0, scope.clock.now() + 60.0)
        plan = scope.plan(star)
        assert (plan["rotator"]["mode"], plan["rotator"]["held_deg"]) == ("horizon", pytest.approx(25.0))
        assert plan["rotator"]["angle_deg"] == pytest.approx(25.0)
        assert scope.plan(star, rotator="mount", position_angle_deg=-10.0)["rotator"]["target_deg"] == -10.0
        assert "field_rotation_deg_s" in scope.rates(star).json
        scope.goto(star, rotator="mount", position_angle_deg=12.0)
        assert scope.status()["rotator"]["angle_deg"] == pytest.approx(12.0, abs=1e-6)
        scope.offset(20.0, -10.0)
        scope.wait(20.0)
        assert scope.status()["doing"] == "tracking"
        assert scope.status()["rotator"]["mode"] == "mount"
        parked = scope.park()
        assert parked["rotator"]["target_deg"] == pytest.approx(-60.0)
        assert scope.status()["rotator"]["angle_deg"] == pytest.approx(-60.0, abs=1e-6)
        assert scope.status()["rotator"]["mode"] is None


def seconds(answer, name):
    return datetime.fromisoformat(answer[name]).timestamp()


def test_the_rotator_belongs_to_the_arrival_that_is_announced_counted_down_and_met(tmp_path):
    with apo_telescope("sdss", tmp_path, rotator__park_deg=120.0) as scope:
        star = star_at(scope, 20.0, 50.0, scope.clock.now() + 60.0)
        planned, shown = scope.plan(star, position_angle_deg=150.0), []
        arrival = scope.goto(star, shown.append, position_angle_deg=150.0)
        late = scope.clock.now() - seconds(arrival, "arrival_utc")
        alone = seconds(arrival, "arrival_utc") - seconds(arrival, "axes_arrival_utc")
        print(f"the rotator arrives {alone:.1f} s after the axes; done {late:+.3f} s from what was announced")
        assert alone > 10.0
        assert 0.0 <= late < 0.5
        assert arrival["eta_s"] == pytest.approx(planned["eta_s"], abs=0.5)
        assert arrival["rotator"]["arrival_utc"] == arrival["arrival_utc"]
        assert shown[0].eta_s == pytest.approx(arrival["eta_s"], abs=1e-6)
        assert shown[0].remaining_s == pytest.approx(arrival["eta_s"], abs=0.5)
        (one, _), (two, _) = scope._session.planner.track(
            star, seconds(arrival, "arrival_utc"), arrival["posture"], scope._session.planner.angles((20.0, 50.0))
        )
        assert [axis["angle_deg"] for axis in arrival["axes"]] == pytest.approx(
            [math.degrees(one), math.degrees(two)], abs=1e-5
        )
        parked = scope.park()
        assert seconds(parked, "arrival_utc") > seconds(parked, "axes_arrival_utc") + 1.0
        assert abs(scope.clock.now() - seconds(parked, "arrival_utc")) < 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_another_position_angle_of_what_is_tracked_turns_the_rotator_alone(kind, tmp_path, monkeypatch):
    with apo_telescope(kind, tmp_path, rotator__mode="sky") as scope:
        witness = ApoWitness(scope)
        star = star_at(scope, 200.0, 50.0, scope.clock.now() + 60.0)
        scope.goto(star, position_angle_deg=10.0)
        scope.wait(15.0)
        drifted = []
        for axis in scope._session.drive.axes:
            monkeypatch.setattr(
                axis, "drift", lambda axis=axis, drift=axis.drift: drifted.append(axis.name) or drift()
            )
        off, slewing = [], []

        def look(_):
            off.append(witness.off_arcsec(star))
            slewing.append(scope._session.doing)

        turned = scope.goto(star, look, position_angle_deg=70.0)
        found = scope.status()
        print(f"{kind}: while it turned, {len(off)} looks, {max(off):.4f}″ off at most; DRIFT to {drifted}")
        assert set(drifted) == {"rotator"}
        assert max(off) < 0.05
        assert set(slewing) == {"slewing"}
        assert turned["eta_s"] > 10.0
        assert found["doing"] == "tracking"
        assert not found["rotator"]["slewing"]
        assert found["rotator"]["position_angle_deg"] == pytest.approx(70.0, abs=1e-4)


def test_tracking_ends_at_the_rotators_limit_as_it_was_foretold_and_another_angle_can_be_held(tmp_path):
    with apo_telescope("apo", tmp_path, rotator__min_deg=-100.0, rotator__max_deg=150.0) as scope:
        star = star_at(scope, 165.0, 78.0, scope.clock.now() + 60.0)
        rates = scope.rates(star)["rotator"]
        assert rates["rate_deg_s"] < 0.0
        held = -96.0 - rates["angle_deg"]  # so that it arrives a degree or two from the end of its travel
        arrival = scope.goto(star, position_angle_deg=held)
        foretold, limit = scope.status()["next_limit"], arrival["rotator"]["next_limit"]
        assert foretold["name"] == limit["name"] == "rotator soft limit"
        while scope.status()["doing"] == "tracking":
            scope.wait(5.0)
        late = scope.clock.now() - datetime.fromisoformat(foretold["utc"]).timestamp()
        assert -10.5 <= late < 7.0  # the controllers are given the path ten seconds ahead
        trouble = scope.status()["trouble"]
        print(f"{late:+.1f} s from what was foretold: {trouble}")
        assert "rotator" in trouble
        assert "-100° to 150°" in trouble
        assert "`goto`" in trouble
        with pytest.raises(Unreachable, match=r"rotator.* is at the end of its travel"):
            scope.goto(star, position_angle_deg=held)
        scope.goto(star, position_angle_deg=held + 90.0)
        assert scope.status()["doing"] == "tracking"


def test_what_no_rotator_can_do_is_refused_before_anything_moves(tmp_path):
    with apo_telescope("sdss", tmp_path / "with", rotator__min_deg=-90.0, rotator__max_deg=90.0) as scope:
        star = star_at(scope, 200.0, 50.0, scope.clock.now() + 60.0)
        with pytest.raises(Unreachable, match=r"150° on the mount, at 150\.000° is 60\.000° outside its travel"):
            scope.goto(star, rotator="mount", position_angle_deg=150.0)
        with pytest.raises(ArgumentError, match="use one of sky, horizon, mount"):
            scope.goto(star, rotator="star")
        assert scope.status()["doing"] == "idle"
    with (
        apo_telescope("sdss", tmp_path / "without") as scope,
        pytest.raises(Refused, match=r"no rotator: a table \[rotator\]"),
    ):
        scope.goto(star, position_angle_deg=1.0)
