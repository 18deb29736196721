"""The bands in which axis 1 is kept, and the moves that bring it back, by arithmetic of their own."""

import math

import pytest
from avr_bench import SIDEREAL, STEPS_PER_TURN

from mounts.avr_box.following import HELD_EVERY_S, band_of, leaves_in, move_back, single_steps
from mounts.avr_box.guiding import GuideRates
from mounts.avr_box.slew_table import laws, standard

RATES = GuideRates.of(276.548673, 4)
ARCMIN = STEPS_PER_TURN[0] / 21600.0
LAW = laws(standard())[0]


def seconds(half):
    return LAW.cycles(half) / 16e6


def test_at_rest_it_is_held_short_of_its_place_and_never_beyond_it():
    band = band_of(0.0, RATES)
    assert -ARCMIN < band.high <= -2.0 * 276.548673  # two seconds of tracking are left for the next look
    assert band.goal == pytest.approx(-HELD_EVERY_S * 276.548673)
    assert -7.6 * ARCMIN < band.low < band.goal < -4.9 * ARCMIN


@pytest.mark.parametrize("of_sidereal", [0.981, 0.99, 1.0, 1.015])
def test_within_reach_of_guiding_the_band_is_even_and_wider_than_guiding_needs(of_sidereal):
    band = band_of(of_sidereal * SIDEREAL, RATES)
    assert (-band.low, band.goal) == (band.high, 0.0)
    needs = max(RATES.faster - RATES.own, RATES.own - RATES.slower) * 20.0 / 4.0  # half of a triangle's height
    print(f"\nguiding runs {needs:.1f} to and fro of {band.high:.1f} microsteps")
    assert band.high >= needs * 0.9


@pytest.mark.parametrize("of_sidereal", [0.5, 0.965, 1.03, 1.5])
def test_beyond_the_reach_it_runs_evenly_to_both_sides_of_its_path(of_sidereal):
    wanted = of_sidereal * SIDEREAL
    band = band_of(wanted, RATES)
    drift = (RATES.slower if wanted < RATES.own else RATES.faster) - wanted
    entered, left = (band.goal, band.high) if drift > 0.0 else (band.goal, band.low)
    assert entered == pytest.approx(-left)
    assert math.copysign(1.0, left) == math.copysign(1.0, drift)
    assert leaves_in(band.goal, drift, band) == pytest.approx(abs(left - entered) / abs(drift))
    assert band.low < band.goal < band.high


def test_it_leaves_a_band_when_its_drift_has_led_it_to_the_end():
    band = band_of(0.0, RATES)
    assert leaves_in(band.goal, 0.0, band) == math.inf
    assert leaves_in(band.goal, 276.548673, band) == pytest.approx(HELD_EVERY_S - 2.0)
    assert leaves_in(1.0, 276.548673, band) == 0.0


@pytest.mark.parametrize("wanted", [0.0, 0.965 * SIDEREAL, 1.2 * SIDEREAL])
@pytest.mark.parametrize("beyond", [-9000.0, -40.0, -0.5, 0.5, 25.0, 4000.0])
def test_a_move_ends_at_the_goal_though_the_path_goes_on_meanwhile(wanted, beyond):
    band = band_of(wanted, RATES)
    ahead = beyond + (band.high if beyond > 0.0 else band.low)
    half = move_back(ahead, wanted, band, seconds)
    after = ahead + 2 * half - wanted * seconds(abs(half))
    assert after == pytest.approx(band.goal, abs=2.5)  # half of two microsteps, and what tracking makes of them


@pytest.mark.parametrize(
    ("ahead", "steps"),
    [(0.0, 0), (0.4, 0), (-0.6, 1), (3.2, -3), (60.0, -59), (-60.4, 59), (61.0, 0)],
)
def test_axis_2_makes_few_microsteps_one_by_one_and_many_by_a_move_and_none_by_a_byte_that_is_a_letter(ahead, steps):
    assert single_steps(ahead) == steps
