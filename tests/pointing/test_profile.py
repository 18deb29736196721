"""Motions that join a moving place: against an integration step by step, and against ruckig for the time."""

import math
import random

import pytest
from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory

from pointing.profile import Ramps

A, V = 4000.0, 16000.0


def cases(n, seed=1):
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    for _ in range(n):
        yield (
            rng.uniform(-1e5, 1e5) * rng.choice((1.0, 1e-3, 0.0)),
            rng.uniform(-V, V) * rng.choice((1.0, 0.0)),
            rng.uniform(-1e5, 1e5) * rng.choice((1.0, 1e-3)),
            rng.uniform(-0.9 * V, 0.9 * V) * rng.choice((1.0, 1e-3, 0.0)),
        )


def test_it_ends_on_the_place_with_its_velocity_and_keeps_to_speed_and_acceleration():
    for start, start_rate, place, rate in cases(300):
        motion = Ramps(V, A).meet(start, start_rate, place, rate)
        T = motion.duration
        position, speed, n = start, start_rate, 2000
        for k in range(n):  # the velocity stated is the derivative of the position stated, and never jumps
            middle = motion.at(T * (k + 0.5) / n)[1]
            assert abs(middle - speed) <= A * T / n * 1.001 + 1e-6
            assert abs(middle) <= V * (1.0 + 1e-9)
            position += middle * T / n
            speed = middle
        worst = 3 * A * (T / n) ** 2 + 1e-6
        assert position == pytest.approx(place + rate * T, abs=worst)
        assert motion.at(T) == pytest.approx((place + rate * T, rate))
        before = motion.at(T * (1.0 - 1e-9))
        assert before == pytest.approx((place + rate * T, rate), abs=1e-6 + V * T * 1e-9)


def quickest(distance, relative, low, high):
    """Seconds to rest at a distance, by ruckig, in the frame that moves with the place; None where it fails."""
    asked = InputParameter(1)
    asked.current_position, asked.current_velocity = [0.0], [relative]
    asked.target_position, asked.target_velocity = [distance], [0.0]
    asked.max_velocity, asked.min_velocity = [high], [low]
    asked.max_acceleration, asked.max_jerk = [A], [math.inf]
    found = Trajectory(1)
    try:
        assert Ruckig(1).calculate(asked, found) in {Result.Working, Result.Finished}
    except RuckigError:
        return None
    return found.duration


def test_no_motion_is_quicker():
    worst, failed = 0.0, 0
    for start, start_rate, place, rate in cases(2000, seed=2):
        motion = Ramps(V, A).meet(start, start_rate, place, rate)
        found = quickest(place - start, start_rate - rate, -V - rate, V - rate)
        failed += found is None
        worst = max(worst, abs(motion.duration - (found or motion.duration)))
    print(f"quickest motion: within {worst * 1e6:.3f} µs of ruckig's, which failed {failed} times of 2000")
    assert worst < 1e-6
    assert failed < 40


def test_the_extremes_are_those_of_the_way():
    for start, start_rate, place, rate in cases(500, seed=3):
        motion = Ramps(V, A).meet(start, start_rate, place, rate)
        seen = [motion.position(motion.duration * k / 2000) for k in range(2001)]
        low, high = motion.extremes
        step = A * (motion.duration / 2000) ** 2 + 1e-6
        assert low <= min(seen) + 1e-6
        assert high >= max(seen) - 1e-6
        assert low == pytest.approx(min(seen), abs=step)
        assert high == pytest.approx(max(seen), abs=step)


@pytest.mark.parametrize("rate", [V, -V, 1.5 * V])
def test_a_place_as_fast_as_the_axis_is_not_met(rate):
    assert Ramps(V, A).meet(0.0, 0.0, 0.0, rate) is None


def test_one_that_is_there_already_is_met_at_once():
    motion = Ramps(V, A).meet(5.0, 100.0, 5.0, 100.0)
    assert (motion.duration, motion.landed) == (0.0, 5.0)
