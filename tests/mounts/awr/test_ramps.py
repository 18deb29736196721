"""How far a timed press moves an axis: closed forms against a speed that is followed moment by moment."""

import random

import pytest

from mounts.awr.ramps import Key

TICK = 1e-4
KEYS = [Key(15_000.0, 16_000.0), Key(-15_240.0, 16_000.0), Key(36.0, 20_000.0), Key(-240.0, 500.0)]


def stepped(key: Key, hold: float) -> tuple[float, float, list[float]]:
    """Way, duration and the way after each tick, of a speed that follows its command tick by tick."""
    rate = way = 0.0
    course, ticks = [0.0], 0
    while ticks * TICK < hold or rate:
        wanted, most = (key.rate if (ticks + 0.5) * TICK < hold else 0.0), key.acceleration * TICK
        after = rate + min(max(wanted - rate, -most), most)
        way += (rate + after) / 2.0 * TICK
        course.append(way)
        rate, ticks = after, ticks + 1
    return way, ticks * TICK, course


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("hold", [0.012, 0.1, 0.47, 0.9, 1.7])
def test_the_way_and_the_duration_of_a_press_are_those_of_its_ramps(key, hold):
    way, duration, course = stepped(key, hold)
    assert key.way(hold) == pytest.approx(way, abs=2.0 * abs(key.rate) * TICK)
    assert key.duration(hold) == pytest.approx(duration, abs=3.0 * TICK)
    for elapsed in (0.3 * duration, 0.7 * duration, duration):
        assert key.made(hold, elapsed) == pytest.approx(course[int(elapsed / TICK)], abs=3.0 * abs(key.rate) * TICK)
    assert key.made(hold, duration + 5.0) == pytest.approx(key.way(hold))
    assert key.made(hold, -1.0) == 0.0


def test_way_and_duration_tell_the_hold_to_a_nanosecond():
    rng, worst = random.Random(1), 0.0  # noqa: S311
    for _ in range(2000):
        key = Key(rng.choice((-1, 1)) * 10.0 ** rng.uniform(1, 5), 10.0 ** rng.uniform(2, 5))
        hold = 10.0 ** rng.uniform(-2, 2)
        worst = max(worst, abs(key.hold(key.way(hold)) - hold), abs(key.held(key.duration(hold)) - hold))
    print(f"2000 presses: {worst:.1e} s")
    assert worst < 1e-9


def test_no_press_leads_the_other_way():
    assert Key(36.0, 2e4).hold(-5.0) == 0.0
    assert Key(-36.0, 2e4).hold(5.0) == 0.0
    assert Key(-36.0, 2e4).hold(0.0) == 0.0


@pytest.mark.parametrize("hold", [0.2, 3.0])
def test_a_longer_hold_makes_the_way_longer_as_its_derivative_says(hold):
    key = Key(-15_240.0, 16_000.0)
    grown = (key.way(hold + 1e-6) - key.way(hold - 1e-6)) / 2e-6
    assert key.way_per_hold(hold) == pytest.approx(abs(grown), rel=1e-5)
