"""A pointing run goes on whatever happens at a place, says why one was skipped, and loses nothing that was seen."""

import math
import os
import select
import sqlite3
import sys
from collections import deque

import pytest
from telescope_bench import QUICK, telescope

from clockdrive.errors import Refused, StateError
from clockdrive.observing import IMPLAUSIBLE_DEG
from clockdrive.run_store import FILE_NAME
from clockdrive.witness import CommandWitness, Sighting, WitnessError, sighted
from mounts.errors import DriveError
from pointing.instant import Instant
from pointing.limits import Horizon, Limits
from pointing.vectors import azimuth_altitude, from_azimuth_altitude, longitude_latitude
from transports.errors import LinkError

N = 6
CROOKED = {
    "mount__type": "german",
    "simulator__misalignment_x_arcsec": 900.0,
    "simulator__misalignment_y_arcsec": -600.0,
    "simulator__collimation_arcsec": 180.0,
    **QUICK,
}
TRUTH = {"MA": -900.0, "ME": 600.0, "CH": 180.0}


@pytest.fixture
def scope(tmp_path):
    with telescope(tmp_path, **CROOKED) as opened:
        yield opened


class Witness:
    """The true sky, but for what happens at the looks that are named, counted from 1."""

    def __init__(self, scope, happens):
        self.sky, self.happens, self.looks = scope.true_sky, happens, 0

    def look(self):
        self.looks += 1
        happens = self.happens(self.looks) if callable(self.happens) else self.happens.get(self.looks)
        seen = yield from self.sky.look()
        return seen if happens is None else happens(seen)


def fails(_seen):
    raise WitnessError("the plate solver found no stars")


def crashes(_seen):
    raise ZeroDivisionError("a mistake in somebody's own witness")


def is_astray(seen, off_deg=40.0):
    azimuth, altitude = azimuth_altitude(seen.observed)
    off = math.radians(off_deg) * (1.0 if altitude < 0.7 else -1.0)
    return Sighting(from_azimuth_altitude(azimuth, altitude + off), seen.time, seen.sigma_arcsec)


def is_no_number(seen):
    return Sighting((math.nan, math.nan, math.nan), seen.time, seen.sigma_arcsec)


def is_of_tomorrow(seen):
    return Sighting(seen.observed, seen.time + 86400.0, seen.sigma_arcsec)


class Told:
    """What a run says while it goes on."""

    def __init__(self, when=None, then=None):
        self.steps, self.when, self.then = [], when, then

    def __call__(self, progress):
        self.steps.append(progress)
        if self.then is not None and (progress.number, progress.state) == self.when:
            self.then()

    def of(self, state):
        return [each.number for each in self.steps if each.state == state]

    def reasons(self):
        return {each.number: each.detail for each in self.steps if each.state == "skipped"}


def moved(scope):
    scope.wait(8.0)
    scope.simulator.advance(scope.clock.now())
    before = [scope.simulator.true_position(axis) for axis in (1, 2)]
    scope.wait(5.0)
    scope.simulator.advance(scope.clock.now())
    return before != [scope.simulator.true_position(axis) for axis in (1, 2)]


def assert_the_true_mount(report, within_arcsec=2.0):
    found = {each.name: each.arcsec for each in report.fit.coefficients}
    for name, arcsec in TRUTH.items():
        assert found[name] == pytest.approx(arcsec, abs=within_arcsec), found


def test_every_place_is_seen_once_and_kept_with_what_a_fit_needs_at_any_time(scope):
    scope.offset(30.0, -20.0)
    told = Told()
    report = scope.pointing_run(N, name="kept", watch=told)
    assert told.of("slewing") == told.of("looking") == told.of("observed") == list(range(1, N + 1))
    assert scope.status()["doing"] == "idle"
    assert not moved(scope)
    assert_the_true_mount(report)
    for seen in scope.runs["kept"].observations:
        angles = scope._session.planner.angles(seen.counts)
        assert [math.degrees(angle) for angle in angles] == pytest.approx(seen.axes_deg, abs=1e-12)
        assert seen.posture == ("beyond" if abs(seen.axes_deg[1]) > 90.0 else "normal")
        assert seen.weather["pressure_hpa"] == pytest.approx(scope.configuration.weather.pressure_hpa)
        assert seen.in_force["offset_east_arcsec"] == 30.0
        assert seen.in_force["pointing_model_arcsec"] is None
        assert seen.masked == ""
    print(report.text)


def test_the_fit_does_not_depend_on_the_model_with_which_the_telescope_was_sent_there(scope):
    found = []
    for name in ("without", "with"):
        report = scope.pointing_run(N, name=name)
        assert (report.stored.observations[0].in_force["pointing_model_arcsec"] is not None) is (name == "with")
        found.append({each.name: each.arcsec for each in report.fit.coefficients})
        scope.use_model(report)
    apart = {name: found[1][name] - found[0][name] for name in found[0]}
    print({name: f"{off:+.3f}″" for name, off in apart.items()})
    assert max(map(abs, apart.values())) < 1.0  # counts are whole, 0.9″


BAD_LOOKS = {
    2: (fails, "the plate solver found no stars"),
    3: (crashes, "the witness failed: ZeroDivisionError"),
    4: (is_astray, "from where the telescope believes to point, at most 5° are believed"),
    5: (is_no_number, "the witness saw it nan° from where"),
    6: (is_of_tomorrow, "the time of the exposure is of no use"),
}


def test_a_bad_look_skips_its_place_with_the_reason_and_the_place_is_tried_once_more_at_the_end(scope):
    told = Told()
    witness = Witness(scope, {look: happens for look, (happens, _) in BAD_LOOKS.items()})
    report = scope.pointing_run(N, witness, watch=told)
    assert set(told.reasons()) == set(BAD_LOOKS)
    assert all(BAD_LOOKS[number][1] in why for number, why in told.reasons().items()), told.reasons()
    assert told.of("looking") == [*range(1, N + 1), *BAD_LOOKS]
    assert len(report.stored.observations) == N
    assert not report.stored.skipped
    assert_the_true_mount(report)


def test_what_fails_again_stays_skipped_with_its_reason_and_the_others_are_fitted(scope):
    report = scope.pointing_run(N + 2, Witness(scope, dict.fromkeys((4, 7, N + 3, N + 4), fails)))
    assert [each.number for each in report.stored.skipped] == [4, 7]
    assert {each.reason for each in report.stored.skipped} == {"the plate solver found no stars"}
    assert len(report.stored.observations) == N
    assert any("skipped: 2 places" in each for each in report.recommendation)
    assert_the_true_mount(report)


def test_clouds_over_half_of_the_stars_leave_the_other_half(scope):
    report = scope.pointing_run(2 * N, Witness(scope, lambda look: fails if look % 2 or look > 2 * N else None))
    print(f"{len(report.stored.observations)} seen, {len(report.stored.skipped)} skipped")
    assert (len(report.stored.observations), len(report.stored.skipped)) == (N, N)
    assert_the_true_mount(report)


def test_a_witness_that_never_sees_anything_ends_the_run_early_and_it_is_resumed_when_the_sky_clears(scope):
    clouded = Witness(scope, lambda look: fails)  # noqa: ARG005 - whatever look
    with pytest.raises(Refused, match=r"nothing was seen at the first 5 places, the last time: .*resume cloudy"):
        scope.pointing_run(N, clouded, name="cloudy")
    assert clouded.looks == 5
    assert scope.status()["doing"] == "idle"
    report = scope.pointing_run(witness="simulator", name="cloudy", resume=True)
    assert len(report.stored.observations) == N


def test_a_run_that_is_resumed_under_a_closed_sky_ends_early_too_though_stars_were_seen_before(scope):
    with pytest.raises(Refused, match="stopped by command"):
        scope.pointing_run(2 * N + 2, name="cloudy", watch=Told((3, "observed"), scope.stop))
    clouded = Witness(scope, lambda look: fails)  # noqa: ARG005 - whatever look
    with pytest.raises(Refused, match=r"nothing was seen at the first 5 places, the last time: .*resume cloudy"):
        scope.pointing_run(name="cloudy", resume=True, witness=clouded)
    assert clouded.looks == 5


def test_what_was_seen_is_kept_though_another_process_holds_the_file_meanwhile(scope, tmp_path, monkeypatch):
    """Another process begins to write before place 4 is written, and goes on for half a minute of this clock."""
    other = sqlite3.connect(tmp_path / FILE_NAME, isolation_level=None, check_same_thread=False)
    monkeypatch.setattr("clockdrive.telescope.looking._PATIENCE_S", 0.01)
    held = []

    def cycle(usual=scope._session.cycle):
        if held and scope.clock.now() - held[0] > 30.0 and other.in_transaction:
            other.execute("ROLLBACK")
        return usual()

    def hold():
        if not held:
            held.append(scope.clock.now())
            other.execute("BEGIN IMMEDIATE")

    monkeypatch.setattr(scope._session, "cycle", cycle)
    told = Told((4, "looking"), hold)
    report = scope.pointing_run(N, watch=told)
    other.close()
    assert told.of("observed") == list(range(1, N + 1))
    assert len(report.stored.observations) == N
    assert_the_true_mount(report)


def test_a_file_that_stays_held_ends_the_run_with_the_remedy_and_the_telescope_at_rest(scope, tmp_path, monkeypatch):
    monkeypatch.setattr("clockdrive.telescope.looking._PATIENCE_S", 0.001)
    other = sqlite3.connect(tmp_path / FILE_NAME, isolation_level=None)
    with pytest.raises(StateError, match=r"another process has held it .*: end that one"):
        scope.pointing_run(N, name="held", watch=Told((4, "looking"), lambda: other.execute("BEGIN IMMEDIATE")))
    other.close()
    assert not moved(scope)
    assert len(scope.runs["held"].observations) == 3
    assert len(scope.pointing_run(name="held", resume=True).stored.observations) == N


def test_too_few_stars_are_said_and_not_fitted(scope):
    from clockdrive.run_report import TooFewStars

    with pytest.raises(TooFewStars, match=r"has 3 stars to fit, 3 places skipped; a fit of 7 terms needs 6"):
        scope.pointing_run(N, Witness(scope, lambda look: None if look <= 3 else fails), name="short")
    assert len(scope.runs["short"].observations) == 3


@pytest.mark.parametrize("state", ["slewing", "observed"])
def test_a_stop_ends_the_run_at_once_and_resuming_goes_on_there(state, scope):
    told = Told((5, state), scope.stop)
    with pytest.raises(Refused, match="stopped by command"):
        scope.pointing_run(N, name="stopped", watch=told)
    assert not moved(scope)
    kept = 5 if state == "observed" else 4
    assert len(scope.runs["stopped"].observations) == kept
    again = Told()
    report = scope.pointing_run(name="stopped", resume=True, watch=again)
    assert again.of("observed") == list(range(kept + 1, N + 1))
    assert len(report.stored.observations) == N


def test_ctrl_c_stops_the_motion_and_leaves_a_run_that_is_resumed(scope):
    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        scope.pointing_run(N, name="interrupted", watch=Told((5, "looking"), interrupt))
    assert not moved(scope)
    assert len(scope.pointing_run(name="interrupted", resume=True).stored.observations) == N


def test_a_watcher_that_fails_ends_the_run_with_its_own_error(scope):
    def fail():
        raise ValueError("no more paper")

    with pytest.raises(ValueError, match="no more paper"):
        scope.pointing_run(N, name="watched", watch=Told((3, "looking"), fail))
    assert not moved(scope)
    assert scope.runs["watched"].skipped == ()


def test_a_place_that_has_left_the_limits_is_skipped_with_the_limit_and_the_run_goes_on(scope):
    def raise_horizon():
        planner = scope._session.planner
        planner.limits = Limits(Horizon.level(45.0), 0.0)

    report = scope.pointing_run(2 * N, watch=Told((8, "observed"), raise_horizon))
    below = [each for each in report.stored.places[8:] if math.degrees(each.place.altitude) < 45.0]
    assert {each.number for each in report.stored.skipped} >= {each.number for each in below}
    assert all("horizon" in each.reason for each in report.stored.skipped), report.stored.skipped
    assert len(report.stored.observations) + len(report.stored.skipped) == 2 * N
    print(f"{len(below)} places below the raised horizon, {len(report.stored.observations)} seen")


class CutLine:
    """A line to the unit that is cut while `dead` says so."""

    dead = False

    def __init__(self, device):
        self.device = device

    def receive(self, data, t):
        if CutLine.dead:
            raise LinkError("the cable is out")
        return self.device.receive(data, t)


@pytest.fixture
def cut(tmp_path, monkeypatch):
    from clockdrive import Telescope, VirtualClock

    monkeypatch.setattr(CutLine, "dead", False)
    overrides = {name.replace("__", "."): value for name, value in CROOKED.items()}
    overrides |= {"state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0}
    with Telescope.simulated(clock=VirtualClock(1.8e9), overrides=overrides, line=CutLine) as opened:
        yield opened
        CutLine.dead = False


def test_a_link_that_is_lost_for_a_minute_costs_one_place_which_is_seen_at_the_end(cut, monkeypatch):
    scope, lost = cut, []
    cycle = scope._session.cycle

    def mended():
        lost.append(scope.clock.now())
        if lost[-1] - lost[0] > 60.0:
            CutLine.dead = False
        return cycle()

    monkeypatch.setattr(scope._session, "cycle", mended)
    told = Told((5, "slewing"), lambda: setattr(CutLine, "dead", not lost))
    report = scope.pointing_run(N, watch=told)
    assert set(told.reasons()) == {5}
    assert told.of("observed") == [1, 2, 3, 4, *range(6, N + 1), 5]
    print(told.reasons())
    assert_the_true_mount(report)


def test_a_link_that_stays_lost_ends_the_run_which_is_resumed_when_it_is_back(cut):
    scope = cut
    with pytest.raises(Refused, match=r"the drive has not answered for 600 s: check its link; .* resume away"):
        scope.pointing_run(N, name="away", watch=Told((5, "slewing"), lambda: setattr(CutLine, "dead", True)))
    assert len(scope.runs["away"].observations) == 4
    CutLine.dead = False
    scope.wait(5.0)
    assert not moved(scope)
    assert len(scope.pointing_run(name="away", resume=True).stored.observations) == N


def test_a_drive_that_does_not_go_ends_the_run_after_three_slews(scope, monkeypatch):
    def blocked(*_):
        raise DriveError("a clutch slips")

    starts = Told((4, "observed"), lambda: monkeypatch.setattr(scope._session.drive, "start", blocked))
    with pytest.raises(Refused, match=r"3 slews one after the other failed, the last one: a clutch slips"):
        scope.pointing_run(N, name="stuck", watch=starts)
    assert len(scope.runs["stuck"].observations) == 4
    assert not moved(scope)


def test_a_person_types_the_places(scope):
    frame = scope._session.planner.sky

    def ask(_what):
        ra, dec = longitude_latitude(
            frame.at(Instant.from_posix(scope.clock.now())).astrometric(scope.true_sky.observed())
        )
        scope.reply(f"{math.degrees(ra):.5f} {math.degrees(dec):+.5f}")

    report = scope.pointing_run(N, "typed", ask=ask, bright=True)
    assert all(each.place.name for each in report.stored.places)
    assert {seen.sigma_arcsec for seen in report.stored.observations} == {30.0}
    assert_the_true_mount(report, within_arcsec=6.0)  # their proper motion and parallax are not in what is typed


def test_a_line_that_was_typed_before_anybody_asked_is_no_answer(scope):
    def ask(_what):
        seen = scope._session.planner.sky.at(Instant.from_posix(scope.clock.now()))
        ra, dec = longitude_latitude(seen.astrometric(scope.true_sky.observed()))
        scope.reply(f"{math.degrees(ra):.5f} {math.degrees(dec):+.5f}")
        scope.reply(f"{math.degrees(ra):.5f} {math.degrees(dec) + 1.0:+.5f}")  # for nobody

    report = scope.pointing_run(N, "typed", ask=ask)
    assert_the_true_mount(report, within_arcsec=6.0)
    assert report.stored.settings["witness"] == "typed"


@pytest.mark.skipif(sys.platform == "win32", reason="it has no groups of processes")
def test_a_solver_that_takes_too_long_is_ended_with_all_that_it_has_started(scope, tmp_path):
    fifo, program = tmp_path / "alive", tmp_path / "solve.sh"
    os.mkfifo(fifo)
    program.write_text(f"#!/bin/sh\nexec 3>{fifo}\necho begun >&3\nsleep 60\n", encoding="utf-8")
    program.chmod(0o755)
    alive = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)  # open for as long as the script or its child lives
    looking = CommandWitness(str(program), scope._session.planner, scope.clock, patience_s=2.0).look()
    next(looking)
    select.select([alive], [], [], 30.0)
    assert os.read(alive, 10) == b"begun\n"
    with pytest.raises(WitnessError, match="it was ended"):
        deque(looking, maxlen=0)
    assert select.select([alive], [], [], 30.0)[0]
    assert os.read(alive, 10) == b""
    os.close(alive)


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("import sys; sys.exit(3)", "failed with exit code 3; run it by hand"),
        ("print('no solution')", "print RA and Dec"),
        ("import time; time.sleep(60)", r"said nothing for 2 s; it was ended"),
        ("print('10.0 -85.0')", f"at most {IMPLAUSIBLE_DEG:g}° are believed"),
    ],
    ids=["fails", "prints no place", "says nothing", "sees another place"],
)
def test_a_plate_solver_that_is_of_no_use_is_told_with_its_command(program, reason, scope):
    session = scope._session
    solver = CommandWitness(f'{sys.executable} -c "{program}"', session.planner, scope.clock, patience_s=2.0)
    told = Told()
    if "sleep" not in program:
        solver._patience = 1e9  # real programs take real time, of which this clock knows nothing
    with pytest.raises(Refused, match="nothing was seen at the first 5 places"):
        scope.pointing_run(N, solver, watch=told)
    assert all(reason in why for why in told.reasons().values()), told.reasons()


def test_encoders_are_no_witness_of_the_sky(scope):
    with pytest.raises(Refused, match="encoders see no sky"):
        scope.pointing_run(N, "encoders")
    assert scope.runs.names == ()


def test_the_last_line_of_a_chatty_solver_counts_however_much_it_printed_before(scope):
    chatty = f"{sys.executable} -c \"print('10 20\\n' * 5000 + 'solved\\x1b[2J' + 'x' * 500)\""
    solver = CommandWitness(chatty, scope._session.planner, scope.clock, patience_s=1e9)
    steps = solver.look()
    with pytest.raises(
        WitnessError, match=r"the last line of the witness says 'solved\\x1b\[2Jx+…': print RA"
    ) as said:
        exhausted(steps)
    assert str(said.value).isprintable()
    assert len(str(said.value)) < 300
    sighting = sighted("10 20\n" * 5000 + "187.5 -12.0", scope._session.planner, scope.clock.now(), 10.0)
    assert sighting.sigma_arcsec == 10.0
    with pytest.raises(WitnessError, match="it ends with no UTC") as said:
        sighted("187.5 -12.0 T\x1b[2J" + "9" * 500, scope._session.planner, scope.clock.now(), 10.0)
    assert str(said.value).isprintable()


def exhausted(steps):
    for _ in steps:
        pass


def test_a_run_that_is_being_taken_is_not_deleted(scope):
    def forgets(progress):
        if progress.number == 3 and progress.state == "looking":
            with pytest.raises(Refused, match="is being taken"):
                scope.runs.forget(progress.run)

    report = scope.pointing_run(N, name="kept", watch=forgets)
    assert report.fit.n == N
    scope.runs.forget("kept")
    assert scope.runs.names == ()


def test_a_witness_is_tried_where_the_telescope_rests_and_nothing_moves_or_is_kept(scope):
    before = scope._session.synchronised().counts
    found = scope.try_witness()
    believed, true = (scope._session.planner.observed(before), scope.true_sky.observed())
    off = math.degrees(math.dist(believed, true)) * 3600.0
    print(f"\ntried: {found['off_arcsec']:.1f}″ off, true {off:.1f}″")
    assert found["off_arcsec"] == pytest.approx(off, abs=0.1)
    assert scope._session.synchronised().counts == before
    assert scope.runs.names == ()
    with pytest.raises(WitnessError, match="failed with exit code 1"):
        scope.try_witness("command:false")
    scope.goto("altaz:60,50")
    with pytest.raises(Refused, match="where it rests: `stop` first"):
        scope.try_witness()
