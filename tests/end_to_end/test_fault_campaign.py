"""Whatever happens to line, unit and people, the position is right within its bounds or called unsynchronised.

Faults of every kind come at random moments of a goto, its settling and its tracking. Afterwards the telescope is
usable again by what its own sentences say.
"""

import math
import os
import random
import re
import time
from collections import Counter

import pytest
from fault_bench import FaultyLine, Witness, seeded_events
from telescope_bench import T0, star_at

from clockdrive import Telescope, VirtualClock
from clockdrive.errors import ClockdriveError, Refused
from mounts.errors import DriveError
from pointing.errors import PointingError, Unreachable
from pointing.targets import FixedAltAz
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = int(os.environ.get("CLOCKDRIVE_FAULT_RUNS", "1000" if FULL else "16"))
FIRST = int(os.environ.get("CLOCKDRIVE_FAULT_FIRST", "0"))
OURS = (ClockdriveError, DriveError, PointingError, TransportError)
REMEDY = re.compile(r"`[a-z]|check|try again|again|find its cause|wait|close the other|give|say --", re.IGNORECASE)
MOUNTS = ("equatorial-fork", "german", "altaz-fork")


class Run:
    """One seeded night's trouble."""

    def __init__(self, seed, folder):
        self.seed = seed
        self.chance = random.Random(seed)  # noqa: S311
        self.happened = Counter()
        self.outcome = ""
        chance = self.chance
        bits = chance.choice((0, 0, 14, 16))
        overrides = {
            "state.path": str(folder),
            "site.latitude_deg": chance.choice((-42.4, 51.5)),
            "site.longitude_deg": 173.7,
            "mount.type": chance.choice(MOUNTS),
            "simulator.baud": chance.choice((0, 9600)),
            "simulator.latency_s": chance.choice((0.001, 0.02)),
            "simulator.slew_idle": (idle := chance.choice(("both", "per-axis"))),
            "drive.slew_idle": idle,
            "simulator.seed": seed,
            **{f"axis{i}.encoder_bits": bits for i in (1, 2)},
            **{f"axis{i}.{name}_register": ramp for i in (1, 2) for name in ("acceleration", "deceleration")
               for ramp in [chance.choice((26, 100, 255))]},
        }  # fmt: skip
        self.start = T0 + chance.uniform(0.0, 86400.0)
        lines = []

        def line(unit):
            lines.append(FaultyLine(unit, seed))
            return lines[0]

        self.scope = Telescope.simulated(clock=VirtualClock(self.start), overrides=overrides, line=line)
        self.line = lines[0]
        self.witness = Witness(self.scope, self.line)
        self.witness.t0 = self.start

    def go(self):
        with self.scope:
            try:
                self.trouble()
                self.afterwards()
            except BaseException as error:
                self.witness.fail(f"{type(error).__name__}: {error}")
                raise
        return self.witness.broken

    def trouble(self):
        """A goto, and tracking for a minute, while things happen."""
        scope, chance = self.scope, self.chance
        target = self.star()
        begin = scope.clock.now()
        span = chance.choice((15.0, 40.0, 80.0))
        events, self.kinds = seeded_events(self.line, scope.simulator, chance, begin, span)
        self.happened.update(self.kinds)
        self.witness.plan(events)
        error = self.attempt(lambda: scope.goto(target, self.progress))
        self.outcome = "arrived" if error is None else type(error).__name__
        end = max(self.witness.last_event, begin + span) + 12.0
        while scope.clock.now() < end:
            scope.wait(1.0)
            self.witness.check_status()
        self.happened.update(self.line.happened)

    def progress(self, _):
        self.witness.check_status()

    def attempt(self, work):
        """Do it; return the error, which must be ours and say what to do."""
        try:
            work()
        except OURS as error:
            if not REMEDY.search(str(error)) and not isinstance(error, Unreachable):  # which says by how much
                self.witness.fail(f"no remedy in: {type(error).__name__}: {error}")
            return error
        except Exception as error:  # noqa: BLE001 - that is the claim
            self.witness.fail(f"a bare {type(error).__name__}: {error}")
            return error
        return None

    def afterwards(self):
        """Do what the sentences say, then go somewhere and be there."""
        scope, status = self.scope, self.witness.check_status()
        done = []
        if status["link_silent_s"] is not None:
            self.witness.fail(f"the line is whole, but {status['link_silent_s']:.0f} s silent")
        if status["doing"] != "tracking" and not status["trouble"] and self.outcome == "arrived":
            self.witness.fail("it no longer tracks and does not say why")
        for _ in range(3):
            error = self.attempt(lambda: scope.goto("best"))
            status = self.witness.check_status()
            said = status["unsynchronised_because"] or error if isinstance(error, Unreachable) else error
            if "`drive power on`" in str(said) or (isinstance(error, Unreachable) and not status["powered"]):
                done.append("power")
                self.attempt(lambda: scope.power(on=True))
            elif "`sync`" in str(said):
                done.append("sync")
                self.attempt(self.sync)
            else:
                break
            scope.wait(3.0)
        target = self.star()
        error = self.attempt(lambda: scope.goto(target, self.progress))
        if error is not None:
            self.witness.fail(f"after {', '.join(done) or 'nothing'}, goto says: {type(error).__name__}: {error}")
            return
        scope.wait(20.0)
        status = self.witness.check_status()
        if status["doing"] != "tracking":
            self.witness.fail(f"20 s after arrival it is {status['doing']}: {status['trouble']}")
        else:
            off = max(map(abs, scope._session.pursuit.errors(scope._session.reading)))
            if off > 5.0:
                self.witness.fail(f"20 s after arrival it is {off:.1f} counts off its target")
        self.outcome += ", then " + (" and ".join(done) or "nothing more")

    def sync(self):
        """Sync on what the telescope truly points at."""
        planner = self.scope._session.planner
        sample = self.witness.now()
        x, y, z = planner.observed(sample.counts)
        posture = planner.mount.posture(planner.angles(sample.counts)[1])
        place = FixedAltAz(math.atan2(y, -x), math.asin(z))
        self.scope.sync(place, posture, force=True)

    def star(self):
        """Somewhere up that can be gone to."""
        for _ in range(200):
            altitude = math.degrees(math.asin(self.chance.uniform(math.sin(math.radians(20.0)), 0.97)))
            target = star_at(self.scope, self.chance.uniform(0.0, 360.0), altitude)
            try:
                self.scope.plan(target)
            except (Unreachable, Refused):
                continue
            return target
        raise AssertionError("nowhere to go")


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_the_position_is_right_or_called_unsynchronised_whatever_happens(tmp_path):
    began = time.perf_counter()
    happened, outcomes, broken = Counter(), Counter(), {}
    worst, readings, lost = (0.0, 0.0, 0.0), 0, 0
    for seed in range(FIRST, FIRST + RUNS):
        run = Run(seed, tmp_path / str(seed))
        try:
            run.go()
        except Exception as error:  # noqa: BLE001 - told with all others
            run.witness.fail(f"escaped: {error!r}")
        if run.witness.broken:
            broken[seed] = run
        happened += run.happened
        outcomes[run.outcome] += 1
        worst = max(worst, run.witness.worst)
        readings += run.witness.readings
        lost += run.witness.unsynchronised
    print(f"{RUNS} runs, {readings} readings ({lost} unsynchronised), {time.perf_counter() - began:.0f} s")
    print("faults:", ", ".join(f"{kind} {count}" for kind, count in happened.most_common()))
    print("outcomes:", "; ".join(f"{name} {count}" for name, count in outcomes.most_common()))
    print(f"worst |reported − true| {worst[1]:.2f} counts, stated ±{worst[2]:.2f}")
    for seed, run in broken.items():
        print(f"seed {seed} ({', '.join(run.kinds)}):", *run.witness.broken[:6], sep="\n    ")
    assert not broken
