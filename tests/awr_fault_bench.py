"""Nights of an AWR Microstep on a bad line, in which something else goes wrong as well.

Programs drive one unit, one after the other, under a virtual clock: where one is killed, a dead-man process of the
same clock acts for it, and the next one goes on. Every reading is compared with the motors themselves, every key with
its plan, and every word that is kept for good with what was asked.
"""

import random
import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from awr_bench import SETTINGS, SIDEREAL, Guard, Mutilating

from clockdrive.clock import VirtualClock
from mounts.awr.commands import RELEASES, packet
from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.drive import AwrDrive
from mounts.awr.memory import Shown, at_park
from mounts.awr.simulator import SimulatedAwr
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.uncertainty import Jitter
from mounts.awr.unit import RELEASE_AGAIN_S, Unit
from mounts.deadman_process import QUICK_ATTEMPTS, QUICK_PAUSE_S, confirm, send_at_once
from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import LinkError, TransportError
from transports.memory import MemoryLink

T0 = 1_800_000_000.0
BAUD = 9600
LINE_S = 0.01  # that a release takes on the line, with its answer
RATE = 0.05  # of packets and writes that something happens to
DEEDS = ("none", "late", "closed", "killed", "saved", "override", "reset", "power cut")
SILENCE_S, HASTY_S, EASY_S = 0.7, 0.12, 10.0  # of the dead-man process, as `clockdrive/drives/awr/kind.py` has them
WRITTEN = 0x05  # the word that `drive save` keeps
LATE_S = 0.2  # beyond its plan a key may be held, beside what is excused
SOON_S = 0.05  # before its time a release may be sent, to be there at it
GROSS = 2.55  # times the stated 95 %: five standard deviations, which is no chance


class Killed(BaseException):
    """The program was killed; nothing in it may catch that."""


class Release(NamedTuple):
    """A release on the line.

    Attributes
    ----------
    sent, arrived : float
        POSIX seconds at which it should have come to the unit, and at which its last byte did.
    lost : bool
        The line made something else of it.
    """

    sent: float
    arrived: float
    lost: bool


class Forging(Mutilating):
    """The bad line, which knows what was truly said, and is dead while the unit has no power."""

    def __init__(self, device, seed, rate):
        super().__init__(device, seed, rate)
        self.off = False
        self.said = {}  # bodies, and when the host said them last
        self.releases = [], []  # of each axis

    def receive(self, data, t):
        self.said |= dict.fromkeys(re.findall(r":([^:#]*)#", data.decode("latin-1")), t)
        self.device.advance(t)
        if self.off:
            return b""
        come = self.mutilated(data)
        answer = self.device.receive(come, t)
        arrived = max(t, self.device._inward._free)
        for body, releases in zip(RELEASES, self.releases, strict=True):
            if packet(body) in data:
                releases.append(Release(t, arrived, packet(body) not in come))
        return self.mutilated(answer)

    def held_up(self, axis, since, until):
        """Seconds for which this line kept a release from its axis that was sent in a time, and by what."""
        excused = Counter()
        for release in self.releases[axis]:
            if since <= release.sent <= until:
                excused["changed"] += RELEASE_AGAIN_S + LINE_S if release.lost else 0.0
                if not release.lost:
                    excused["held up"] += release.arrived - release.sent
                    break
        return excused

    def says(self, until):
        said = super().says(until)
        return None if said is None else (said[0], b"") if self.off else said


class DeadMan(Guard):
    """The dead-man process under the virtual clock: it knows when it would act."""

    def __init__(self, clock):
        super().__init__()
        self.clock, self.last, self.late = clock, clock.now(), 0

    @property
    def due(self):
        return self.last + (HASTY_S if self.hasty else EASY_S if self.easy else SILENCE_S)

    def beat(self):
        self.late += self.armed and self.clock.now() > self.due
        self.last = self.clock.now()
        return True

    def arm(self):
        super().arm()
        self.last = self.clock.now()

    def start(self):
        super().start()
        self.fate = ""

    def hasten(self):
        super().hasten()
        self.last = self.clock.now()


class Cable:
    """The link of one program."""

    def __init__(self, night, link):
        self.night, self.link, self.name = night, link, link.name

    def write(self, data):
        self.night.happen()
        return self.link.write(data)

    def read(self, max_bytes, timeout_s):
        end = self.night.clock.now() + timeout_s
        while True:
            self.night.happen()
            left = end - self.night.clock.now()
            come = self.link.read(max_bytes, max(0.0, min(left, self.night.next_in)))
            if come or self.night.clock.now() >= end:
                return come

    def close(self):
        self.link.close()


@dataclass
class Judged:
    """What was found."""

    readings: int = 0
    beyond: int = 0  # by more than what is stated, for 95 of 100
    ends: Counter = field(default_factory=Counter)  # axes after a goto: within what is stated, beyond, unknown
    gross: list = field(default_factory=list)  # readings off by what is no chance
    moving: list = field(default_factory=list)  # likewise, while keys move the axes and their events are on the way
    why: Counter = field(default_factory=Counter)  # the position was unknown after a goto
    needed: int = 0  # of them after a deed that nobody could look behind
    runs_lost: int = 0
    keys: int = 0  # that were pressed
    late_s: float = 0.0  # keys held beyond their plan, or pressed by a command that nobody gave, less what is excused
    dead_s: float = 0.0  # likewise, released by a dead-man process or after it
    longest_s: float = 0.0  # likewise, by either, and nothing excused
    excused: Counter = field(default_factory=Counter)  # keys that were held too long, by what the line did
    late: list = field(default_factory=list)  # those held too long for which the line is no excuse
    commands: Counter = field(default_factory=Counter)  # that the unit obeyed and nobody gave
    misled: set = field(default_factory=set)  # runs in which such a one made a position wrong
    worn: Counter = field(default_factory=Counter)  # words kept for good, by a command that was given
    forged: Counter = field(default_factory=Counter)  # likewise, by one that was not
    unsaid: list = field(default_factory=list)  # runs in which nobody said so
    blind_s: float = 0.0  # until a stop, a reset or a power cut was noticed

    def __str__(self):
        rows = (
            f"{self.readings} readings, {self.beyond / max(1, self.readings):.2%} beyond what is stated",
            f"axes after a goto {dict(self.ends)}; grossly wrong {self.gross[:9]}, while moving {len(self.moving)}",
            f"{self.keys} keys at most {self.late_s:.3f} s late, {self.dead_s:.3f} s by a dead-man process",
            f"{self.longest_s:.3f} s with what is excused: {dict(self.excused)}; not excused {self.late[:9]}",
            f"worn {dict(self.worn)}, by damaged commands {dict(self.forged)}, unsaid {self.unsaid}",
            f"commands that nobody gave {dict(self.commands)}, by which {len(self.misled)} positions were wrong",
            f"a stop, reset or power cut unnoticed for {self.blind_s:.1f} s",
            f"unknown in {self.runs_lost} runs, after {sum(self.why.values())} gotos, as it must be {self.needed}",
            *(f"{count:4} {why}" for why, count in self.why.most_common()),
        )
        return "\n  ".join(rows)


class Night:
    """One run."""

    def __init__(self, seed, judged, deed=None, rate=RATE):
        self.seed, self.judged, self.rng = seed, judged, random.Random(seed)  # noqa: S311 - nothing secret
        self.deed = DEEDS[seed % len(DEEDS)] if deed is None else deed
        self.clock = VirtualClock(T0)
        self.awr = SimulatedAwr(SimulatorSettings(seed=seed + 1, debug=0.1), T0)
        self.line = Forging(self.awr, seed, 0.0)
        self.kept = at_park((0, 0), T0, "", Shown(SETTINGS.assumed, (True, True), referenced=True))
        self.rate, self.lost = rate, False
        self.due, self.until, self.said = [], T0, set()
        self.alive = self.closed_until = 0.0
        self.program()
        self.drive.connect(T0, make_safe=False)
        now = self.clock.now()
        self.awr.advance(now)
        self.drive.sync((self.awr.true_position(1), self.awr.true_position(2)), now)
        self.watch()
        self.line.rate = rate
        if self.deed == "late":
            wear = replace(self.awr.settings, byte_delay=0.01, byte_delay_s=self.rng.choice((0.02, 0.05, 0.15)))
            self.awr._inward._settings = self.awr._outward._settings = wear
        at = self.clock.now() + self.rng.uniform(0.0, 25.0)
        if self.deed not in {"none", "late", "saved"}:
            self.due = [(at, self.deed)]

    # Programs --------------------------------------------------------------------------------------------------

    def program(self):
        """A program at the unit."""
        self.alive = True
        self.guard = DeadMan(self.clock)
        self.unit = Unit(self.opened, self.clock, BAUD)
        # On a line that is late by itself a person has found the times of events to be off by that.
        jitter = Jitter(5e-3, 5e-3) if self.deed == "late" else SETTINGS.jitter
        self.drive = AwrDrive(self.unit, replace(SETTINGS, jitter=jitter), self.kept, self.keep, self.guard)
        begin = self.drive.keys.begin

        def began(stage):
            self.planned = [press and (press.sign, press.hold) for press in stage.presses]
            return begin(stage)

        self.drive.keys.begin = began

    def keep(self, memory):
        self.kept = memory

    def opened(self):
        if self.clock.now() < self.closed_until:
            raise LinkError("nothing answers there")
        return Cable(self, MemoryLink(self.line, self.clock, baud=BAUD))

    def next_program(self):
        """The dead-man process acts for a program that was killed, then another one is started."""
        if self.guard.armed:
            self.sleep(self.guard.due - self.clock.now())
            self.made_safe()
        self.sleep(self.rng.uniform(0.1, 20.0))
        self.program()
        for _ in range(6):
            try:
                self.drive.connect(self.clock.now(), make_safe=False)
            except (DriveError, TransportError):
                self.sleep(0.5)
            else:
                return

    def made_safe(self):
        """As the dead-man process does it, on a link of its own; the unit may have been told something before."""
        link, frames = MemoryLink(self.line, self.clock, baud=BAUD), safe_frames()
        for _ in range(QUICK_ATTEMPTS):
            try:
                send_at_once(link, frames)
                for frame in frames:
                    confirm(link, frame, self.clock)
            except TransportError:
                self.clock.sleep(QUICK_PAUSE_S)
            else:
                return

    # What happens ----------------------------------------------------------------------------------------------

    @property
    def next_in(self):
        return max(0.0, self.due[0][0] - self.clock.now()) if self.due else 1e9

    def happen(self):
        """What is due by now."""
        if not self.alive:
            raise Killed
        now = self.clock.now()
        while self.due and self.due[0][0] <= now + 1e-9:
            _, deed = self.due.pop(0)
            self.awr.advance(now)
            getattr(self, f"do_{deed.replace(' ', '_')}")(now)
        if now < self.closed_until:
            raise LinkError("the connection was closed")

    def do_closed(self, now):
        self.closed_until = now + self.rng.choice((0.0, self.rng.uniform(0.0, 3.0)))
        self.until = self.closed_until  # before which nobody can release a key
        raise LinkError("the connection was closed")

    def do_killed(self, _now):
        self.alive = False
        raise Killed

    def do_override(self, now):
        self.lost, self.cut, self.since = True, now, [None, None]
        self.awr.override(stopped=True)
        self.due = [(now + self.rng.uniform(0.5, 10.0), "lifted")]

    def do_lifted(self, _now):
        self.awr.override(stopped=False)

    def do_reset(self, now):
        self.lost, self.cut, self.since = True, now, [None, None]
        self.awr.reset(self.rng.choice(("watchdog", "MCLR", "brownout")))

    def do_power_cut(self, now):
        self.lost, self.line.off, self.cut, self.since = True, True, now, [None, None]
        self.awr.switched_on()
        self.awr.stand()
        self.due = [(now + self.rng.uniform(0.2, 5.0), "power back")]

    def do_power_back(self, _now):
        self.line.off = False
        self.awr.switched_on()

    # What is watched -------------------------------------------------------------------------------------------

    def watch(self):
        """Note keys as they act, and words as they are kept for good."""
        self.since, self.planned = [None, None], [None, None]
        act, answers, burn = self.awr._act, self.awr._answers, self.awr._burn

        def acted(command):
            before = list(self.awr.keys)
            act(command)
            self.keys_changed(before, self.awr._now)

        def answered(body):
            self.body = body
            said = answers(body)
            if said and said != ["N"] and self.awr._now - self.line.said.get(body, -1e9) > 0.3:
                self.changed_to, self.changed_at = body, self.awr._now  # what the host said became this on the line
                self.judged.commands[body[:1] if len(body) == 1 else "a word"] += 1
            return said

        def burnt(address, value):
            truly = self.awr._now - self.line.said.get(self.body, -1e9) < 2.0
            (self.judged.worn if truly else self.judged.forged)[address] += 1
            self.forgery = getattr(self, "forgery", False) or not truly
            burn(address, value)

        self.awr._act, self.awr._answers, self.awr._burn = acted, answered, burnt

    def keys_changed(self, before, now):
        for axis, (was, is_) in enumerate(zip(before, self.awr.keys, strict=True)):
            if is_ == was:
                continue
            if was and self.since[axis] is not None:
                begun, hold = self.since[axis]
                self.released(axis, begun, hold, now)
                self.since[axis] = None
                if hold is not None and now >= begun + hold - SOON_S:
                    self.planned[axis] = None  # one that came late is pressed anew
            if is_:
                planned = self.planned[axis]
                ours = planned is not None and planned[0] == is_
                self.since[axis] = now, planned[1] if ours else None

    def released(self, axis, begun, hold, now):
        """A key is not pressed any more that was to be held so long; of one that nobody pressed it is None."""
        due = max(begun + (hold or 0.0), self.until)
        excused = self.line.held_up(axis, due - SOON_S, now)
        late, dead = now - due, self.acted or not self.alive
        self.judged.keys += 1
        self.judged.longest_s = max(self.judged.longest_s, late)
        if late > LATE_S:
            self.judged.excused.update(what for what, seconds in excused.items() if seconds > 0.0)
        late -= sum(excused.values())
        if late > LATE_S:
            self.judged.late.append((self.seed, self.deed, axis, hold and round(hold, 3), round(late, 3), dead))
        name = "dead_s" if dead else "late_s"
        setattr(self.judged, name, max(getattr(self.judged, name), late))

    def judge(self, reading, *, end=False):
        """A reading against the motors."""
        self.awr.advance(reading.time)
        if reading.unsynchronised:
            self.cut = None
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - self.awr.true_position(i + 1))
            beyond = off > axis.uncertainty_counts
            if end:
                self.judged.ends["unknown" if reading.unsynchronised else "beyond" if beyond else "within"] += 1
            if reading.unsynchronised:
                continue
            self.judged.readings += 1
            self.judged.beyond += beyond
            if self.changed_to and off > GROSS * axis.uncertainty_counts:
                self.judged.misled.add((self.seed, self.changed_to))
            elif self.cut is not None and off > GROSS * axis.uncertainty_counts:
                self.judged.blind_s = max(self.judged.blind_s, reading.time - self.cut)
            elif off > GROSS * axis.uncertainty_counts:
                row = self.seed, self.deed, i, round(off, 1), round(axis.uncertainty_counts, 1), axis.slewing
                (self.judged.moving if axis.slewing else self.judged.gross).append(
                    (*row, round(reading.time - T0, 2))
                )

    # A night ---------------------------------------------------------------------------------------------------

    def run(self, gotos=3):
        """Gotos; where the position was lost a person says where it is."""
        for number in range(gotos):
            self.attempt(self.goto)
            self.attempt(self.settle)
            if self.deed == "saved" and number == 0:
                self.attempt(self.save)
        self.line.rate = 0.0
        self.attempt(lambda: self.poll(12.0))
        self.finish()

    def attempt(self, what):
        try:
            what()
        except (DriveError, TransportError):
            pass
        except Killed:
            self.lost = self.lost or self.guard.armed
            self.next_program()

    def goto(self):
        began, here = self.clock.now(), self.drive.read(self.clock.now())
        targets = [axis.counts + self.rng.choice((-1, 1)) * 10.0 ** self.rng.uniform(1.5, 5.0) for axis in here.axes]
        self.drive.start([AxisSlew(targets[0], SIDEREAL, None, began), AxisSlew(targets[1], 0.0, None, began)], began)
        self.poll(60.0, slewing=True)

    def save(self):
        self.drive.hand.soft_write("guide_up_counts", 50000)
        self.drive.hand.commit()

    def settle(self):
        """Look at the end of a goto, and have a position that was lost put right."""
        self.poll(2.0)
        for _ in range(20):
            with suppress(DriveError, TransportError):
                reading = self.drive.read(self.clock.now())
                self.judge(reading, end=True)
                break
            self.sleep(0.25)
        else:
            return
        if reading.unsynchronised:
            self.judged.why[re.sub(r"[+-]?[\d.]+", "#", reading.unsynchronised)[:70]] += 1
            self.judged.needed += self.lost
            self.unknown = True
            self.poll(12.0)  # until an override is lifted, and motions have ended
            now = self.clock.now()
            self.awr.advance(now)
            with suppress(DriveError):
                self.drive.sync((self.awr.true_position(1), self.awr.true_position(2)), now)
            self.lost, self.changed_to = False, ""

    acted = False  # a dead-man process did
    changed_at = 0.0  # POSIX seconds
    changed_to = ""  # the last command that the unit obeyed and nobody gave, until the next sync
    unknown, cut = False, None  # POSIX seconds of a stop, a reset or a power cut that nobody has noticed yet

    def poll(self, seconds, *, slewing=False):
        end = self.clock.now() + seconds
        while self.clock.now() < end:
            with suppress(DriveError, TransportError):
                reading = self.drive.read(self.clock.now())
                self.judge(reading)
                self.said.update(self.drive.notes)
                if slewing and not any(axis.slewing for axis in reading.axes):
                    return
            self.sleep(0.25)

    def sleep(self, seconds):
        """Time passes; a dead-man process that hears nothing in it acts."""
        end = self.clock.now() + seconds
        if self.alive and self.guard.armed and self.guard.due < end:
            self.clock.sleep(max(0.0, self.guard.due - self.clock.now(), self.closed_until - self.clock.now()))
            self.made_safe()
            self.guard.fate, self.acted = "it heard nothing of this program and released the keys", True
        self.clock.sleep(max(0.0, end - self.clock.now()))

    def finish(self):
        self.judged.runs_lost += self.unknown
        assert self.awr.keys == [0, 0], (self.seed, self.awr.keys)
        if getattr(self, "forgery", False) and not any("nobody asked" in note for note in self.said):
            self.judged.unsaid.append(self.seed)
