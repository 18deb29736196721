"""A key is never held long when its owner dies: real owners, killed and frozen, a real line, the simulated unit.

The unit's own times of press and release are the oracle.
"""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import pytest
from waiting import seconds_until

from clockdrive.clock import SystemClock
from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from transports.memory import MemoryLink
from transports.serve import serve

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
CLOCK = SystemClock()
HOLD_S = 1.5
LATE_S = 0.2

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals are a matter of POSIX")

OWNER = """
import sys, time
from pathlib import Path
from clockdrive.clock import SystemClock
from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Beside
from mounts.awr.cascade import Press, Stage
from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.holding import Holding
from mounts.awr.ramps import Key
from mounts.awr.uncertainty import Jitter
from mounts.awr.unit import Unit
from mounts.deadman import DeadMan
from transports.open_link import open_link

url, hold, log = sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])
clock = SystemClock()
dead_man = DeadMan(url, safe_frames(), program="clockdrive.dead_man", silence_s=0.7, hasty_s=0.12, log=log)
unit = Unit(dead_man.sharing(lambda: open_link(url, clock)), clock)
unit.identify()
axes = AwrAxis(0, 0.0, clock.now(), 0.0), AwrAxis(1, 0.0, clock.now(), 0.0)
keys = Holding(unit, Beside(unit, dead_man), axes, Jitter(0.005, 0.003), print)
press = Press(Key(1600.0, 20000.0), hold)
keys.begin(Stage("move", (None, press), (0.0, 0.0), 0.0, (0.0, 0.0), (0.0, 0.0)))
while keys.busy:
    keys.look()
    time.sleep(0.25)
print("done", flush=True)
"""


class Watched:
    """A unit that remembers when its key of axis 2 was pressed and released."""

    def __init__(self):
        self.unit = SimulatedAwr(SimulatorSettings(), CLOCK.now())
        self.lock = threading.Lock()
        self.pressed = self.released = None
        act = self.unit._act

        def acted(body):
            act(body)
            if self.unit.keys[1] and self.pressed is None:
                self.pressed = self.unit._now
            elif not self.unit.keys[1] and self.pressed is not None and self.released is None:
                self.released = self.unit._now

        self.unit._act = acted

    def receive(self, data, t):
        with self.lock:
            return self.unit.receive(data, t)

    def says(self, until):
        with self.lock:
            return self.unit.says(until)


def held(listen, deed, after_s, log):
    """For how long the key was held by an owner to whom a deed was done so many seconds after the press."""
    device = Watched()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with serve(device, CLOCK, listen) as server:
        command = [sys.executable, "-c", OWNER, server.address, str(HOLD_S), str(log)]
        with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as owner:
            try:
                seconds_until(lambda: device.pressed is not None)
                if deed is not None:
                    time.sleep(max(0.0, device.pressed + after_s - CLOCK.now()))
                    owner.send_signal(deed)
                seconds_until(lambda: device.released is not None)
                if deed is None:
                    owner.wait(10.0)
                else:  # its dead-man process is not left behind
                    seconds_until(lambda: log.exists() and "made safe" in log.read_text())
            finally:
                owner.kill()
    assert device.unit.keys == [0, 0]
    assert not device.unit.wear
    return device.released - device.pressed


DEEDS = [
    (None, 0.0),
    (signal.SIGKILL, 0.3),
    (signal.SIGSTOP, 0.3),
    (signal.SIGSTOP, HOLD_S - 0.62),
    (signal.SIGSTOP, HOLD_S - 0.1),
]


LISTENS = ("tcp://127.0.0.1:0", "pty:")
CASES = [(listen, *deed) for listen in LISTENS for deed in DEEDS]


@pytest.mark.parametrize(("listen", "deed", "after_s"), CASES if FULL else [CASES[1], CASES[-1]])
def test_a_key_is_released_in_time_whatever_becomes_of_its_owner(listen, deed, after_s, tmp_path):
    seconds = held(listen, deed, after_s, tmp_path / "log")
    print(f"\n{listen} {deed and deed.name} after {after_s:.2f} s: held {seconds:.3f} s of {HOLD_S:g} s")
    assert seconds < HOLD_S + LATE_S


def test_the_frames_release_both_pairs_of_keys_among_events():
    unit = SimulatedAwr(SimulatorSettings(execution_s=0.0, execution_jitter_s=0.0), CLOCK.now())
    unit.press(1, 1)
    unit.press(2, -1)
    link = MemoryLink(unit, CLOCK)
    for frame in safe_frames():
        link.write(frame.data)
        heard = b""
        while data := link.read(100, 0.05):
            heard += data
        assert re.search(frame.answer, heard)
    assert unit.keys == [0, 0]
