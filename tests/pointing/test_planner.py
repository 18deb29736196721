"""Plans, against a brute force that knows neither the planner nor the mount's formulas.

The brute force tries every posture and winding, solves each arrival by plain iteration, and looks at 1500 moments of
each path; directions come from numpy matrices.
"""

import math
import os
from dataclasses import replace

import numpy as np
import pytest
from planning_bench import LIMITS_DEG, MIDNIGHT, gearing, noon_of, planner, random_star, start_at, timing

from pointing.errors import PointingError, TargetError, Unreachable
from pointing.instant import Instant
from pointing.limits import Horizon
from pointing.mount import MountType
from pointing.plan import Axis, Start
from pointing.targets import FixedAltAz, FixedHaDec, Star
from pointing.way_round import to_axes

SIZE = 400 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 32
GRAZE_DEG = 0.03  # two ways of looking at a path may differ about a limit that is only touched
HILLS = Horizon(
    tuple(
        (math.radians(azimuth), math.radians(altitude))
        for azimuth, altitude in ((0, 8), (90, 35), (110, 6), (250, 25))
    )
)
kinds = pytest.mark.parametrize("kind", MountType)


def random_start(rng, subject, time, *, moving=True):
    """A start within the limits, above the horizon and outside the Sun's zone."""
    (low1, high1), (low2, high2) = LIMITS_DEG[subject.mount.type]
    while True:
        rates = rng.uniform(-0.02, 0.02, 2) if moving else (0.0, 0.0)
        start = start_at(subject, rng.uniform(low1, high1), rng.uniform(low2, high2), time, rates)
        checks = subject.standing(subject.angles(start.counts), time)
        clear = subject.limits.horizon.margin(subject.observed(start.counts)) > 0.02
        if clear and all(check.ok for check in checks):
            return start


# The brute force.


def matrix(mount):
    """Columns lead from the mount's frame to the horizon frame."""
    s, c = math.sin(mount.latitude), math.cos(mount.latitude)
    base = np.eye(3) if mount.type is MountType.ALTAZ_FORK else np.array([(s, 0.0, c), (0.0, 1.0, 0.0), (-c, 0.0, s)])
    angle = math.hypot(mount.x, mount.y)
    turn = np.eye(3)
    if angle:
        k = np.array([(0.0, 0.0, mount.y), (0.0, 0.0, -mount.x), (-mount.y, mount.x, 0.0)]) / angle
        turn = np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k
    return base.T @ turn


def directions(mount, axis1, axis2):
    """Observed directions (n, 3) of axis angles (n,)."""
    lateral = (math.pi if mount.type is MountType.ALTAZ_FORK else 0.0) - axis1
    inner = np.stack((np.cos(axis2) * np.cos(lateral), np.cos(axis2) * np.sin(lateral), np.sin(axis2)), -1)
    return inner @ matrix(mount).T


def placed(mount, observed, *, beyond):
    x, y, z = matrix(mount).T @ np.array(observed)
    axis1 = (math.pi if mount.type is MountType.ALTAZ_FORK else 0.0) - math.atan2(y, x)
    axis2 = math.atan2(z, math.hypot(x, y))
    return np.array((axis1 + math.pi, math.pi - axis2) if beyond else (axis1, axis2))


def clearance(subject, times, travels):
    """The least room in degrees to the horizon and to the Sun's zone over the path of a slew."""
    begin = times[0]
    counts = [np.array([travel.position(time - begin) for time in times]) for travel in travels]
    angles = [
        axis.gearing.centre + (c - 0x800000) / axis.gearing.counts_per_radian
        for axis, c in zip(subject.axes, counts, strict=True)
    ]
    seen = directions(subject.mount, *angles)
    altitude = np.degrees(np.arctan2(seen[:, 2], np.hypot(seen[:, 0], seen[:, 1])))
    azimuth = np.degrees(np.arctan2(seen[:, 1], -seen[:, 0])) % 360.0
    points = np.degrees(np.array(subject.limits.horizon.altitudes))
    lowest = np.interp(azimuth, points[:, 0], points[:, 1], period=360.0)
    room = (altitude - lowest).min()
    if subject.limits.sun_avoidance:
        some = np.linspace(times[0], times[-1], 5)
        suns = np.array([subject.sky.at(Instant.from_posix(time)).sun() for time in some])
        sun = np.stack([np.interp(times, some, suns[:, i]) for i in range(3)], -1)
        away = np.degrees(np.arctan2(np.linalg.norm(np.cross(seen, sun), axis=1), (seen * sun).sum(1)))
        room = min(room, away.min() - math.degrees(subject.limits.sun_avoidance))
    return room


def brute_force(subject, target, start, how):
    """(arrival, room in degrees) of every way whose arrival keeps the axis limits, in order of arrival."""
    begin, found = start.time + how.latency, {}
    window = (-math.inf, math.inf)
    if subject.mount.type is MountType.GERMAN:
        window = (-subject.past_meridian, math.pi + subject.past_meridian)
    for beyond in (False, True):
        for k1 in range(-2, 3):
            for k2 in (-1, 0, 1):
                at = placed(subject.mount, target.observed(subject.sky.at(Instant.from_posix(begin))), beyond=beyond)
                at = at + math.tau * np.array((k1, k2))
                if np.any(np.abs(at) > 8.0):
                    continue
                due = 30.0
                for _ in range(8):
                    seen = target.observed(subject.sky.at(Instant.from_posix(begin + due)))
                    wanted = placed(subject.mount, seen, beyond=beyond)
                    at = wanted + math.tau * np.round((at - wanted) / math.tau)
                    travels = [
                        model.travel(count + rate * how.latency, round(axis.gearing.counts(angle)), rate, 0.0)
                        for model, count, rate, axis, angle in zip(
                            how.slew, start.counts, start.rates, subject.axes, at, strict=True
                        )
                    ]
                    due = max(travel.duration for travel in travels)
                inside = [
                    min(angle - axis.minimum, axis.maximum - angle)
                    for axis, angle in zip(subject.axes, at, strict=True)
                ]
                room = math.degrees(min(*inside, at[0] - window[0], window[1] - at[0]))
                if room > -GRAZE_DEG:
                    times = np.linspace(begin, begin + due, 1500)
                    room = min(room, clearance(subject, times, travels))
                    found[round(at[0], 6), round(at[1], 6)] = (begin + due, room)
    return sorted(found.values())


@kinds
@pytest.mark.parametrize("together", [True, False])
def test_the_axes_land_where_the_target_then_is(kind, together):
    rng = np.random.default_rng(2)
    worst, planned, refused = 0.0, 0, 0
    for x, y in ((0.0, 0.0), (1.3, -1.5), (-0.4, 0.2)):
        for latitude in (-42.4, 35.0):
            subject = planner(kind, latitude, x_deg=x, y_deg=y)
            for _ in range(20):
                how = timing(rng.uniform(0.5, 5.0), second_speed_deg_s=rng.uniform(0.5, 5.0), together=together)
                start = random_start(rng, subject, MIDNIGHT + rng.uniform(-3e8, 3e8))
                target = random_star(rng)
                try:
                    plan = subject.straight(target, start, how)[0]
                except Unreachable:
                    plan = None
                if plan is None:
                    refused += 1
                    continue
                planned += 1
                near = tuple(axis.angle for axis in plan.axes)
                for i, axis in enumerate(plan.axes):
                    landing = plan.arrival if together else start.time + how.latency + axis.travel.duration
                    angle, _ = subject.track(target, landing, plan.posture, near)[i]
                    off = abs(axis.target_counts - subject.axes[i].gearing.counts(angle))
                    worst = max(worst, off)
                    at_arrival, rate = subject.track(target, plan.arrival, plan.posture, near)[i]
                    assert abs(axis.angle - at_arrival) < 1e-9
                    assert axis.rate == pytest.approx(rate, rel=1e-3, abs=1e-9)
                    assert axis.travel.landed == axis.target_counts
    print(
        f"{kind.text}, {'together' if together else 'one by one'}: "
        f"{planned} plans ({refused} refused), worst {worst:.4f} count"
    )
    assert planned > 40
    assert worst <= 0.51  # half a count and the flicker of one count's travel time


@kinds
@pytest.mark.parametrize(("horizon", "sun_deg", "x"), [(None, 0.0, 0.0), (HILLS, 35.0, 1.5)])
@pytest.mark.campaign
def test_the_plan_is_the_earliest_of_all_allowed_ways(kind, horizon, sun_deg, x):
    rng = np.random.default_rng(7)
    agreed, refused, grazing, worst = 0, 0, 0, 0.0
    for _ in range(SIZE):
        subject = planner(kind, rng.choice((-42.4, 35.0)), horizon=horizon, sun_deg=sun_deg, x_deg=x, y_deg=-x / 2)
        how = timing(rng.uniform(1.0, 5.0), rng.uniform(0.3, 2.0), second_speed_deg_s=rng.uniform(1.0, 5.0))
        start = random_start(rng, subject, MIDNIGHT + rng.uniform(-3e7, 3e7))
        target = random_star(rng)
        ways = brute_force(subject, target, start, how)
        allowed = [arrival for arrival, room in ways if room >= 0.0]
        if any(abs(room) < GRAZE_DEG for _, room in ways):
            grazing += 1
            continue
        plan, _ = subject.straight(target, start, how)
        if plan is None:
            assert not allowed, f"refused, but a way arrives at {allowed}"
            refused += 1
            continue
        assert allowed, f"planned, but no way is allowed: {ways}"
        worst = max(worst, abs(plan.arrival - allowed[0]))
        agreed += 1
    print(f"{kind.text}: {agreed} plans agree to {worst:.1e} s, {refused} refusals, {grazing} graze a limit")
    assert worst < 0.02
    assert agreed >= SIZE // 8
    assert refused >= 2


def test_the_other_posture_is_taken_when_it_arrives_earlier():
    subject = planner(MountType.EQUATORIAL_FORK, limits_deg=((-170.0, 190.0), (-250.0, 100.0)))
    start = start_at(subject, 80.0, -60.0)
    target = FixedHaDec(math.radians(-95.0), math.radians(-75.0))
    how = timing(4.5, 1.0, second_speed_deg_s=4.5)
    plan = subject.plan(target, start, how)
    assert plan.posture == "beyond"
    assert plan.arrival == pytest.approx(
        min(arrival for arrival, room in brute_force(subject, target, start, how) if room > 0)
    )


def crossing(subject, start, how, limit_deg, *, before):
    """A star whose axis 1 passes `limit_deg` so many seconds after the motion begins."""
    moment = Instant.from_posix(start.time + how.latency + before)
    observed = subject.mount.observed(math.radians(limit_deg), math.radians(-20.0))
    frame = subject.sky.at(moment)
    x, y, z = frame.astrometric(observed)
    return Star.from_degrees(math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z)))


def test_a_target_that_leaves_the_limits_during_the_slew_is_reached_the_other_way_round():
    below = Horizon.level(-89.0)
    subject = planner(MountType.EQUATORIAL_FORK, limits_deg=((-200.0, 170.0), (-100.0, 100.0)), horizon=below)
    start, how = start_at(subject, 100.0, -40.0), timing()
    leaving = crossing(subject, start, how, 170.0, before=5.0)
    plan = subject.plan(leaving, start, how)
    assert math.degrees(plan.axes[0].angle) == pytest.approx(-190.0, abs=1.5)


def test_the_winding_is_taken_in_which_a_target_can_be_tracked_for_longest():
    below = Horizon.level(-89.0)
    wide, narrow = (
        planner(MountType.EQUATORIAL_FORK, limits_deg=((low, 170.0), (-100.0, 100.0)), horizon=below)
        for low in (-200.0, -170.0)
    )
    start, how = start_at(wide, 100.0, -40.0), timing()
    leaving_soon = crossing(wide, start, how, 170.0, before=60.0)
    assert math.degrees(wide.plan(leaving_soon, start, how).axes[0].angle) == pytest.approx(-190.0, abs=1.5)
    assert math.degrees(narrow.plan(leaving_soon, start, how).axes[0].angle) == pytest.approx(170.0, abs=0.3)
    staying = crossing(wide, start, how, 120.0, before=60.0)
    assert math.degrees(wide.plan(staying, start, how).axes[0].angle) == pytest.approx(120.0, abs=0.3)


def test_a_target_that_enters_the_limits_during_the_slew_is_planned_there():
    below = Horizon.level(-89.0)
    subject = planner(MountType.EQUATORIAL_FORK, limits_deg=((-90.0, 170.0), (-100.0, 100.0)), horizon=below)
    start, how = start_at(subject, 0.0, -40.0), timing()
    entering = crossing(subject, start, how, -90.0, before=10.0)
    plan = subject.plan(entering, start, how)
    assert -90.0 <= math.degrees(plan.axes[0].angle) < -89.9
    with pytest.raises(Unreachable, match=r"axis1 at -9\d\.\d+° is 0\.\d+° outside") as refused:
        subject.plan(crossing(subject, start, how, -90.0, before=60.0), start, how)
    assert 0.0 < refused.value.reachable - start.time < 62.0


@kinds
def test_a_german_window_and_every_limit_hold_at_arrival(kind):
    rng = np.random.default_rng(11)
    subject = planner(kind, 35.0, past_deg=3.0, x_deg=0.5, y_deg=0.5)
    for _ in range(60):
        start = random_start(rng, subject, MIDNIGHT + rng.uniform(-1e7, 1e7))
        plan, _ = subject.straight(random_star(rng), start, timing())
        if plan is None:
            continue
        for axis, plan_axis in zip(subject.axes, plan.axes, strict=True):
            assert axis.minimum <= plan_axis.angle <= axis.maximum
        if kind is MountType.GERMAN:
            assert -3.0 <= math.degrees(plan.axes[0].angle) <= 183.0
            assert any(check.name == "hour-angle window" and check.ok for check in plan.checks)


def test_a_german_refusal_names_the_window_by_how_much_and_when():
    """A tube that may not go through the pole's far side: only the normal posture is left."""
    subject = planner(MountType.GERMAN, 35.0, limits_deg=((-20.0, 200.0), (-90.0, 90.0)), past_deg=5.0)
    start = start_at(subject, 90.0, 80.0)
    moment = subject.sky.at(Instant.from_posix(start.time))
    x, y, z = moment.astrometric(FixedHaDec(math.radians(-9.0), 0.3).observed(moment))
    target = Star.from_degrees(math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z)), "East")
    with pytest.raises(
        Unreachable, match=r"East: mechanical hour angle at -\d\.\d+° is [34]\.\d+° outside -5\.00°"
    ) as refused:
        subject.plan(target, start, timing())
    assert refused.value.reachable - start.time == pytest.approx(4.0 / 15.041 * 3600.0, abs=60.0)
    assert any(check.name == "hour-angle window" and not check.ok for check in refused.value.checks)


def altitude_deg(subject, target, time):
    return math.degrees(math.asin(target.observed(subject.sky.at(Instant.from_posix(time)))[2]))


@kinds
def test_a_target_below_the_horizon_says_by_how_much_and_when_it_comes(kind):
    rng = np.random.default_rng(3)
    subject = planner(kind, 35.0, horizon=Horizon.level(20.0))
    told = never = 0
    worst = 0.0
    for _ in range(20):
        start = random_start(rng, subject, MIDNIGHT + rng.uniform(-1e7, 1e7))
        target = random_star(rng)
        if altitude_deg(subject, target, start.time) > 15.0:
            continue
        with pytest.raises(
            Unreachable, match=r"altitude .* is \d+\.\d\d° below the horizon limit of 20\.00°"
        ) as refused:
            subject.plan(target, start, timing())
        scan = np.arange(start.time, start.time + 86_400.0, 30.0)
        risen = [
            time for time in scan if altitude_deg(subject, target, time) >= 20.0 and subject.allowed(target, time)
        ]
        if refused.value.reachable is None:
            assert not risen
            never += 1
        else:
            worst = max(worst, abs(refused.value.reachable - risen[0]))
            told += 1
    print(f"{kind.text}: {told} told when, within {worst:.0f} s of a scan every 30 s; {never} never rise")
    assert worst <= 32.0
    assert told >= 3
    assert never >= 1


def test_a_target_that_never_rises_has_no_time():
    subject = planner(MountType.EQUATORIAL_FORK, 51.5)
    with pytest.raises(Unreachable, match=r"Canopus.*below the horizon limit") as refused:
        subject.plan(Star.from_degrees(95.99, -52.7, "Canopus"), start_at(subject, 0.0, 20.0), timing())
    assert refused.value.reachable is None


def blocked_by_the_sun():
    """A planner at noon, the Sun between the start and what stands in the west."""
    subject = planner(MountType.ALTAZ_FORK, 35.0, sun_deg=40.0, limits_deg=((0.0, 359.0), (0.0, 91.0)))
    noon = noon_of(subject)
    return subject, noon, start_at(subject, 110.0, 20.0, noon)


class Ending(FixedAltAz):
    """A place that nobody knows for more than twenty minutes after noon, as after the end of a table."""

    end: Instant

    def observed(self, frame):
        if frame.instant > self.end:
            raise TargetError(f"{self.name}: its table ends here")
        return super().observed(frame)


def test_a_blocked_way_to_what_nobody_knows_for_long_names_no_moment():
    subject, noon, start = blocked_by_the_sun()
    target = Ending(math.radians(250.0), math.radians(20.0), "west")
    object.__setattr__(target, "end", Instant.from_posix(noon + 1200.0))
    with pytest.raises(Unreachable, match=r"west: .*inside its zone of 40\.0°") as refused:
        subject.plan(target, start, timing())
    assert refused.value.reachable is None


def test_a_way_blocked_by_the_sun_says_when_it_is_free():
    """The Sun stands between; the target itself is allowed, now and later."""
    subject, noon, start = blocked_by_the_sun()
    target = FixedAltAz(math.radians(250.0), math.radians(20.0), "west")
    assert subject.allowed(target, noon)
    with pytest.raises(
        Unreachable, match=r"° from the Sun .* s after the start is .*° inside its zone of 40\.0°"
    ) as refused:
        subject.plan(target, start, timing())
    free = refused.value.reachable
    assert free is not None
    assert subject.straight(target, replace(start, time=free), timing())[0] is not None
    assert subject.straight(target, replace(start, time=free - 20.0), timing())[0] is None
    print(f"free {free - noon:.0f} s later")


def test_a_target_too_near_the_pole_of_axis_1_is_refused_or_met_but_never_missed():
    """A star passes 20″ from the zenith: for ten seconds no drive keeps up, and beyond it the azimuth is not free."""
    subject = planner(MountType.ALTAZ_FORK, 35.0, limits_deg=((0.0, 200.0), (0.0, 91.0)))
    how, start = timing(1.0), start_at(subject, 90.0, 60.0)
    frame = subject.sky.at(Instant.from_posix(start.time + 60.0))
    x, y, z = frame.astrometric((0.0001, 0.0, math.sqrt(1.0 - 1e-8)))
    star = Star.from_degrees(math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z)), "overhead")
    outcomes, worst = [], 0.0
    for late in range(41):
        plan, _ = subject.straight(star, replace(start, time=start.time + late), how)
        outcomes.append(plan is not None)
        if plan is not None:
            near = (plan.axes[0].angle, plan.axes[1].angle)
            (angle, rate), _ = subject.track(star, plan.arrival, plan.posture, near)
            assert abs(math.degrees(rate)) <= 1.0
            worst = max(worst, abs(plan.axes[0].target_counts - subject.axes[0].gearing.counts(angle)))
    print(f"{outcomes.count(False)} of {len(outcomes)} starts refused, worst met {worst:.3f} count")
    assert worst < 1.0
    assert outcomes[0]
    blocked = replace(start, time=start.time + outcomes.index(False))
    with pytest.raises(Unreachable, match=r"overhead: .*(the drive reaches 1\.000°/s|runs away|outside)") as refused:
        subject.plan(star, blocked, how)
    assert refused.value.reachable is not None


def test_a_drive_slower_than_the_sky_is_refused_with_both_speeds():
    subject = planner(MountType.EQUATORIAL_FORK, 35.0)
    target = Star.from_degrees(0.0, 35.0)
    time = next(t for t in np.arange(MIDNIGHT, MIDNIGHT + 86_400.0, 600.0) if altitude_deg(subject, target, t) > 60.0)
    with pytest.raises(Unreachable, match=r"axis1 tracks at 0\.0041\d°/s, the drive reaches 0\.003°/s"):
        subject.plan(target, start_at(subject, 0.0, 35.0, time), timing(0.003))


def test_fixed_places_are_reached_and_end_at_rest():
    for kind in MountType:
        subject = planner(kind, 35.0)
        plan = subject.plan(FixedAltAz(1.0, 0.8), start_at(subject, 30.0, 50.0), timing())
        assert plan.observed == pytest.approx(FixedAltAz(1.0, 0.8).observed(None), abs=1e-9)
        assert plan.axes[0].rate_counts == plan.axes[1].rate_counts == 0.0
        assert plan.eta == pytest.approx(0.05 + max(axis.travel.duration for axis in plan.axes))


def test_axes_can_be_sent_to_angles_and_refuse_those_outside():
    subject = planner(MountType.EQUATORIAL_FORK)
    start = start_at(subject, 30.0, -40.0)
    plan = subject.plan_axes("park", (0.0, math.radians(-42.4)), start, timing())
    assert [axis.target_counts for axis in plan.axes] == [0x800000, 0x800000]
    assert [axis.rate for axis in plan.axes] == [0.0, 0.0]
    with pytest.raises(Unreachable, match=r"park: axis1 at 171\.000° is 1\.000° outside -170\.00° to 170\.00°"):
        subject.plan_axes("park", (math.radians(171.0), -0.5), start, timing())
    with pytest.raises(Unreachable, match=r"park: altitude .* below the horizon limit"):
        subject.plan_axes("park", (math.radians(160.0), 0.3), start, timing())
    with pytest.raises(PointingError, match="nan"):
        subject.plan_axes("park", (math.nan, 0.0), start, timing())


@pytest.mark.parametrize("hour_angle_deg", [-10.0, 190.0])
def test_a_german_mount_may_stand_at_either_end_of_its_window(hour_angle_deg):
    subject = planner(MountType.GERMAN)
    subject = type(subject)(subject.sky, subject.mount, subject.axes, subject.limits, math.radians(10.0))
    plan = subject.plan_axes("park", (math.radians(hour_angle_deg), -1.2), start_at(subject, 90.0, -70.0), timing())
    assert math.degrees(plan.axes[0].angle) == pytest.approx(hour_angle_deg)


def test_a_telescope_below_the_horizon_may_only_be_led_out():
    subject = planner(MountType.ALTAZ_FORK, 35.0, horizon=Horizon.level(30.0))
    start = start_at(subject, 0.0, 10.0)
    out = subject.plan(FixedAltAz(0.5, math.radians(50.0)), start, timing())
    assert all(check.ok for check in out.checks)
    with pytest.raises(Unreachable, match=r"altitude 20\.00° at arrival is 10\.00° below"):
        subject.plan(FixedAltAz(0.0, math.radians(20.0)), start, timing())
    angles = [math.radians(angle) for angle in (0.0, 20.0)]
    assert all(check.ok for check in subject.plan_axes("jog", (angles[0], angles[1]), start, timing()).checks)
    with pytest.raises(Unreachable, match=r"altitude 5\.00° at arrival is 25\.00° below"):
        subject.plan_axes("jog", (0.0, math.radians(5.0)), start, timing())


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_no_number_is_refused_with_a_sentence(bad):
    subject = planner(MountType.GERMAN)
    star = Star.from_degrees(10.0, -30.0)
    with pytest.raises(PointingError, match="finite"):
        Start(MIDNIGHT, (bad, 0.0))
    with pytest.raises(PointingError, match="finite"):
        Start(MIDNIGHT, (0.0, 0.0), (0.0, bad))
    with pytest.raises(PointingError, match="finite number of POSIX seconds"):
        subject.plan(star, Start(bad, (8388608.0, 8388608.0)), timing())
    with pytest.raises(PointingError, match="finite"):
        Axis("axis1", gearing(0.0), -1.0, bad)
    with pytest.raises(TargetError):
        FixedAltAz(bad, 0.5)
    with pytest.raises(TargetError):
        Star.from_degrees(bad, 0.5)


@pytest.mark.parametrize("year", [1950, 1990, 2025, 2060, 2150])
def test_any_date_is_planned_and_none_is_an_exception(year):
    subject = planner(MountType.EQUATORIAL_FORK, 35.0)
    time = (year - 1970) * 365.2425 * 86_400.0
    planned = 0
    for ra in range(0, 360, 40):
        plan, _ = subject.straight(Star.from_degrees(ra, 20.0), start_at(subject, 0.0, 35.0, time), timing())
        planned += plan is not None
    assert planned >= 3


def test_standing_says_how_the_telescope_stands_to_each_limit():
    subject = planner(MountType.GERMAN, 35.0, sun_deg=20.0)
    names = [check.name for check in subject.standing((1.0, 0.5), MIDNIGHT)]
    assert names == ["axis1 soft limit", "axis2 soft limit", "hour-angle window", "horizon", "Sun"]
    down = subject.standing((math.pi, -1.0), MIDNIGHT)
    assert [check.ok for check in down][3] is False


def test_where_the_straight_way_is_barred_another_leads_round():
    """The Sun stands between two places of the same height; over the zenith, or axis by axis, there is a way."""
    subject = planner(MountType.ALTAZ_FORK, 35.0, sun_deg=30.0, limits_deg=((0.0, 359.0), (0.0, 91.0)))
    start, how = start_at(subject, 110.0, 20.0, noon_of(subject)), timing(second_speed_deg_s=1.0)
    target = FixedAltAz(math.radians(250.0), math.radians(70.0), "high in the west")
    straight, refused = subject.straight(target, start, how)
    assert straight is None
    assert "Sun" in {check.name for check in refused.checks if not check.ok}
    plan = subject.plan(target, start, how)
    assert plan.via is not None
    assert plan.start == start.time
    for leg in (plan.via, plan):
        assert all(check.ok for check in leg.checks)
    here = [axis.target_counts for axis in plan.via.axes]
    assert [axis.from_counts for axis in plan.axes] == here
    assert plan.arrival > plan.via.arrival


def test_fixed_angles_are_reached_round_what_bars_the_straight_way_and_by_no_way_round_a_limit():
    """Trees 60° high between two places: over them, then down; both ways looked at every tenth of a second."""
    degrees = ((0, 5), (39, 5), (40, 60), (60, 60), (61, 5))
    trees = Horizon(tuple((math.radians(azimuth), math.radians(altitude)) for azimuth, altitude in degrees))
    subject = planner(MountType.ALTAZ_FORK, horizon=trees)
    start, there = start_at(subject, 20.0, 70.0), (math.radians(90.0), math.radians(20.0))
    with pytest.raises(Unreachable, match="below the horizon limit"):
        subject.plan_axes("there", there, start, timing())
    plan = to_axes(subject, "there", there, start, timing())
    assert plan.start == start.time
    for leg in (plan.via, plan):
        one, two = (axis.travel for axis in leg.axes)
        for k in range(round(10.0 * max(one.duration, two.duration)) + 1):
            assert trees.margin(subject.observed((one.position(k / 10.0), two.position(k / 10.0)))) >= 0.0
    one, two = (axis.travel.position(axis.travel.duration) for axis in plan.axes)
    assert subject.angles((one, two)) == pytest.approx(there, abs=1e-5)
    for degrees, why in (((60.0, 95.0), "axis2"), ((50.0, 20.0), "below the horizon limit")):
        with pytest.raises(Unreachable, match=why):
            to_axes(subject, "there", (math.radians(degrees[0]), math.radians(degrees[1])), start, timing())
