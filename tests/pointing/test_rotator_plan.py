"""Which way a rotator goes, and when it holds the field; the law of motion is a constant speed, written here."""

import math
from dataclasses import dataclass, replace

import pytest
from rotator_bench import ERRORS, TIME, TURN, star_at, subject

from pointing.errors import PointingError, Unreachable
from pointing.limits import Check
from pointing.plan import AxisPlan, Plan, Start, Timing
from pointing.rotator import Held, Hold, Rotator
from pointing.rotator_plan import rotator_path, turned_to, with_rotator


@dataclass(frozen=True)
class Straight:
    """A way at constant speed."""

    start: float
    landed: float
    speed: float

    @property
    def duration(self):
        return abs(self.landed - self.start) / self.speed

    def position(self, elapsed):
        if elapsed >= self.duration:
            return self.landed
        return self.start + math.copysign(self.speed * elapsed, self.landed - self.start)


@dataclass(frozen=True)
class ConstantSpeed:
    """An axis that is at its speed at once."""

    max_rate: float = 2.0

    def travel(self, start, end, _start_rate, _end_rate):
        return Straight(start, end, self.max_rate)

    def limited(self, max_rate):
        return ConstantSpeed(max_rate)


LAW = ConstantSpeed()
TIMING = Timing((LAW, LAW), latency=1.0, rotator=LAW)


def a_plan(star, arrival):
    """A plan of the axes that arrive then."""
    travel = Straight(0.0, 10.0, 1.0)
    axes = AxisPlan("axis1", 0.0, 0.0, 0.0, 10.0, 0.0, travel), AxisPlan("axis2", 0.0, 0.0, 0.0, 10.0, 0.0, travel)
    return Plan(star.name, TIME, arrival, "normal", (0.0, 0.0, 1.0), axes, (Check("horizon", ok=True, detail=""),))


def planned(hold, here_deg=0.0, low_deg=-180.0, high_deg=180.0, azimuth=160.0, altitude=70.0, timing=TIMING):
    geometry = subject(terms=ERRORS)
    star = star_at(geometry, azimuth, altitude)
    axis = replace(TURN, minimum=math.radians(low_deg), maximum=math.radians(high_deg))
    geometry.rotator = Rotator(axis, Hold("mount"), park=math.radians(low_deg + 5.0))
    start = Start(TIME, (0.0, 0.0), rotator=(here_deg, 0.0))
    plan = with_rotator(geometry, a_plan(star, TIME + 11.0), star, start, timing, hold)
    return geometry, star, start, plan


@pytest.mark.parametrize("here_deg", [-170.0, 0.0, 75.0, 170.0])
def test_the_rotator_meets_the_angle_that_is_right_when_the_axes_arrive_or_it_does(here_deg):
    geometry, star, _, plan = planned(Hold("sky", 1.0), here_deg)
    turns = plan.rotator
    alone = TIME + 1.0 + abs(turns.axis.target_counts - here_deg) / 2.0
    assert turns.arrival == pytest.approx(max(alone, plan.arrival), abs=1e-9)
    right, rate = Held(geometry, star, "normal", Hold("sky", 1.0)).state(turns.arrival, turns.axis.angle)
    assert turns.axis.target_counts == pytest.approx(math.degrees(right), abs=2e-9)
    assert turns.axis.rate == pytest.approx(rate, rel=1e-9)
    path = rotator_path(geometry, plan, star)
    assert path.at(turns.arrival) == pytest.approx((turns.axis.target_counts, turns.axis.rate_counts), abs=2e-9)


def test_the_winding_that_holds_the_target_for_longest_is_taken_though_it_is_farther():
    """Two windings stand within the travel; the nearer one has 5° left, which the field turns through in minutes."""
    geometry = subject(terms=ERRORS)
    star = star_at(geometry, 160.0, 70.0)
    angle, rate = map(math.degrees, Held(geometry, star, "normal", Hold("sky")).state(TIME + 11.0, 0.0))
    assert rate < 0.0
    low = angle - 5.0  # the nearer winding is at `angle`, the other a turn above
    _, _, _, plan = planned(Hold("sky"), here_deg=angle - 3.0, low_deg=low, high_deg=low + 400.0)
    assert plan.rotator.axis.target_counts == pytest.approx(angle + 360.0, abs=3.0)  # it is there in 3 minutes
    assert plan.rotator.limit is None
    _, _, _, only = planned(Hold("sky"), here_deg=angle - 3.0, low_deg=low, high_deg=low + 300.0)
    assert only.rotator.axis.target_counts == pytest.approx(angle, abs=1.0)
    moment, check = only.rotator.limit
    assert TIME + 60.0 < moment < TIME + 5.0 / abs(rate)  # it turns faster and faster towards the meridian
    assert check.name == "rotator soft limit"


def test_of_windings_that_hold_the_target_equally_long_the_nearest_is_taken():
    for here in (-300.0, 0.0, 300.0):
        _, _, _, plan = planned(Hold("horizon", 0.0), here, low_deg=-500.0, high_deg=500.0)
        assert abs(plan.rotator.axis.target_counts - here) <= 180.0


def test_an_angle_outside_the_travel_is_refused_with_value_bound_and_remedy():
    with pytest.raises(Unreachable) as refused:
        planned(Hold("mount", math.radians(150.0)), low_deg=-90.0, high_deg=90.0)
    said = str(refused.value)
    assert (
        "rotator, to hold 150° on the mount, at 150.000° is 60.000° outside its travel, allowed -90.00° to 90.00°"
        in said
    )
    assert "hold another angle" in said
    assert refused.value.checks[-1].name == "rotator soft limit"


def test_a_field_that_turns_faster_than_the_rotator_is_refused():
    for speed in (0.02, 0.0001):
        timing = Timing((LAW, LAW), latency=1.0, rotator=ConstantSpeed(speed))
        with pytest.raises(
            Unreachable, match=rf"the field turns at -0\.\d+°/s, nearly as fast .*, {speed:.3f}°/s: no"
        ):
            planned(Hold("sky"), -160.0, azimuth=179.0, altitude=84.0, timing=timing)


def test_parking_takes_the_rotator_to_its_own_place_and_mounts_without_one_plan_as_ever():
    geometry, star, start, plan = planned(Hold("mount", 0.5))
    there = turned_to(geometry, plan, geometry.rotator.park, start, TIMING).rotator
    assert there.axis.target_counts == pytest.approx(-175.0)
    assert there.arrival == pytest.approx(TIME + 1.0 + 175.0 / 2.0)
    assert there.axis.rate_counts == 0.0
    bare = subject()
    plain = a_plan(star, TIME + 11.0)
    assert with_rotator(bare, plain, star, start, TIMING) is plain
    assert rotator_path(bare, plain, star) is None


def test_a_rotator_of_which_nobody_says_where_it_is_is_not_guessed_at():
    geometry, star, _, plan = planned(Hold("mount", 0.5))
    with pytest.raises(PointingError, match="a rotator whose position or law of motion nobody knows"):
        with_rotator(geometry, plan, star, Start(TIME, (0.0, 0.0)), TIMING)
