"""Who stands beside a motion: there before it begins, until it is known to have ended, and missed when gone."""

import pytest
from tc410_bench import Beside as Guardian

from mounts.awr.beside import Attended
from mounts.beside import Beside
from mounts.deadman import DeadManError
from mounts.errors import DriveRefused


class Unit:
    """What calls before each exchange."""

    slice_s = float("inf")

    def __init__(self):
        self.before_each = lambda: None

    def exchange(self, guardian):
        before = guardian.beats
        self.before_each()
        return guardian.beats - before


def test_it_is_started_once_armed_before_and_beaten_until_the_motion_has_ended():
    unit, guardian = Unit(), Guardian()
    beside = Beside(unit, guardian, "the motion")
    beside.stand_by()
    assert guardian.diary == ["start"]
    assert not unit.exchange(guardian)
    beside.begin()
    beside.begin()
    assert guardian.diary == ["start", "arm"]
    assert unit.exchange(guardian)
    beside.rest()
    assert not unit.exchange(guardian)
    beside.begin()
    beside.end()
    beside.end()
    assert guardian.diary == ["start", "arm", "disarm", "arm", "disarm", "close"]


def test_what_did_not_end_is_left_to_it_armed():
    unit, guardian = Unit(), Guardian()
    beside = Beside(unit, guardian, "the motion")
    beside.begin()
    beside.leave()
    assert guardian.diary == ["start", "arm", "close"]
    assert not beside.armed
    assert not unit.exchange(guardian)


def test_nothing_begins_without_it_or_goes_on_when_it_is_gone():
    with pytest.raises(DriveRefused, match="the motion needs a dead-man process"):
        Beside(Unit(), None, "the motion").begin()
    beside = Beside(Unit(), Guardian(starts=False), "the motion")
    with pytest.raises(DeadManError):
        beside.begin()
    assert not beside.armed
    guardian = Guardian()
    beside = Beside(Unit(), guardian, "the motion")
    beside.begin()
    guardian.fate = "it was killed"
    assert beside.fate == "it was killed"
    with pytest.raises(DriveRefused, match="the motion was ended: it was killed"):
        beside.begin()
    beside.rest()
    guardian.fate = ""
    beside.begin()
    assert not beside.fate


def test_its_patience_is_that_of_the_quickest_of_what_moves():
    guardian = Guardian()
    unit = Unit()
    beside = Attended(unit, guardian)
    beside.drives_go()
    beside.begin()
    beside.hasten()
    beside.calm()
    beside.drives_rest()  # a key is held still
    beside.drives_go()
    beside.rest()
    beside.drives_rest()
    assert guardian.diary == ["start", "arm", "ease", "arm", "hasten", "arm", "ease", "disarm"]
