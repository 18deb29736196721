"""Bytes lost, doubled and garbled on the way to the box and back: what then moves, and what the driver says of it."""

import os
import random
from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, Bench, Line, like
from avr_faults import LONGEST_S, Campaign, Mutilating, Watch, switch_off_and_on
from faults import FaultyDevice, by_chance

from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = 1000 if FULL else 20
FIRST = int(os.environ.get("CLOCKDRIVE_SEED", "0"))


def night(seed, rate, *, encoders=20000, both=True, interfere=lambda _bench, _rng: None):
    """Two slews and tracking on a bad line; returns the bench, its watch, what was said at the end."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    lines = []

    def line(device):
        answers = FaultyDevice(device, by_chance(seed, rate), seed) if encoders else device  # blind, it begins clean
        lines.append(Mutilating(answers, seed, 0.0))
        return lines[0]

    settings = replace(SETTINGS, longest_s=LONGEST_S, encoder_counts_per_turn=encoders)
    bench = Bench(settings, like(encoder_counts_per_turn=encoders), line=line)
    connect(bench)
    watch = Watch(bench.box, bench.drive)
    lines[0].rate = rate
    if both and not encoders:
        lines[0].device = FaultyDevice(bench.box, by_chance(seed, rate), seed)
    for _ in range(2):
        try:
            here = bench.read()
            targets = [axis.counts + rng.choice((-1, 1)) * 10.0 ** rng.uniform(3.0, 5.3) for axis in here.axes]
            slews = [AxisSlew(targets[0], SIDEREAL), AxisSlew(targets[1])]
            bench.drive.start(slews, bench.clock.now())
            interfere(bench, rng)
            poll(bench, 60.0, stop=True)
            path = Line((bench.read().axes[0].counts, targets[1]), (SIDEREAL, 0.0), bench.clock.now())
            bench.follow(path, 15.0)
        except (DriveError, TransportError):
            bench.clock.sleep(1.0)
    lines[0].rate, lines[0].device = 0.0, bench.box
    poll(bench, 20.0, stop=False)
    return bench, watch, lines[0].happened


def connect(bench):
    """Try until it is connected, as a person does."""
    while True:
        try:
            bench.connect()
        except (DriveError, TransportError):
            bench.clock.sleep(1.0)
        else:
            return


def hand_controller(bench, rng):
    """Somebody presses a key of the hand controller in the middle of a slew, or after it."""
    poll(bench, rng.uniform(0.5, 12.0), stop=False)
    axis, half = rng.choice(((0, 2763), (1, 1382)))
    bench.box._begin(axis, half, rng.choice((-1, 1)), 1)


def power_cut(bench, rng):
    """Somebody switches the box off and on in the middle of a slew, or after it."""
    poll(bench, rng.uniform(0.5, 12.0), stop=False)
    switch_off_and_on(bench.box, bench.clock.now())


def poll(bench, seconds, *, stop):
    end = bench.clock.now() + seconds
    while bench.clock.now() < end:
        try:
            reading = bench.read()
            if stop and not any(axis.slewing for axis in reading.axes):
                return
        except (DriveError, TransportError):
            pass
        bench.clock.sleep(0.25)


@pytest.mark.parametrize(("command", "steps"), [(b"M\xe8\x03\x00\x00\x00", 1000), (b"W", 5526)])
def test_what_the_line_repeats_of_a_command_counts_as_a_move_that_nobody_commanded(command, steps):
    bench, far = Bench(), []
    bench.connect()
    watch = Watch(bench.box, bench.drive)
    for send in (bench.drive._box.send, lambda again: bench.box.receive(again, bench.clock.now())):
        send(command)
        for _ in range(100):
            bench.clock.sleep(0.1)
            bench.box.advance(bench.clock.now())
        far.append(watch.worst[0])
    assert far[0] == 0
    assert steps <= far[1] < steps + 0.1 * 280  # and what it tracks until that is looked at


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("interfere", [None, hand_controller, power_cut])
def test_a_mutilated_command_moves_no_farther_than_one_bounded_move_and_the_position_is_right_or_unknown(interfere):
    campaign = Campaign()
    for seed in range(FIRST, FIRST + RUNS):
        bench, watch, happened = night(seed, 0.05, **({} if interfere is None else {"interfere": interfere}))
        campaign.add(seed, bench.read, watch, happened)
    print(f"\n{RUNS} runs, {campaign}")
    assert not campaign.longer
    assert not campaign.wrong


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("rate", "both"), [(0.05, True), (0.05, False), (0.01, False)][: 3 if FULL else 2])
def test_without_encoders_nothing_goes_farther_than_one_bounded_move_and_every_reading_is_right_or_unknown(
    rate, both
):
    campaign = Campaign()
    for seed in range(FIRST, FIRST + RUNS):
        bench, watch, happened = night(seed, rate, encoders=0, both=both)
        campaign.add(seed, bench.read, watch, happened)
    print(f"\n{RUNS} runs, {campaign}")
    assert not campaign.longer
    assert not campaign.wrong
