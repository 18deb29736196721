"""Which answers are believed: what was foreseen, what another confirms, and never what was said before."""

import pytest

from mounts.apo import tai
from mounts.apo.clock_offset import ClockOffset
from mounts.apo.confirming import Confirming
from mounts.apo.controller import Timed
from mounts.apo.node_queue import NodeQueue
from mounts.apo.readings import Drift
from transports.errors import WrongAnswer

T0 = 1_800_000_000.0
ACCELERATION = 0.25


def answer(position, velocity, sent, clock_s=0.0, said_ago_s=0.0):
    """An answer that comes 2 ms after it was asked for; by a clock that is off, or one that was given before."""
    told = tai.seconds_of_day(sent + 0.001 - said_ago_s) + clock_s
    return Timed(Drift(position, velocity, round(told, 3)), sent, sent + 0.002, sent + 0.002)


def believing(seconds=10):
    """One that has believed an axis at 0.5°/s, and knows its clock."""
    offset = ClockOffset()
    confirming = Confirming(NodeQueue(), offset, ACCELERATION)
    for k in range(seconds):
        timed = confirming.asked(iter([answer(10.0 + 0.5 * k, 0.5, T0 + k)] * 2).__next__)
        offset.see(tai.posix(timed.value.time_tai_s, timed.received), timed.sent, timed.began)
    return confirming


def test_what_was_foreseen_is_believed_at_once():
    left = iter([answer(15.0, 0.5, T0 + 10.0)])
    assert believing().asked(left.__next__).value.position_deg == 15.0
    assert not list(left)


def test_what_was_not_foreseen_is_believed_when_the_next_answer_follows_from_it():
    confirming = believing()
    asked = iter([answer(14.95, 0.2, T0 + 10.0), answer(14.958, 0.2, T0 + 10.04)])
    assert confirming.asked(asked.__next__).value.position_deg == 14.958
    assert confirming.jumped_deg == 0.0


def test_a_position_that_no_motion_explains_is_believed_and_called_a_jump():
    confirming = believing()
    asked = iter([answer(3.0, 0.0, T0 + 10.0), answer(3.0, 0.0, T0 + 10.04)])
    assert confirming.asked(asked.__next__).value.position_deg == 3.0
    assert confirming.jumped_deg == pytest.approx(11.5)


def test_earlier_answers_are_not_believed_though_they_follow_from_each_other():
    earlier = [
        answer(10.0 + 0.5 * k, 0.5, T0 + 10.0 + 0.04 * i, said_ago_s=10.0 - k) for i, k in enumerate((3, 4, 8))
    ]
    with pytest.raises(WrongAnswer, match="3 positions that do not follow from each other"):
        believing().asked(iter(earlier).__next__)


@pytest.mark.parametrize("clock_s", [5.0, -37.0])
def test_a_clock_that_was_set_wrong_is_believed_as_its_answers_are_as_far_apart_as_they_came(clock_s):
    told = [answer(15.0 + 0.02 * i, 0.5, T0 + 10.0 + 0.04 * i, clock_s=clock_s) for i in range(3)]
    confirming = believing()
    assert confirming.asked(iter(told).__next__) is told[2]
    assert confirming.jumped_deg == 0.0
