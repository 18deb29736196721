"""Gotos out of timed presses, against a telescope whose speeds are followed and whose commands come late or early."""

import itertools
import math
import os
import random
import statistics

import pytest
from awr_presses import SIDEREAL, Goto, TrueUnit, ladder, random_ways, went

from mounts.awr.cascade import Cascade, Errors, Press, Stage, side_by_side
from mounts.awr.errors import AwrError
from mounts.awr.ladder import Ladder, Rung
from mounts.awr.ramps import Key
from mounts.awr.uncertainty import TWO_SIDED_95, Jitter

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
GOTOS = 1000 if FULL else 400  # fewer say little of a share of 95 %
CASES, SEEDS = (100, 60) if FULL else (4, 10)
TIGHT, LOOSE = Jitter(5e-3, 1e-4), Jitter(5e-3, 5e-3)


def planner(of: Ladder, drifts: tuple[float, float] = (0.0, 0.0)):
    """What `Cascade` says is next."""
    cascade = Cascade(of)
    return lambda left, speed: cascade.next(Errors(left, drifts), speed)


def gotos(of: Ladder, seed: int, many: int = GOTOS) -> list[Goto]:
    """So many random gotos, each with jitter of its own."""
    rng, plan = random.Random(seed), planner(of)  # noqa: S311
    return [went(of, plan, TrueUnit(of.jitter, 10_000 * seed + i), random_ways(rng)) for i in range(many)]


def quantile_95(values: list[float]) -> float:
    return sorted(values)[math.ceil(0.95 * len(values)) - 1]


def covered(done: list[Goto]) -> float:
    """How often the stated 95 % interval of an axis holds what is true."""
    inside = [
        abs(goto.true[axis] - goto.left[axis]) <= TWO_SIDED_95 * goto.sigmas[axis]
        for goto in done
        for axis in range(2)
    ]
    return statistics.fmean(inside)


@pytest.mark.campaign
@pytest.mark.parametrize("slew", [120.0, 480.0])
def test_random_gotos_end_within_two_guide_steps_and_within_what_is_stated(slew):
    fastest = ladder(slew, TIGHT)
    careful = fastest.slewing_at(fastest.careful_rates)
    done = gotos(careful, seed=int(slew))
    error, share = quantile_95([goto.worst(careful.guide_steps) for goto in done]), covered(done)
    print(
        f"{len(done)} gotos, slew of {slew:.0f}x held to {careful.slew_rates[1] / SIDEREAL:.0f}x: 95 % within "
        f"{error:.2f} guide steps, stated interval holds {100 * share:.1f} %, "
        f"{statistics.fmean(len(goto.stages) for goto in done):.2f} stages"
    )
    assert error <= 2.0
    assert 0.93 <= share <= 0.97


@pytest.mark.campaign
def test_with_events_as_uncertain_as_presses_the_slew_decides_and_the_interval_says_so():
    fastest = ladder(480.0, LOOSE)
    assert fastest.careful_rates == fastest.slew_rates  # a slower one could not be slow enough
    done = gotos(fastest, seed=77)
    rate = max(fast / step for fast, step in zip(fastest.slew_rates, fastest.guide_steps, strict=True))
    bound = max(2.0, 2.0 * math.sqrt(2.0) * rate * 5e-3)
    error, share = quantile_95([goto.worst(fastest.guide_steps) for goto in done]), covered(done)
    print(
        f"{len(done)} gotos: 95 % within {error:.0f} guide steps of {bound:.0f}, interval holds {100 * share:.1f} %"
    )
    assert error <= bound
    assert 0.93 <= share <= 0.97


# Against every other order ----------------------------------------------------------------------------------------


def fixed_order(of: Ladder, order: tuple[int, ...], shares: tuple[float, ...]):
    """A plan that goes down some of the speeds, each pressed for a share of what the error takes, then the last one.

    It stops by the same rule, and leaves an axis alone whose press would be too short.
    """
    begun = 0
    cascade = Cascade(of)

    def plan(left: tuple[float, float], _speed):
        nonlocal begun
        if cascade.reached(left):
            return None
        presses: list[Press | None] = [None, None]
        while not any(presses):
            last = begun >= len(order) - 1
            rung = of.rungs[order[min(begun, len(order) - 1)]]
            share = shares[min(begun, len(order) - 1)]
            holds = [0.0, 0.0]
            for axis in range(2):
                way = left[axis] * share
                key = rung.key(axis, way)
                hold = key.hold(way)
                if hold >= of.shortest_s or (last and abs(left[axis]) > of.guide_steps[axis]):
                    holds[axis] = max(hold, of.shortest_s)
            presses = [
                Press(rung.key(axis, left[axis]), holds[axis]) if holds[axis] else None for axis in range(2)
            ]  # fmt: skip
            begun += 1
        apart = side_by_side((presses[0], presses[1]), of.exchange_s)
        return Stage(rung.speed, apart, left, 0.0, (0.0, 0.0), (0.0, 0.0))

    return plan


ORDERS = [
    order for many in range(1, 5) for order in itertools.combinations((3, 2, 1, 0), many) if order[-1] in (0, 1)
]
SHARES = (0.94, 0.98, 1.0, 1.02)


def mean_seconds(of: Ladder, plan_of, ways: tuple[float, float], seed: int, most: float = math.inf) -> float:
    """Mean seconds to the target, over many seeds; given up where a few show that it takes far longer than `most`."""
    times = []
    for i in range(SEEDS):
        times.append(went(of, plan_of(), TrueUnit(of.jitter, 1000 * seed + i), ways).seconds)
        if i == 4 and statistics.fmean(times) > 1.5 * most:
            break
    return statistics.fmean(times)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("jitter", [TIGHT, LOOSE], ids=["events to 0.1 ms", "events to 5 ms"])
def test_no_fixed_order_of_speeds_and_press_times_is_a_tenth_faster(jitter):
    of = ladder(480.0, jitter)
    of = of.slewing_at(of.careful_rates)
    rng, ratios, ours, best = random.Random(3), [], 0.0, 0.0  # noqa: S311
    for case in range(CASES):
        ways = random_ways(rng, least_deg=0.003)
        own = mean_seconds(of, lambda: planner(of), ways, case)
        others = min(
            mean_seconds(of, lambda order=order, shares=shares: fixed_order(of, order, shares), ways, case, own)
            for order in ORDERS
            for shares in itertools.product(*[SHARES] * (len(order) - 1), (1.0,))
        )
        ratios.append(own / others)
        ours, best = ours + own, best + others
    print(
        f"{CASES} cases, {SEEDS} seeds each: mean time {ours / best:.3f} of the best fixed order's, a case "
        f"{statistics.median(ratios):.3f} in the median and {max(ratios):.3f} at worst"
    )
    assert ours <= 1.1 * best
    assert statistics.median(ratios) <= 1.1


# One stage --------------------------------------------------------------------------------------------------------


def test_a_drifting_target_is_met_as_a_still_one_is():
    of = ladder(120.0, TIGHT)
    rng, drifts = random.Random(5), (20.0, -12.0)  # noqa: S311 - a guide key makes 36 steps a second
    done = [went(of, planner(of, drifts), TrueUnit(TIGHT, i), random_ways(rng), drifts) for i in range(60)]
    still = [goto for goto in done if goto.worst(of.guide_steps) <= 2.0]
    print(f"{len(still)} of {len(done)} within two guide steps, in {statistics.fmean(g.seconds for g in done):.1f} s")
    assert len(still) >= 0.95 * len(done)


def test_a_target_that_no_key_overtakes_is_refused_with_its_speed():
    of = ladder(120.0, TIGHT)
    with pytest.raises(AwrError, match=r"target that goes 20000.0 and 0.0 steps/s faster than the drives"):
        Cascade(of).next(Errors((500.0, 0.0), (20_000.0, 0.0)))


def test_nothing_is_pressed_within_a_guide_step():
    of = ladder()
    one, two = of.guide_steps
    assert Cascade(of).next(Errors((0.99 * one, -0.99 * two))) is None
    assert Cascade(of).next(Errors((0.99 * one, -1.01 * two))) is not None


def test_what_a_stage_expects_is_what_comes_on_the_average():
    of = ladder(120.0, TIGHT)
    rng, plan, off = random.Random(9), planner(of), []  # noqa: S311
    for i in range(300):
        goto = went(of, plan, TrueUnit(TIGHT, i), random_ways(rng))
        off.append(goto.seconds - goto.stages[0].expected_s)
    print(f"seconds expected: off by {statistics.fmean(off):+.3f} on the average of 300 gotos")
    assert abs(statistics.fmean(off)) < 0.05


def test_nothing_of_one_axis_comes_closer_to_anything_of_the_other_than_the_line_carries_it():
    rng, apart, later = random.Random(2), 0.05, []  # noqa: S311
    for _ in range(5_000):
        one, two = (Press(Key(rng.choice((40.0, -6000.0)), 2e4), 0.1 * 10.0 ** rng.uniform(0.0, 2.0)) for _ in "12")
        assert side_by_side((one, None), apart) == (one, None)
        found = side_by_side((one, two), apart)
        assert all(press and press.begin >= 0.0 for press in found)
        assert min(press.begin for press in found if press) == 0.0
        ours, others = ((press.begin, press.release, press.end) for press in found if press)
        assert all(abs(mine - other) >= 0.998 * apart for mine in ours for other in others)
        if one.hold < one.key.climb_s and two.hold < two.key.climb_s:  # twice the jitter moves both ends
            assert abs(ours[2] - others[2]) >= 1.69 * apart
        alone = max(one.duration, two.duration)
        assert max(*ours, *others) <= one.duration + two.duration + 1.36 * apart
        later.append(max(*ours, *others) - alone)
    print(f"{statistics.fmean(later) * 1e3:.0f} ms longer than the longer one, {max(later) * 1e3:.0f} at most")
    assert statistics.fmean(later) <= apart


def test_a_motor_goes_farther_by_the_play_that_it_takes_up_first():
    of, ways = ladder(), Errors((0.0, -9000.0))
    for slack, way in (((500.0, 0.0), -9000.0), ((0.0, 500.0), -9500.0), ((0.0, -200.0), -8800.0)):
        stage = Cascade(of).next(ways._replace(slacks=((0.0, 0.0), slack)))
        assert stage is not None
        assert stage.presses[0] is None
        press = stage.presses[1]
        assert press is not None
        assert press.made(press.duration) == pytest.approx(way)
        assert press.measured(TIGHT, press.duration).steps == pytest.approx(way)


# What is known of a press -----------------------------------------------------------------------------------------


def test_plan_and_events_are_weighted_by_what_they_are_worth():
    key = Key(10_000.0, 20_000.0)
    for jitter, share in ((TIGHT, 1.0), (LOOSE, 0.5), (Jitter(5e-3, 1.0), 0.0)):
        way = jitter.measured(key, 2.0, key.duration(2.0) + 0.004)
        assert way.steps - key.way(2.0) == pytest.approx(share * 40.0, abs=0.05)
    assert Jitter(5e-3, 5e-3).measured(key, 2.0, key.duration(2.0)).sigma == pytest.approx(50.0)
    assert Jitter(5e-3, 1e-4).planned(key, 2.0).sigma == pytest.approx(10_000.0 * math.sqrt(2.0) * 5e-3)


def test_a_host_that_was_held_up_is_believed_its_events():
    key = Key(10_000.0, 20_000.0)
    way = LOOSE.measured(key, 2.0, key.duration(2.0) + 0.3)
    assert way.steps == pytest.approx(key.way(2.3))
    assert way.sigma == pytest.approx(10_000.0 * math.sqrt(2.0) * 5e-3)


def test_a_perfect_clock_leaves_nothing_unknown():
    key = Key(-10_000.0, 20_000.0)
    assert Jitter(0.0, 0.0).measured(key, 2.0, key.duration(2.0)) == (pytest.approx(-20_000.0), 0.0)


# The speeds -------------------------------------------------------------------------------------------------------


def test_a_slew_is_as_fast_as_its_jitter_allows_and_not_slower_than_is_worth_it():
    for stamp, times in ((1e-4, 127.0), (1e-5, 480.0), (5e-4, 480.0)):
        rates = ladder(480.0, Jitter(5e-3, stamp)).careful_rates
        assert rates[1] / SIDEREAL == pytest.approx(times, rel=0.01)


def test_a_slower_slew_leaves_out_the_speeds_that_are_faster_than_it():
    of = ladder(480.0)
    assert [rung.speed for rung in of.slewing_at((20_000.0, 20_000.0)).rungs] == ["guide", "centre", "move", "slew"]
    slow = of.slewing_at((2_000.0, 2_000.0))
    assert [rung.speed for rung in slow.rungs] == ["guide", "centre", "slew"]
    assert slow.slew_rates == (2_000.0, 2_000.0)


def test_a_unit_whose_guide_keys_move_nothing_is_refused():
    guide = Rung.of("guide", ((SIDEREAL, SIDEREAL), (36.0, -36.0)), (SIDEREAL, 0.0), (2e4, 2e4))
    with pytest.raises(AwrError, match="no key moves the axes at GUIDE speed"):
        Ladder((guide,))


def test_a_guide_key_that_is_no_slower_than_the_drive_moves_nothing_back():
    of = ladder(drives=(0.5 * SIDEREAL, 0.0))  # the slower guide rate, 0.7, is faster than this drive
    assert of.rungs[0].keys[0][1] is None
    stage = Cascade(of).next(Errors((-50.0, 0.0)))
    assert stage is not None
    assert stage.speed != "guide"
