import os
import sys
from itertools import pairwise

import pytest
from apo_slews import as_printed, largest, random_slews
from seven_phase import change_s, least_s, stops_first_s

from mounts.apo.errors import ApoError
from mounts.apo.slew_model import ApoSlewModel
from mounts.apo.slew_profile import MARGIN, SHORTEST_S, Limits, Slew, quickest

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
CASES = 1000
AZIMUTH = ApoSlewModel(1.75, 0.1, 0.5)
EXAMPLE = Slew.to(0.0, 0.0, 30.0, 0.0042)
PRINTED = 0.5e-12 + 1e-13  # of twelve decimals, and of a float of some hundred degrees
CHANNELS = ("velocity", "acceleration", "jerk")


def test_the_readings_example_takes_34_799_seconds():
    limits = Limits(1.75 / MARGIN, 0.1 / MARGIN, 0.5 / MARGIN)  # the example keeps no margin
    assert quickest(EXAMPLE, limits).duration == pytest.approx(34.799, abs=5e-4)
    unbounded = Limits(1.75 / MARGIN, 0.1 / MARGIN, 1e6)
    assert quickest(EXAMPLE, unbounded).duration == pytest.approx(34.599, abs=5e-4)


def test_a_slew_is_as_quick_as_seven_phases_can_be_and_quicker_than_one_that_stops_first():
    worst, gained = 0.0, []
    for _, slew in random_slews(1, CASES):
        speed, acceleration, jerk = slew.planned
        distance, rates = slew.end - slew.start, (slew.start_rate, slew.end_rate)
        took = slew.model.travel(slew.start, slew.end, *rates).way.duration
        worst = max(worst, abs(took - least_s(distance, *rates, (-speed, speed), acceleration, jerk)))
        gained.append(stops_first_s(distance, *rates, speed, acceleration, jerk) - took)
    print(
        f"{CASES} slews: {worst:.1e} s from the seven phases; stopping first takes {sum(gained) / CASES:.2f} s more"
    )
    assert worst < 1e-6
    assert min(gained) > -1e-6


def test_a_slew_onto_a_line_is_as_quick_as_seven_phases_can_be_beside_it():
    worst = 0.0
    for _, slew in random_slews(2, CASES):
        speed, acceleration, jerk = slew.planned
        rate = slew.end_rate
        took = slew.model.onto(slew.start, slew.start_rate, slew.end, rate).way.duration
        told = least_s(
            slew.end - slew.start, slew.start_rate - rate, 0.0, (-speed - rate, speed - rate), acceleration, jerk
        )
        worst = max(worst, abs(took - told))
    print(f"{CASES} slews onto moving lines: {worst:.1e} s from the seven phases")
    assert worst < 1e-6


@pytest.mark.campaign
@pytest.mark.timeout(900)
def test_slews_keep_all_limits_as_planned_and_as_sent():
    count, planned, sent, lost = 10_000 if FULL else 500, [0.0] * 3, [0.0] * 3, []
    for _, slew in random_slews(3, count):
        way = slew.model.profile(slew.start, slew.start_rate, slew.end, slew.end_rate)
        nodes = [tuple(map(as_printed, node)) for node in way.nodes]
        assert way.shortest >= SHORTEST_S
        for phase in way.phases:
            over = (found - limit for found, limit in zip(phase.extremes[2:], slew.planned, strict=True))
            planned = [max(pair) for pair in zip(planned, over, strict=True)]
        for pair in pairwise(nodes):
            over = (found / limit - 1.0 for found, limit in zip(largest(*pair), slew.planned, strict=True))
            sent = [max(pair) for pair in zip(sent, over, strict=True)]
        lost.append(way.duration - slew.model.travel(slew.start, slew.end, slew.start_rate, slew.end_rate).duration)
    again = [seconds for seconds in lost if seconds > 1e-9]
    print(f"{count} slews: over the planning limits by {dict(zip(CHANNELS, planned, strict=True))} as planned,")
    print(f"by {dict(zip(CHANNELS, sent, strict=True))} of them as sent; {len(again)} stretched, which costs at most")
    print(f"{max(again):.3f} s, and over 0.1 s in {sum(seconds > 0.1 for seconds in again)} cases")
    assert max(planned) < 1e-9
    assert max(sent) < 1e-4
    assert sum(seconds > 0.1 for seconds in again) <= 1e-3 * count


def test_a_way_is_continuous_at_every_node_and_ends_where_it_should_to_the_printed_digits():
    """Each phase is carried on by Taylor's series from the one before; nothing that a phase says it begins with."""
    jumps, ends = [0.0, 0.0], [0.0, 0.0]
    for _, slew in random_slews(9, CASES):
        way = slew.model.profile(slew.start, slew.start_rate, slew.end, slew.end_rate)
        state, ended = (slew.start, slew.start_rate, 0.0), 0.0
        following = [*(phase.jerk for phase in way.phases[1:]), None]  # on from the end without jerk, before it too
        for phase, node, after in zip(way.phases, way.nodes[1:], following, strict=True):
            x, v, a = state
            t, j = phase.duration, phase.jerk
            state = x + v * t + a * t**2 / 2.0 + j * t**3 / 6.0, v + a * t + j * t**2 / 2.0, a + j * t
            ended += t
            off = node.time - ended
            bend = 0.0 if after is None else j if off < 0.0 else after
            there = (
                state[0] + state[1] * off + state[2] * off**2 / 2.0 + bend * off**3 / 6.0,
                state[1] + state[2] * off + bend * off**2 / 2.0,
            )
            jumps = [max(pair) for pair in zip(jumps, map(missed, there, node[1:]), strict=True)]
        ends = [max(pair) for pair in zip(ends, map(missed, state[:2], (slew.end, slew.end_rate)), strict=True)]
    print(
        f"nodes are off the way by {jumps[0]:.1e}° and {jumps[1]:.1e}°/s, ends by {ends[0]:.1e}° and {ends[1]:.1e}°/s"
    )
    assert max(jumps) < PRINTED
    assert max(ends) < PRINTED


def missed(one, other):
    return abs(one - other)


def test_a_target_faster_than_the_axis_is_refused_with_both_speeds():
    with pytest.raises(ApoError, match=r"moves at 1\.76°/s.*0\.999 of 1\.75°/s.*wait"):
        AZIMUTH.profile(0.0, 0.0, 10.0, 1.76)


def test_an_axis_without_the_library_is_told_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "ruckig", None)
    with pytest.raises(ApoError, match=r"pip install 'clockdrive\[apo\]'"):
        AZIMUTH.travel(0.0, 10.0, 0.0, 0.0)


def test_the_lowest_and_highest_position_of_a_way_that_must_turn_round_are_told():
    way = AZIMUTH.profile(0.0, 1.7, 1.0, 0.0)
    sampled = [way.at(way.duration * k / 20_000)[0] for k in range(20_001)]
    assert way.extremes == pytest.approx((min(sampled), max(sampled)), abs=1e-6)
    acceleration, jerk = 0.1 * MARGIN, 0.5 * MARGIN
    stopping = change_s(1.7, acceleration, jerk) * 1.7 / 2.0  # to rest; turning round needs no last ramp
    assert way.extremes[1] == pytest.approx(stopping - acceleration**3 / (24.0 * jerk**2), abs=1e-9)
    assert len(way.sent) == len(way.phases)


def test_nodes_lie_where_a_posix_time_has_digits():
    for _, slew in random_slews(10, 200):
        begin = 1_800_000_000.0
        way = slew.model.profile(slew.start, slew.start_rate, slew.end, slew.end_rate)
        assert all((begin + node.time) - begin == node.time for node in way.nodes)
