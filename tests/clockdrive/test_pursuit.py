"""A pursuit foresees from anywhere on its way, on a bridge too, what the plan of its pass foresaw."""

import math

import pytest
from orbit import Overhead
from planning_bench import COUNTS_PER_DEGREE, MIDNIGHT, planner

from clockdrive.pursuit import Pursuit
from pointing.mount import MountType
from pointing.pass_plan import pass_plan
from pointing.plan import Leading
from pointing.profile import Ramps

AXIS = Ramps(4.0 * COUNTS_PER_DEGREE, 0.9 * COUNTS_PER_DEGREE)
LEADING = Leading((AXIS, AXIS), 0.5)


def test_the_next_limit_of_a_pass_is_the_same_before_on_and_after_a_bridge():
    geometry = planner(MountType.ALTAZ_FORK)
    target = Overhead(MIDNIGHT + 400.0, 1.1, math.radians(0.05))
    up = next(MIDNIGHT + k for k in range(400) if geometry.allowed(target, MIDNIGHT + k))
    found = pass_plan(geometry, target, up, LEADING)
    ((begin, end),) = found.lost
    pursuit = Pursuit(geometry, target, found.posture, found.wait, LEADING, found.trajectory)
    for time in (begin - 60.0, (begin + end) / 2.0, end + 60.0):
        moment, check = pursuit.next_limit(time)
        print(f"{time - begin:+.0f} s: {moment - found.ends:+.3f} s from the plan's end")
        assert moment == pytest.approx(found.ends, abs=0.02)
        assert check.name == found.limit.name
