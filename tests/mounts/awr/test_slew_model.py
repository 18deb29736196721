"""How long a goto takes as the planner is told, against gotos that are carried out."""

import itertools
import math
import random
import statistics

import pytest
from awr_presses import ACCELERATIONS, SIDEREAL, TrueUnit, ladder, random_ways, went

from mounts.awr.cascade import Cascade, Errors
from mounts.awr.slew_model import AwrSlewModel
from mounts.awr.uncertainty import Jitter


def models(of):
    return AwrSlewModel(of, 0), AwrSlewModel(of, 1)


@pytest.mark.parametrize(("slew", "stamp_s"), [(120.0, 1e-4), (480.0, 5e-3)])
def test_the_estimate_is_exceeded_in_fewer_than_one_of_a_hundred_gotos_and_hardly_longer(slew, stamp_s):
    of = ladder(slew, Jitter(5e-3, stamp_s))
    cascade, both = Cascade(of), models(of)
    rng, late, ratio = random.Random(4), 0, []  # noqa: S311
    for i in range(200):
        ways = random_ways(rng)
        goto = went(
            of, lambda left, speed: cascade.next(Errors(left), speed), TrueUnit(of.jitter, 50_000 + i), ways
        )  # fmt: skip
        told = max(model.onto(0.0, 0.0, way, 0.0).duration for model, way in zip(both, ways, strict=True))
        late += goto.seconds > told
        ratio.append(told - goto.seconds)
    print(f"{late} of 200 later than told; told {statistics.fmean(ratio):.2f} s more on the average")
    assert late < 2
    assert statistics.fmean(ratio) < 1.5


def test_the_duration_grows_with_the_way_without_a_jump():
    model = models(ladder())[0]
    ways = [10.0 ** (exponent / 200.0) for exponent in range(-400, 1400)]
    durations = [model.onto(0.0, 0.0, way, 0.0).duration for way in ways]
    for (near, far), (less, more) in zip(itertools.pairwise(ways), itertools.pairwise(durations), strict=True):
        ramps = 2.0 * (math.sqrt(far) - math.sqrt(near)) / math.sqrt(ACCELERATIONS[0])
        assert 0.0 <= more - less <= (far - near) / (0.3 * SIDEREAL) + ramps + 1e-9


def test_it_lands_on_a_line_and_at_a_place():
    rng = random.Random(8)  # noqa: S311
    for _ in range(300):
        model = models(ladder())[rng.randrange(2)]
        start, end, rate = rng.uniform(-1e6, 1e6), rng.uniform(-1e6, 1e6), rng.uniform(-2.0, 2.0) * SIDEREAL
        there, onto = model.travel(start, end, 0.0, rate), model.onto(start, 0.0, end, rate)
        assert there.landed == pytest.approx(end, abs=1e-3)
        assert there.position(there.duration) == pytest.approx(there.landed, abs=1e-6)
        assert there.position(1e9) == pytest.approx(there.landed, abs=1e-6)
        assert onto.landed == pytest.approx(end + rate * onto.duration)
        course = [there.position(there.duration * i / 50.0) for i in range(51)]
        low, high = min(start, end), max(start, end)
        reach = abs(rate) * there.duration
        assert all(low - reach - 1.0 <= each <= high + reach + 1.0 for each in course)


def test_a_target_faster_than_every_key_is_answered_with_a_time_that_no_plan_takes():
    model = models(ladder())[0]
    travel = model.travel(0.0, 1e5, 0.0, 10.0 * model.max_rate)
    assert travel.duration > 1e5 or math.isclose(travel.landed, 1e5, abs_tol=1.0)


def test_a_slower_slew_takes_longer_and_keeps_its_bound():
    model = models(ladder(480.0))[1]
    slow = model.limited(10_000.0)
    assert slow.max_rate == 10_000.0
    assert slow.onto(0.0, 0.0, 1e6, 0.0).duration == pytest.approx(100.0, abs=3.0)
    assert model.limited(1e9).max_rate == model.max_rate
