"""Nothing goes on long when its owner dies: real owners, killed and frozen, a real line, the simulated unit.

The unit's own times are the oracle. An owner strikes itself at a moment of its own work, or is struck when the unit
says what it does.
"""

import os
import re
import signal
import subprocess
import sys
import threading

import pytest
from waiting import seconds_until

from clockdrive.clock import SystemClock
from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.registers import BY_NAME
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from transports.memory import MemoryLink
from transports.serve import serve

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
CLOCK = SystemClock()
HOLD_S = 1.5
EASY_S = 1.0
LATE_S = 0.2

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and pseudo-terminals are a matter of POSIX")

OWNER = """
import os, sys
from pathlib import Path
from clockdrive.clock import SystemClock
from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.drive import AwrDrive
from mounts.awr.memory import at_park
from mounts.awr.settings import AwrSettings
from mounts.awr.unit import Unit
from mounts.deadman import DeadMan
from transports.open_link import open_link

url, hold, log, moment, deed = sys.argv[1], float(sys.argv[2]), Path(sys.argv[3]), sys.argv[4], int(sys.argv[5])
easy = float(sys.argv[6])
clock = SystemClock()

def strike(now):
    if now == moment:
        os.kill(os.getpid(), deed)

class Struck(DeadMan):
    def hasten(self):
        super().hasten()
        strike("hastened")

frames = safe_frames()
dead_man = Struck(url, frames, program="clockdrive.dead_man", silence_s=0.7, hasty_s=0.12, easy_s=easy, log=log)
unit = Unit(dead_man.sharing(lambda: open_link(url, clock)), clock)
drive = AwrDrive(unit, AwrSettings(50.0), at_park((0, 0), clock.now(), ""), guardian=dead_man)
drive.connect(clock.now(), make_safe=True)
"""
KEY = (
    OWNER
    + """
from mounts.awr.cascade import Press, Stage
from mounts.awr.ramps import Key

drive.keys.begin(Stage("move", (None, Press(Key(1600.0, 20000.0), hold)), (0.0, 0.0), 0.0, (0.0, 0.0), (0.0, 0.0)))
drive.keys.look()
strike("pressed")
release = unit.release

def released(*axes):
    strike("releasing")
    return release(*axes)

unit.release = released
while drive.keys.busy:
    drive.keys.look()
    unit.listen(clock.now() + 0.25)
drive.close(clock.now(), keep_tracking=False)
"""
)
FAST = (
    OWNER
    + """
class Path:
    def at(self, time):
        since = time - began
        return (150.0 * since, 150.0), (-120.0 * since, -120.0)

began = clock.now()
while True:
    drive.read(clock.now())
    drive.follow(Path(), clock.now())
    unit.listen(clock.now() + 0.25)
"""
)


class Watched:
    """A unit that remembers when its key of axis 2 was pressed and released, and when both drives rested."""

    def __init__(self):
        self.unit = SimulatedAwr(SimulatorSettings(), CLOCK.now())
        self.lock = threading.Lock()
        self.pressed = self.released = self.rested = None
        self.fast = threading.Event()
        act = self.unit._act

        def acted(body):
            act(body)
            if self.unit.keys[1] and self.pressed is None:
                self.pressed = self.unit._now
            elif not self.unit.keys[1] and self.pressed is not None and self.released is None:
                self.released = self.unit._now

        self.unit._act = acted

    @property
    def drives(self):
        return [bool(self.unit.ram[BY_NAME[f"{drive}_flags"].address] & 1) for drive in ("drive_ra", "drive_dec")]

    def receive(self, data, t):
        with self.lock:
            answer = self.unit.receive(data, t)
            if all(self.drives):
                self.fast.set()
            elif self.fast.is_set() and not any(self.drives) and self.rested is None:
                self.rested = t
            return answer

    def says(self, until):
        with self.lock:
            return self.unit.says(until)


class Owner:
    """An owner of a unit served on a line, with its dead-man process; none of them is left behind."""

    def __init__(self, device, listen, script, log, moment="", deed=0):
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self.log, self._server = log, serve(device, CLOCK, listen)
        arguments = [str(HOLD_S), str(log), moment, str(int(deed)), str(EASY_S)]
        self._command = [sys.executable, "-c", script, self._server.address, *arguments]
        self._environment = environment

    def __enter__(self):
        self._server.__enter__()
        self.process = subprocess.Popen(self._command, env=self._environment, stdout=subprocess.DEVNULL)
        return self

    def was_deserted(self):
        """Wait for the dead-man process to have done its work."""
        seconds_until(lambda: self.log.exists() and "made safe" in self.log.read_text())

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self._server.__exit__(None, None, None)


LISTENS = ("tcp://127.0.0.1:0", "pty:")
DEEDS = [
    ("", 0),
    ("pressed", signal.SIGKILL),
    ("pressed", signal.SIGSTOP),
    ("hastened", signal.SIGSTOP),
    ("releasing", signal.SIGSTOP),
]
CASES = [(listen, *deed) for listen in LISTENS for deed in DEEDS]


@pytest.mark.parametrize(("listen", "moment", "deed"), CASES if FULL else [CASES[1], CASES[-1]])
def test_a_key_is_released_in_time_whatever_becomes_of_its_owner(listen, moment, deed, tmp_path):
    device = Watched()
    with Owner(device, listen, KEY, tmp_path / "log", moment, deed) as owner:
        seconds_until(lambda: device.released is not None)
        if deed:
            owner.was_deserted()
        else:
            assert owner.process.wait(10.0) == 0
    assert device.unit.keys == [0, 0]
    assert not device.unit.wear
    held = device.released - device.pressed
    print(f"\n{listen} {moment or 'undisturbed'}: held {held:.3f} s of {HOLD_S:g} s")
    assert held < HOLD_S + LATE_S


@pytest.mark.parametrize(
    ("listen", "deed"),
    [(listen, deed) for listen in LISTENS for deed in (signal.SIGKILL, signal.SIGSTOP)]
    if FULL
    else [("pty:", signal.SIGKILL)],
)
def test_drives_that_go_fast_are_switched_off_when_their_owner_is_gone(listen, deed, tmp_path):
    device = Watched()
    with Owner(device, listen, FAST, tmp_path / "log") as owner:
        assert device.fast.wait(20.0)
        struck = CLOCK.now()
        owner.process.send_signal(deed)
        seconds_until(lambda: device.rested is not None)
        owner.was_deserted()
    late = device.rested - struck
    print(
        f"\n{listen} {deed.name}: both drives off after {late:.3f} s, said {(tmp_path / 'log').read_text().strip()}"
    )
    assert device.drives == [False, False]
    assert not device.unit.wear
    assert late < LATE_S + (EASY_S if deed == signal.SIGSTOP else 0.0)
    device.unit.advance(CLOCK.now())
    assert all(axis.velocity == 0.0 for axis in device.unit.axes)


def test_the_frames_release_both_pairs_of_keys_and_switch_both_drives_off_among_events():
    unit = SimulatedAwr(SimulatorSettings(execution_s=0.0, execution_jitter_s=0.0), CLOCK.now())
    unit.press(1, 1)
    unit.press(2, -1)
    unit.ram[BY_NAME["drive_dec_flags"].address] |= 1
    link = MemoryLink(unit, CLOCK)
    for frame in safe_frames():
        link.write(frame.data)
        heard = b""
        while data := link.read(100, 0.05):
            heard += data
        assert re.search(frame.answer, heard)
    assert unit.keys == [0, 0]
    assert not unit.ram[BY_NAME["drive_ra_flags"].address] & 1
    assert not unit.ram[BY_NAME["drive_dec_flags"].address] & 1
    assert not unit.wear
