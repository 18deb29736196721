"""What the encoders see and the driver does: hands, missed steps, a box switched off, wires swapped, runaways."""

import re
from dataclasses import replace

import pytest
from avr_bench import COUNT, SETTINGS, SIDEREAL, STEPS_PER_TURN, T0, Bench, Line, like
from avr_faults import switch_off_and_on
from faults import Fault, FaultyDevice

from clockdrive.clock import VirtualClock
from mounts.avr_box.answers import Pair
from mounts.avr_box.box import Box
from mounts.avr_box.commands import ASK_ENCODERS, COMMANDS
from mounts.avr_box.reasons import ABSENT, MAY_RUN, SWITCHED
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.drive import AxisSlew
from mounts.errors import DriveRefused, Unsynchronised
from mounts.remembered import NEVER
from transports.errors import LinkError, NoAnswer
from transports.memory import MemoryLink


def opened(**changes):
    bench = Bench(unit=like(**changes))
    bench.connect()
    return bench


def within(bench):
    """Whether both axes are where they are said to be, within what is stated."""
    reading = bench.read()
    bench.box.advance(reading.time)
    return all(
        abs(axis.counts - bench.box.true_position(i + 1)) <= axis.uncertainty_counts
        for i, axis in enumerate(reading.axes)
    )


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("counts", [-40.0, 4.0])
def test_an_axis_pushed_by_hand_is_found_and_taken_from_its_encoder(axis, counts):
    bench = opened()
    bench.read()
    bench.box.push(axis, counts * COUNT[axis - 1])
    assert within(bench)
    assert f"axis {axis} is" in bench.drive.notes[-1]
    assert bench.read().unsynchronised == ""


def test_steps_that_a_motor_missed_in_a_slew_are_found_and_the_next_slew_lands_right():
    bench = opened(lost_steps=0.02)
    bench.slew(300_000.0, -200_000.0)
    assert within(bench)
    assert "missed steps" in " ".join(bench.drive.notes)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_motor_that_misses_steps_either_way_falls_short_and_each_slew_goes_on_to_the_target(way):
    bench = opened(lost_steps=0.05)
    bench.slew(0.0, way * 500_000.0, rates=(0.0, 0.0))
    first = abs(way * 500_000.0 - bench.true()[1])
    bench.slew(0.0, way * 500_000.0, rates=(0.0, 0.0))
    second = abs(way * 500_000.0 - bench.true()[1])
    print(f"\n5 % of the fast steps missed: {first:.0f} microsteps short, after another slew {second:.0f}")
    assert abs(bench.true()[1]) < 500_000.0
    assert 15_000.0 < first < 25_000.0
    assert second < 0.05 * first + 1.5 * COUNT[1]  # what this one missed, and how well it was known where it began
    assert within(bench)
    assert "ran where it was not sent" not in " ".join(bench.drive.notes)


@pytest.mark.parametrize("letter", "NSnsEW")
def test_a_hand_controllers_move_is_followed_and_said(letter):
    bench = opened()
    bench.follow(Line((0.0, 0.0), (SIDEREAL, 0.0), bench.clock.now()), 30.0)
    bench.box.receive(letter.encode(), bench.clock.now())
    bench.clock.sleep(0.4)
    seen = set()
    for _ in range(60 if letter in "ns" else 20):
        seen.update(bench.read().motion)
        bench.clock.sleep(0.25)
    assert within(bench)
    assert seen == {"tracking", "hand controller"}
    assert bench.read().motion == ("tracking",)
    assert "moved by hand" in bench.drive.notes[-1]
    assert bench.read().alarms == ()


def test_what_moves_by_itself_and_by_commands_is_not_taken_for_a_hand_controller():
    bench, seen = opened(), set()
    bench.slew(60_000.0, 50_000.0)
    place = bench.drive.read(bench.clock.now()).axes[0].counts
    bench.follow(Line((place, 50_000.0), (SIDEREAL, 1.0), bench.clock.now()), 60.0)
    path = Line((place, 0.0), (0.0, 0.0), bench.clock.now(), axes=1)
    bench.follow(path, 60.0, lambda _: seen.update(bench.read().motion))
    assert seen == {"tracking"}


@pytest.mark.parametrize("where", [(60_000.0, 50_000.0), (-700_000.0, 4000.0)])
def test_a_box_that_was_switched_off_and_on_is_unsynchronised_until_sync(where):
    bench = opened()
    bench.slew(*where)
    fresh = SimulatedAvrBox(bench.box.settings, bench.clock.now(), bench.box.steps_per_turn, positions=(5, 5))
    bench.box.__dict__.update(fresh.__dict__)
    assert bench.read().unsynchronised == SWITCHED
    bench.drive.sync(where, bench.clock.now())
    assert bench.read().unsynchronised == ""


class Turning:
    """A box that somebody turns whenever it is asked."""

    def __init__(self, box):
        self.box, self.asked = box, 0

    def receive(self, data, t):
        self.asked += 1
        self.box.push(1, 50.0 * COUNT[0])
        return self.box.receive(data, t)


@pytest.mark.parametrize("fault", [Fault.DELAY, Fault.MERGE])
def test_an_answer_that_comes_late_ahead_of_the_next_one_is_not_taken_for_that(fault):
    clock = VirtualClock(T0)
    turning = Turning(SimulatedAvrBox(like(), T0, STEPS_PER_TURN))
    far = FaultyDevice(turning, [None, fault])
    box = Box(lambda: MemoryLink(far, clock, baud=9600), clock, 9600)
    assert box.ask(ASK_ENCODERS).pair.one == 50
    assert box.ask(ASK_ENCODERS).pair.one == 150
    assert box.ask(ASK_ENCODERS).pair.one == 200
    assert (turning.asked, box.trust.flaws) == (4, 2)


class Garbling:
    """A line that makes something else of the next answers about the encoders, where that is given."""

    def __init__(self, device):
        self.device, self.instead = device, []

    def receive(self, data, t):
        answer = self.device.receive(data, t)
        other = self.instead.pop(0) if data == ASK_ENCODERS and self.instead else None
        return answer if other is None else other.text


def garbling():
    lines = []
    bench = Bench(line=lambda device: lines.append(Garbling(device)) or lines[-1])
    bench.connect()
    return bench, lines[0]


def test_a_box_switched_off_near_where_it_was_switched_on_is_noticed_though_the_second_look_is_garbled():
    bench, line = garbling()
    bench.slew(2000.0, 6.2 * COUNT[1])
    bench.read()
    switch_off_and_on(bench.box, bench.clock.now())
    line.instead = [None, Pair(50000, 0)]
    assert bench.read().unsynchronised == SWITCHED


def test_a_box_switched_off_within_what_its_position_may_be_off_is_noticed_by_its_bin():
    bench = opened()
    bench.slew(-300.0, 3.2 * COUNT[1])
    bench.drive.axes[1].widened(2.0 * COUNT[1], bench.clock.now())
    bench.read()
    switch_off_and_on(bench.box, bench.clock.now())
    assert bench.read().unsynchronised == SWITCHED


@pytest.mark.parametrize("axis", [1, 2])
def test_an_axis_that_a_hand_moved_is_within_what_is_stated_though_the_second_look_is_garbled(axis):
    bench, line = garbling()
    bench.read()
    before = Pair(*bench.box.encoders())
    bench.box.push(axis, -4.0 * COUNT[axis - 1])
    line.instead = [None, before]
    assert within(bench)


@pytest.mark.parametrize("cut_s", [0.3, 2.0, 9.0, 26.9, 27.3, 30.0, 60.0])
def test_a_power_cut_in_a_slew_is_noticed_before_it_can_end_on_its_target(cut_s):
    bench = opened()
    bench.slew(60_000.0, 50_000.0)
    bench.drive.start([AxisSlew(1_500_000.0, SIDEREAL), AxisSlew(-600_000.0, 0.0)], bench.clock.now())
    begun = bench.clock.now()
    while bench.clock.now() < begun + cut_s:
        bench.read()
        bench.clock.sleep(min(0.25, max(0.01, begun + cut_s - bench.clock.now())))
    here = tuple(round(each) for each in bench.true())
    fresh = SimulatedAvrBox(bench.box.settings, bench.clock.now(), bench.box.steps_per_turn, positions=here)
    bench.box.__dict__.update(fresh.__dict__)
    reading, cut = bench.read(), bench.clock.now()
    while not reading.unsynchronised and any(axis.slewing for axis in reading.axes):
        bench.clock.sleep(0.25)
        reading = bench.read()
    print(f"\ncut after {cut_s} s: told {bench.clock.now() - cut:.1f} s later")
    assert reading.unsynchronised == SWITCHED
    assert not any(axis.slewing for axis in reading.axes)


@pytest.mark.parametrize("where", [(60_000.0, 50_000.0), (-700_000.0, 4000.0)])
def test_a_box_that_was_switched_off_while_no_program_ran_is_unsynchronised_for_the_next_one(where):
    bench = opened()
    bench.slew(*where)
    bench.clock.sleep(2.0)
    bench.read()
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    memory = dict(bench.drive.memory)
    bench.clock.sleep(600.0)
    fresh = SimulatedAvrBox(bench.box.settings, bench.clock.now(), bench.box.steps_per_turn, positions=(5, 5))
    again = Bench(memory=memory, box=fresh, clock=bench.clock)
    assert again.connect().unsynchronised == SWITCHED


@pytest.mark.parametrize("turned", [30_000, -300_000, 3_000_000])
def test_a_box_that_was_switched_off_and_turned_by_hand_overnight_is_unsynchronised_where_its_encoders_were_near_zero(
    turned,
):
    bench = opened()
    bench.follow(Line((0.0, 0.0), (0.0, 0.0), bench.clock.now()), 30.0)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    memory = dict(bench.drive.memory)
    bench.clock.sleep(12 * 3600.0)
    fresh = SimulatedAvrBox(
        bench.box.settings, bench.clock.now() - 30.0, bench.box.steps_per_turn, positions=(turned, turned)
    )
    assert Bench(memory=memory, box=fresh, clock=bench.clock).connect().unsynchronised == SWITCHED


@pytest.mark.parametrize(("seconds", "why"), [(12 * 3600.0, ABSENT), (30.0, "")])
def test_without_encoders_a_box_left_alone_is_believed_for_a_minute_with_all_that_it_tracks(seconds, why):
    blind = replace(SETTINGS, encoder_counts_per_turn=0)
    bench = Bench(blind)
    bench.connect()
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    memory = dict(bench.drive.memory)
    bench.clock.sleep(seconds)
    fresh = SimulatedAvrBox(bench.box.settings, bench.clock.now(), bench.box.steps_per_turn)
    reading = Bench(blind, memory=memory, box=fresh, clock=bench.clock).connect()
    assert reading.unsynchronised == why
    if not why:  # its tracking may have been off with it
        assert abs(reading.counts[0] - fresh.true_position(1)) <= reading.axes[0].uncertainty_counts


def test_a_box_that_was_switched_on_is_given_its_flags_by_a_sync():
    bench = opened()
    bench.slew(60_000.0, 50_000.0)
    fresh = SimulatedAvrBox(bench.box.settings, bench.clock.now(), bench.box.steps_per_turn, positions=(5, 5))
    bench.box.__dict__.update(fresh.__dict__)
    assert bench.read().unsynchronised == SWITCHED
    assert bench.box.flags == 0x04  # PEC on, no guiding
    bench.drive.sync((60_000.0, 50_000.0), bench.clock.now())
    assert bench.box.flags == 0x12


@pytest.mark.parametrize("axis", [1, 2])
def test_an_encoder_wired_backwards_is_told_with_the_remedy_and_no_longer_pointed_by(axis):
    bench = opened(**{f"encoder_reversed{axis}": True})
    slews = [AxisSlew(200_000.0, SIDEREAL), AxisSlew(100_000.0)]
    bench.drive.start(slews, bench.clock.now())
    for _ in range(40):
        why = bench.read().unsynchronised
        bench.clock.sleep(0.25)
    assert "swap its A and B wires" in why
    assert f"encoder of axis {axis}" in why


def test_a_box_that_ignores_moves_while_it_moves_raises_an_alarm_when_it_runs_away():
    bench = opened(busy="ignore")
    bench.slew(1000.0, 1000.0)
    bench.box.receive(b"M\x00\x00\x00\x01\x02", bench.clock.now())  # 16.8 million microsteps
    for _ in range(20):
        reading = bench.read()
        bench.clock.sleep(0.25)
    assert "axis 2 runs away" in reading.alarms
    assert "switch the box off now" in reading.unsynchronised


@pytest.mark.parametrize("true", ["restart", "ignore"])
def test_where_no_move_ends_another_a_runaway_is_an_alarm_and_is_sent_nothing(true):
    bench = Bench(replace(SETTINGS, busy="ignore"), like(busy=true))
    bench.connect()
    bench.slew(1000.0, 1000.0)
    begun, begin = [], bench.box._begin
    bench.box._begin = lambda *move: begun.append(move) or begin(*move)
    bench.box.receive(b"M\x00\x00\x00\x01\x02", bench.clock.now())
    began = bench.clock.now()
    while not (reading := bench.read()).alarms:
        bench.clock.sleep(0.25)
    print(f"\nan alarm {bench.clock.now() - began:.1f} s after it began to run")
    assert bench.clock.now() - began < 8.0  # three seconds may be a hand controller
    assert reading.alarms == ("axis 2 runs away",)
    assert "no move ends it: switch the box off now" in reading.unsynchronised
    for _ in range(20):
        bench.read()
        bench.clock.sleep(0.25)
    assert len(begun) == 1


@pytest.mark.parametrize("encoders", [20000, 0])
def test_where_no_move_ends_another_silence_after_one_is_never_broken_until_a_sync(encoders):
    lines = []
    bench = Bench(
        replace(SETTINGS, busy="ignore", encoder_counts_per_turn=encoders),
        line=lambda device: lines.append(Failing(device)) or lines[-1],
    )
    bench.connect()
    bench.drive.start([AxisSlew(50_000.0, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    lines[0].deaf = True
    bench.drive._moves.prove()
    lines[0].carried = 0
    for _ in range(20):
        reading = bench.read()
        bench.clock.sleep(0.5)
    assert lines[0].carried == 0
    assert "Switch the box off and on, then `sync`" in reading.unsynchronised


def test_a_runaway_after_a_mutilated_move_is_ended_and_its_place_known():
    bench = opened()
    bench.slew(1000.0, 1000.0)
    bench.drive.axes[1].unproved = True
    bench.box.receive(b"M\x00\x00\x00\x01\x02", bench.clock.now())
    began = bench.true()[1]
    for _ in range(20):
        bench.read()
        bench.clock.sleep(0.25)
    print(f"\nthe runaway came {bench.true()[1] - began:.0f} microsteps far")
    assert not bench.box.moving[1]
    assert within(bench)
    assert bench.read().unsynchronised == ""


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("never", [True, False])
def test_a_runaway_is_ended_though_nobody_knows_where_the_axes_are(axis, never):
    bench = Bench(memory={} if never else None)
    bench.connect()
    if not never:
        bench.drive.supervision.standing.lose(SWITCHED)
    bench.read()
    bench.box.receive(b"M\x00\x00\x00\x10" + bytes((2 * (axis - 1),)), bench.clock.now())
    began = bench.true()[axis - 1]
    for _ in range(60):
        reading = bench.read()
        bench.clock.sleep(0.25)
    turns = (bench.true()[axis - 1] - began) / STEPS_PER_TURN[axis - 1]
    print(f"\nthe runaway of axis {axis} came {360.0 * turns:.2f}° far")
    assert bench.box.moving == (False, False)
    assert 360.0 * turns < 1.5
    assert reading.alarms == ()
    assert reading.unsynchronised == (NEVER if never else SWITCHED)


class Lying:
    """A line that says something else in answer to some questions, in turn."""

    def __init__(self, device):
        self.device, self.lies = device, []

    def receive(self, data, t):
        answer = self.device.receive(data, t)
        return (self.lies.pop(0) or answer) if answer and self.lies else answer


@pytest.mark.parametrize(
    ("lies", "ends"),
    [
        (["x", "", "y", "", "z"], ""),
        (["x", "", "y", "z", "u", ""], ""),  # the last answer of three agrees with none
        (list("xyzuvwabcdef"), "no two of which can be right"),
    ],
)
def test_an_answer_that_no_other_one_agrees_with_is_never_believed(lies, ends):
    lines = []
    bench = Bench(line=lambda device: lines.append(Lying(device)) or lines[-1])
    bench.connect()
    bench.slew(60_000.0, 50_000.0)
    bench.drive._box.trust.flawed()
    lines[0].lies = [b"%+06d\t%+06d\r" % (400 + 60 * ord(lie), 9 * ord(lie)) if lie else b"" for lie in lies]
    said = ""
    for _ in range(4):
        try:
            assert within(bench)
        except NoAnswer as none:
            said = str(none)
        bench.clock.sleep(0.25)
    assert ends in said if ends else not said
    assert within(bench)
    assert bench.read().unsynchronised == ""


class Failing:
    """A link that fails in the middle of a command with arguments, once it is armed."""

    def __init__(self, device, whole=3):
        self.device, self.armed, self.deaf, self.whole = device, False, False, whole
        self.carried = 0

    def receive(self, data, t):
        if self.armed and COMMANDS[chr(data[0])].arguments:
            self.device.receive(data[: self.whole], t)
            raise LinkError("unplugged")
        self.carried += len(data)
        return b"" if self.deaf else self.device.receive(data, t)


def cut_off(whole, encoders):
    """A bench whose first move was cut off after some bytes, and its link, whole again."""
    lines = []
    settings = replace(SETTINGS, encoder_counts_per_turn=encoders)
    bench = Bench(settings, line=lambda device: lines.append(Failing(device, whole)) or lines[-1])
    bench.connect()
    lines[0].armed = True
    with pytest.raises(LinkError):
        bench.drive.start([AxisSlew(1_200_000.0, SIDEREAL), AxisSlew(5000.0)], bench.clock.now())
    lines[0].armed = False
    lines[0].carried = 0
    return bench, lines[0]


@pytest.mark.parametrize("again", [False, True], ids=["the same program", "the next one"])
@pytest.mark.parametrize("encoders", [20000, 0])
@pytest.mark.parametrize("whole", [1, 2, 3, 4, 5])
def test_after_half_a_move_not_one_byte_is_sent_until_a_sync(whole, encoders, again):
    bench, line = cut_off(whole, encoders)
    if again:
        bench = Bench(bench.drive._settings, None, dict(bench.kept), lambda _: line, box=bench.box, clock=bench.clock)
        bench.connect()
    before = bench.true()[1]
    for _ in range(40):
        reading = bench.read()
        bench.drive.follow(Line((0.0, 0.0), (0.0, 0.0), T0), bench.clock.now())
        bench.clock.sleep(0.5)
    assert "Switch the box off and on, then `sync`" in reading.unsynchronised
    with pytest.raises(Unsynchronised, match="Switch the box off and on"):
        bench.drive.start([AxisSlew(0.0), AxisSlew(5.0)], bench.clock.now())
    with pytest.raises(DriveRefused, match="Switch the box off and on"):
        bench.drive.registers()
    assert line.carried == 0
    assert (bench.box.moving, bench.true()[1]) == ((False, False), before)
    bench.box._held.clear()  # it is switched off and on
    bench.drive.sync(bench.true(), bench.clock.now())
    assert bench.read().unsynchronised == ""
    bench.slew(20_000.0, 7000.0)
    assert bench.box.moving == (False, False)
    assert within(bench)


def test_whatever_is_remembered_around_a_move_knows_of_it_or_doubts():
    bench, kept = opened(), []
    remember = bench.drive._moves._remember

    def noted():
        remember()
        kept.append(dict(bench.kept))

    bench.drive._moves._remember = noted
    bench.drive.start([AxisSlew(1_200_000.0, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    assert any(each["sending"] for each in kept)
    assert all(each["sending"] or each["axes"][0]["moves"] for each in kept)


@pytest.mark.parametrize("whole", [1, 2, 3, 4, 5])
def test_a_sync_without_the_power_switch_makes_no_longer_move_than_the_one_cut_off(whole):
    bench, _ = cut_off(whole, 20000)
    bench.clock.sleep(60.0)
    bench.drive.sync((0.0, 0.0), bench.clock.now())
    begun = [motor.slew.step_max for motor in bench.box.motors if motor.slew is not None]
    print(f"\n{whole} bytes: a move of {begun} halves")
    assert max(begun, default=0) <= bench.drive.axes[0].model.longest_half


def test_without_encoders_silence_after_a_move_leaves_the_position_unknown():
    lines = []
    bench = Bench(
        replace(SETTINGS, encoder_counts_per_turn=0),
        line=lambda device: lines.append(Failing(device)) or lines[-1],
    )
    bench.connect()
    bench.drive.start([AxisSlew(50_000.0, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    assert bench.drive.supervision.unsynchronised == ""
    lines[0].deaf = True
    bench.drive._moves.unproved = True
    bench.drive._moves.prove()
    assert bench.drive.supervision.unsynchronised == MAY_RUN


@pytest.mark.parametrize(
    ("configured", "true", "said"),
    [("total", "half", 'twice as far .* set `move_count` to "half"'),
     ("half", "total", 'half as far .* set `move_count` to "total"')],
)  # fmt: skip
def test_a_count_that_means_something_else_is_told_by_the_first_slew_and_no_other_is_made(configured, true, said):
    bench = Bench(replace(SETTINGS, move_count=configured), like(move_count=true))
    bench.connect()
    bench.slew(200_000.0, -100_000.0)
    bench.clock.sleep(10.0)
    assert re.search(said, bench.read().unsynchronised)
    with pytest.raises(Unsynchronised, match=said):
        bench.slew(0.0, 0.0)


def test_a_motor_that_misses_half_of_its_steps_once_is_no_count_that_is_wrong():
    bench = opened()
    bench.drive.start([AxisSlew(60_000.0, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    while any(axis.slewing for axis in bench.read().axes):
        bench.clock.sleep(0.25)
    bench.drive.start([AxisSlew(0.0, SIDEREAL), AxisSlew(0.0)], bench.clock.now())
    bench.read()
    bench.clock.sleep(2.0)
    bench.box.push(1, 30_000.0)
    bench.clock.sleep(10.0)
    assert within(bench)
    assert bench.read().unsynchronised == ""
