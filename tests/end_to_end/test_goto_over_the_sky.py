"""A goto lands on the moving target at the second it announced, with one slew, and stays there."""

import math
import os
import random

import pytest
from telescope_bench import ARCSEC_PER_COUNT, Witness, star_at, telescope

from pointing.errors import Unreachable

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
TARGETS = 100 if FULL else 4  # for each mount, hemisphere: 600 or 24 in all
PAUSE_S = 600.0 if FULL else 40.0  # at most, tracking, before the next one
TICK_S = 0.002
MOUNTS = [
    (kind, latitude, x, y)
    for kind, x, y in (("equatorial-fork", 1.2, -1.6), ("german", -1.9, 0.4), ("altaz-fork", 0.3, 1.9))
    for latitude in (-42.4, 51.5)
]


def skewed(kind, latitude, x_deg, y_deg):
    """A mount that is misaligned, and known to be."""
    return {
        "mount__type": kind,
        "site__latitude_deg": latitude,
        "site__longitude_deg": 173.7,
        "mount__mount_x_mas": round(x_deg * 3.6e6),
        "mount__mount_y_mas": round(y_deg * 3.6e6),
        "simulator__misalignment_x_arcsec": x_deg * 3600.0,
        "simulator__misalignment_y_arcsec": y_deg * 3600.0,
    }


def rates(scope, target, time):
    """Counts per second of both axes, from the places half a second before and after."""
    planner, posture = scope._session.planner, scope._session.pursuit.posture
    near = planner.angles(tuple(axis.counts for axis in scope._session.reading.axes))
    before, after = (planner.track(target, time + half, posture, near) for half in (-0.5, 0.5))
    return tuple(
        (b[0] - a[0]) * axis.gearing.counts_per_radian for axis, a, b in zip(planner.axes, before, after, strict=True)
    )


def misses(scope, witness, target):
    """By how many counts each axis was off the target at the arrival announced, and its allowance."""
    time = witness.arrivals[-1]
    off = witness.off_counts(target, witness.at_arrival(), time)
    return [(each, 1.0 + abs(rate) * TICK_S) for each, rate in zip(off, rates(scope, target, time), strict=True)]


@pytest.mark.campaign
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("kind", "latitude", "x_deg", "y_deg"), MOUNTS)
def test_every_axis_is_on_the_moving_target_at_the_stated_arrival_with_one_slew(
    kind, latitude, x_deg, y_deg, tmp_path
):
    chance = random.Random(f"{kind} {latitude}")  # noqa: S311
    reached, worst, on_sky, early, refused = 0, 0.0, 0.0, 0.0, []
    with telescope(tmp_path, **skewed(kind, latitude, x_deg, y_deg)) as scope:
        witness = Witness(scope)
        while reached < TARGETS:
            scope.wait(chance.uniform(0.0, PAUSE_S))
            altitude = math.degrees(math.asin(chance.uniform(math.sin(math.radians(16.0)), 1.0)))
            target = star_at(scope, chance.uniform(0.0, 360.0), altitude)
            try:
                arrival = scope.goto(target)
            except Unreachable as refusal:
                refused.append(str(refusal))
                assert len(refused) < 3 * TARGETS, refused
                continue
            reached += 1
            assert arrival["slews"] == 1, target
            early = max(early, witness.arrivals[-1] - scope.clock.now())  # by a few milliseconds
            for off, allowed in misses(scope, witness, target):
                worst = max(worst, abs(off))
                assert abs(off) <= allowed, (target, off, allowed)
            on_sky = max(on_sky, witness.on_sky_arcsec(target, witness.counts_at_arrival, witness.arrivals[-1]))
    print(
        f"{kind} at {latitude:+.1f}°, skewed by {math.hypot(x_deg, y_deg):.1f}°: {reached} targets, one slew each; "
        f"worst axis {worst:.2f} counts, worst on the sky {on_sky:.2f}″, at most {early:.3f} s early; "
        f"{len(refused)} refused"
    )
    assert on_sky < 2.0 * ARCSEC_PER_COUNT


@pytest.mark.parametrize("baud", [0, 9600])
@pytest.mark.parametrize(("kind", "latitude", "x_deg", "y_deg"), MOUNTS[::2])
def test_tracks_within_half_an_arcsecond_for_ten_minutes(kind, latitude, x_deg, y_deg, baud, tmp_path):
    with telescope(tmp_path, **skewed(kind, latitude, x_deg, y_deg), simulator__baud=baud) as scope:
        witness = Witness(scope)
        target = star_at(scope, 75.0, 52.0, scope.clock.now() + 15.0)
        scope.goto(target)
        offs = []
        for _ in range(600):
            scope.wait(1.0)
            offs += [off * ARCSEC_PER_COUNT for off in witness.off_counts(target, witness.now(), scope.clock.now())]
        sky = witness.on_sky_arcsec(target, witness.now(), scope.clock.now())
    rms = math.sqrt(sum(off * off for off in offs) / len(offs))
    worst = max(map(abs, offs))
    print(f"{kind}, {baud or 'no'} baud: ten minutes within {worst:.3f}″, RMS {rms:.3f}″, at the end {sky:.3f}″")
    assert worst < 0.5
    assert sky < 1.0


def test_a_fixed_place_is_reached_and_kept_without_tracking(tmp_path):
    with telescope(tmp_path) as scope:
        witness = Witness(scope)
        arrival = scope.goto("altaz:75,40")
        scope.wait(60.0)
        assert witness.on_sky_arcsec(scope._session.pursuit.target, witness.now(), scope.clock.now()) < 1.5
        assert arrival["slews"] == 1
        assert scope.simulator.axes[0].moved == 0
