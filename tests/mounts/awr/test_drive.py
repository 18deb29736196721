"""The driver of the AWR Microstep against the simulated unit: gotos, tracking, stop, and all that makes it doubt."""

import math
import os
import re
import statistics
from contextlib import suppress
from dataclasses import replace

import pytest
from awr_bench import SETTINGS, SIDEREAL, STILL, Bench, Line

from mounts.awr.cascade import Press, Stage
from mounts.awr.errors import AwrError
from mounts.awr.factory import factory
from mounts.awr.ramps import Key
from mounts.awr.registers import by_name
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.drive import AxisSlew
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from transports.errors import LinkError, NoAnswer, TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
ARCSEC = 0.3  # of a step, of either axis of the example


def test_a_path_is_kept_to_an_arcsecond_by_the_drive_registers():
    bench = Bench()
    bench.connect()
    moon = Line(bench.true(), (SIDEREAL * 0.963, 0.37), bench.clock.now())
    worst = []

    def look(now):
        wanted = [counts for counts, _ in moon.at(now)]
        worst.append(max(abs(true - want) for true, want in zip(bench.true(), wanted, strict=True)) * ARCSEC)

    bench.follow(moon, 3600.0 if FULL else 300.0, look)
    rms = statistics.fmean(each**2 for each in worst) ** 0.5
    print(f"\nRMS {rms:.3f}″, at most {max(worst):.3f}″ off a path at 0.963 and 0.0074 of the sidereal rate")
    assert rms < 1.0
    assert not bench.awr.wear


def test_no_drive_register_is_set_faster_than_may_go_on_when_the_program_is_gone():
    bench = Bench(replace(SETTINGS, fastest=(4.0 * SIDEREAL, 4.0 * SIDEREAL)))
    bench.connect()
    for rates in ((70.0 * SIDEREAL, 0.0), (SIDEREAL, -5.0 * SIDEREAL)):
        before = dict(bench.awr.ram)
        satellite = Line(bench.true(), rates, bench.clock.now())
        with pytest.raises(DriveRefused, match="choose a slower target"):
            bench.drive.follow(satellite, bench.clock.now())
        with pytest.raises(DriveRefused, match="choose a slower target"):
            bench.slew(1e4, 0.0, rates=rates)
        assert bench.awr.ram == before
        assert bench.awr.keys == [0, 0]


def test_stop_releases_the_keys_and_both_axes_stand_where_they_are_reckoned_to_be():
    bench = Bench()
    bench.connect()
    bench.drive.start([AxisSlew(4e5, SIDEREAL), AxisSlew(-3e5)], bench.clock.now())
    for _ in range(8):
        bench.read()
        bench.clock.sleep(0.25)
    bench.drive.stop(bench.clock.now())
    assert bench.awr.keys == [0, 0]
    bench.clock.sleep(1.0)
    before = bench.true()
    bench.clock.sleep(10.0)
    assert bench.true() == before
    reading = bench.read()
    assert not reading.tracking
    assert not reading.unsynchronised
    assert all(abs(off) < axis.uncertainty_counts * 2.0 for off, axis in zip(bench.off(), reading.axes, strict=True))


def test_the_dead_man_is_armed_while_a_key_is_held_and_hastened_before_its_release():
    bench = Bench()
    bench.connect()
    bench.drive.start([AxisSlew(1e5, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    assert bench.guard.armed
    while any(axis.slewing for axis in bench.read().axes):
        bench.clock.sleep(0.25)
    assert bench.guard.easy  # the drives go on
    assert "hasten" in bench.guard.told
    bench.drive.start([AxisSlew(1e5, SIDEREAL), AxisSlew(-5e4)], bench.clock.now())
    while any(axis.slewing for axis in bench.read().axes):
        assert not (bench.guard.armed and bench.guard.hasty)  # the next look may be a quarter of a second away
        bench.clock.sleep(0.25)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    assert bench.guard.told[-1] == "close"
    assert not bench.guard.armed


@pytest.mark.parametrize("rates", [(180.0, -30.0), (0.0, -30.0)], ids=["both", "axis 2 alone"])
def test_the_dead_man_stands_beside_a_drive_before_it_goes_and_until_both_are_known_to_be_off(rates):
    bench = Bench()
    bench.connect(make_safe=True)
    assert not bench.guard.armed
    seen, receive = [], bench.line.receive

    def received(data, t):
        attended, answers = bench.guard.armed and bench.guard.easy, receive(data, t)
        if data[1:2] == b"8" and (bench.awr.ram[0x02] & 1 or bench.awr.ram[0x04] & 1):
            seen.append(attended)
        return answers

    bench.line.receive = received
    bench.follow(Line(tuple(bench.read().counts), rates, bench.clock.now()), 3.0)
    assert [bool(axis.velocity) for axis in bench.awr.axes] == [bool(rate) for rate in rates]
    assert all(seen)
    assert len(seen) > 2
    bench.line.receive = lambda data, t: b"" if data[1:3] == b"84" else receive(data, t)
    with pytest.raises(TransportError):
        bench.drive.stop(bench.clock.now())
    assert bench.guard.armed
    bench.line.receive = receive
    bench.drive.stop(bench.clock.now())
    bench.read()
    assert not bench.guard.armed


def test_a_drive_that_does_not_obey_is_left_to_the_dead_man():
    bench = Bench()
    bench.connect(make_safe=True)
    bench.follow(Line((0.0, 0.0), (180.0, -30.0), bench.clock.now()), 3.0)
    receive = bench.line.receive
    bench.line.receive = lambda data, t: b"" if data[1:2] == b"8" else receive(data, t)
    with pytest.raises(TransportError):
        bench.drive.close(bench.clock.now(), keep_tracking=False)
    assert bench.guard.armed
    assert bench.guard.told[-1] == "close"


def test_drives_go_on_at_rest_of_a_driver_that_is_told_to_leave_them_so():
    bench = Bench()
    bench.connect()
    bench.slew(1e4, 0.0)
    bench.drive.close(bench.clock.now(), keep_tracking=True)
    assert not bench.guard.armed
    assert bench.awr.ram[0x02] & 1


def test_a_dead_man_that_switched_the_drives_off_leaves_a_position_that_nobody_knows():
    bench = Bench()
    bench.connect()
    bench.follow(Line((0.0, 0.0), (180.0, -30.0), bench.clock.now()), 3.0)
    bench.guard.fate = "it stopped the drive"
    with pytest.raises(DriveRefused, match="it stopped the drive"):
        bench.read()
    reading = bench.read()
    assert "both drives were switched off, and nobody knows when" in reading.unsynchronised
    assert not reading.tracking
    assert not bench.awr.ram[0x02] & 1
    assert not bench.awr.ram[0x04] & 1


def test_without_a_dead_man_no_key_is_pressed():
    bench = Bench()
    bench.drive._parts.beside._guardian = None
    bench.connect()
    with pytest.raises(DriveRefused, match="needs a dead-man process beside it"):
        bench.slew(1e4, 0.0)
    assert bench.awr.keys == [0, 0]


def test_a_dead_man_that_died_ends_the_goto():
    bench = Bench()
    bench.connect()
    bench.drive.start([AxisSlew(1e5, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    bench.guard.fate = "it was killed"
    with pytest.raises(DriveRefused, match="it was killed"):
        bench.read()
    bench.clock.sleep(0.1)
    bench.true()
    assert bench.awr.keys == [0, 0]


@pytest.mark.parametrize(
    ("what", "why"),
    [
        (lambda awr: awr.override(stopped=True), "override input stopped"),
        (lambda awr: awr.reset("watchdog"), "e1 watchdog reset"),
        (lambda awr: awr.reset("MCLR"), "e6"),
        (lambda awr: awr.reset("brownout"), "e7"),
        (lambda awr: awr.press(1, 1), "no key of this program"),
        (lambda awr: awr.overflow(), "lost events (e3"),
    ],
)
@pytest.mark.parametrize("slewing", [False, True])
def test_what_voids_dead_reckoning_makes_it_unsynchronised_until_sync(what, why, slewing):
    bench = Bench()
    bench.connect()
    if slewing:
        bench.drive.start([AxisSlew(0.0, SIDEREAL), AxisSlew(1e5)], bench.clock.now())
        bench.clock.sleep(0.3)
    what(bench.awr)
    for _ in range(4):
        bench.clock.sleep(0.3)
        reading = bench.read()
    assert why in reading.unsynchronised
    assert bench.awr.keys == [0, 0]
    with pytest.raises(Unsynchronised, match="sync"):
        bench.drive.start([AxisSlew(0.0), AxisSlew(0.0)], bench.clock.now())
    bench.awr.override(stopped=False)
    bench.clock.sleep(0.1)
    bench.read()
    bench.drive.sync((10.0, 20.0), bench.clock.now())
    reading = bench.read()
    assert not reading.unsynchronised
    assert reading.counts == pytest.approx((10.0, 20.0), abs=60.0)


@pytest.mark.parametrize(("firmware", "taken_up"), [(0.77, [200, 300]), (0.57, [7, 400])])
def test_a_unit_takes_up_the_play_that_is_configured_in_ram_alone_and_again_after_a_reset(firmware, taken_up):
    unit = SimulatorSettings(firmware=firmware, words=factory(backlash=(7, 400)))
    bench = Bench(replace(SETTINGS, plays=(200.4, 300.0)), unit)
    bench.connect()
    assert [bench.awr.ram[address] for address in (0x19, 0x1A)] == taken_up
    left = [play.steps for play in bench.drive.words.plays]
    assert left == pytest.approx([0.4, 0.0] if firmware > 0.6 else [200.4, 300.0])
    bench.awr.reset("brownout")
    bench.clock.sleep(1.0)
    bench.read()
    assert [bench.awr.ram[address] for address in (0x19, 0x1A)] == taken_up
    assert bench.drive.registers()["play_2"].startswith(f"{left[1]:.1f} steps besides what the unit takes up")
    assert not bench.awr.wear


@pytest.mark.parametrize("deaf", [False, True])
@pytest.mark.parametrize("told", [False, True])
def test_what_rests_rests_again_after_a_reset(told, deaf):
    bench = Bench()
    bench.connect(make_safe=True)
    receive = bench.line.receive
    bench.awr.reset("brownout")
    if not told:
        bench.awr.says(bench.clock.now() + 1.0)
        bench.clock.sleep(11.0)
    bench.clock.sleep(1.0)
    if deaf:
        bench.line.receive = lambda data, t: (
            b"" if data[1:2] == b"8" else receive(data, t)
        )  # soft writes and their reads
        with suppress(DriveError, TransportError):
            bench.read()
        bench.line.receive = receive
    bench.read()
    bench.clock.sleep(1.0)
    before = bench.true()
    bench.clock.sleep(10.0)
    assert bench.true() == before
    assert not bench.read().tracking


def tell_no_motion(bench):
    says = bench.awr.says

    def silent(until):
        said = says(until)
        return said if said is None or b"X" not in said[1] else (said[0], b"")

    bench.awr.says = silent


def test_an_event_that_is_lost_makes_it_unsynchronised():
    bench = Bench()
    bench.connect()
    tell_no_motion(bench)
    bench.drive.start([AxisSlew(1e4, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    reading = bench.read()
    assert "did not tell when axis 1 began" in reading.unsynchronised
    bench.clock.sleep(0.1)
    bench.true()
    assert bench.awr.keys == [0, 0]


def test_a_key_that_became_one_of_the_other_axis_is_released_though_no_motion_is_told():
    bench = Bench()
    bench.connect()
    tell_no_motion(bench)
    receive = bench.awr.receive
    bench.awr.receive = lambda data, t: receive(data.replace(b":1#", b":3#"), t)
    bench.drive.hand.press("UP", "move", 0.5)
    assert "did not tell when axis 2 began" in bench.read().unsynchronised
    bench.clock.sleep(0.1)
    assert bench.true()[0] > 100.0
    assert bench.awr.keys == [0, 0]


@pytest.mark.parametrize("unheard", [1, 2])
def test_a_motion_that_went_on_to_a_later_release_is_stated_so_where_the_end_of_the_other_axis_was_not_told(unheard):
    """One event tells then that both stand, and nobody knows of which it is, nor which release was heard."""
    bench = Bench()
    bench.connect()
    receive, says, lost = bench.awr.receive, bench.awr.says, []

    def garbled(data, t):  # the first releases of axis 1 become releases of axis 2
        if data == b":5#" and len(lost) < unheard:
            lost.append(data)
            return receive(b":6#", t)
        return receive(data, t)

    def told(until):
        said = says(until)
        return said if said is None or b"X10" not in said[1] else (said[0], b"")

    key = Key(1600.0, 20000.0)
    bench.drive.keys.begin(Stage("move", (Press(key, 1.0), Press(key, 0.8)), (0.0, 0.0), 1.0, (0.0, 0.0), (0.0, 0.0)))
    bench.clock.sleep(0.3)
    bench.read()
    bench.awr.receive, bench.awr.says = garbled, told
    while bench.drive.keys.busy:
        bench.clock.sleep(0.1)
        bench.read()
    off, reading = bench.off(), bench.read()
    stated = [axis.uncertainty_counts for axis in reading.axes]
    print(f"\n{off[0]:+.0f} and {off[1]:+.0f} steps off, {stated[0]:.0f} and {stated[1]:.0f} stated")
    assert len(lost) == unheard
    assert not reading.unsynchronised
    assert all(abs(each) < most for each, most in zip(off, stated, strict=True))
    assert stated[0] < 400.0


@pytest.mark.parametrize(
    "moves",
    [
        lambda bench: bench.slew(*(axis.at(bench.clock.now()).counts + 30.0 for axis in bench.drive.axes)),
        lambda bench: jogged(bench, (0.0, 60.0)),
        lambda bench: bench.drive.hand.press("UP", "guide", 0.5),
    ],
    ids=["goto", "jog", "key by hand"],
)
def test_a_speed_that_the_hand_box_changed_is_set_again_before_a_motion_begins(moves):
    bench = Bench()
    bench.connect()
    moves(bench)
    assert bench.awr.speed in {"guide", "centre"}
    bench.awr.speed = "move"
    moves(bench)
    off, reading = bench.off(), bench.read()
    print(f"\n{off[0]:+.1f} and {off[1]:+.1f} steps off, {reading.axes[1].uncertainty_counts:.1f} stated")
    assert not reading.unsynchronised
    assert max(map(abs, off)) < 3.0


def jogged(bench, rates):
    bench.drive.move_at(rates, bench.clock.now())
    for _ in range(4):
        bench.clock.sleep(0.25)
        bench.read()
    bench.drive.stop(bench.clock.now())


@pytest.mark.parametrize("heard", [False, True], ids=["not heard", "not answered"])
def test_a_drive_that_may_go_at_either_of_two_rates_is_stated_to_be_off_by_what_lies_between_them(heard):
    bench = Bench()
    bench.connect()
    bench.follow(Line((0.0, 0.0), (SIDEREAL, 0.0), bench.clock.now()), 3.0)
    receive = bench.awr.receive

    def lost(data, t):
        if data[1:2] != b"8":
            return receive(data, t)
        if heard:
            receive(data, t)
        return b""

    bench.awr.receive = lost
    with pytest.raises(TransportError):
        bench.drive.follow(Line(bench.true(), (3.0 * SIDEREAL, 0.0), bench.clock.now()), bench.clock.now())
    bench.clock.sleep(4.0)
    bench.awr.receive = receive
    stated, off = bench.read().axes[0].uncertainty_counts, abs(bench.off()[0])
    print(f"\n{off:.0f} steps off, {stated:.0f} stated")
    assert (off > 300.0) == heard
    assert off < stated < 600.0


def test_a_key_that_is_not_heard_is_said_and_leaves_nobody_armed():
    bench = Bench()
    bench.connect(make_safe=True)
    receive = bench.awr.receive
    bench.awr.receive = lambda data, t: b"" if data == b":1#" else receive(data, t)
    with pytest.raises(AwrError, match="did not hear UP"):
        bench.drive.hand.press("UP", "move", 0.5)
    assert not bench.guard.armed
    assert not bench.read().unsynchronised
    bench.awr.receive = receive
    bench.drive.hand.press("UP", "move", 0.5)
    assert bench.true()[1] > 400.0


def test_a_jog_of_which_no_event_is_told_is_over_and_as_uncertain_as_it_may_have_gone():
    bench = Bench()
    bench.connect(make_safe=True)
    tell_no_motion(bench)
    bench.drive.move_at((0.0, 1500.0), bench.clock.now())
    for _ in range(4):
        bench.clock.sleep(0.25)
        reading = bench.read()
    assert "did not tell when axis 2 began" in reading.unsynchronised
    assert not any(axis.slewing for axis in reading.axes)
    assert not bench.guard.armed
    off = bench.off()
    print(f"off {off[1]:.0f} steps, stated {reading.axes[1].uncertainty_counts:.0f}")
    assert abs(off[1]) < reading.axes[1].uncertainty_counts < 10.0 * abs(off[1]) + 2000.0


def test_a_division_names_the_register_written_last():
    bench = Bench()
    bench.connect()
    bench.drive.words.soft_write(by_name("guide_left_counts"), 20)
    bench.awr._say("e9")
    bench.clock.sleep(0.1)
    reading = bench.read()
    assert "guide_left_counts (09)" in reading.alarms[0]
    assert "drive reload" in reading.alarms[0]


def test_a_division_names_a_register_that_holds_no_counts_whatever_was_written_last():
    bench = Bench(unit=SimulatorSettings(words={**factory(), 0x0F: 15}))
    bench.connect(make_safe=True)
    bench.awr._say("e8")
    bench.clock.sleep(0.1)
    assert "centre_left_counts (0F)" in bench.read().alarms[0]


def test_relays_and_input_lines_stand_in_the_notes_and_each_change_is_an_event():
    bench = Bench()
    bench.connect()
    assert "relays: 1 off, 2 off, 3 off" in bench.drive.notes
    assert not bench.drive.told()
    bench.drive.hand.switch_relay(2, on=True)
    assert bench.drive.told() == ("relays: 1 off, 2 on, 3 off",)
    bench.awr.relays = 0b101  # by the hand box
    bench.awr.levels("ACDE")
    bench.clock.sleep(11.0)
    bench.read()
    lines = "input lines: A high, B low, C high, D high, E high, F low"
    assert set(bench.drive.told()) == {lines, "relays: 1 on, 2 off, 3 on"}
    assert {lines, "relays: 1 on, 2 off, 3 on"} <= set(bench.drive.notes)
    assert not bench.drive.told()
    assert bench.drive.registers()["input_lines"] == lines.removeprefix("input lines: ")


def test_a_unit_that_was_switched_off_meanwhile_is_noticed_by_its_cookie():
    bench = Bench()
    bench.connect()
    bench.drive.close(bench.clock.now(), keep_tracking=True)
    bench.awr.ram = dict(bench.awr.lasting)
    again = Bench(memory=dict(bench.drive.memory), clock=bench.clock)
    again.awr = bench.awr
    again.line.device = bench.awr
    assert "switched off and on" in again.connect().unsynchronised


def test_the_next_program_goes_on_where_the_drives_have_led():
    bench = Bench()
    bench.connect()
    bench.slew(5e4, 2e4)
    bench.drive.close(bench.clock.now(), keep_tracking=True)
    bench.clock.sleep(3600.0)
    again = Bench(memory=dict(bench.drive.memory), clock=bench.clock)
    again.awr = bench.awr
    again.line.device = bench.awr
    reading = again.connect()
    assert not reading.unsynchronised
    assert all(abs(off) < axis.uncertainty_counts for off, axis in zip(again.off(), reading.axes, strict=True))


@pytest.mark.parametrize(("address", "word", "why"), [(0, 0x3, "direction senses"), (1, 17000, "drive_ra .01, 02.")])
def test_words_that_the_position_rests_on_make_it_unsynchronised_when_they_are_changed(address, word, why):
    bench = Bench()
    bench.connect()
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    bench.awr.lasting[address] = word
    again = Bench(memory=dict(bench.drive.memory), clock=bench.clock)
    again.line.device = bench.awr
    assert re.search(why, again.connect().unsynchronised)


@pytest.mark.parametrize(
    "opposite",
    [{"frequency_unit": 2.0}, {"acceleration_unit": 0.5}, {"acceleration_error": -0.4}],
    ids=str,
)
def test_units_that_are_not_as_configured_are_noticed_at_the_first_goto(opposite):
    bench = Bench(unit=SimulatorSettings(words=factory(), **opposite))
    bench.connect()
    bench.drive.start([AxisSlew(2e5, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    while any(axis.slewing for axis in bench.read().axes):
        bench.clock.sleep(0.25)
    reading = bench.read()
    assert "frequency_unit or acceleration_unit" in reading.unsynchronised


@pytest.mark.parametrize(("latency_s", "timeout_s"), [(0.08, 0.1), (0.15, 0.1), (0.4, 1.0)])
def test_a_unit_far_away_is_driven_as_well(latency_s, timeout_s):
    bench = Bench(latency_s=latency_s, timeout_s=timeout_s)
    assert not bench.connect().unsynchronised
    assert bench.unit.delay_s == pytest.approx(latency_s, abs=0.001)
    bench.slew(2e4, -1e4)
    reading = bench.read()
    assert not reading.unsynchronised
    off = max(map(abs, bench.off()))
    print(f"\n{latency_s:g} s each way: {off:.2f} steps off, {reading.axes[0].uncertainty_counts:.2f} stated")
    assert off < 3.0


def test_a_unit_too_far_away_is_refused_with_the_key_that_reaches_it():
    bench = Bench(latency_s=0.25)
    with pytest.raises(NoAnswer, match="a longer timeout_s"):
        bench.connect()


@pytest.mark.parametrize(("words", "said"), [((18000, 4), False), ((17000, 4), True), ((18000, 2), True)])
def test_a_drive_ra_that_is_otherwise_than_configured_is_said(words, said):
    bench = Bench(replace(SETTINGS, drive_ra=words))
    bench.connect()
    told = "drive_ra holds 18000 counts at postscaler 4, otherwise than configured"
    assert any(told in note for note in bench.drive.notes) == said


def test_firmware_that_tells_no_ram_is_driven_all_the_same():
    bench = Bench(unit=SimulatorSettings(**STILL | {"reads_ram": False, "firmware": 0.59, "execution_s": 0.02}))
    bench.connect()
    bench.slew(1e4, -1e4)
    assert max(map(abs, bench.off())) < 3.0
    assert any("what its RAM holds" in note for note in bench.drive.notes)


def test_at_a_speed_the_keys_of_the_nearest_are_held_until_told_otherwise():
    bench = Bench()
    bench.connect(make_safe=True)
    for _ in range(20):
        bench.drive.move_at((-1400.0, 1500.0), bench.clock.now())
        assert bench.guard.armed
        assert not bench.guard.hasty
        assert all(axis.slewing for axis in bench.read().axes)
        bench.clock.sleep(0.1)
    assert bench.awr.keys == [-1, 1]
    assert bench.awr.speed == "move"
    bench.drive.move_at((0.0, 0.0), bench.clock.now())
    reading = bench.read()
    assert bench.awr.keys == [0, 0]
    assert not any(axis.slewing or axis.rate for axis in reading.axes)
    assert not bench.guard.armed
    off, stated = bench.off(), [axis.uncertainty_counts for axis in reading.axes]
    assert all(abs(each) < 2.0 * most + 1.0 for each, most in zip(off, stated, strict=True))
    assert max(stated) < 20.0
    assert bench.true()[0] < -2500.0


def test_keys_are_released_as_soon_as_a_link_is_back_that_was_lost_while_they_were_held():
    bench = Bench()
    bench.connect()
    bench.drive.start([AxisSlew(2e5, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    bench.clock.sleep(0.25)
    assert bench.read().axes[0].slewing
    down = {"since": bench.clock.now()}
    receive, says = bench.line.receive, bench.line.says

    def dead(*_):
        raise LinkError("unplugged")

    bench.line.receive = bench.line.says = dead
    while bench.clock.now() < down["since"] + 3.0:
        with pytest.raises(LinkError):
            bench.read()
        bench.clock.sleep(0.25)
    assert bench.awr.keys[0] == 1
    assert bench.guard.armed
    bench.line.receive, bench.line.says = receive, says
    back, released, act = bench.clock.now(), [], bench.awr._act

    def acted(command):
        act(command)
        released.append(bench.awr._now - back if command == "RA_IDLE" else math.inf)

    bench.awr._act = acted
    with suppress(TransportError):
        bench.read()
    bench.true()
    assert released[0] < 0.1
    while any(axis.slewing for axis in bench.read().axes):
        bench.clock.sleep(0.25)
    reading = bench.read()
    assert bench.awr.keys == [0, 0]
    assert bench.guard.easy
    off, stated = bench.off(), [axis.uncertainty_counts for axis in reading.axes]
    assert reading.unsynchronised or all(abs(o) < 2.0 * s + 1.0 for o, s in zip(off, stated, strict=True))


def test_how_late_keys_act_is_learnt_from_the_first_presses_and_remembered():
    bench = Bench(unit=SimulatorSettings(execution_s=0.12))
    bench.connect()
    assert bench.drive.memory["delay_s"] is None
    bench.slew(2e4, -1e4)
    bench.slew(4e4, -2e4)
    assert not bench.read().unsynchronised
    assert bench.drive.keys.delay_s == pytest.approx(0.12, abs=0.01)
    assert max(map(abs, bench.off())) < 3.0
    again = Bench(memory=dict(bench.drive.memory), clock=bench.clock)
    assert again.drive.keys.delay_s == bench.drive.keys.delay_s


def test_a_commit_that_a_damaged_command_made_is_noticed():
    bench = Bench()
    bench.connect()
    bench.awr._obeyed("E")
    bench.clock.sleep(11.0)
    bench.read()
    assert any("nobody asked to commit" in note for note in bench.drive.notes)


def test_a_sync_is_refused_while_the_override_holds_and_both_axes_are_reckoned_at_rest_until_it_is_lifted():
    bench = Bench()
    bench.connect()
    bench.awr.override(stopped=True)
    bench.clock.sleep(1.0)
    reading = bench.read()
    assert reading.limits == ("override",)
    assert [axis.rate for axis in reading.axes] == [0.0, 0.0]
    before = bench.off()
    bench.clock.sleep(60.0)
    bench.read()
    assert bench.off() == pytest.approx(before, abs=0.01)
    with pytest.raises(DriveRefused, match="override button"):
        bench.drive.sync((0.0, 0.0), bench.clock.now())
    bench.awr.override(stopped=False)
    bench.clock.sleep(1.0)
    bench.read()
    bench.drive.sync(bench.true(), bench.clock.now())
    bench.clock.sleep(60.0)
    reading = bench.read()
    assert reading.tracking
    assert not reading.unsynchronised
    assert max(map(abs, bench.off())) < 0.5


def test_a_clock_that_was_turned_back_between_two_programs_makes_it_unsynchronised():
    bench = Bench()
    bench.connect()
    bench.slew(5e4, 2e4)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    memory = dict(bench.drive.memory)
    again = Bench(memory=memory | {"time": memory["time"] + 60.0}, clock=bench.clock)
    again.awr = again.line.device = bench.awr
    assert "60 s earlier than when the position was kept" in again.connect().unsynchronised


@pytest.mark.parametrize("firmware", [0.71, 0.72])
def test_firmware_that_cannot_be_asked_for_its_override_says_that_a_stop_may_pass_unseen(firmware):
    bench = Bench(unit=SimulatorSettings(firmware=firmware))
    bench.connect()
    assert any("whether the override holds it" in note for note in bench.drive.notes) == (firmware < 0.72)
