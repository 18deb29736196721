"""Bytes lost, doubled and garbled on the way to the box and back: what then moves, and what the driver says of it."""

import math
import os
import random
from collections import Counter
from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, Bench, Line, like
from faults import FaultyDevice, by_chance

from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.slew_table import laws, standard
from mounts.avr_box.timers import CRYSTAL_HZ
from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = 1000 if FULL else 20
FIRST = int(os.environ.get("CLOCKDRIVE_SEED", "0"))
LONGEST_S = 10.0


class Mutilating:
    """A line on which what is sent goes wrong now and then."""

    def __init__(self, device, seed, rate):
        self.device, self.rate = device, rate
        self.chance = random.Random(seed)  # noqa: S311 - nothing secret
        self.happened = Counter()

    def receive(self, data, t):
        if self.chance.random() < self.rate:
            data = self.mutilated(data)
        return self.device.receive(data, t) if data else b""

    def mutilated(self, data):
        how = self.chance.choice(("lost", "doubled", "garbled", "silence"))
        self.happened[how, chr(data[0])] += 1
        at = self.chance.randrange(len(data))
        byte = bytes((data[at] ^ 1 << self.chance.randrange(8),))
        return {
            "lost": data[:at] + data[at + 1 :],
            "doubled": data[: at + 1] + data[at:],
            "garbled": data[:at] + byte + data[at + 1 :],
            "silence": b"",
        }[how]


class Watch:
    """Measures the moves that the box makes and nobody commanded."""

    def __init__(self, bench):
        self.wanted = set()
        self.worst = [0, 0]
        self.running = [None, None]
        box, send = bench.box, bench.drive._box.send
        begin, advance = box._begin, box.advance

        def sent(command):
            if command[:1] == b"M":
                self.wanted.add(
                    (int(bool(command[5] & 2)), int.from_bytes(command[1:5], "little") // 2, 1 - (command[5] >> 6))
                )
            return send(command)

        def began(axis, step_max, direction, slowed):
            self.note(box)
            begin(axis, step_max, direction, slowed)
            asked = (axis, step_max, direction) in self.wanted or step_max in {2763, 1382}
            self.running[axis] = None if asked else box.motors[axis].position

        def advanced(t):
            advance(t)
            self.note(box)

        bench.drive._box.send, box._begin, box.advance = sent, began, advanced

    def note(self, box):
        for axis, since in enumerate(self.running):
            if since is not None:
                self.worst[axis] = max(self.worst[axis], abs(box.motors[axis].position - since))
                if box.motors[axis].slew is None:
                    self.running[axis] = None


def night(seed, rate, *, encoders=20000, interfere=lambda _bench, _rng: None):
    """Two slews and tracking on a bad line; returns the bench, its watch, what was said at the end."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    lines = []

    def line(device):
        lines.append(Mutilating(FaultyDevice(device, by_chance(seed, rate), seed), seed, 0.0))
        return lines[0]

    settings = replace(SETTINGS, longest_s=LONGEST_S, encoder_counts_per_turn=encoders)
    bench = Bench(settings, like(encoder_counts_per_turn=encoders), line=line)
    connect(bench)
    watch = Watch(bench)
    lines[0].rate = rate
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
    box = bench.box
    box.advance(bench.clock.now())
    fresh = SimulatedAvrBox(
        box.settings,
        bench.clock.now(),
        box.steps_per_turn,
        positions=tuple(motor.position for motor in box.motors),
    )
    kept = {name: value for name, value in box.__dict__.items() if name in {"_begin", "advance"}}
    box.__dict__.update(fresh.__dict__ | kept)


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


class Campaign:
    """What many nights came to."""

    def __init__(self):
        self.faults, self.worst, self.lost, self.wrong, self.ratio, self.longer = Counter(), [0, 0], 0, [], 0.0, []
        self.bound = [2 * law.half_within(round(LONGEST_S * CRYSTAL_HZ)) for law in laws(standard())]

    def add(self, seed, bench, watch, happened):
        self.faults += Counter(how for how, _ in happened.elements())
        self.worst = [max(pair) for pair in zip(self.worst, watch.worst, strict=True)]
        if any(far > most for far, most in zip(watch.worst, self.bound, strict=True)):
            self.longer.append((seed, watch.worst))
        try:
            reading = bench.read()
        except (DriveError, TransportError):  # it will not be spoken to until it was switched off and on
            self.lost += 1
            return
        if reading.unsynchronised:
            self.lost += 1
            return
        bench.box.advance(reading.time)
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - bench.box.true_position(i + 1))
            self.ratio = max(self.ratio, off / (axis.uncertainty_counts or math.inf))
            if off > axis.uncertainty_counts:
                self.wrong.append((seed, i, off, axis.uncertainty_counts))

    def __str__(self):
        return (
            f"{sum(self.faults.values())} mutilated: {dict(self.faults)}, farthest {self.worst} of {self.bound} "
            f"microsteps, {self.lost} unsynchronised, {self.ratio:.2f} of what was stated\n"
            f"longer: {self.longer[:10]} wrong: {self.wrong[:10]}"
        )


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("interfere", [None, hand_controller, power_cut])
def test_a_mutilated_command_moves_no_farther_than_one_bounded_move_and_the_position_is_right_or_unknown(interfere):
    campaign = Campaign()
    for seed in range(FIRST, FIRST + RUNS):
        campaign.add(seed, *night(seed, 0.05, **({} if interfere is None else {"interfere": interfere})))
    print(f"\n{RUNS} runs, {campaign}")
    assert not campaign.longer
    assert not campaign.wrong
