"""What a person does with the rotator alone: jog it, declare where it stands; and what moves the axes alone."""

import math

import pytest
from apo_bench import apo_telescope
from telescope_bench import star_at

from clockdrive.errors import ArgumentError, Refused
from pointing.errors import Unreachable


@pytest.fixture
def scope(tmp_path):
    with apo_telescope("apo", tmp_path, rotator__mode="sky", rotator__min_deg=-90.0, rotator__max_deg=100.0) as scope:
        yield scope


def true_angle(scope):
    scope.simulator.advance(scope.clock.now())
    return scope.simulator.true_position(3)


def test_a_jog_turns_the_rotator_by_its_speed_and_time_within_its_limits_and_says_when(scope):
    began, shown = scope.clock.now(), []
    jogged = scope.jog("rotator", 2.0, 5.0, shown.append)
    assert true_angle(scope) == pytest.approx(10.0, abs=1e-6)
    assert scope.status()["axes"][0]["angle_deg"] == pytest.approx(0.0, abs=1e-6)
    late = scope.clock.now() - began - jogged["eta_s"]
    print(f"10° in {jogged['eta_s']:.2f} s, done {late:+.3f} s from what was announced")
    assert 0.0 <= late < 0.5
    assert jogged["eta_s"] > 5.0
    assert shown[0].eta_s == pytest.approx(jogged["eta_s"])
    with pytest.raises(
        Unreachable, match=r"at 110\.000° is 10\.000° outside its travel, allowed -90\.00° to 100\.00°"
    ):
        scope.jog(3, 2.0, 50.0)
    with pytest.raises(Refused, match=r"9°/s: rotator goes at up to ±3\.500°/s"):
        scope.jog("rot", 9.0, 1.0)
    with pytest.raises(ArgumentError, match="use 1, axis1 or azimuth"):
        scope.jog("focus", 1.0, 1.0)


def test_what_moves_the_axes_alone_ends_what_the_rotator_followed(scope):
    scope.goto(star_at(scope, 200.0, 50.0, scope.clock.now() + 60.0), position_angle_deg=10.0)
    scope.jog("altitude", -0.5, 20.0)
    scope.wait(5.0)
    assert (scope.status()["doing"], scope.status()["trouble"]) == ("idle", "")
    assert scope.status()["rotator"]["rate_deg_s"] == 0.0


def test_an_image_declares_where_the_rotator_stands_and_what_is_tracked_is_held_anew(scope):
    scope.goto(star_at(scope, 200.0, 50.0, scope.clock.now() + 60.0), position_angle_deg=20.0)
    before = true_angle(scope)
    with pytest.raises(Refused, match=r"by 10\.00°, more than 5°: check the angle, or say --force"):
        scope.sync_rotator(position_angle_deg=30.0)
    moved = scope.sync_rotator(position_angle_deg=23.0)
    assert moved == pytest.approx(3.0, abs=1e-3)
    scope.wait(20.0)
    found = scope.status()
    print(f"the true rotator went {true_angle(scope) - before:+.4f}°; the scale moved by {moved:+.4f}°")
    assert found["doing"] == "tracking"
    assert found["rotator"]["position_angle_deg"] == pytest.approx(20.0, abs=1e-4)
    assert true_angle(scope) - before == pytest.approx(-3.0, abs=0.2)  # with the field's own rotation meanwhile
    assert found["error_arcsec"] < 0.05
    assert "rotator at" in next(event.text for event in scope.events(5) if event.kind == "sync")


def test_a_rotator_that_lost_its_angle_is_repaired_by_that_alone(scope):
    scope.simulator.axes[2].restart(scope.clock.now(), loses_position=True)
    scope.simulator.axes[2].believe(40.0)
    scope.wait(15.0)
    assert not scope.status()["synchronised"]
    assert "rotator" in scope.status()["unsynchronised_because"]
    assert any("--rotator-angle DEG" in note for note in scope.status()["notes"])
    scope.sync_rotator(0.0)
    found = scope.status()
    assert found["synchronised"]
    assert found["rotator"]["angle_deg"] == pytest.approx(0.0, abs=1e-4)
    assert found["rotator"]["uncertainty_counts"] < 0.01
    assert math.isclose(found["axes"][1]["angle_deg"], 45.0, abs_tol=1e-6)


def test_a_sync_of_the_rotator_wants_one_angle_within_its_limits(scope, tmp_path):
    with pytest.raises(ArgumentError, match="not both"):
        scope.sync_rotator(1.0, position_angle_deg=2.0)
    with pytest.raises(ArgumentError, match="not both"):
        scope.sync_rotator()
    with pytest.raises(Refused, match=r"cannot stand at 120\.000° is 20\.000° outside.*; check the angle"):
        scope.sync_rotator(120.0, force=True)
    with (
        apo_telescope("apo", tmp_path / "without") as without,
        pytest.raises(Refused, match=r"no rotator: a table \[rotator\]"),
    ):
        without.sync_rotator(1.0)
