"""Bytes lost, doubled and garbled on the way to the box and back: what then moves, and what the driver says of it."""

import os
import random
from collections import Counter
from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, Bench, Line, like
from faults import FaultyDevice, by_chance

from mounts.avr_box.slew_table import laws, standard
from mounts.avr_box.timers import CRYSTAL_HZ
from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = 1000 if FULL else 60
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


def night(seed, rate):
    """Two slews and a minute of tracking on a bad line; returns the bench, its watch, what was said at the end."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    lines = []

    def line(device):
        lines.append(Mutilating(FaultyDevice(device, by_chance(seed, rate), seed), seed, 0.0))
        return lines[0]

    bench = Bench(replace(SETTINGS, longest_s=LONGEST_S), like(), line=line)
    bench.connect()
    watch = Watch(bench)
    lines[0].rate = rate
    for _ in range(2):
        try:
            here = bench.read()
            targets = [axis.counts + rng.choice((-1, 1)) * 10.0 ** rng.uniform(3.0, 5.3) for axis in here.axes]
            slews = [AxisSlew(targets[0], SIDEREAL), AxisSlew(targets[1])]
            bench.drive.start(slews, bench.clock.now())
            poll(bench, 60.0, stop=True)
            path = Line((bench.read().axes[0].counts, targets[1]), (SIDEREAL, 0.0), bench.clock.now())
            bench.follow(path, 15.0)
        except (DriveError, TransportError):
            bench.clock.sleep(1.0)
    lines[0].rate, lines[0].device = 0.0, bench.box
    poll(bench, 20.0, stop=False)
    return bench, watch, lines[0].happened


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


@pytest.mark.campaign
@pytest.mark.timeout(1800)
def test_a_mutilated_command_moves_no_farther_than_one_bounded_move_and_the_position_is_right_or_unknown():
    bound = [2 * law.half_within(round(LONGEST_S * CRYSTAL_HZ)) for law in laws(standard())]
    faults, worst, lost, wrong, ratio, longer = Counter(), [0, 0], 0, [], 0.0, []
    for seed in range(RUNS):
        bench, watch, happened = night(seed, 0.05)
        faults += Counter(how for how, _ in happened.elements())
        worst = [max(pair) for pair in zip(worst, watch.worst, strict=True)]
        if any(far > most for far, most in zip(watch.worst, bound, strict=True)):
            longer.append((seed, watch.worst))
        try:
            reading = bench.read()
        except (DriveError, TransportError):  # it will not be spoken to until it was switched off and on
            lost += 1
            continue
        if reading.unsynchronised:
            lost += 1
            continue
        bench.box.advance(reading.time)
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - bench.box.true_position(i + 1))
            ratio = max(ratio, off / (axis.uncertainty_counts + 2.0))
            if off > axis.uncertainty_counts + 2.0:
                wrong.append((seed, i, off, axis.uncertainty_counts))
    print(
        f"\n{RUNS} runs, {dict(faults)}: farthest {worst} of {bound} microsteps, {lost} unsynchronised, {ratio:.2f}"
    )
    print("longer:", longer[:10], "wrong:", wrong[:10])
    assert not longer
    assert not wrong
