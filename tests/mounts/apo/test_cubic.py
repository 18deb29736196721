import math
import random

import pytest
from apo_slews import between

from mounts.apo.cubic import Cubic


def random_segments(seed, count):
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    for _ in range(count):
        begin, end = ((rng.uniform(-180.0, 360.0), rng.uniform(-2.0, 2.0)) for _ in range(2))
        duration = rng.choice([0.02, 1.0, 5.0, 60.0])
        if duration < 60.0:
            end = begin[0] + (begin[1] + end[1]) / 2.0 * duration * rng.uniform(0.8, 1.2), end[1]
        yield begin, end, duration


def test_a_segment_is_the_curve_of_its_control_points():
    """To the last digits of positions, which a velocity has divided by the duration."""
    digit, worst = math.ulp(360.0), [0.0, 0.0]
    for begin, end, duration in random_segments(1, 200):
        segment = Cubic.between(begin, end, duration)
        for k in range(11):
            told = between((0.0, *begin), (duration, *end), duration * k / 10.0)
            off = [abs(a - b) / digit for a, b in zip(segment.at(duration * k / 10.0), told, strict=True)]
            worst = max(worst[0], off[0]), max(worst[1], off[1] * duration)
    print(f"de Casteljau within {worst[0]:.1f} last digits in place, {worst[1]:.1f} over the time in velocity")
    assert worst[0] <= 8.0
    assert worst[1] <= 16.0


def test_a_segment_of_uniform_motion_has_no_acceleration():
    segment = Cubic.between((10.0, 0.5), (12.0, 0.5), 4.0)
    assert (segment.acceleration, segment.jerk) == (0.0, 0.0)
    assert segment.extremes == (10.0, 12.0, 0.5, 0.0, 0.0)


def test_the_manuals_formulae_for_acceleration_and_jerk_hold():
    segment = Cubic.between((0.0, 0.0), (1.0, 0.0), 2.0)  # v̄ = 0.5: a = (2/2)(1.5), j = (6/4)(−1)
    assert (segment.acceleration, segment.jerk) == (1.5, -1.5)
    assert segment.at(1.0) == (0.5, 0.75)


def test_extremes_are_never_passed_and_always_reached():
    for begin, end, duration in random_segments(2, 100):
        segment = Cubic.between(begin, end, duration)
        sampled = [segment.at(duration * k / 2000.0) for k in range(2001)]
        places, speeds = [x for x, _ in sampled], [abs(v) for _, v in sampled]
        step = segment.extremes.acceleration * (duration / 2000.0) ** 2 + 1e-9
        assert segment.extremes.lowest == pytest.approx(min(places), abs=step)
        assert segment.extremes.highest == pytest.approx(max(places), abs=step)
        assert min(places) >= segment.extremes.lowest - 1e-12
        assert max(places) <= segment.extremes.highest + 1e-12
        assert segment.extremes.speed == pytest.approx(
            max(speeds), abs=segment.extremes.jerk * (duration / 2000.0) ** 2 + 1e-9
        )
        assert max(speeds) <= segment.extremes.speed + 1e-12


def test_a_turn_between_the_ends_is_found():
    segment = Cubic.between((0.0, 1.0), (0.0, -1.0), 4.0)
    assert segment.extremes.highest == 1.0
    assert segment.extremes.lowest == 0.0
    overshoot = Cubic.between((0.0, 0.0), (0.0, 0.3), 3.0)  # (u³ − u²)·0.9: lowest at two thirds
    assert overshoot.extremes.lowest == pytest.approx(-0.9 * 4.0 / 27.0, abs=1e-15)
