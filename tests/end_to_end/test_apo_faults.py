"""Whatever happens to lines and controllers: every axis halted or tracking, never dry, no position silently wrong."""

import math
import os
import re
from dataclasses import replace

import pytest
from apo_bench import APACHE_POINT, MIDNIGHT
from apo_dry import Exchange, could_have_been_given
from apo_fault_bench import ApoLine, FaultWitness, seeded_events
from fault_run import FaultRun, Reckoning
from faults import Fault
from rotator_bench import across_the_field
from telescope_bench import star_at

from clockdrive import Telescope, VirtualClock
from clockdrive.errors import Refused
from mounts.errors import DriveError
from pointing.errors import Unreachable
from pointing.targets import FixedAltAz

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = int(os.environ.get("CLOCKDRIVE_FAULT_RUNS", "1000" if FULL else "4"))
FIRST = int(os.environ.get("CLOCKDRIVE_FAULT_FIRST", "0"))
SETTLED_ARCSEC = 0.1
SHORT_ARCSEC = (0.0, 5.0, 60.0, 3600.0)
ROTATED_DEG = 1e-4  # by which what is said of the rotator may be off
NEAR_PARK = (5.0, 48.0)  # azimuth and altitude


class Run(FaultRun):
    """One seeded night's trouble."""

    remedy = re.compile(
        r"`[a-z]|check|try again|again|find its cause|find the cause|wait|give|say --|set it", re.IGNORECASE
    )
    lowest_deg = 22.0

    def __init__(self, seed, folder):
        super().__init__(seed)
        chance = self.chance
        self.ways, self.worst_field, self.error = 0, 0.0, None
        kind = chance.choice(("apo", "sdss"))
        expiry = chance.choice(("halt", "extrapolate"))
        overrides = {
            **APACHE_POINT,
            "state.path": str(folder),
            "limits.sun_avoidance_deg": 0.0,
            "simulator.baud": chance.choice((0, 0, 38400)),
            "simulator.latency_s": chance.choice((0.001, 0.02)),
            "simulator.on_expiry": expiry,
            "drive.on_expiry": expiry,
            "simulator.clock_drift_ppm": chance.choice((0.0, 20.0, -20.0)),
            "simulator.clock_offset_s": chance.choice((0.0, 0.0, 0.15)),
            **chance.choice(({}, {"rotator.mode": "sky"})),
        }
        self.turns = "rotator.mode" in overrides
        self.held_deg = 0.0
        self.start = MIDNIGHT + chance.uniform(-43200.0, 43200.0)
        self.lines = []

        def line(device):
            self.lines.append(ApoLine(device, seed))
            return self.lines[-1]

        self.scope = Telescope.simulated(kind, clock=VirtualClock(self.start), overrides=overrides, line=line)
        self.witness = FaultWitness(self.scope, self.lines)
        self.witness.t0 = self.start

    @property
    def name(self):
        return f"{self.scope.simulator.kind}: {super().name}"

    def last_look(self):
        self.witness.check_dry()

    def trouble(self):
        """A goto, tracking for a minute, and short ways and other angles meanwhile, while things happen."""
        scope, chance = self.scope, self.chance
        target, begin = self.star(), scope.clock.now()
        span = chance.choice((15.0, 40.0, 80.0))
        events, self.kinds = seeded_events(self.witness, chance, begin, span)
        self.happened.update(self.kinds)
        self.witness.plan(events)
        error = self.attempt(lambda: scope.goto(target))
        self.outcome = "arrived" if error is None else type(error).__name__
        end = max(self.witness.last_event, begin + span) + 25.0
        asked = [chance.uniform(begin, end - 25.0) for _ in range(2)]
        while scope.clock.now() < end:
            scope.wait(1.0)
            self.witness.now()
            if asked and scope.clock.now() > min(asked) and scope.status()["doing"] == "tracking":
                asked.remove(min(asked))
                target = self.short_way(target, chance.choice(SHORT_ARCSEC)) or target
        self.halted_or_tracking(target)

    def halted_or_tracking(self, target):
        """The lines are whole again, for long enough to have stopped what was not on its way."""
        status = self.scope.status().json
        if "internal error" in status["trouble"]:
            self.witness.fail(status["trouble"])
        moving = [abs(axis.servo.velocity) for axis in self.witness.device.axes]
        if status["doing"] == "tracking":
            if status["synchronised"]:
                self.is_on(target, "it tracks")
        elif max(moving) > 1e-6:
            self.witness.fail(f"it is {status['doing']}, and an axis moves at {max(moving):.5f}°/s")
        elif not status["trouble"] and self.outcome == "arrived":
            self.witness.fail("it no longer tracks and does not say why")

    def is_on(self, target, what):
        """The tube looks at its target, and the rotator holds its angle and says so, where it is known."""
        unsure = math.hypot(*(axis.uncertainty_counts for axis in self.scope._session.reading.axes[:2])) * 3600.0
        if (off := self.witness.off_arcsec(target)) > SETTLED_ARCSEC + unsure:
            self.witness.fail(f"{what} {off:.2f}″ off its target, ±{unsure:.2f}″ stated")
        if not self.turns:
            return
        said = self.scope.status()["rotator"]
        if said["uncertainty_counts"] > 1.0:  # lost, and said to be
            return
        off = across_the_field(self.scope, target, self.held_deg)
        self.worst_field = max(self.worst_field, abs(off))
        if abs(off) > SETTLED_ARCSEC:
            self.witness.fail(f"{what} with a star 1° off the axis {off:.2f}″ beside where it is held")
        if (turned := abs(math.remainder(said["position_angle_deg"] - self.held_deg, 360.0))) > ROTATED_DEG:
            self.witness.fail(f"{what}; the rotator is said to be {turned:.5f}° from the angle it holds")

    def short_way(self, star, arcsec):
        """Go to a star beside, perhaps with another position angle; return it if it is tracked."""
        chance, angle = self.chance, self.held_deg
        north = math.radians(arcsec / 3600.0) * chance.choice((-1.0, 1.0))
        beside = replace(star, name=f"{star.name} and {arcsec:g}″", dec=star.dec + north)
        if self.turns and chance.random() < 0.5:
            angle += chance.choice((0.01, -0.5, 8.0))
        options = {"position_angle_deg": angle} if self.turns else {}
        self.ways += 1
        self.error = self.attempt(lambda: self.scope.goto(beside, **options))
        if self.scope.status()["target"] != beside.name:
            return None
        self.held_deg = angle
        return beside

    def afterwards(self):
        """Do what the sentences say, then go somewhere and be there."""
        scope, done = self.scope, []
        self.attempt(scope.stop)
        scope.wait(60.0)  # the axes come to rest, the controllers wake up
        for _ in range(3):
            if "`sync`" not in scope.status()["unsynchronised_because"]:
                break
            done.append("sync")
            self.attempt(self.sync)
            scope.wait(2.0)
        if self.turns and any("SET.POSITION DEGREES" in note for note in scope.status()["notes"]):
            done.append("SET.POSITION")
            self.attempt(scope.stop)
            scope.wait(30.0)
            self.attempt(self.set_rotator)
        self.held_deg = 0.0
        target = self.arrives(done)
        if target is None:
            return
        scope.wait(5.0)
        self.is_on(target, "5 s after arrival it is")
        for arcsec in self.chance.sample(SHORT_ARCSEC, 2):
            target = self.short_way(target, arcsec)
            if target is None or self.error is not None:
                self.witness.fail(f"a way of {arcsec}″ on sound lines ends with: {self.error}")
                return
            scope.wait(4.0)
            self.is_on(target, f"4 s after a way of {arcsec}″ it is")
        scope.wait(10.0)
        status = scope.status().json
        if status["doing"] != "tracking":
            self.witness.fail(f"at the end it is {status['doing']}: {status['trouble']}")
        self.outcome += ", then " + (" and ".join(done) or "nothing more")

    def set_rotator(self):
        """Tell the rotator's controller where it truly stands."""
        self.witness.now()
        place = self.scope.simulator.true_position(3)
        self.scope.drive.raw("rotator", f"SET.POSITION {place:.7f}", confirmed=True)

    def sync(self):
        """Sync on what the telescope truly points at."""
        planner = self.scope._session.planner
        x, y, z = planner.observed(self.witness.now())
        self.scope.sync(FixedAltAz(math.atan2(y, -x), math.asin(z)), "normal", force=True)

    def may_go(self, target):
        try:
            self.scope._session.plan(target)
        except Unreachable:
            return False
        except (Refused, DriveError):
            pass
        return True


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_every_axis_is_halted_or_tracking_and_no_position_silently_wrong_whatever_happens(tmp_path):
    reckoning, field, ways, excused = Reckoning(), 0.0, 0, 0
    for seed in range(FIRST, FIRST + RUNS):
        run = reckoning.take(Run(seed, tmp_path / str(seed)))
        field = max(field, run.worst_field)
        ways += run.ways
        excused += run.witness.excused
    reckoning.tell()
    reported, stated = reckoning.worst
    print(f"{ways} short ways; {excused} paths ran out while no node could have come")
    print(f"worst |reported − true| {reported:.6f}°, stated ±{stated:.6f}°; a star 1° off the axis {field:.4f}″")
    assert not reckoning.broken


def _dry_by_a_lossy_line(kind, seed, folder, spoil):
    """Track a star over lines that lose half of all answers, the driver spoilt; return what the witness says."""
    lines = []

    def line(device):
        lines.append(ApoLine(device, seed))
        return lines[-1]

    overrides = {**APACHE_POINT, "state.path": str(folder), "limits.sun_avoidance_deg": 0.0}
    with Telescope.simulated(kind, clock=VirtualClock(MIDNIGHT), overrides=overrides, line=line) as scope:
        witness = FaultWitness(scope, lines)
        witness.t0 = MIDNIGHT
        scope.goto(star_at(scope, *NEAR_PARK, MIDNIGHT + 10.0))
        scope.wait(5.0)
        spoil(scope._session.drive._follower)
        for each in lines:
            each.go_wrong(Fault.DROP, 0.5)
        scope.wait(20.0)
        for each in lines:
            each.be_whole()
        witness.check_dry()
        return witness


def _forget_altitude(follower):
    """Let a driver give the altitude axis no node any more."""
    lacks = follower._lacks
    follower._lacks = lambda i, *times: i != 1 and lacks(i, *times)


@pytest.mark.parametrize(("kind", "seed"), [("apo", 0), ("sdss", 3)])
def test_a_driver_that_forgets_an_axis_is_caught_though_every_other_answer_is_lost(kind, seed, tmp_path):
    forgetful = _dry_by_a_lossy_line(kind, seed, tmp_path / "forgetful", _forget_altitude)
    ours = _dry_by_a_lossy_line(kind, seed, tmp_path / "ours", lambda _: None)
    print(f"{kind}: forgetful {forgetful.broken}, excused {forgetful.excused}; ours {ours.broken}, {ours.excused}")
    assert any("axis 2 ran dry" in text for text in forgetful.broken)
    assert not ours.broken


_LOOKS = [(second, "STATUS") for second in range(12)]
_TRIES = [*_LOOKS, (3.5, "MOVE"), (8.5, "MOVE")]
_FLUSHED = [*_LOOKS[:2], (9.9, "DRIFT"), (10.0, "MOVE"), (11.0, "MOVE")]
_CASES = {
    "it is only looked at": (_LOOKS, "nothing", True),
    "two nodes are eaten, between looks that come": (_TRIES, "nodes", True),
    "two nodes are eaten, and two of three looks": (_TRIES, "most", False),
    "one is eaten long ago, and nobody tries again": ([*_LOOKS, (-3.0, "MOVE")], "most", True),
    "another host has it": (_TRIES, "all", False),
    "another host has it until six seconds before": (_TRIES, "early", True),
    "it is flushed, and then all is eaten": (_FLUSHED, "nodes", False),
}
_EATS = {
    "nothing": lambda *_: False,
    "nodes": lambda _, command: command == "MOVE",
    "most": lambda time, command: command == "MOVE" or time % 3,
    "all": lambda *_: True,
    "early": lambda time, _: time < 6.0,
}


@pytest.mark.parametrize("case", _CASES)
def test_a_path_that_ran_out_is_excused_by_what_the_line_ate_only(case):
    said, eats, guilty = _CASES[case]
    eaten = _EATS[eats]
    exchanges = [Exchange(time, command, eaten=bool(eaten(time, command))) for time, command in sorted(said)]
    assert could_have_been_given(exchanges, 11.9) is guilty
