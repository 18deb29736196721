"""What the telescope said of its place is known for 20 minutes, and never across a change of its position."""

import pytest

from clockdrive.errors import Refused
from clockdrive.history import SPAN_S, History
from mounts.drive import AxisReading, Reading

T0 = 1_800_000_000.0


def reading(time, one=0.0, two=0.0, *, slewing=False, unsynchronised=""):
    axes = tuple(AxisReading(counts, 0.5, 0.0, slewing) for counts in (one, two))
    return Reading(T0 + time, axes, unsynchronised=unsynchronised)


@pytest.fixture
def history():
    found = History()
    for second in range(10):
        found.add(reading(second, 100.0 + 4.0 * second, -2.0 * second))
    return found


def test_between_two_readings_the_axes_go_straight(history):
    assert history.counts(T0 + 3.0) == (112.0, -6.0)
    assert history.counts(T0 + 3.25) == pytest.approx((113.0, -6.5))
    assert history.counts(T0 + 9.0) == (136.0, -18.0)
    assert history.counts(T0) == (100.0, 0.0)


@pytest.mark.parametrize(
    ("time", "said"), [(-0.5, "was not read before"), (9.5, "lies after the last reading"), (1e6, "after the last")]
)
def test_a_moment_outside_is_refused(time, said, history):
    with pytest.raises(Refused, match=rf"{said}.*middle of an exposure"):
        history.counts(T0 + time)


def test_a_long_silence_is_not_bridged_and_a_slew_is_no_exposure(history):
    history.add(reading(30.0))
    with pytest.raises(Refused, match=r"21 s without a reading, at most 5 s"):
        history.counts(T0 + 20.0)
    history.add(reading(31.0, slewing=True))
    with pytest.raises(Refused, match="was slewing at"):
        history.counts(T0 + 30.5)


@pytest.mark.parametrize("why", ["a sync came after it", "another instrument was chosen after it"])
def test_what_was_forgotten_says_why(why, history):
    history.forget(why)
    history.add(reading(11.0))
    with pytest.raises(Refused, match=why):
        history.counts(T0 + 5.0)
    assert history.counts(T0 + 11.0) == (0.0, 0.0)


def test_a_lost_position_and_a_clock_set_back_end_what_was_known(history):
    history.add(reading(10.0, unsynchronised="power was lost"))
    history.add(reading(11.0))
    with pytest.raises(Refused, match="the position was lost after it"):
        history.counts(T0 + 9.0)
    history.add(reading(-100.0))
    with pytest.raises(Refused, match="clock was set back"):
        history.counts(T0 - 101.0)


def test_only_twenty_minutes_are_kept(history):
    for second in range(10, 3000):
        history.add(reading(second))
    assert len(history._readings) == SPAN_S + 1
    with pytest.raises(Refused, match="20 minutes are kept"):
        history.counts(T0 + 1000.0)
