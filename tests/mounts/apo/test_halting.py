"""Halting: what was begun ends, every axis is told, and the motion is over when the axes are seen to stand."""

import pytest

from mounts.apo.halting import Halting
from mounts.apo.settings import ApoSettings, AxisSettings
from transports.errors import NoAnswer

SETTINGS = ApoSettings("apo", (AxisSettings("azimuth", "AZ", -300.0, 300.0, 1.75, 0.25, 0.5),))


class Told:
    """A group of axes that keeps what it was told, and something that was begun with it."""

    def __init__(self, error=None):
        self.halted, self.ended, self.error = [], 0, error

    def halt(self, *, abruptly):
        self.halted.append(abruptly)
        if self.error:
            raise self.error

    def end(self):
        self.ended += 1


def test_axes_that_turn_stand_for_a_moment_only_and_brake_still():
    told = Told()
    halting = Halting(told, SETTINGS, (told,))
    halting.all(0.0)
    assert (told.halted, told.ended, halting.brakes) == ([False], 1, True)
    for time, stand, brakes in ((1.0, False, True), (2.0, True, True), (2.3, False, True), (2.6, True, True)):
        halting.settle(time, stand=stand)
        assert halting.brakes is brakes
    halting.settle(2.9, stand=True)
    assert not halting.brakes


def test_what_does_not_stand_in_its_time_is_stopped_abruptly():
    told = Told()
    halting = Halting(told, SETTINGS, ())
    halting.all(0.0)
    halting.settle(8.9, stand=False)
    assert told.halted == [False]
    halting.settle(9.1, stand=False)
    assert told.halted == [False, True]


def test_a_failure_halts_what_answers_and_is_told_itself():
    told = Told(NoAnswer("azimuth"))
    with pytest.raises(ZeroDivisionError), Halting(told, SETTINGS, (told,)).on_failure(0.0):
        raise ZeroDivisionError
    assert (told.halted, told.ended) == ([False], 1)
