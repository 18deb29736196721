"""Where the axes are led: on the target wherever the drive can be, and back on it as soon as it can."""

import math
import os
import random

import pytest
from orbit import Overhead
from planning_bench import COUNTS_PER_DEGREE, MIDNIGHT, planner, start_at

from pointing.limits import Horizon, separation
from pointing.mount import MountType
from pointing.next_limit import next_limit
from pointing.pass_plan import pass_plan, planned_pass
from pointing.plan import Leading, Start, Timing
from pointing.profile import Ramps
from pointing.targets import FixedAltAz, FixedHaDec, Star
from pointing.trajectory import Trajectory

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
SPEED, RAMP = 4.0, 0.9  # degrees a second, and a second each second
LEADING = Leading(
    (
        Ramps(SPEED * COUNTS_PER_DEGREE, RAMP * COUNTS_PER_DEGREE),
        Ramps(SPEED * COUNTS_PER_DEGREE, RAMP * COUNTS_PER_DEGREE),
    ),
    0.5,
)
LOOK_S = 0.1  # between two looks ahead of a way
INSTANT_S = 0.02  # in which no change of velocity tells: less than any drive takes for one
WIDE = ((-270.0, 270.0), (-5.0, 95.0))
kinds = pytest.mark.parametrize("kind", [MountType.ALTAZ_FORK, MountType.EQUATORIAL_FORK])


def subject(kind, **more):
    limits = WIDE if kind is MountType.ALTAZ_FORK else ((-190.0, 190.0), (-95.0, 95.0))
    return planner(kind, limits_deg=limits, turned=(False, False), **more)


def satellites(n, seed=7):
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    for k in range(n):
        yield Overhead(
            MIDNIGHT + 400.0,
            rng.uniform(0.0, math.tau),
            math.radians(rng.uniform(-12.0, 12.0) * rng.choice((1.0, 0.1))),
            rng.choice((400.0, 800.0)),
            f"satellite {k}",
        )


def first_up(geometry, target):
    time = MIDNIGHT
    while not geometry.allowed(target, time):
        time += 0.5
        assert time < MIDNIGHT + 800.0
    return time


@kinds
def test_speed_and_acceleration_are_kept_and_the_target_is_met_where_the_drive_can(kind):
    """Between the moments at which the way looks ahead the bounds hold to rounding, on the target and off it.

    What is left of a look in which an axis joins the target counts as `INSTANT_S` at least.
    """
    geometry, joined_for, lost, rounding = subject(kind), 0.0, 0.0, 2.0 * math.ulp(MIDNIGHT)
    hardest = {"speed": 0.0, "acceleration": 0.0}
    for target in (*satellites(3), Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.02))):
        found = pass_plan(geometry, target, first_up(geometry, target), LEADING)
        way = found.trajectory
        way.extend(found.ends)
        joins = [(each.axis, each.end) for each in way.bridges]
        time, before, was = way._set_out.time, None, None
        while time < found.ends:
            state = way.angles(time)
            for axis in (0, 1) if was is not None else ():
                (angle, rate), (angle_was, rate_was) = state[axis], was[axis]
                joining = any(joined == axis and before < end <= time for joined, end in joins)
                seconds = time - before + rounding + (INSTANT_S if joining else 0.0)
                for name, change, bound in (
                    ("speed", angle - angle_was, SPEED),
                    ("acceleration", rate - rate_was, RAMP),
                ):
                    hardest[name] = max(hardest[name], abs(change) / (math.radians(bound) * seconds))
            if way.is_joined(time):
                seen = geometry.mount.observed(state[0][0], state[1][0])
                assert separation(seen, target.observed(geometry.sky.at(_instant(time)))) < 1e-9
            before, was, time = time, state, time + LOOK_S
        joined_for += found.followed_s
        lost += found.lost_s
    print(
        f"{kind.text}: 4 passes, {joined_for:.0f} s on the target, {lost:.1f} s too fast for the drive; "
        f"of what the drive can {hardest}"
    )
    assert max(hardest.values()) <= 1.0 + 1e-9
    assert joined_for > 300.0


@pytest.mark.parametrize("miss_deg", [0.0, 1e-5, 1e-4, 1e-3, 0.01])
@pytest.mark.parametrize("offset", [0.0, 0.013, 0.05, 0.087])
def test_the_way_never_jumps_however_near_the_pole_the_target_passes(miss_deg, offset):
    """Where the target leaps round the pole in an instant the axis goes on by its ramps."""
    geometry = subject(MountType.ALTAZ_FORK)
    target = Overhead(MIDNIGHT + 60.0 + offset, 1.1, math.radians(miss_deg))
    start = start_at(geometry, 100.0, 60.0, time=MIDNIGHT + 30.0)
    way = Trajectory(geometry, target, "normal", (math.radians(100.0), 1.0), LEADING, start)
    step, before = 0.02, None
    for k in range(3500):
        state = way.angles(MIDNIGHT + 30.0 + step * k)
        if before is not None:
            for (angle, _), (was, _) in zip(state, before, strict=True):
                assert abs(angle - was) <= math.radians(SPEED) * step * 1.01, k
        before = state


def _instant(time):
    from pointing.instant import Instant

    return Instant.from_posix(time)


def test_no_other_moment_to_leave_and_to_join_loses_less():
    """The keyhole of an altazimuth: every moment to leave and every one to join, tried one by one."""
    geometry = subject(MountType.ALTAZ_FORK)
    axis, ramps = geometry.axes[0], LEADING.ramps[0]
    for miss_deg in (0.02, 0.2):
        target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(miss_deg))
        found = pass_plan(geometry, target, first_up(geometry, target), LEADING)
        ((begin, end),) = found.trajectory.gaps(found.ends)

        def place(time, near, target=target, found=found):
            angle, rate = geometry.track(target, time, found.posture, (near, near))[0]
            return axis.gearing.counts(angle), rate * axis.gearing.counts_per_radian

        before, after = (found.trajectory.angles(time)[0][0] for time in (begin - 0.1, end + 0.1))
        least = math.inf
        for leave in (begin - 0.5 * k for k in range(40)):
            here = place(leave, before)
            for k in range(1, 400):
                seconds = 0.25 * k
                there, rate = place(leave + seconds, after)
                motion = ramps.meet(*here, there - rate * seconds, rate)
                if motion is not None and motion.duration <= seconds and leave + seconds > end - 30.0:
                    least = min(least, seconds)
                    break
        print(f"passes the zenith by {miss_deg * 6771 / 400:.1f}°: lost {end - begin:.2f} s, tried {least:.2f} s")
        assert end - begin <= least + 0.5


@pytest.mark.campaign
def test_the_plan_of_a_pass_keeps_the_whole_of_it_where_a_posture_can():
    """Of all postures and windings none follows for longer than the one that is planned."""
    geometry = subject(MountType.ALTAZ_FORK)
    for target in satellites(8 if FULL else 3, seed=3):
        up = first_up(geometry, target)
        best = pass_plan(geometry, target, up, LEADING)
        for posture in ("normal", "beyond"):
            (one, _), (two, _) = geometry.track(target, up + 0.1, posture, (0.0, 0.0))
            for wait in geometry.windings((one, two), (0.0, 0.0)):
                counts = tuple(axis.gearing.counts(angle) for axis, angle in zip(geometry.axes, wait, strict=True))
                way = Trajectory(geometry, target, posture, wait, LEADING, Start(up + 0.1, counts))
                assert planned_pass(way, up, wait).followed_s <= best.followed_s + 1e-6


def test_a_plan_meets_a_satellite_that_is_up_with_its_velocity():
    geometry = subject(MountType.ALTAZ_FORK)
    timing = Timing(_slews(), 0.05, together=True, leading=LEADING)
    for target in satellites(8, seed=11):
        up = first_up(geometry, target) + 40.0
        plan = geometry.plan(target, start_at(geometry, 20.0, 50.0, time=up), timing)
        assert plan.trajectory is not None
        state = geometry.track(target, plan.arrival, plan.posture, (plan.axes[0].angle, plan.axes[1].angle))
        for axis, (angle, rate) in zip(plan.axes, state, strict=True):
            assert axis.angle == pytest.approx(angle, abs=1e-9)
            assert axis.rate == pytest.approx(rate, abs=1e-9)
        assert plan.arrival >= up + LEADING.delay_s


def _slews():
    from planning_bench import Trapezoid

    one = Trapezoid(4.5 * COUNTS_PER_DEGREE, 1.0 * COUNTS_PER_DEGREE)
    return one, one


@pytest.mark.parametrize("target", [FixedHaDec(0.3, -0.4), FixedAltAz(2.0, 0.9)])
def test_what_stands_still_meets_no_limit(target):
    geometry = subject(MountType.EQUATORIAL_FORK)
    near = geometry.mount.axes(target.observed(geometry.sky.at(_instant(MIDNIGHT))), "normal")
    assert next_limit(Trajectory(geometry, target, "normal", near), MIDNIGHT) is None


@pytest.mark.parametrize("kind", MountType)
def test_the_next_limit_is_the_first_one_that_looking_every_second_finds(kind):
    geometry = planner(kind, horizon=Horizon(((0.0, 0.3), (1.5, 0.1), (3.0, 0.6), (5.0, 0.2))), sun_deg=20.0)
    rng, compared, worst = random.Random(5), 0, 0.0  # noqa: S311 - nothing secret
    while compared < 4:
        star = Star.from_degrees(rng.uniform(0.0, 360.0), rng.uniform(-80.0, 40.0))
        if not geometry.allowed(star, MIDNIGHT):
            continue
        observed = star.observed(geometry.sky.at(_instant(MIDNIGHT)))
        posture = rng.choice(("normal", "beyond"))
        near = next(iter(geometry.windings(geometry.mount.axes(observed, posture), (0.0, 0.0))), None)
        if near is None:
            continue
        found = next_limit(Trajectory(geometry, star, posture, near), MIDNIGHT, 6 * 3600.0)
        time, first = MIDNIGHT, None
        while time <= MIDNIGHT + 6 * 3600.0:
            (one, _), (two, _) = geometry.track(star, time, posture, near)
            near = one, two
            if not all(check.ok for check in geometry.standing((one, two), time)):
                first = time
                break
            time += 5.0
        compared += 1
        assert (found is None) == (first is None)
        if found is not None:
            worst = max(worst, abs(found[0] - first))
            assert first - 5.0 - 0.1 <= found[0] <= first + 0.1
    print(f"{kind.text}: next limits as found by looking every 5 s, worst {worst:.1f} s")


def test_a_target_faster_than_the_drive_is_refused_with_a_sentence():
    geometry = subject(MountType.ALTAZ_FORK)
    slow = Leading((Ramps(20.0, 20.0), Ramps(20.0, 20.0)), 0.5)
    target = Overhead(MIDNIGHT + 100.0, 1.1, 0.03)
    way = Trajectory(geometry, target, "normal", (0.0, 0.8), slow, Start(MIDNIGHT + 40.0, (8388608.0, 8388608.0)))
    assert way.unmet
