"""What the session keeps to, whoever commands it: it checks every reading, and never loses a telescope that moves."""

import asyncio
import math

import pytest
from telescope_bench import DEG_PER_COUNT, QUICK, T0, Witness, star_at, telescope

from clockdrive import Telescope
from clockdrive.clock import SystemClock, VirtualClock
from clockdrive.clock_watch import ClockStep
from clockdrive.errors import InputError, OwnedElsewhere, Refused, StateError
from clockdrive.state import Activity
from mounts.errors import DriveError
from mounts.tc410.registers import COUNTS_PER_SECOND, by_name
from pointing.errors import TargetError, Unreachable
from pointing.instant import Instant
from pointing.limits import separation
from transports.errors import LinkError, NoAnswer


@pytest.fixture
def scope(tmp_path):
    with telescope(tmp_path) as opened:
        yield opened


def setting_star(scope, above_deg=0.05):
    """A star that sets in the west, that much above the horizon limit of 15° after the slew."""
    return star_at(scope, 270.0, 15.0 + above_deg, scope.clock.now() + 40.0)


def kinds(scope):
    return [event.kind for event in scope.events()]


def moving(scope):
    scope.wait(6.0)  # for what ramps down
    scope.simulator.advance(scope.clock.now())
    return any(axis.moved for axis in scope.simulator.axes)


class Ending:
    """A star whose place nobody knows from a moment on, as that of Pluto at the end of its kernel."""

    name = "Ending"

    def __init__(self, star, end):
        self.star = star
        self.end = Instant.from_posix(end)

    def observed(self, frame):
        return self.observed_with_rate(frame)[0]

    def observed_with_rate(self, frame):
        if frame.instant > self.end:
            raise TargetError("Ending: its kernel ends here")
        return self.star.observed_with_rate(frame)


def test_a_target_that_nobody_knows_further_stops_the_telescope_with_its_own_sentence(scope):
    now = scope.clock.now()
    scope.goto(Ending(star_at(scope, 90.0, 50.0, now), now + 120.0))
    scope.wait(200.0)
    status = scope.status()
    assert (status["doing"], status["trouble"]) == ("idle", "Ending: its kernel ends here")
    assert not moving(scope)


def test_a_step_of_the_clock_in_a_goto_is_told_with_its_target_in_answer_and_status(scope, monkeypatch):
    now, steps = scope.clock.now(), [ClockStep(2.4, 0.0, 0.0)]
    due = lambda: steps.pop() if steps and scope.clock.now() > now + 2.0 else None  # noqa: E731 - one line
    monkeypatch.setattr(scope._session.surroundings._watch, "look", due)
    star = star_at(scope, 60.0, 45.0)
    (warning,) = scope.goto(star)["warnings"]
    assert warning.startswith(f"the clock was stepped by +2.4 s during the slew to {star.name} (bound")
    assert scope.status()["warnings"] == [warning]
    assert scope.goto(star_at(scope, 61.0, 45.0))["warnings"] == []


# Safety of every reading -------------------------------------------------------------------------------------------


def test_a_star_that_sets_is_left_within_a_cycle_with_the_reason(scope):
    scope.goto(setting_star(scope))
    altitudes = []
    for _ in range(400):
        scope.wait(1.0)
        status = scope.status()
        altitudes.append(status["observed"]["altitude_deg"])
        if status["doing"] == "idle":
            break
    assert status["doing"] == "idle"
    assert "the horizon limit of 15.00°" in status["trouble"]
    assert not moving(scope)
    lowest = min(altitudes)
    print(f"stopped {3600 * (15.0 - lowest):.1f}″ below the horizon limit; a cycle at this rate is 15″")
    assert 15.0 - lowest < 2 * 15.0 / 3600.0
    assert scope.goto("best")["ok"]  # and the way out is free


def test_the_sun_that_comes_to_a_telescope_on_a_fixed_place_stops_it(tmp_path):
    morning = T0 - 9.0 * 3600.0  # 11 h local time at Kaikoura in January
    with telescope(tmp_path, start=morning, limits__sun_avoidance_deg=20.0) as scope:
        x, y, z = scope._session.planner.sky.at(Instant.from_posix(morning + 5400.0)).sun()
        scope.goto(f"altaz:{math.degrees(math.atan2(y, -x)) % 360.0},{math.degrees(math.asin(z))}")
        scope._control._due = scope.clock.now() + 600.0  # nobody looks meanwhile
        scope.wait(1200.0)
        status = scope.status()
        assert status["doing"] == "idle"
        assert "inside its zone of 20.0°" in status["trouble"]


@pytest.mark.parametrize(
    ("disturbance", "reason"),
    [
        ({"alarms": ("supply_shut_down",)}, "alarm|standby"),
        ({"alarms": ("supply_over_voltage",)}, "supply_over_voltage.*find its cause"),
    ],
)
@pytest.mark.parametrize("during", ["slewing", "tracking"])
def test_an_alarm_ends_what_the_telescope_does(disturbance, reason, during, scope):
    def progress(_):
        if during == "slewing":
            scope.simulator.disturb(**disturbance)

    if during == "slewing":
        with pytest.raises((Refused, DriveError), match=reason):
            scope.goto("best", progress)
    else:
        scope.goto("best")
        scope.simulator.disturb(**disturbance)
        scope.wait(2.0)
        import re

        assert re.search(reason, scope.status()["trouble"])
    assert scope.status()["doing"] == "idle"
    assert not moving(scope)
    with pytest.raises((Refused, DriveError)):
        scope.goto("M42" if scope.status()["target"] == "best" else "best")


def test_standby_while_tracking_is_noticed_and_power_brings_it_back(scope):
    scope.goto("best")
    scope.power(on=False)
    status = scope.status()
    assert (status["doing"], status["powered"]) == ("idle", True) or not status["powered"]
    scope.wait(5.0)
    assert not scope.status()["powered"]
    with pytest.raises(DriveError, match=r"no power.*power on"):
        scope.goto("best")
    scope.power(on=True)
    scope.wait(5.0)
    assert scope.goto("best")["ok"]


def test_a_limit_switch_stops_the_slew_and_the_way_back_is_free(scope):
    pressed = []

    def press(progress):
        if not pressed and progress.remaining_s < progress.eta_s / 2:
            for axis in (1, 2):
                moved = scope.simulator.axes[axis - 1].moved
                if moved:
                    scope.simulator.press_limit(axis, 1 if moved > 0 else -1)
                    pressed.append(axis)

    with pytest.raises(Refused, match="limit reached"):
        scope.goto("best", press)
    assert pressed
    assert not moving(scope)
    scope.home()
    assert scope.status()["limits"] == []


def held_stick(scope, x, y=128):
    """Let the joystick move the axes, and hold it at these ADC values."""
    drive = scope._session.drive
    drive._write_control(drive._control | by_name("velocity_control").mask("joystick"))
    scope.simulator.joystick(x, y)


def altitude_deg(scope):
    return scope.status()["observed"]["altitude_deg"]


@pytest.mark.parametrize("adc", [30, 1], ids=["at half a degree a second", "at full speed"])
def test_a_joystick_held_towards_the_horizon_is_stopped_before_it_and_moves_nothing_until_let_go(adc, scope):
    scope.goto("altaz:90,25")
    scope.stop()
    scope.wait(5.0)
    held_stick(scope, adc)
    lowest = 90.0
    for _ in range(240):
        scope.wait(0.5)
        lowest = min(lowest, altitude_deg(scope))
    status = scope.status()
    print(f"lowest altitude {lowest:.3f}° of 15°; {status['trouble']}")
    assert lowest > 15.0
    assert status["trouble"].startswith("moved by joystick: stopped before it would lead out of what is allowed")
    assert not moving(scope)
    assert kinds(scope).count("stopped") == 2  # by command before, and once now
    scope.simulator.joystick(128, 128)
    scope.wait(4.0)
    scope.simulator.joystick(226, 128)
    scope.wait(6.0)
    assert altitude_deg(scope) > lowest + 1.0, "the way back is free"


@pytest.mark.parametrize("doing", ["idle", "parked"])
def test_below_the_horizon_a_joystick_leads_out_freely_and_deeper_not_at_all(doing, tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("altaz:90,20")
        scope.stop()
        later = scope.clock.now() + 60.0
    with telescope(tmp_path, start=later, limits__horizon_deg=30.0) as scope:
        if doing == "parked":
            scope._session.store.record_parked(parked=True, time=later)
            scope._session.now_doing("parked")
        scope.wait(4.0)
        before = altitude_deg(scope)
        held_stick(scope, 30)
        deepest = before
        for _ in range(60):
            scope.wait(0.5)
            deepest = min(deepest, altitude_deg(scope))
        print(f"{doing}: from {before:.2f}° to {deepest:.2f}° at worst; {scope.status()['trouble']}")
        assert not moving(scope)
        assert deepest > before - 1.5  # two seconds until it is seen, and the way to rest
        assert "below the horizon limit of 30.00°" in scope.status()["trouble"]
        scope.simulator.joystick(226, 128)
        scope.wait(40.0)
        assert altitude_deg(scope) > 30.0
        assert scope.status()["doing"] == doing


def test_a_joystick_held_towards_the_sun_is_stopped_before_its_zone(tmp_path):
    morning = T0 - 9.0 * 3600.0
    with telescope(tmp_path, start=morning, limits__sun_avoidance_deg=20.0) as scope:
        x, y, z = scope._session.planner.sky.at(Instant.from_posix(morning + 60.0)).sun()
        azimuth, altitude = math.degrees(math.atan2(y, -x)) % 360.0, math.degrees(math.asin(z))
        scope.goto(f"altaz:{azimuth},{altitude - 27.0}")
        scope.stop()
        planner, session, nearest = scope._session.planner, scope._session, math.inf
        held_stick(scope, 128, 226 if planner.angles(session.reading.counts)[1] < 0.0 else 30)

        def distance():
            sun = planner.sky.at(Instant.from_posix(scope.clock.now())).sun()
            return math.degrees(separation(planner.observed(session.reading.counts), sun))

        first = distance()
        for _ in range(120):
            scope.wait(0.5)
            nearest = min(nearest, distance())
        print(f"from {first:.2f}° to {nearest:.3f}° from the Sun, 20° must be kept; {scope.status()['trouble']}")
        assert first - 2.0 > nearest > 20.0
        assert "inside its zone of 20.0°" in scope.status()["trouble"]
        assert not moving(scope)


def test_a_hand_while_a_pass_is_waited_for_is_stopped_before_the_limit(scope):
    scope.goto("altaz:90,25")
    scope.stop()
    scope.wait(5.0)
    session = scope._session
    session.begin(Activity("waiting", scope.clock.now(), scope.clock.now() + 600.0, detail="a pass"))
    held_stick(scope, 30)
    lowest = 90.0
    for _ in range(60):
        scope.wait(0.5)
        lowest = min(lowest, altitude_deg(scope))
    print(f"lowest altitude {lowest:.3f}° of 15°; {scope.status()['trouble']}")
    assert lowest > 15.0
    assert scope.status()["doing"] == "idle"
    assert "before it would lead out" in scope.status()["trouble"]
    assert not moving(scope)


def test_what_another_program_moves_by_remote_control_is_stopped_before_a_limit(scope):
    """It sets velocity and bit itself, while nothing is asked of this one."""
    scope.goto("altaz:90,40")
    scope.stop()
    scope.wait(5.0)
    unit = scope._session.drive.unit
    remote = by_name("velocity_control").mask("remote_control")
    control = scope.simulator.memory.raw("velocity_control")
    unit.write("axis1_target_velocity", -0.5 / DEG_PER_COUNT / COUNTS_PER_SECOND)  # to the east, and down
    unit.write("velocity_control", control | remote)
    lowest = 90.0
    for _ in range(240):
        scope.wait(0.5)
        lowest = min(lowest, scope.status()["observed"]["altitude_deg"])
    status = scope.status()
    print(f"lowest altitude {lowest:.2f}° of 15°; {status['trouble']}")
    assert 15.0 < lowest < 17.0
    assert status["trouble"].startswith(
        "moved by remote_control: stopped before it would lead out of what is allowed"
    )
    assert not moving(scope)
    assert kinds(scope).count("stopped") == 2  # by command before, and once now
    unit.write("axis1_target_velocity", 0.5 / DEG_PER_COUNT / COUNTS_PER_SECOND)
    unit.write("velocity_control", control | remote)
    scope.wait(10.0)
    assert scope.status()["observed"]["altitude_deg"] > lowest + 2.0, "a way back is nobody's concern"


def test_a_joystick_while_tracking_is_shown_and_afterwards_the_target_is_met_again(scope):
    witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
    drive = scope._session.drive
    drive._write_control(drive._control | by_name("velocity_control").mask("joystick"))
    scope.goto(target)
    scope.simulator.joystick(190, 128)
    scope.wait(2.0)
    assert "joystick" in scope.status()["motion"]
    scope.simulator.joystick(128, 128)
    scope.wait(120.0)
    off = witness.on_sky_arcsec(target, witness.now(), scope.clock.now())
    print(f"two minutes after the joystick was let go: {off:.2f}″ off")
    assert scope.status()["motion"] == ["tracking"]
    assert off < 1.0


def test_an_idle_telescope_where_it_must_not_be_is_reported_and_led_out_only(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("altaz:75,16")
        scope.stop()
        later = scope.clock.now() + 60.0
    with telescope(tmp_path, start=later, limits__horizon_deg=30.0) as scope:
        scope.wait(5.0)
        status = scope.status()
        assert status["doing"] == "idle"
        assert [check["ok"] for check in status["checks"] if check["name"] == "horizon"] == [False]
        assert scope.goto("altaz:75,45")["ok"]


# What is left behind -----------------------------------------------------------------------------------------------


def test_a_telescope_left_tracking_is_taken_over_by_the_next_command(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("best")
        later = scope.clock.now() + 30.0
        assert scope.close(keep_tracking=True)
    with telescope(tmp_path, start=later) as scope:
        assert scope.status()["doing"] == "tracking"
        assert moving(scope)
        scope.stop()
        assert scope.status()["doing"] == "idle"
        assert not moving(scope)


def test_a_telescope_left_tracking_below_the_horizon_is_stopped_when_it_is_found(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto(setting_star(scope))
        later = scope.clock.now() + 3600.0
        assert scope.close(keep_tracking=True)
    with telescope(tmp_path, start=later) as scope:
        assert "below the horizon limit" in scope.status()["trouble"]
        assert scope.status()["doing"] == "idle"
        assert not moving(scope)
        assert not scope.close(keep_tracking=True)


def test_closing_stops_and_the_embedded_telescope_stays_where_it_was(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("best")
        before = scope.status()["axes"]
        later = scope.clock.now() + 3600.0
        assert scope.close() is False
    with telescope(tmp_path, start=later) as scope:
        after = scope.status()
        assert after["synchronised"]
        assert after["doing"] == "idle"
        for one, two in zip(before, after["axes"], strict=True):
            assert abs(one["counts"] - two["counts"]) < 20


def test_a_parked_telescope_refuses_all_motion_until_unpark(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("best")
        plan = scope.park()
        assert [axis["rate_deg_s"] for axis in plan["axes"]] == [0.0, 0.0]
        assert scope.status()["doing"] == "parked"
        for command in (lambda: scope.goto("best"), scope.home, lambda: scope.jog(1, 0.1, 1.0)):
            with pytest.raises(Refused, match="parked; `unpark` first"):
                command()
        scope.park()  # harmless
        scope.stop()
        assert scope.status()["doing"] == "parked"
        later = scope.clock.now() + 60.0
    with telescope(tmp_path, start=later) as scope:
        assert scope.status()["parked"]
        assert scope.status()["doing"] == "parked"
        assert scope.unpark()
        assert not scope.unpark()
        assert scope.goto("best")["slews"] == 1


@pytest.mark.parametrize("way", ["Sun", "horizon"])
def test_a_park_whose_straight_way_is_barred_goes_round_in_two_legs(way, tmp_path):
    """The zone of the Sun, or a tree, stands in the middle of the straight way."""
    morning = T0 - 9.0 * 3600.0
    with telescope(tmp_path, start=morning) as scope:
        planner = scope._session.planner
        x, y, z = planner.sky.at(Instant.from_posix(morning + 120.0)).sun()
        middle = planner.mount.axes((x, y, z), "normal")
        start, park = ((middle[0] + turn, middle[1]) for turn in (math.radians(-40.0), math.radians(40.0)))
        scope._perform(scope._slewing.to_angles("start", start, lambda _: None))
        later = scope.clock.now()
    bars = {"limits__sun_avoidance_deg": 20.0}
    if way == "horizon":
        azimuth, altitude = math.degrees(math.atan2(y, -x)) % 360.0, math.degrees(math.asin(z))
        tree = ((azimuth - 9.0, 15.0), (azimuth - 8.0, altitude + 3.0), (azimuth + 8.0, altitude + 3.0))
        table = "".join(f"{a % 360.0},{e}\n" for a, e in (*tree, (azimuth + 9.0, 15.0)))
        (tmp_path / "trees.csv").write_text("azimuth_deg,altitude_deg\n" + table)
        bars = {"limits__horizon": str(tmp_path / "trees.csv")}
    parks = {f"axis{i}__park_deg": math.degrees(angle) for i, angle in enumerate(park, start=1)}
    with telescope(tmp_path, start=later, **bars, **parks) as scope:
        session = scope._session
        with pytest.raises(Unreachable, match=way):
            session.planner.plan_axes("park", park, session.start(), session.timing())
        witness = Witness(scope)
        broken = []

        def look(_):
            checks = session.planner.standing(witness.angles(witness.now()), scope.clock.now())
            broken.extend(check.detail for check in checks if not check.ok)

        scope.park(look)
        print(f"{way}: parked in {len(witness.arrivals)} legs")
        assert len(witness.arrivals) == 2
        assert not broken
        assert scope.status()["doing"] == "parked"
        assert witness.angles(witness.now()) == pytest.approx(park, abs=math.radians(2 * DEG_PER_COUNT))


def test_an_embedded_telescope_goes_on_when_the_clock_was_set_back(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto("best")
    with telescope(tmp_path, start=T0 - 3600.0) as scope:
        assert scope.status()["synchronised"]
        assert scope.goto("altaz:75,50")["slews"] == 1


# Faults ------------------------------------------------------------------------------------------------------------


def broken(error):
    def fail(*_args, **_more):
        raise error

    return fail


def test_a_velocity_that_did_not_reach_the_drive_does_not_end_the_tracking(scope, monkeypatch):
    witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
    scope.goto(target)
    with monkeypatch.context() as patched:
        patched.setattr(scope._session.drive, "follow", broken(NoAnswer("lost")))
        scope.wait(20.0)
    assert scope.status()["doing"] == "tracking"
    scope.wait(20.0)
    assert witness.on_sky_arcsec(target, witness.now(), scope.clock.now()) < 1.0
    assert kinds(scope).count("stopped") == 0


def test_a_silent_link_is_said_waited_for_and_its_return_noted(scope, monkeypatch):
    scope.goto("best")
    with monkeypatch.context() as patched:
        patched.setattr(scope._session.drive, "read", broken(LinkError("the cable")))
        scope.wait(30.0)
        assert scope.status()["link_silent_s"] >= 29.0
    scope.wait(10.0)
    assert scope.status()["link_silent_s"] is None
    assert scope.status()["doing"] == "tracking"
    assert kinds(scope).count("link") == 2


def test_a_slew_over_a_silent_link_is_given_up_with_the_reason(scope, monkeypatch):
    def cut(_):
        monkeypatch.setattr(scope._session.drive, "read", broken(NoAnswer("nothing")))

    with pytest.raises(Refused, match="not answered for 15 s"):
        scope.goto("best", cut)
    monkeypatch.undo()
    scope.wait(10.0)
    assert scope.status()["doing"] == "idle"
    assert not moving(scope)  # nor does it go on to track where nobody follows


def test_a_stop_that_does_not_reach_the_drive_is_tried_until_it_does(scope, monkeypatch):
    scope.goto("best")
    with monkeypatch.context() as patched:
        patched.setattr(scope._session.drive, "stop", broken(NoAnswer("nothing")))
        with pytest.raises(NoAnswer):
            scope.stop()
        scope.wait(10.0)
        assert moving(scope)
        with pytest.raises(Refused, match="could not be stopped yet"):
            scope.goto("M42")
    scope.wait(5.0)
    assert not moving(scope)
    assert scope.goto("best")["ok"]


@pytest.mark.parametrize("error", [StateError("the disk is full"), RuntimeError("a fault of the program")])
def test_a_store_or_a_program_that_fails_stops_the_telescope_and_the_loop_goes_on(scope, monkeypatch, error):
    scope.goto("best")
    with monkeypatch.context() as patched:
        patched.setattr(scope._store, "record_position", broken(error))
        patched.setattr(scope._store, "record_event", broken(StateError("the disk is full")))
        scope.wait(5.0)
        assert scope.status()["doing"] == "idle"
        assert str(error) in scope.status()["trouble"]
        assert not moving(scope)
    scope.wait(5.0)
    assert scope.goto("best")["ok"]


def test_a_simulator_that_goes_on_as_it_was_left_says_so_and_one_in_a_new_folder_is_new(tmp_path):
    clock = VirtualClock(T0)

    def said(folder):
        with Telescope.simulated(clock=clock, overrides={"state.path": str(tmp_path / folder)}) as scope:
            return [event.text for event in scope.events() if event.kind == "simulator"]

    assert said("one") == []
    clock.sleep(60.0)
    (text,) = said("one")
    assert "as it was left 60 s ago" in text
    assert str(tmp_path / "one") in text
    assert said("two") == []


def test_what_a_progress_report_raises_stops_the_slew_and_reaches_the_caller(scope):
    def report(_):
        raise ZeroDivisionError("in the notebook")

    with pytest.raises(ZeroDivisionError):
        scope.goto("best", report)
    assert scope.status()["doing"] == "idle"
    said = "the callback `progress` failed with ZeroDivisionError('in the notebook'); the telescope was stopped"
    assert scope.status()["trouble"] == said
    scope.wait(2.0)
    assert not moving(scope)


def test_a_progress_report_may_ask_and_stop(scope):
    seen = []

    def report(_):
        seen.append(scope.status()["doing"])
        scope.stop()

    with pytest.raises(Refused, match="stopped by command"):
        scope.goto("best", report)
    assert seen == ["slewing"]
    scope.wait(2.0)
    assert not moving(scope)


def test_a_power_cycle_during_a_slew_is_noticed_and_sync_repairs(scope):
    cycled = []

    def cycle(progress):
        if not cycled and progress.remaining_s < progress.eta_s / 2:
            cycled.append(scope.simulator.power_cycle())

    with pytest.raises((Refused, DriveError), match="power"):
        scope.goto("best", cycle)
    assert cycled
    status = scope.status()
    assert not status["synchronised"]
    assert not moving(scope)
    for command in (lambda: scope.goto("best"), scope.park, scope.home, lambda: scope.jog(1, 0.1, 1.0)):
        with pytest.raises((Refused, DriveError), match="sync"):
            command()
    scope.sync("altaz:75,50")
    assert scope.status()["synchronised"]
    assert scope.goto("best")["slews"] == 1


def test_a_second_owner_in_this_process_is_refused(scope, tmp_path):
    with pytest.raises(OwnedElsewhere, match="owned by process"), telescope(tmp_path):
        pass
    assert scope.status()["ok"]


def test_a_telescope_can_be_used_inside_a_running_event_loop(tmp_path):
    async def cell():
        with telescope(tmp_path) as scope:
            return scope.goto("best")["slews"]

    assert asyncio.run(cell()) == 1


def test_what_is_not_possible_is_refused_before_anything_moves(scope):
    refused = [
        (lambda: scope.goto("altaz:0,5"), Unreachable, "10.00° below the horizon limit"),
        (lambda: scope.goto("altaz:0,-5"), Unreachable, "20.00° below the horizon limit"),
        (lambda: scope.jog(3, 0.1, 1.0), Refused, "has no rotator"),
        (lambda: scope.jog("azimoth", 0.1, 1.0), Refused, "use 1, axis1 or azimuth"),
        (lambda: scope.jog(1, math.nan, 1.0), Refused, "a jog at nan: give a finite"),
        (lambda: scope.jog(1, math.inf, 1.0), Refused, "a jog at inf: give a finite"),
        (lambda: scope.jog(1, 99.0, 1.0), Refused, r"99°/s.*4\.\d+°/s"),
        (lambda: scope.jog(1, 0.1, -1.0), Refused, "-1 s: above 0"),
        (lambda: scope.jog(1, 0.1, math.nan), Refused, "a jog for nan: give a finite"),
        (lambda: scope.jog(1, 1.0, 3600.0), Unreachable, "outside -169.96"),
        (lambda: scope.offset(math.inf, 0.0), Refused, "an offset of inf: give a finite number of arcseconds"),
        (lambda: scope.offset("a", 1), Refused, "an offset of 'a': give a finite number of arcseconds"),
        (lambda: scope.offset(0.0, math.nan), Refused, "an offset of nan: give a finite number"),
        (lambda: scope.wait(math.nan), Refused, "a wait of nan: give a finite number of seconds"),
        (lambda: scope.jog(1, "fast", 1.0), Refused, "a jog at 'fast': give a finite number of degrees"),
        (lambda: scope.guide("n", None), Refused, "a guide pulse of None: give a finite number of millisec"),
        (lambda: scope.offset(4000.0, 0.0), Refused, "4000″: at most ±3600″"),
        (lambda: scope.clear("nonsense"), Refused, "there is none"),
        (lambda: scope.sync("altaz:75,50"), Refused, "more than 5°"),
        (lambda: scope.sync("altaz:75,5", force=True), Refused, "below the horizon"),
    ]
    before = [axis["counts"] for axis in scope.status()["axes"]]
    for command, error, text in refused:
        with pytest.raises(error, match=text):
            command()
    scope.wait(3.0)
    assert [axis["counts"] for axis in scope.status()["axes"]] == before


def test_a_jog_ends_where_it_was_sent_at_its_speed(tmp_path):
    with telescope(tmp_path, **{name.replace(".", "__"): value for name, value in QUICK.items()}) as scope:
        before = scope.status()["axes"][0]["angle_deg"]
        began = scope.clock.now()
        scope.jog(1, -0.5, 10.0)
        assert scope.status()["axes"][0]["angle_deg"] - before == pytest.approx(-5.0, abs=1e-3)
        assert scope.clock.now() - began == pytest.approx(10.0, abs=1.5)
        assert scope.status()["doing"] == "idle"


# What a position stands for ----------------------------------------------------------------------------------------


def test_the_ends_of_the_travel_that_is_planned_with_are_within_the_drives_own_soft_limits(tmp_path):
    with telescope(tmp_path, axis1__max_deg=40.0) as scope:
        end = math.degrees(scope._session.planner.axes[0].maximum)
        assert 0.0 < 40.0 - end < 0.07
        scope.goto(f"hadec:{end - 1e-3:.6f},-42.4")
        assert not scope.status()["limits"]
        with pytest.raises(Unreachable, match=r"outside"):
            scope.goto("hadec:39.999,-42.4")


def test_a_slew_cut_short_from_outside_is_never_taken_for_an_arrival(scope):
    scope.goto("hadec:-20,-42.4")
    pulled, wrong = [], []

    def cut(_):
        pulled.append(1)
        if len(pulled) == 6:
            scope.simulator.write_registers(by_name("all_stop").address, [1])

    taken = scope._session.taken

    def compared(reading):
        if not any(axis.slewing for axis in reading.axes):
            for number, axis in enumerate(reading.axes, start=1):
                off = abs(axis.counts - scope.simulator.counted_position(number))
                # the simulator is at the end of the reading, one request of its own later
                if off > axis.uncertainty_counts + abs(axis.rate) * 0.1 + 20.0:
                    wrong.append(off)
        return taken(reading)

    scope._session.taken = compared
    arrival = scope.goto("hadec:30,-20", cut)
    assert arrival["slews"] > 1
    assert not wrong


def test_a_target_that_is_suddenly_far_away_is_not_crept_after(scope):
    scope.goto("best")
    far = scope._session.pursuit.moved_to(star_at(scope, 20.0, 40.0, scope.clock.now()), scope.clock.now())
    scope._session.pursuit = far
    scope.wait(3.0)
    status = scope.status()
    assert status["doing"] == "idle"
    assert "more than 2°" in status["trouble"]


def test_a_closed_telescope_says_that_it_is_closed_whatever_is_asked_of_it(tmp_path):
    for clock in (VirtualClock(T0), SystemClock()):
        scope = Telescope.simulated(
            clock=clock, overrides={"state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0}
        )
        assert scope.close() is False
        asked = {
            "plan": lambda scope=scope: scope.plan("hadec:1,-41"),
            "goto": lambda scope=scope: scope.goto("hadec:1,-41"),
            "jog": lambda scope=scope: scope.jog(1, 0.1, 1.0),
            "drive_at": lambda scope=scope: scope.drive_at(0.1, 0.0, 1.0),
            "park": scope.park, "unpark": scope.unpark, "home": scope.home, "flip": scope.flip, "stop": scope.stop,
            "wait": lambda scope=scope: scope.wait(1.0),
            "rates": lambda scope=scope: scope.rates("hadec:1,-41"),
            "passes": lambda scope=scope: scope.passes("Canopus"),
            "status": scope.status, "events": scope.events, "registers": scope.registers, "header": scope.header,
            "sync": lambda scope=scope: scope.sync("hadec:1,-41"),
            "offset": lambda scope=scope: scope.offset(1.0, 0.0),
            "guide": lambda scope=scope: scope.guide("n", 100),
            "centre": lambda scope=scope: scope.centre("83.6 22.0"),
            "instrument": scope.instrument,
            "clear": lambda scope=scope: scope.clear("offset"),
            "power": lambda scope=scope: scope.power(on=True),
            "commission": scope.commission,
            "drive.show": scope.drive.show, "drive.diff": scope.drive.diff,
        }  # fmt: skip
        for name, ask in asked.items():
            with pytest.raises(Refused, match="the telescope is closed; open it again"):
                pytest.fail(f"{name} answered {ask()!r}")
        assert scope.close() is False


def test_passes_and_header_are_those_of_the_commands(scope):
    found = scope.passes("Canopus", hours=12.0, above_deg=20.0)
    assert found["ok"]
    assert found["passes"][0]["rise"]["altitude_deg"] >= 19.9
    assert scope.passes(star_at(scope, 90.0, 50.0), 1.0)["passes"]
    with pytest.raises(InputError, match="more than 0 up to"):
        scope.passes("Canopus", hours=0.0)
    header = scope.header()
    assert header["RADESYS"] == "ICRS"
    assert header["RA"] == pytest.approx(scope.status()["icrs"]["ra_deg"], abs=0.1)
