"""What moves where no encoder sees it: each single fault of a move, and the letters that end what it became."""

import os
import random
from contextlib import suppress
from dataclasses import replace
from itertools import product

import pytest
from avr_bench import SETTINGS, SIDEREAL, STEPS_PER_TURN, T0, Bench, Line, like
from avr_faults import LONGEST_S, Watch

from mounts.avr_box import commands
from mounts.avr_box.commands import COMMANDS, FILL, FIVE_ARCMIN, misread, move, rest_of
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
MOVES, FAULTS = range(1, 8), range(61)  # of a slew, the first few, and of a move
BLIND = replace(SETTINGS, longest_s=LONGEST_S, encoder_counts_per_turn=0)
BOUND = [2 * half for half in BLIND.longest_half]


def faults(data):
    """All that may arrive where a byte of a command is lost, doubled or has a bit otherwise, or all are lost."""
    yield b""
    for at, byte in enumerate(data):
        yield data[:at] + data[at + 1 :]
        yield data[: at + 1] + data[at:]
        for bit in range(8):
            yield data[:at] + bytes((byte ^ 1 << bit,)) + data[at + 1 :]


def taken(data):
    """What a box at rest begins that hears so many bytes: axis and half of the microsteps, of each move."""
    box, begun = SimulatedAvrBox(like(), T0, STEPS_PER_TURN), []
    box._begin = lambda axis, half, *_: begun.append((axis, half))
    box.receive(data, T0)
    assert not box._held  # it waits for no rest
    return begun


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("decreasing", [False, True])
@pytest.mark.parametrize("count", [2, 404, 12000, 45056, 124106])
def test_what_a_box_may_take_a_move_for_is_what_a_simulated_one_begins(axis, decreasing, count):
    command = move(axis, count, decreasing=decreasing)
    begun = {each for data in faults(command) for each in taken(data + rest_of(command))}
    letters = {(0, FIVE_ARCMIN[0]), (1, FIVE_ARCMIN[1])}
    assert begun - letters == {(bit, wire // 2) for bit, wire in misread(command)} - letters


def test_no_letter_that_ends_a_move_may_be_taken_for_a_command_that_waits_for_more():
    for letter in (b"W", b"N"):
        heard = {data for data in faults(letter) if len(data) == 1}
        assert all(COMMANDS[chr(data[0])].arguments == 0 for data in heard if chr(data[0]) in COMMANDS)


@pytest.mark.parametrize("letter", [b"E", b"S", b"W", b"N"])
def test_a_letter_is_five_arcminutes_or_less_whatever_one_fault_makes_of_it(letter):
    most = max(half for data in faults(letter) for _, half in taken(data + FILL))
    assert most == FIVE_ARCMIN["WE".find(letter.decode()) < 0] or most == max(FIVE_ARCMIN)


class Once:
    """A line on which one move arrives otherwise than it was sent."""

    def __init__(self, device, number, fault):
        self.device, self.number, self.fault, self.moves = device, number, fault, 0

    def receive(self, data, t):
        if data[:1] == b"M":
            self.moves += 1
            if self.moves == self.number:
                data = list(faults(data))[self.fault]
        return self.device.receive(data, t) if data else b""


def slewed(targets, number=0, fault=0):
    """A slew of which one move suffers one fault; the bench, and what was watched."""
    lines = []
    unit = like(encoder_counts_per_turn=0)
    bench = Bench(BLIND, unit, line=lambda box: lines.append(Once(box, number, fault)) or lines[-1])
    bench.connect()
    watch = Watch(bench.box, bench.drive)
    bench.drive.start([AxisSlew(targets[0], SIDEREAL), AxisSlew(targets[1])], bench.clock.now())
    until = bench.clock.now() + 8.0
    while bench.clock.now() < until:
        with suppress(DriveError, TransportError):
            if any(axis.slewing for axis in bench.read().axes):
                until = bench.clock.now() + 8.0
        bench.clock.sleep(0.5)
    bench.true()
    return bench, watch


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("targets", [(60_000.0, -30_000.0), (-3000.0, 60_000.0), (-120_000.0, 300.0)])
def test_without_encoders_no_fault_of_a_move_runs_farther_than_one_bounded_move(targets):
    every, worst = list(product(MOVES, FAULTS)), [0, 0]
    tried = every if FULL else random.Random(str(targets)).sample(every, 2)  # noqa: S311 - nothing secret
    for number, fault in tried:
        bench, watch = slewed(targets, number, fault)
        worst = [max(pair) for pair in zip(worst, watch.worst, strict=True)]
        assert bench.box.moving == (False, False)
        assert not watch.wrong
    print(f"\n{len(tried)} faults: at most {worst} of {BOUND} microsteps")
    assert worst[0] <= BOUND[0]
    assert worst[1] <= BOUND[1]


def test_a_slew_that_begins_before_an_axis_was_led_back_goes_from_where_that_is():
    bench, sent = Bench(BLIND, like(encoder_counts_per_turn=0)), []
    bench.connect()
    receive = bench.box.receive
    bench.box.receive = lambda data, t: sent.append(data) or receive(data, t)
    path = Line((500.0, 0.0), (SIDEREAL, 0.0), T0 + 1.0)
    while b"W" not in sent:
        bench.follow(path, 0.5)
    bench.slew(6000.0, 0.0)
    assert b"E" not in sent
    assert max(map(abs, bench.off())) <= 1.0
    assert bench.true()[1] == 0


def sent_while(path, seconds=50.0):
    """What is sent while a path is followed without encoders, without questions, and where both axes were then."""
    bench, sent, ways = Bench(BLIND, like(encoder_counts_per_turn=0)), [], []
    bench.connect()
    receive = bench.box.receive

    def noted(data, t):
        if data not in (commands.ASK_PEC, FILL):
            sent.append(data)
        return receive(data, t)

    bench.box.receive = noted
    bench.follow(
        path, seconds, lambda now: ways.append([a - b[0] for a, b in zip(bench.true(), path.at(now), strict=True)])
    )
    return sent, ways


def test_without_encoders_axis_1_is_held_by_letters_alone_and_never_beyond_its_place():
    sent, ways = sent_while(Line((600.0, 0.0), (0.0, 0.0), T0))
    ahead = [way for way, _ in ways]
    print(f"\nheld {min(ahead):.0f} to {max(ahead):.0f} microsteps from its place")
    assert set(sent) == {b"E"}
    assert max(ahead) <= 0.0
    assert min(ahead) > -1.5 * 5531


@pytest.mark.parametrize("rate", [0.965, 0.9806, 3.0])
def test_without_encoders_moves_beside_tracking_follow_each_other_and_need_no_letters(rate):
    sent, ways = sent_while(Line((0.0, 0.0), (rate * SIDEREAL, 0.0), T0 + 1.0))
    worst = max(abs(way) for way, _ in ways[20:])
    print(f"\n{rate} sidereal: {worst:.1f} microsteps off at worst")
    assert {data[:1] for data in sent} - {b"C"} <= {b"M", b"\x00", b"\x80"}
    assert worst < 20.0 + abs(rate - 1.0) * 1.6 * SIDEREAL


def test_without_encoders_one_move_to_a_path_is_ended_by_letters_that_lead_back_to_it():
    sent, ways = sent_while(Line((500.0, 700.0), (SIDEREAL, 0.0), T0 + 1.0), 60.0)
    assert sum(data == b"W" for data in sent) == 4
    assert sum(data == b"E" for data in sent) == 1
    assert max(abs(way) for one, two in ways[-20:] for way in (one - 5.0, two)) < 20.0
