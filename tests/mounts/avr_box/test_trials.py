"""Moves that find out what a move is: one at a time, and never forgotten."""

import pytest
from avr_bench import Bench

from mounts.errors import DriveRefused


def a_trial(bench, kind):
    return bench.drive.trials.north() if kind == "N" else bench.drive.trials.move(1, 2000, falling=True)


@pytest.mark.parametrize("first", ["M", "N"])
@pytest.mark.parametrize("second", ["M", "N"])
def test_no_trial_is_sent_while_an_axis_may_still_move(first, second):
    bench = Bench()
    bench.connect()
    a_trial(bench, first)
    before = bench.box.motors[1].slew
    with pytest.raises(DriveRefused, match=r"may move for another \d\.\d s"):
        a_trial(bench, second)
    assert bench.box.motors[1].slew is before
    bench.clock.sleep(3.0)
    a_trial(bench, second)
    assert bench.box.moving == (False, True)


@pytest.mark.parametrize(("kind", "made"), [("M", -4000), ("N", 2764)])
def test_a_program_that_ends_in_a_trial_leaves_the_next_one_knowing_of_it(kind, made):
    bench = Bench()
    bench.connect()
    a_trial(bench, kind)
    (move,) = bench.kept["axes"][1]["moves"]
    assert 2 * move["half"] * move["sign"] == made
    again = Bench(memory=dict(bench.kept), box=bench.box, clock=bench.clock)
    again.clock.sleep(10.0)
    reading = again.connect()
    assert reading.unsynchronised == ""
    assert reading.axes[1].counts == bench.true()[1] == made
