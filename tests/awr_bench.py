"""An AWR Microstep on the test bench: driver and simulated unit joined in memory under a virtual clock."""

import random
from collections import Counter

from clockdrive.clock import VirtualClock
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.unit import Unit
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
        at = self.chance.randrange(len(data))
        byte = bytes((data[at] ^ 1 << self.chance.randrange(8),))
        return {
            "lost": data[:at] + data[at + 1 :],
            "doubled": data[: at + 1] + data[at:],
            "garbled": data[:at] + byte + data[at + 1 :],
            "silence": b"",
        }[how]


class Wire:
    """Unit, link, clock and simulator."""

    def __init__(self, settings=None, *, baud=9600, rate=0.0, seed=1, clock=None):
        self.clock = clock or VirtualClock(T0)
        self.awr = SimulatedAwr(settings or SimulatorSettings(), self.clock.now())
        self.line = Mutilating(self.awr, seed, rate)
        self.unit = Unit(lambda: MemoryLink(self.line, self.clock, baud=baud), self.clock, baud)
