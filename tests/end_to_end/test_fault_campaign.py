"""Whatever happens to line, unit and people, the position is right within its bounds or called unsynchronised.

Faults of every kind come at random moments of a goto, its settling and its tracking. Afterwards the telescope is
usable again by what its own sentences say.
"""

import math
import os
import re

import pytest
from fault_bench import FaultyLine, Witness, seeded_events
from fault_run import FaultRun, Reckoning
from telescope_bench import T0

from clockdrive import Telescope, VirtualClock
from clockdrive.errors import Refused
from pointing.errors import Unreachable
from pointing.targets import FixedAltAz

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = int(os.environ.get("CLOCKDRIVE_FAULT_RUNS", "1000" if FULL else "10"))
FIRST = int(os.environ.get("CLOCKDRIVE_FAULT_FIRST", "0"))
MOUNTS = ("equatorial-fork", "german", "altaz-fork")


class Run(FaultRun):
    """One seeded night's trouble."""

    remedy = re.compile(
        r"`[a-z]|check|try again|again|find its cause|wait|close the other|give|say --", re.IGNORECASE
    )

    def __init__(self, seed, folder):
        super().__init__(seed)
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
        if self.arrives(done, self.progress) is None:
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

    def may_go(self, target):
        try:
            self.scope.plan(target)
        except (Unreachable, Refused):
            return False
        return True


@pytest.mark.campaign
@pytest.mark.timeout(7200)
def test_the_position_is_right_or_called_unsynchronised_whatever_happens(tmp_path):
    reckoning = Reckoning()
    for seed in range(FIRST, FIRST + RUNS):
        reckoning.take(Run(seed, tmp_path / str(seed)))
    reckoning.tell()
    print(f"worst |reported − true| {reckoning.worst[1]:.2f} counts, stated ±{reckoning.worst[2]:.2f}")
    assert not reckoning.broken
