"""Play between motor and axis, as the driver reckons it, against gears that are followed end by end."""

import math
import random

import pytest

from mounts.awr.axis import AwrAxis
from mounts.awr.cascade import Press
from mounts.awr.play import Play
from mounts.awr.ramps import Key
from mounts.awr.simulator_axis import MovingAxis
from mounts.awr.uncertainty import Way


class Geared:
    """A motor that runs from rate to rate, and the axis behind its gears."""

    def __init__(self, play):
        self.motor = MovingAxis.at(0.0, play)
        self.motor.acceleration = 20_000.0

    def run(self, rate, seconds):
        self.motor.target = rate
        while seconds > 0.0:
            part = min(seconds, self.motor.change_in)
            self.motor.run(part)
            seconds -= part


@pytest.mark.parametrize("drive", [0.0, 50.0, -3.0])
@pytest.mark.parametrize("play", [0.0, 40.0, 300.0])
def test_an_axis_is_reckoned_where_its_gears_have_brought_it(drive, play):
    rng, gears, time = random.Random(4), Geared(play), 1000.0  # noqa: S311
    axis = AwrAxis(0, 0.0, time, 0.0, side=1.0)
    axis.has(Play(play), time)
    axis.drives_at(drive, time)
    gears.run(drive, 5.0)
    time += 5.0
    for _ in range(60):
        key = Key(rng.choice((-1.0, 1.0)) * rng.choice((15.0, 100.0, 1600.0)), 20_000.0)
        press = Press(key, 10.0 ** rng.uniform(-1.5, 0.3))
        axis.pressed(press, time)
        gears.run(drive + key.rate, press.hold)
        gears.run(drive, press.duration - press.hold)
        time += press.duration
        axis.ended(Way(press.made(press.duration), 0.0), time)
        assert axis.at(time).counts == pytest.approx(gears.motor.place, abs=0.2)
        wait = rng.choice((0.0, 0.5, 20.0))
        gears.run(drive, wait)
        time += wait
        assert axis.at(time).counts == pytest.approx(gears.motor.place, abs=0.2)


def test_a_blip_longer_than_the_play_leads_the_axis_on_by_as_much():
    axis = AwrAxis(1, 0.0, 0.0, 0.0, side=1.0)
    axis.has(Play(-50.0), 0.0)
    assert axis.slack(0.0, -1.0) == -50.0
    press = Press(Key(-100.0, 20_000.0), 1.0)
    axis.pressed(press, 0.0)
    axis.ended(Way(-100.0, 0.0), press.duration)
    assert axis.at(2.0).counts == -150.0
    assert axis.slack(2.0, -1.0) == 0.0


def test_where_nobody_knew_the_side_an_axis_that_was_moved_is_unsure_by_half_the_play():
    axis = AwrAxis(1, 0.0, 0.0, 0.0)
    axis.has(Play(200.0), 0.0)
    axis.known(0.0, 0.0, 0.5)
    assert axis.at(1.0).uncertainty == 0.5
    axis.pressed(Press(Key(100.0, 20_000.0), 3.0), 1.0)
    axis.ended(Way(300.0, 0.0), 5.0)
    assert axis.at(5.0).counts == 200.0  # 300 less half the play, give or take as much
    assert axis.at(5.0).uncertainty == pytest.approx(100.0, abs=0.01)
    axis.known(200.0, 5.0, 0.5)
    assert axis.at(6.0).uncertainty == 0.5


def test_a_side_that_was_lost_leaves_a_blip_unsure_until_the_axis_is_known_behind_a_motion():
    axis = AwrAxis(1, 0.0, 0.0, 0.0, side=1.0)
    axis.has(Play(0.0, 0.0, 200.0), 0.0)
    for stated in (200.0, 0.0):
        if stated:
            axis.forget_side()
        axis.known(0.0, 1.0, 0.5)
        assert axis.at(2.0).uncertainty == 0.5
        axis.pressed(Press(Key(-100.0, 20_000.0), 3.0), 2.0)
        axis.ended(Way(-300.0, 0.0), 6.0)
        assert axis.at(6.0).uncertainty == pytest.approx(math.hypot(0.5, stated))


def test_a_drive_that_goes_on_after_a_blip_was_broken_off_is_not_taken_to_push_its_axis_at_once():
    axis = AwrAxis(0, 0.0, 0.0, 0.0, side=1.0)
    axis.has(Play(0.0, 0.0, 200.0), 0.0)
    axis.drives_at(50.0, 0.0)
    axis.forget_side()
    axis.known(50.0, 1.0, 0.5)
    assert axis.at(1.0).uncertainty > 200.0
    axis.known(500.0, 10.0, 0.5)  # it has gone by the play since
    assert axis.at(11.0).uncertainty == pytest.approx(0.5, abs=0.01)


def test_what_is_not_known_of_the_play_counts_on_the_other_side_only():
    axis = AwrAxis(1, 0.0, 0.0, 0.0, side=1.0)
    axis.has(Play(0.0, 10.0), 0.0)
    for way, stated in ((100.0, 0.0), (-100.0, 19.6), (-50.0, 19.6), (30.0, 0.0)):
        axis.pressed(Press(Key(way, 20_000.0), 1.0), 1.0)
        axis.ended(Way(way, 0.0), 3.0)
        assert axis.at(3.0).uncertainty == pytest.approx(stated, abs=0.01)


def test_a_drive_takes_up_the_play_by_itself_where_it_is_fast_enough():
    axis = AwrAxis(0, 0.0, 0.0, 0.0, side=-1.0)
    axis.has(Play(200.0), 0.0)
    axis.drives_at(50.0, 0.0)
    assert axis.falls(0.0) == 200.0
    assert axis.falls(3.0) == 50.0
    assert not axis.settled(3.9)
    assert axis.settled(4.0)
    assert axis.at(4.0).counts == 0.0
    assert axis.at(5.0).counts == 50.0
    assert axis.falls(5.0) == 0.0
    axis.drives_at(-0.01, 5.0)
    assert axis.falls(5.0) == 0.0
    assert axis.settled(5.0)
    assert axis.slack(5.0, -1.0) == 200.0
