import math
import os
from itertools import pairwise
from time import perf_counter

import pytest
from apo_slews import AXES, Slew, as_printed, bent, between, largest, random_slews
from seven_phase import least_s

from mounts.apo.errors import ApoError
from mounts.apo.rendezvous import LONGEST_S, meeting, soonest
from mounts.apo.slew_model import ApoSlewModel
from mounts.apo.slew_profile import SHORTEST_S

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
CASES = 1000
AZIMUTH = ApoSlewModel(1.75, 0.1, 0.5)


def uniform(position, rate):
    return lambda elapsed: (position + rate * elapsed, rate)


def seen_from(slew, position, rate):
    """Least seconds onto a line, told beside it, where it stands still."""
    speed, acceleration, jerk = slew.planned
    speeds = -speed - rate, speed - rate
    return least_s(position - slew.start, slew.start_rate - rate, 0.0, speeds, acceleration, jerk)


def test_a_uniform_target_is_met_as_soon_as_seven_phases_can():
    worst = 0.0
    for _, slew in random_slews(4, CASES, fastest_end=0.95):
        met = soonest(slew.start, slew.start_rate, uniform(slew.end, slew.end_rate), slew.model.limits)
        worst = max(worst, abs(met.duration - seen_from(slew, slew.end, slew.end_rate)))
    print(f"{CASES} drifting axes met uniform targets within {worst:.1e} s of the seven phases")
    assert worst < 1e-6


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_a_target_that_speeds_up_and_slows_down_is_met_in_place_and_velocity():
    worst, rounds, late = [0.0, 0.0], [], []
    meetings = 10_000 if FULL else 500
    for rng, slew in random_slews(5, meetings):
        path, asked = bent(rng, slew.model), []
        begin = 1_800_000_000.0 + rng.randrange(1_000_000) * 2.0**-20

        def where(elapsed, path=path, begin=begin):
            return path((begin + elapsed) - begin)  # with the digits that a POSIX time has

        def counted(elapsed, where=where, asked=asked):
            asked.append(elapsed)
            return where(elapsed)

        met = meeting(slew.start, slew.start_rate, counted, slew.model.limits)
        rounds.append(len(asked))
        last = met.nodes[-1]
        off = (abs(a - b) for a, b in zip(where(last.time), last[1:], strict=True))
        worst = [max(pair) for pair in zip(worst, off, strict=True)]
        assert met.shortest >= SHORTEST_S
        x, rate = where(met.duration)  # no line that touches the path there is met sooner
        late.append(met.duration - seen_from(slew, x - rate * met.duration, rate))
    print(f"{meetings} met curved paths to {worst[0]:.1e}° and {worst[1]:.1e}°/s in {max(rounds)} rounds at most,")
    print(f"{sum(rounds) / meetings:.1f} on average, and up to {max(late):.3f} s late by what stretching costs")
    assert worst[0] < 1e-12
    assert worst[1] < 2e-7  # where the arrival is between two times of the grid
    assert min(late) > -2e-6
    assert sum(seconds > 0.1 for seconds in late) <= 1e-3 * meetings


def test_an_axis_ahead_of_a_target_waits_for_it_in_motion():
    """The end can be passed sooner, but not when the target is there: no arrival at a fixed place fits."""
    start_rate, rate, ahead = 0.05, 0.2, 0.2
    met = meeting(0.0, start_rate, uniform(-ahead, rate), AZIMUTH.limits)
    passed = AZIMUTH.travel(0.0, met.end.position, start_rate, rate)
    print(f"met after {met.duration:.3f} s at {met.end.position:.4f}°, which is passed after {passed.duration:.3f} s")
    assert met.end.position == pytest.approx(-ahead + rate * met.duration, abs=1e-9)
    assert met.duration == pytest.approx(
        seen_from(Slew(AZIMUTH, 0.0, start_rate, -ahead, rate), -ahead, rate), abs=1e-6
    )
    assert met.duration > passed.duration + 0.3


def test_a_target_that_is_too_fast_now_is_met_when_it_has_slowed_down():
    def where(elapsed):  # 3°/s at first, half of that after a minute
        return 40.0 + 180.0 * math.log1p(elapsed / 60.0), 180.0 / (60.0 + elapsed)

    met = meeting(0.0, 0.0, where, AZIMUTH.limits)
    print(f"a target of 3°/s is met after {met.duration:.1f} s at {met.end.velocity:.3f}°/s")
    assert met.nodes[-1][1:] == pytest.approx(where(met.nodes[-1].time), abs=1e-9)


def test_the_sent_nodes_lead_along_the_planned_way():
    worst = 0.0
    for rng, slew in random_slews(6, 300):
        met = meeting(slew.start, slew.start_rate, bent(rng, slew.model), slew.model.limits)
        nodes = [tuple(float(as_printed(number)) for number in node) for node in met.nodes]
        for one, two in pairwise(nodes):
            for k in range(5):
                when = one[0] + (two[0] - one[0]) * k / 5.0
                worst = max(worst, abs(between(one, two, when)[0] - met.at(when)[0]))
            assert all(
                value <= limit * (1.0 + 1e-4)
                for value, limit in zip(
                    largest(*(tuple(map(as_printed, node)) for node in (one, two))), _allowed(slew), strict=True
                )
            )
    print(f"paths through the sent nodes are within {worst * 3.6e6:.4f} mas of the planned way")
    assert worst * 3.6e6 < 0.01


def _allowed(slew):
    speed, acceleration, jerk = slew.planned
    return max(speed, abs(slew.start_rate)), acceleration, jerk


def test_the_first_node_continues_the_drift_to_the_printed_digits():
    """DRIFT tells the velocity to 1e-5 deg/s and the time to 1 ms."""
    worst = 0.0
    for rng, slew in random_slews(7, 300):
        lead, told = 2.0, (round(slew.start, 7), round(slew.start_rate, 5))
        begin = told[0] + told[1] * lead
        met = meeting(begin, told[1], bent(rng, slew.model), slew.model.limits)
        _, position, velocity = met.nodes[0]
        assert velocity == told[1]
        assert position == begin
        truly = slew.start + slew.start_rate * (lead + rng.uniform(-5e-4, 5e-4))
        worst = max(worst, abs(position - truly) - abs(slew.start_rate) * 5e-4 - 5e-6 * lead - 5e-8)
    assert worst <= 1e-12


def test_a_target_that_is_too_fast_is_refused_with_its_speed_and_the_bound():
    with pytest.raises(ApoError, match=r"moves at 1\.8°/s.*0\.999 of 1\.75°/s.*wait"):
        meeting(0.0, 0.0, uniform(5.0, 1.8), AZIMUTH.limits)


def test_a_target_that_runs_away_is_refused_with_its_speed():
    with pytest.raises(ApoError, match=rf"moves at 1\.748°/s.*runs away.*1\.75°/s.*{LONGEST_S:g} s"):
        meeting(0.0, 0.0, uniform(5.0, 1.748), AZIMUTH.limits)


def test_an_axis_that_is_on_its_target_has_nothing_to_do():
    met = meeting(10.0, 0.004, uniform(10.0, 0.004), AZIMUTH.limits)
    assert met.duration == 0.0
    assert met.nodes == ((0.0, 10.0, 0.004),)


def test_an_axis_faster_than_its_limit_slows_down_and_meets_its_target():
    met = meeting(0.0, 1.9, uniform(100.0, 0.004), AZIMUTH.limits)
    assert met.end.velocity == 0.004
    speeds = [phase.extremes.speed for phase in met.phases]
    assert max(speeds) == pytest.approx(1.9, abs=1e-12)
    assert met.at(10.0)[1] <= 1.75


@pytest.mark.parametrize("rate", [-0.3, 0.0, 0.0042, 1.2])
def test_the_smallest_displacements_are_met(rate):
    for exponent in range(-12, 0):
        met = meeting(200.0, rate, uniform(200.0 + 10.0**exponent, rate), AZIMUTH.limits)
        assert met.shortest >= SHORTEST_S
        assert math.isclose(met.nodes[-1].position, 200.0 + 10.0**exponent + rate * met.nodes[-1].time, abs_tol=2e-12)


def test_a_plan_is_asked_for_in_microseconds():
    slews = [slew for _, slew in random_slews(8, 500)]
    took = []
    for _ in range(5):
        begun = perf_counter()
        for slew in slews:
            slew.model.onto(slew.start, slew.start_rate, slew.end, slew.end_rate)
        took.append((perf_counter() - begun) / len(slews))
    print(f"one travel takes {min(took) * 1e6:.0f} µs, of {len(AXES)} axes")
    assert min(took) < 1e-3
