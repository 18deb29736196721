"""Satellites by their elements are met once and followed, on the simulator's wire; a table ends before its end."""

import math
import os

import pytest
from satellites import EPOCH_UTC, NO_DRAG, ORBITS, lines

from clockdrive import Telescope, VirtualClock
from clockdrive.cli import display
from clockdrive.errors import Refused
from clockdrive.utc import utc
from pointing.instant import Instant
from pointing.satellite import Satellite
from pointing.tle import Tle
from pointing.visibility import passes

START = Instant.from_utc_iso(EPOCH_UTC).posix()
HIGH = {
    "Molniya": ORBITS["Molniya"],
    "GPS": ORBITS["GPS"],
    "geostationary": lines(41867, 0.05, 80.0, 0.0002, 90.0, 250.0, 1.00273, NO_DRAG),  # one that the site sees
}
LOW = [("400 km", "altaz-fork"), ("sun-synchronous", "equatorial-fork")]
if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full":
    LOW += [("400 km", "equatorial-fork"), ("sun-synchronous", "altaz-fork")]


def opened(time):
    return Telescope.simulated("tc410", clock=VirtualClock(time))


@pytest.mark.parametrize("name", HIGH)
def test_a_high_satellite_is_met_by_one_slew_and_followed(name, tmp_path, monkeypatch):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    target = Satellite(Tle(*HIGH[name], name))
    with opened(START) as scope:
        found = max(passes(scope._session.planner, target, START, START + 86400.0), key=lambda each: each.duration)
    with opened(found.rise.time + found.duration / 3.0) as scope:
        arrival = scope.goto(target)
        worst = 0.0
        for _ in range(60):
            scope.wait(5.0)
            worst = max(worst, scope.status()["error_arcsec"])
        print(f"{name}: {arrival['arrival_error_arcsec']:.2f}″ on landing, at most {worst:.2f}″ in five minutes")
        assert arrival["slews"] == 1
        assert arrival["arrival_error_arcsec"] < 5.0  # a tenth of a second of its way, before tracking
        assert worst < 1.0
        assert scope.status()["doing"] == "tracking"


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "kind"), LOW)
def test_a_low_satellite_is_waited_for_and_met_with_its_velocity(name, kind, tmp_path, monkeypatch):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    monkeypatch.setenv("CLOCKDRIVE_MOUNT__TYPE", kind)
    target = Satellite(Tle(*ORBITS[name], name))
    with opened(START) as scope:
        day = passes(scope._session.planner, target, START, START + 2 * 86400.0)
        found = next(each for each in day if each.duration > 200.0 and each.rise.time > START + 300.0)
    with opened(found.rise.time - 200.0) as scope:
        plan = scope.plan(target)
        assert plan["pass"]["followed_s"] > 0.5 * found.duration
        assert abs(plan["eta_s"] - 200.0) < 3.0
        arrival = scope.goto(target)
        assert arrival["slews"] == 1
        assert any(note.startswith(f"{name}: its elements are") for note in arrival["notes"])
        scope.wait(2.0)
        worst = 0.0
        while scope.status()["doing"] == "tracking":
            now = Instant.from_posix(scope.clock.now()).posix()
            if not any(gap["begin_utc"] <= utc(now + 1.0) and utc(now - 1.0) <= gap["end_utc"] for gap in lost(plan)):
                worst = max(worst, scope.status()["error_arcsec"])
            scope.wait(3.1)
        print(f"{name}, {kind}: {plan['pass']['followed_s']:.0f} s of {found.duration:.0f} s, worst {worst:.2f}″")
        assert worst < 5.0
        assert "before it would lead out" in scope.status()["trouble"]


@pytest.fixture
def soon(tmp_path, monkeypatch):
    """A telescope, and a 400 km satellite that comes up in 100 s."""
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    target = Satellite(Tle(*ORBITS["400 km"], "TEST 1"))
    with opened(START) as scope:
        day = passes(scope._session.planner, target, START, START + 2 * 86400.0)
        found = next(each for each in day if each.duration > 200.0 and each.rise.time > START + 300.0)
    with opened(found.rise.time - 100.0) as scope:
        yield scope, target, found


def test_while_a_satellite_is_waited_for_progress_and_status_say_so_with_the_seconds_left(soon):
    scope, target, found = soon
    said, refusals = [], []

    def watch(progress):
        status = scope.status().json
        bar = {"target": progress.target, "remaining_s": progress.remaining_s, "waiting": str(progress.waiting)}
        said.append((progress.waiting, scope.clock.now(), status, display.live_line(status), display._slew_line(bar)))
        if progress.waiting and not refusals:
            with pytest.raises(Refused, match="the telescope is waiting; wait for it") as refused:
                scope.offset(1.0, 0.0)
            refusals.append(refused)

    scope.goto(target, watch)
    waits = [each for each in said if each[0] is not None]
    assert len(waits) > 50
    assert refusals
    for waiting, now, status, line, bar in waits:
        assert (status["doing"], status["target"]) == ("waiting", "TEST 1")
        assert status["waiting"]["left_s"] == pytest.approx(waiting.until - now, abs=0.1)
        assert abs(waiting.until - found.rise.time) < 2.0
        assert waiting.azimuth_deg == pytest.approx(math.degrees(found.rise.azimuth), abs=0.1)
        text = (
            f"waiting for TEST 1 at azimuth {waiting.azimuth_deg:.2f}°, altitude {waiting.altitude_deg:.2f}°, until "
        )
        assert line.startswith(text)
        assert line.endswith("s left")
        assert bar.startswith(text)
    slews = [status for waiting, _, status, _, _ in said if waiting is None]
    assert {(each["doing"], each["target"], each["waiting"]) for each in slews} == {("slewing", "TEST 1", None)}
    assert scope.status()["waiting"] is None


def test_a_dead_man_process_that_is_slow_to_start_does_not_leave_the_axes_behind(soon, monkeypatch):
    scope, target, found = soon
    guardian = scope._session.drive._direct._guardian
    monkeypatch.setattr(guardian, "start", lambda: scope.clock.sleep(4.0))
    scope.wait(found.rise.time + 60.0 - scope.clock.now())
    arrival = scope.goto(target)
    print(f"{arrival['arrival_error_arcsec']:.1f}″ off on joining, {arrival['slews']} slew(s)")
    assert arrival["arrival_error_arcsec"] < 30.0
    assert arrival["slews"] == 1


def lost(plan):
    return plan["pass"]["lost"]


def test_a_table_that_ends_stops_the_telescope_before_its_end(tmp_path, monkeypatch):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path / "state"))
    with opened(START) as scope:
        frame = scope._session.planner.sky.at(Instant.from_posix(START))
        x, y, z = frame.astrometric((0.3, 0.2, math.sqrt(1.0 - 0.13)))
        ra, dec = math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z))
        rows = "".join(f"{utc(START + 60.0 * (k - 2))[:-1]} {ra + 0.01 * k:.6f} {dec:.6f}\n" for k in range(8))
        path = tmp_path / "rock.ecsv"
        path.write_text(
            "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: time, datatype: string}\n"
            "# - {name: ra, unit: deg, datatype: float64}\n# - {name: dec, unit: deg, datatype: float64}\n"
            f"time ra dec\n{rows}",
            encoding="utf-8",
        )
        plan = scope.plan(f"ephem:{path}")
        assert plan["next_limit"]["name"] == "target"
        scope.goto(f"ephem:{path}")
        scope.wait(START + 298.0 - scope.clock.now())
        assert scope.status()["doing"] == "tracking"
        scope.wait(4.0)
        status = scope.status()
        assert status["doing"] == "idle"
        assert "rock: its table holds" in status["trouble"]
        events = [event for event in scope.events(50) if "its table holds" in event.text]
        assert min(event.time for event in events) <= START + 300.0
        assert not any(axis.moved for axis in scope.simulator.axes)
