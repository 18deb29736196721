"""Dead reckoning against the same motion summed in small steps."""

import pytest

from mounts.reckoning import Motion, Reckoning


def test_an_axis_goes_on_at_its_rate_and_ever_less_surely():
    axis = Reckoning(100.0, 0.0, 1.0, 5.0, 1e-3)
    state = axis.at(1000.0)
    assert (state.counts, state.rate, state.moving) == (5100.0, 5.0, False)
    assert state.uncertainty == pytest.approx(1.0 + 5.0)


def test_rates_change_when_it_is_told_and_a_later_word_voids_an_earlier():
    axis = Reckoning(0.0, 0.0, rate=5.0)
    axis.goes_on(7.0, 10.0)
    axis.goes_on(5.0, 20.0)
    assert [axis.at(t).counts for t in (10.0, 15.0, 20.0, 30.0)] == [50.0, 85.0, 120.0, 170.0]
    axis.goes_on(0.0, 15.0)
    assert axis.at(30.0).counts == 85.0
    axis.goes_on(1.0, 15.0)
    assert axis.at(30.0).counts == 100.0


@pytest.mark.parametrize("suspends", [True, False])
def test_a_motion_adds_its_way_and_may_take_the_motor_from_the_rate(suspends):
    axis = Reckoning(0.0, 0.0, rate=5.0)
    axis.moves(Motion(10.0, 4.0, lambda s: 100.0 * s, suspends=suspends, uncertainty=0.5))
    rate = 100.0 if suspends else 105.0
    middle, after = axis.at(12.0), axis.at(20.0)
    assert middle.counts == pytest.approx(50.0 + 2.0 * rate)
    assert middle.rate == pytest.approx(rate, rel=1e-6)
    assert middle.moving
    assert after.counts == pytest.approx(50.0 + 4.0 * rate + 30.0)
    assert (after.rate, after.moving, after.uncertainty) == (5.0, False, 0.5)
    assert axis.ends == 14.0


def test_what_is_over_is_put_together_and_nothing_is_lost_by_it():
    axis, expected = Reckoning(0.0, 0.0, rate=3.0, rate_uncertainty=1e-4), 0.0
    for k in range(200):
        axis.moves(Motion(10.0 * k + 2.0, 1.5, lambda s: -20.0 * s, uncertainty=0.5))
        expected += -30.0 + 3.0 * 8.5
    state = axis.at(2000.0)
    assert state.counts == pytest.approx(expected)
    assert state.uncertainty == pytest.approx(100.0 + 3.0 * 1700.0 * 1e-4, rel=0.2)


def test_what_becomes_known_shifts_a_motion_under_way_and_a_halt_ends_it():
    axis = Reckoning(0.0, 0.0, rate=0.0)
    axis.moves(Motion(0.0, 10.0, lambda s: 7.0 * s))
    axis.known(50.0, 5.0, 2.0)
    assert axis.at(10.0).counts == pytest.approx(85.0)
    assert axis.at(10.0).uncertainty == pytest.approx(2.0)
    axis.halted(60.0, 6.0, 3.0)
    assert axis.at(10.0).counts == 60.0
    assert not axis.at(7.0).moving


def test_at_its_end_a_motion_has_made_all_of_its_way_whatever_the_clock_rounds():
    begin = 1_800_000_000.123456
    axis = Reckoning(0.0, begin)
    axis.moves(Motion(begin, 26.6522, lambda s: float(int(s / 26.6522 * 1e6))))
    assert axis.at(begin + 26.6522).counts == 1e6
