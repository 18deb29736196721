"""What the telescope does by itself, where it cannot do it, and what people do meanwhile."""

import pytest
from orbit import Overhead
from telescope_bench import Witness, star_at, telescope

from clockdrive.cli import display
from clockdrive.errors import Refused
from mounts.tc410.registers import by_name
from pointing.errors import TargetError, Unreachable

MOVING = by_name("velocity_control").mask("tracking") | by_name("velocity_control").mask("remote_control")


def is_moved(scope):
    return bool(scope.simulator.memory.raw("velocity_control") & MOVING)


def test_an_escape_that_finds_no_place_leaves_the_telescope_tracking_under_guard(tmp_path, monkeypatch):
    """It goes on watching, and stops at the edge of the zone."""
    with telescope(tmp_path, limits__sun_escape="away") as scope:
        scope.goto(star_at(scope, 60.0, 45.0))
        automatic = scope._automatic
        monkeypatch.setattr(automatic, "_sun_comes", lambda *_: True)

        def nowhere(*_):
            raise Unreachable("no place that is safe from the Sun can be reached from here; cover the telescope")

        monkeypatch.setattr("clockdrive.automatic.refuge", nowhere)
        scope.wait(200.0)
        status = scope.status()
        assert (status["doing"], status["target"] is not None) == ("tracking", True)
        assert sum("no place that is safe" in event.text for event in scope.events(50)) >= 2
        scope.stop()
        assert not is_moved(scope)


def test_what_a_person_asked_for_first_is_not_overtaken(tmp_path, monkeypatch):
    """Between the decision to move by itself and the first motion no call comes in between."""
    with telescope(tmp_path, limits__sun_escape="away") as scope:
        scope.goto(star_at(scope, 60.0, 45.0))
        automatic, session = scope._automatic, scope._session
        monkeypatch.setattr(automatic, "_sun_comes", lambda *_: True)
        automatic.cycle()
        assert session.doing == "slewing"
        with pytest.raises(Refused, match="slewing"):
            scope.park()


def test_a_drive_that_tracks_while_nothing_is_followed_is_stopped(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto(star_at(scope, 60.0, 45.0))
        scope._session.fail("given up, as by a fault")
        assert is_moved(scope)
        scope.wait(5.0)
        assert not is_moved(scope)
        assert "nothing is followed" in scope.status()["trouble"]


def test_a_refusal_between_two_slews_leaves_nothing_that_seems_to_slew(tmp_path, monkeypatch):
    with telescope(tmp_path) as scope:
        session, star = scope._session, star_at(scope, 60.0, 45.0)
        plan, calls = session.plan, []

        def refusing(target, posture=None):
            calls.append(target)
            if len(calls) == 3:
                raise Unreachable("it is forbidden by now")
            return plan(target, posture)

        monkeypatch.setattr(session, "plan", refusing)
        monkeypatch.setattr("clockdrive.pursuit.Pursuit.error_arcsec", lambda *_: 90.0)
        with pytest.raises(Unreachable, match="by now"):
            scope.goto(star)
        monkeypatch.undo()
        assert scope._session.doing != "slewing"
        assert scope.goto(star)["ok"]


def test_a_sun_zone_that_nothing_moves_away_from_is_a_warning_in_the_status_while_it_lasts(tmp_path, monkeypatch):
    with telescope(tmp_path, limits__sun_escape="stop") as scope:
        scope.goto(star_at(scope, 60.0, 45.0))
        assert scope.status()["warnings"] == []
        monkeypatch.setattr(scope._automatic, "_sun_comes", lambda *_: True)
        scope.wait(3.0)
        (warning,) = scope.status()["warnings"]
        assert warning.startswith("the Sun's zone comes to where the telescope looks: move it away")
        assert f"  warning: {warning}" in display.status_text(scope.status().json)
        assert sum(event.kind == "Sun" for event in scope.events()) == 1
        monkeypatch.undo()
        scope.wait(3.0)
        assert scope.status()["warnings"] == []


def test_an_offset_waits_for_the_end_of_a_slew(tmp_path):
    with telescope(tmp_path) as scope:
        said = []

        def displace(_):
            if not said:
                with pytest.raises(Refused, match="slewing") as refused:
                    scope.offset(10.0, 0.0)
                said.append(str(refused.value))

        scope.goto(Overhead(scope.clock.now() + 60.0, 1.0, 0.1), displace)
        assert said


def test_a_fast_target_is_not_left_to_the_drive_and_never_said_to_be(tmp_path):
    with telescope(tmp_path, mount__type="altaz-fork") as scope:
        scope.goto(Overhead(scope.clock.now() + 120.0, 1.0, 0.1))
        assert scope.status()["led"]
        unit = scope.simulator
        assert scope.close(keep_tracking=True) is False
        unit.advance(scope.clock.now() + 10.0)
        assert not any(axis.moved for axis in unit.axes)


@pytest.mark.parametrize("between", ["sync", "speed"])
def test_the_speed_of_a_jog_is_nobody_elses(between, tmp_path):
    with telescope(tmp_path) as scope:
        full = scope.simulator.memory.raw("axis1_max_speed")
        scope.jog(1, 0.1, 2.0)
        assert scope.simulator.memory.raw("axis1_max_speed") == full
        if between == "sync":
            here = scope.status()["icrs"]
            scope.sync(f"{here['ra_deg']:.6f},{here['dec_deg']:.6f}")
            scope.jog(1, 0.1, 2.0)
            witness, star = Witness(scope), star_at(scope, 60.0, 45.0)
            scope.goto(star)
            assert witness.on_sky_arcsec(star, witness.now(), scope.clock.now()) < 2.0
        else:
            moved = scope.drive_at(1.0, 0.0, 5.0)
            assert moved["to_deg"][0] - moved["from_deg"][0] == pytest.approx(5.0, abs=0.2)
        assert scope.simulator.memory.raw("axis1_max_speed") == full


def test_an_instrument_that_fails_for_any_reason_leaves_the_one_before(tmp_path, monkeypatch):
    beside = {"instruments.main.x_arcsec": 0.0, "instruments.cam.x_arcsec": 1800.0}
    with telescope(tmp_path, **{name.replace(".", "__"): value for name, value in beside.items()}) as scope:
        scope.goto(star_at(scope, 60.0, 45.0))

        def ended(*_, **__):
            raise TargetError("its table has ended")

        monkeypatch.setattr(scope._session.planner, "plan", ended)
        with pytest.raises(TargetError):
            scope.instrument("cam")
        monkeypatch.undo()
        assert scope._instruments.name == "main"
        assert scope._session.planner.mount.origin_x == 0.0


def test_a_second_way_round_is_not_taken_straight(tmp_path, monkeypatch):
    """Where the way on from the place between is barred by then, the telescope stops there."""
    from dataclasses import replace

    with telescope(tmp_path) as scope:
        session = scope._session
        plan = session.plan

        def always_round(target, posture=None):
            straight = plan(target, posture)
            via = session.planner.plan_axes("between", (0.2, -0.5), session.start(), session.timing())
            return replace(straight, via=via)

        monkeypatch.setattr(session, "plan", always_round)
        started = []
        start = session.drive.start

        def seen(axes, time):
            started.append(tuple(axis.target for axis in axes))
            return start(axes, time)

        monkeypatch.setattr(session.drive, "start", seen)
        with pytest.raises(Refused, match="bars the way on from here"):
            scope.goto(star_at(scope, 60.0, 45.0))
        assert len(started) == 1
        assert session.doing == "idle"
