"""Faults on the line to a stepper box, and what became of many runs with them: of the driver, of whole telescopes."""

import math
import random
from collections import Counter

from faults import mutilated

from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.slew_table import laws, standard
from mounts.avr_box.timers import CRYSTAL_HZ
from mounts.errors import DriveError
from transports.errors import TransportError

LONGEST_S = 10.0
HEARD_S = 1.0  # after which a command that was not begun is none any more


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
        return mutilated(how, data, self.chance)


def moves_of(command):
    """Axis, `step_max`, direction and slowness of each move that a command begins, by the manual."""
    if command[:1] == b"M":
        count, last = int.from_bytes(command[1:5], "little"), command[5]
        return [(last >> 1 & 1, count // 2, -1 if last & 0x80 else 1, 1)]
    letters = {"E": (0, 2763, -1, 1), "W": (0, 2763, 1, 1), "S": (1, 1382, -1, 1), "N": (1, 1382, 1, 1)}
    return (
        [letters[letter] for letter in command.decode("latin-1") if letter in letters]
        if command[:1] in (b"E", b"W", b"S", b"N")
        else []
    )


class Watch:
    """Measures the moves that the box makes and nobody commanded, and holds every reading to the box's own motors."""

    def __init__(self, box, drive):
        self.wanted = []  # what was commanded and has not begun: when, axis, step_max, direction, slowed
        self.worst = [0, 0]
        self.running = [None, None]
        self.readings, self.ratio, self.wrong = 0, 0.0, []
        read, send = drive.read, drive._box.send
        begin, advance = box._begin, box.advance

        def sent(command):
            self.wanted += [(drive._box.now(), *move) for move in moves_of(command)]
            return send(command)

        def began(axis, step_max, direction, slowed):
            self.note(box)
            begin(axis, step_max, direction, slowed)
            time = box._t0 + box._now / CRYSTAL_HZ
            due = (each for each in self.wanted if each[1:] == (axis, step_max, direction, slowed))
            asked = next((each for each in due if abs(time - each[0]) < HEARD_S), None)
            if asked:
                self.wanted.remove(asked)
            self.running[axis] = None if asked else box.motors[axis].position

        def advanced(t):
            advance(t)
            self.note(box)

        def judged(time):
            reading = read(time)
            self.judge(reading, box)
            return reading

        drive.read, drive._box.send, box._begin, box.advance = judged, sent, began, advanced

    def judge(self, reading, box):
        if reading.unsynchronised:
            return
        self.readings += 1
        box.advance(reading.time)
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - box.true_position(i + 1))
            self.ratio = max(self.ratio, off / (axis.uncertainty_counts or math.inf))
            if off > axis.uncertainty_counts:
                self.wrong.append((i, off, axis.uncertainty_counts))

    def note(self, box):
        for axis, since in enumerate(self.running):
            if since is not None:
                self.worst[axis] = max(self.worst[axis], abs(box.motors[axis].position - since))
                if box.motors[axis].slew is None:
                    self.running[axis] = None


def switch_off_and_on(box, time):
    """A box that lost its power for a moment: the motors stand where they were, all else is as it boots."""
    box.advance(time)
    positions = tuple(motor.position for motor in box.motors)
    fresh = SimulatedAvrBox(box.settings, time, box.steps_per_turn, positions=positions, signs=box._signs)
    watched = {name: value for name, value in box.__dict__.items() if name in {"_begin", "advance", "receive"}}
    box.__dict__.update(fresh.__dict__ | watched)


class Campaign:
    """What many nights came to."""

    def __init__(self):
        self.faults, self.worst, self.lost, self.wrong, self.ratio, self.longer = Counter(), [0, 0], 0, [], 0.0, []
        self.readings = 0
        self.bound = [2 * law.half_within(round(LONGEST_S * CRYSTAL_HZ)) for law in laws(standard())]

    def add(self, seed, read, watch, happened):
        self.faults += Counter(how for how, _ in happened.elements())
        self.worst = [max(pair) for pair in zip(self.worst, watch.worst, strict=True)]
        if any(far > most for far, most in zip(watch.worst, self.bound, strict=True)):
            self.longer.append((seed, watch.worst))
        self.readings, self.ratio = self.readings + watch.readings, max(self.ratio, watch.ratio)
        self.wrong += [(seed, *each) for each in watch.wrong]
        try:
            reading = read()
        except (DriveError, TransportError):  # it will not be spoken to until it was switched off and on
            self.lost += 1
            return
        self.lost += bool(reading.unsynchronised)

    def __str__(self):
        return (
            f"{sum(self.faults.values())} mutilated: {dict(self.faults)}, farthest {self.worst} of {self.bound} "
            f"microsteps, {self.lost} unsynchronised, {self.readings} readings, {self.ratio:.2f} of what was stated\n"
            f"longer: {self.longer[:10]} wrong: {self.wrong[:10]}"
        )
