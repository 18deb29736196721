"""An AWR Microstep on the test bench: driver and simulated unit joined in memory under a virtual clock."""

import random
from collections import Counter
from dataclasses import dataclass
from functools import partial

from faults import mutilated

from clockdrive.clock import VirtualClock
from mounts.awr.drive import AwrDrive
from mounts.awr.memory import Shown, at_park
from mounts.awr.settings import AwrSettings
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.unit import Unit
from mounts.drive import AxisSlew
from transports.memory import MemoryLink

T0 = 1_800_000_000.0
STILL = {"execution_s": 0.0, "execution_jitter_s": 0.0, "stamp_jitter_s": 0.0}


class Mutilating:
    """A line on which packets and bytes, either way, are lost, doubled or garbled now and then."""

    def __init__(self, device, seed, rate):
        self.device, self.rate = device, rate
        self.chance = random.Random(seed)  # noqa: S311 - nothing secret
        self.happened = Counter()
        self.garbles = True  # what the host says as well: a bit makes another key of a key

    def receive(self, data, t):
        self.device.advance(t)
        return self.mutilated(self.device.receive(self.mutilated(data, garbles=self.garbles), t))

    def says(self, until):
        said = self.device.says(until)
        return None if said is None else (said[0], self.mutilated(said[1]))

    def mutilated(self, data, *, garbles=True):
        if not data or self.chance.random() >= self.rate:
            return data
        how = self.chance.choice(("lost", "doubled", "silence", *(("garbled",) if garbles else ())))
        self.happened[how] += 1
        return mutilated(how, data, self.chance)


class Wire:
    """Unit, link, clock and simulator."""

    def __init__(self, settings=None, *, baud=9600, rate=0.0, seed=1, clock=None, latency_s=0.0, timeout_s=0.1):
        self.clock = clock or VirtualClock(T0)
        self.awr = SimulatedAwr(settings or SimulatorSettings(), self.clock.now())
        self.line = Mutilating(self.awr, seed, rate)
        opened = partial(MemoryLink, self.line, self.clock, baud=baud, latency_s=latency_s)
        self.unit = Unit(opened, self.clock, baud, timeout_s)


SETTINGS = AwrSettings(50.0)
SIDEREAL = 50.0


@dataclass
class Line:
    """A path on which both axes go evenly."""

    counts: tuple[float, float]
    rates: tuple[float, float]
    since: float
    led: bool = False

    def at(self, time):
        (x, y), (u, v), t = self.counts, self.rates, time - self.since
        return (x + u * t, u), (y + v * t, v)


class Guard:
    """In place of a dead-man process: remembers what it was told."""

    def __init__(self):
        self.fate, self.armed, self.hasty, self.easy, self.told = "", False, False, False, []

    def start(self):
        self.told.append("start")

    def arm(self):
        self.armed, self.hasty, self.easy = True, False, False

    def hasten(self):
        self.hasty, self.easy = True, False
        self.told.append("hasten")

    def ease(self):
        self.hasty, self.easy = False, True

    def beat(self):
        return True

    def disarm(self):
        self.armed = False

    def close(self):
        self.told.append("close")


class Bench(Wire):
    """The driver as well."""

    def __init__(self, settings=SETTINGS, unit=None, memory=None, **ways):
        super().__init__(unit, **ways)
        seen = Shown(settings.assumed, (True, True), referenced=True)
        self.kept = memory if memory is not None else at_park((0, 0), self.clock.now(), "", seen)
        self.guard = Guard()
        self.drive = AwrDrive(self.unit, settings, self.kept, self._keep, self.guard)

    def _keep(self, memory):
        self.kept = memory

    def connect(self, *, make_safe=False):
        return self.drive.connect(self.clock.now(), make_safe=make_safe)

    def read(self):
        return self.drive.read(self.clock.now())

    def slew(self, *targets, rates=(SIDEREAL, 0.0), limit_s=900.0):
        """Slew and poll as the session does; return for how long it slewed."""
        began = self.clock.now()
        slews = [AxisSlew(target, rate, None, began) for target, rate in zip(targets, rates, strict=True)]
        self.drive.start(slews, began)
        while any(axis.slewing for axis in self.read().axes):
            self.clock.sleep(0.25)
            assert self.clock.now() - began < limit_s
        return self.clock.now() - began

    def true(self):
        """Where both motors truly are, now."""
        self.awr.advance(self.clock.now())
        return self.awr.true_position(1), self.awr.true_position(2)

    def off(self):
        """By how many steps the reckoning is ahead of the truth, now."""
        now, true = self.clock.now(), self.true()
        return tuple(axis.at(now).counts - here for axis, here in zip(self.drive.axes, true, strict=True))

    def follow(self, path, seconds, look=lambda _: None):
        """Read and follow as the session does."""
        end = self.clock.now() + seconds
        while (now := self.clock.now()) < end:
            self.read()
            due = self.drive.follow(path, self.clock.now())
            look(self.clock.now())
            self.clock.sleep(min(due, 1.0, max(0.0, end - now)))
