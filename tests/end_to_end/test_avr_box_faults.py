"""A whole telescope with a stepper box on a bad line, with hands on it and its power cut, under a virtual clock."""

import os
import random

import pytest
from avr_faults import LONGEST_S, Campaign, Mutilating, Watch, switch_off_and_on
from faults import FaultyDevice, by_chance
from telescope_bench import T0, star_at

from clockdrive import Telescope, VirtualClock
from clockdrive.errors import ClockdriveError
from mounts.errors import DriveError
from pointing.errors import PointingError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
RUNS = 1000 if FULL else 1
FIRST = int(os.environ.get("CLOCKDRIVE_SEED", "0"))
ERRORS = ClockdriveError, DriveError, PointingError, TransportError


class Line:
    """What the box hears and says, clean until it is told to be bad; what it says, with encoders alone."""

    def __init__(self, box, seed, encoders):
        clean = box.receive
        self.clean = type("Clean", (), {"receive": staticmethod(clean)})
        far = FaultyDevice(self.clean, by_chance(seed, 0.05), seed) if encoders else self.clean
        self.bad = Mutilating(far, seed, 0.05)
        self.now = self.clean
        box.receive = self.receive

    def receive(self, data, t):
        return self.now.receive(data, t)


def hand_controller(scope, rng):
    """Somebody presses a key of the hand controller."""
    axis, half = rng.choice(((0, 2763), (1, 1382)))
    scope.simulator._begin(axis, half, rng.choice((-1, 1)), 1)


def power_cut(scope, _rng):
    """Somebody switches the box off and on."""
    switch_off_and_on(scope.simulator, scope.clock.now())


def night(folder, seed, interfere, campaign, encoders=20000):
    """Two gotos, and tracking, on a bad line; then a minute on a good one."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    overrides = {
        "state.path": str(folder),
        "limits.sun_avoidance_deg": 0.0,
        "limits.horizon_deg": -5.0,
        "drive.max_uninterruptible_s": LONGEST_S,
        "drive.encoder_counts_per_turn": encoders,
    }
    with Telescope.simulated("avr-box", clock=VirtualClock(T0), overrides=overrides) as scope:
        line, watch = Line(scope.simulator, seed, encoders), Watch(scope.simulator, scope._session.drive)
        line.now = line.bad
        when = rng.uniform(1.0, 60.0)
        for _ in range(2):
            azimuth, altitude = rng.uniform(0.0, 360.0), rng.uniform(20.0, 85.0)
            try:
                disturbed(scope, star_at(scope, azimuth, altitude), when, interfere, rng)
                scope.wait(15.0)
            except ERRORS:
                scope.wait(1.0)
        line.now = line.clean
        scope.wait(60.0)
        campaign.add(seed, lambda: scope._control.call(scope._session.poll), watch, line.bad.happened)


def disturbed(scope, target, when, interfere, rng):
    """A goto in the middle of which something happens."""
    due = scope.clock.now() + when
    steps = scope._slewing.goto(target, lambda _: None)
    for waits in steps:
        scope.clock.sleep(waits)
        if interfere is not None and scope.clock.now() > due:
            interfere(scope, rng)
            due = float("inf")


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize(
    ("interfere", "encoders"), [(None, 20000), (hand_controller, 20000), (power_cut, 20000), (None, 0)]
)
def test_no_fault_moves_a_telescope_farther_than_one_move_and_its_position_is_right_or_unknown(
    tmp_path, interfere, encoders
):
    campaign = Campaign()
    for seed in range(FIRST, FIRST + RUNS):
        night(tmp_path / str(seed), seed, interfere, campaign, encoders)
    print(f"\n{RUNS} runs, {campaign}")
    assert not campaign.longer
    assert not campaign.wrong
