"""A pursuit foresees from anywhere on its way, on a bridge too, what the plan of its pass foresaw."""

import math
import random
from time import perf_counter

import pytest
from orbit import Overhead
from planning_bench import COUNTS_PER_DEGREE, MIDNIGHT, planner

import clockdrive.pursuit
from clockdrive.pursuit import Pursuit
from mounts.drive import AxisReading, Reading
from pointing.limits import Horizon
from pointing.mount import MountType
from pointing.next_limit import forbidden
from pointing.pass_plan import pass_plan
from pointing.plan import Leading, Start
from pointing.profile import Ramps
from pointing.sky import Sky
from pointing.trajectory import Trajectory

AXIS = Ramps(4.0 * COUNTS_PER_DEGREE, 0.9 * COUNTS_PER_DEGREE)
LEADING = Leading((AXIS, AXIS), 0.5)


def test_the_next_limit_of_a_pass_is_the_same_before_on_and_after_a_bridge():
    geometry = planner(MountType.ALTAZ_FORK)
    target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.05))
    up = next(MIDNIGHT + k for k in range(400) if geometry.allowed(target, MIDNIGHT + k))
    found = pass_plan(geometry, target, up, LEADING)
    ((begin, end),) = found.lost
    for time in (begin - 60.0, (begin + end) / 2.0, end + 60.0):
        pursuit = Pursuit(geometry, target, found.posture, found.wait, LEADING, found.trajectory)
        moment, check = pursuit.next_limit(time)
        print(f"{time - begin:+.0f} s: {moment - found.ends:+.3f} s from the plan's end")
        assert moment == pytest.approx(found.ends, abs=0.02)
        assert check.name == found.limit.name


def test_a_limit_that_was_found_is_looked_for_again_when_it_is_past_or_the_sky_has_changed(monkeypatch):
    geometry = planner(MountType.ALTAZ_FORK)
    target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(3.0))
    up = next(MIDNIGHT + k for k in range(400) if geometry.allowed(target, MIDNIGHT + k))
    found = pass_plan(geometry, target, up, LEADING)
    pursuit = Pursuit(geometry, target, found.posture, found.wait, LEADING, found.trajectory)
    searched = []
    search = clockdrive.pursuit.next_limit
    monkeypatch.setattr(
        clockdrive.pursuit, "next_limit", lambda way, time, span: searched.append(time) or search(way, time, span)
    )
    begin, (moment, _) = found.joined, pursuit.next_limit(found.joined)
    assert [pursuit.next_limit(begin + k)[0] for k in range(1, int(moment - begin), 7)][-1] == moment
    assert searched == [begin]
    geometry.sky = Sky(geometry.sky.site)  # as with other air
    assert pursuit.next_limit(moment - 2.0)[0] == pytest.approx(moment, abs=0.02)
    assert pursuit.next_limit(moment + 0.1)[0] == moment + 0.1
    assert searched == [begin, moment - 2.0, moment + 0.1]


def reading_at(way, moment):
    axes = [AxisReading(counts, 0.0, rate, slewing=False) for counts, rate in way.at(moment)]
    return Reading(moment, tuple(axes))


def setting_out(geometry, rng):
    """A pursuit that sets out from an allowed place at random to a satellite at random that is up."""
    while True:
        target = Overhead(MIDNIGHT + 400.0, rng.uniform(0.0, math.tau), math.radians(rng.uniform(-8.0, 8.0)))
        begin = MIDNIGHT + rng.uniform(200.0, 600.0)
        here = tuple(rng.uniform(axis.minimum, axis.maximum) for axis in geometry.free)
        if not geometry.allowed(target, begin) or not all(check.ok for check in geometry.standing(here, begin)):
            continue
        counts = tuple(axis.gearing.counts(angle) for axis, angle in zip(geometry.axes, here, strict=True))
        posture = rng.choice(("normal", "beyond"))
        way = Trajectory(geometry, target, posture, here, LEADING, Start(begin, counts))
        if not way.unmet:
            return Pursuit(geometry, target, posture, here, LEADING, way), way, begin


def stopping(geometry, way, moment):
    """Axis angles every half a second while both axes go on for a notice and are then braked evenly to rest."""
    notice, brake = 2.0 * LEADING.period_s, AXIS.acceleration
    state = way.at(moment)
    for k in range(16):
        counts = []
        for place, rate in state:
            ramped = min(max(0.0, 0.5 * k - notice), abs(rate) / brake)
            gone = abs(rate) * (min(0.5 * k, notice) + ramped) - brake * ramped**2 / 2.0
            counts.append(place + math.copysign(gone, rate))
        yield geometry.angles((counts[0], counts[1]))


@pytest.mark.parametrize("kind", MountType)
def test_wherever_a_bridge_is_not_barred_a_stop_comes_to_rest_where_the_telescope_may_stand(kind):
    trees = Horizon(((0.0, 0.3), (1.5, 0.5), (3.0, 0.7), (5.0, 0.2)))
    geometry, rng = planner(kind, horizon=trees, sun_deg=20.0), random.Random(11)  # noqa: S311 - nothing secret
    asked = barred = 0
    for _ in range(25):
        pursuit, way, begin = setting_out(geometry, rng)
        moment = begin + 0.1
        while not way.is_joined(moment):
            asked += 1
            if pursuit.barred(reading_at(way, moment)):
                barred += 1
                break
            *_, rest = stopping(geometry, way, moment)
            failed = [check.detail for check in geometry.standing(rest, moment) if not check.ok]
            assert not failed, f"{moment - begin:.1f} s after setting out"
            moment += 0.3
    print(f"{kind.text}: {asked} places on 25 bridges, {barred} of which barred")
    assert asked > 100


def test_axes_on_a_bridge_that_are_too_fast_to_stop_inside_a_limit_are_barred_whatever_was_planned():
    geometry = planner(MountType.ALTAZ_FORK)
    target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.05))
    begin, here = MIDNIGHT + 330.0, (math.radians(-60.0), math.radians(12.0))
    counts = tuple(axis.gearing.counts(angle) for axis, angle in zip(geometry.axes, here, strict=True))
    way = Trajectory(geometry, target, "normal", here, LEADING, Start(begin, counts))
    pursuit = Pursuit(geometry, target, "normal", here, LEADING, way)
    reading = reading_at(way, begin + 0.3)
    assert not pursuit.barred(reading)
    down = math.copysign(4.0 * COUNTS_PER_DEGREE, -geometry.axes[1].gearing.counts_per_radian)
    hasty = Reading(reading.time, (reading.axes[0], AxisReading(reading.axes[1].counts, 0.0, down, slewing=False)))
    assert [check.name for check in pursuit.barred(hasty)] == ["horizon"]


def test_a_planned_bridge_is_walked_once_and_again_when_the_limits_change(monkeypatch):
    geometry, walks = planner(MountType.ALTAZ_FORK), []
    monkeypatch.setattr(clockdrive.pursuit, "forbidden", lambda *way: walks.append(way) or forbidden(*way))
    target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.05))
    begin, here = MIDNIGHT + 330.0, (math.radians(-60.0), math.radians(40.0))
    counts = tuple(axis.gearing.counts(angle) for axis, angle in zip(geometry.axes, here, strict=True))
    way = Trajectory(geometry, target, "normal", here, LEADING, Start(begin, counts))
    pursuit = Pursuit(geometry, target, "normal", here, LEADING, way)
    moments = [begin + 0.1 * k for k in range(1, 100) if not way.is_joined(begin + 0.1 * k + 0.5)]
    longest = 0.0
    for moment in moments:
        reading, started = reading_at(way, moment), perf_counter()
        assert not pursuit.barred(reading)
        if moment > moments[0]:
            longest = max(longest, perf_counter() - started)
    print(
        f"{len(moments)} readings on a bridge, {len(walks)} walk along it; the later ones took {1e3 * longest:.2f} ms"
    )
    assert len(moments) > 50
    assert len(walks) == 1
    geometry.limits = type(geometry.limits)(Horizon.level(80.0))
    assert [check.name for check in pursuit.barred(reading_at(way, moments[-1]))] == ["horizon"]
