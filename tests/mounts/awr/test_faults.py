"""Gotos on a bad line: how long keys are held, what is written for good, and whether the position is right."""

import os
import random
from collections import Counter

import pytest
from awr_bench import SIDEREAL, Bench

from mounts.awr.factory import factory
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.drive import AxisSlew
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = 1000 if FULL else 25
LATE_S = 0.2


class Watch:
    """Measures for how long keys are held beyond what was planned."""

    def __init__(self, bench):
        self.worst, self.since, self.bench = 0.0, [None, None], bench
        self.planned = [None, None]
        act, begin = bench.awr._act, bench.drive.keys.begin

        def acted(body):
            before = list(bench.awr.keys)
            act(body)
            self.note(before, bench.awr._now)

        def began(stage):
            self.planned = [press and press.hold for press in stage.presses]
            return begin(stage)

        bench.awr._act, bench.drive.keys.begin = acted, began

    def note(self, before, now):
        for axis, (was, is_) in enumerate(zip(before, self.bench.awr.keys, strict=True)):
            if is_ and not was:
                self.since[axis] = now, self.planned[axis] or 0.0
            elif was and not is_ and self.since[axis] is not None:
                begun, planned = self.since[axis]
                self.worst = max(self.worst, now - begun - planned)
                self.since[axis] = None

    @property
    def held(self):
        return any(since is not None for since in self.since)


PLAY = {"plays": (200.0, 300.0), "words": factory(backlash=(200, 300))}


def night(seed, rate):
    """Three gotos on a bad line, with play that is taken up every other time; returns the bench and its watch."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    bench = Bench(unit=SimulatorSettings(seed=seed + 1, debug=0.1, **(PLAY if seed % 2 else {})), seed=seed)
    bench.line.garbles = False
    bench.connect()
    watch = Watch(bench)
    bench.line.rate = rate
    for _ in range(3):
        try:
            began, here = bench.clock.now(), bench.read()
            targets = [axis.counts + rng.choice((-1, 1)) * 10.0 ** rng.uniform(1.5, 5.0) for axis in here.axes]
            bench.drive.start(
                [AxisSlew(targets[0], SIDEREAL, None, began), AxisSlew(targets[1], 0.0, None, began)], began
            )
            poll(bench, 60.0, slewing=True)
        except (DriveError, TransportError):
            poll(bench, 2.0)
    bench.line.rate = 0.0
    poll(bench, 5.0)
    return bench, watch


def poll(bench, seconds, *, slewing=False):
    end = bench.clock.now() + seconds
    while bench.clock.now() < end:
        try:
            reading = bench.read()
            if slewing and not any(axis.slewing for axis in reading.axes):
                return
        except (DriveError, TransportError):
            pass
        bench.clock.sleep(0.25)


@pytest.mark.campaign
@pytest.mark.timeout(1800)
def test_on_a_bad_line_no_key_is_held_long_nothing_is_written_for_good_and_the_position_is_right_or_unknown():
    worst, faults, lost, wrong, worn = 0.0, Counter(), 0, [], Counter()
    for seed in range(RUNS):
        bench, watch = night(seed, 0.05)
        faults += bench.line.happened
        worn += bench.awr.wear
        worst = max(worst, watch.worst)
        assert not watch.held, seed
        reading = bench.read()
        if reading.unsynchronised:
            lost += 1
            continue
        bench.awr.advance(reading.time)
        for i, axis in enumerate(reading.axes):
            off = abs(axis.counts - bench.awr.true_position(i + 1))
            if off > 3.0 * axis.uncertainty_counts + 1.0:
                wrong.append((seed, i, round(off, 1), round(axis.uncertainty_counts, 1)))
    print(
        f"\n{RUNS} runs, {dict(faults)}: keys at most {worst * 1e3:.0f} ms late, {dict(worn)} words worn, "
        f"{lost} unsynchronised, wrong {wrong[:10]}"
    )
    assert worst < LATE_S
    assert not worn
    assert not wrong
