"""The phase and the crystal, found from bins that a clock of known phase and drift would tell."""

import math
import random

import pytest

from mounts.avr_box.guiding import EVERY_S, GuideRates, pulse, sent_after
from mounts.avr_box.tick_clock import NEAR_TICKS, TickClock
from mounts.avr_box.timers import TICK_S

T0 = 1_800_000_000.0


class Ticking:
    """A box whose ticks are known: its phase, its crystal, and an index pulse that moves the bin."""

    def __init__(self, phase, ppm, index_every=None):
        self.tick, self.phase, self.index = TICK_S / (1.0 + ppm * 1e-6), phase, index_every

    def bin(self, t):
        passed = math.floor((t - T0 - self.phase) / self.tick) + 100
        return (passed if self.index is None else passed % self.index) % 519

    def phase_at(self, t):
        return (t - T0 - self.phase) % self.tick


def asked(clock, box, times, seed=0, trip=0.016):
    chance = random.Random(seed)  # noqa: S311 - nothing secret
    for t in times:
        clock.heard(box.bin(t + trip * chance.random()), t, t + trip)


def off(clock, box, t):
    """By how much the phase is off, seconds, the short way round."""
    wrong = clock.since_tick(t) - box.phase_at(t)
    return abs((wrong + box.tick / 2.0) % box.tick - box.tick / 2.0)


@pytest.mark.parametrize("phase", [0.0, 0.1, 0.3, 0.46])
def test_the_phase_is_known_to_an_exchange_after_one_tick_was_seen(phase):
    clock, box = TickClock(), Ticking(phase, 0.0)
    asked(clock, box, [T0 + 0.02 * k for k in range(30)])
    assert clock.uncertainty_s < 0.02
    assert off(clock, box, T0 + 10.0) <= clock.uncertainty_s + 0.001


@pytest.mark.parametrize("ppm", [-100.0, 0.0, 60.0])
def test_the_crystal_is_measured_within_what_is_stated(ppm):
    clock, box = TickClock(), Ticking(0.2, ppm)
    asked(clock, box, [T0 + 0.02 * k for k in range(30)])
    asked(clock, box, [T0 + 10.0 * k for k in range(1, 360)], seed=1)
    found = (clock.crystal - 1.0) * 1e6
    print(f"\n{ppm:+.0f} ppm: found {found:+.1f} ± {clock.crystal_uncertainty * 1e6:.1f} ppm in an hour")
    assert abs(found - ppm) <= 1e6 * clock.crystal_uncertainty
    assert clock.crystal_uncertainty < 2e-5
    assert off(clock, box, T0 + 3600.0) < 0.02


def test_an_index_pulse_moves_the_bin_and_not_the_tick():
    clock, box = TickClock(), Ticking(0.2, 0.0, index_every=518)
    asked(clock, box, [T0 + 0.02 * k for k in range(30)])
    asked(clock, box, [T0 + 7.3 * k for k in range(1, 200)], seed=2)
    assert off(clock, box, T0 + 1500.0) < 0.02


@pytest.mark.parametrize("turn", [510, 518, 519, 528])
def test_index_pulses_of_a_guided_worm_are_never_taken_for_a_clock_that_was_set(turn):
    clock, box, chance = TickClock(), Ticking(0.2, 30.0, index_every=turn), random.Random(turn)  # noqa: S311
    t, unexplained = T0, 0.0
    while t < T0 + 6 * turn * TICK_S:
        told = box.bin(t + 0.008)
        unexplained = max(unexplained, clock.unexplained(told, 0, t, t + 0.016))
        clock.heard(told, t, t + 0.016)
        t += chance.uniform(0.1, 11.0)
    print(f"\n{turn} ticks a turn: at most {unexplained:.1f} ticks unexplained")
    assert unexplained <= NEAR_TICKS
    assert clock.slipped_s == 0.0


def test_nothing_is_known_before_the_first_answer():
    assert TickClock().uncertainty_s == math.inf


def test_a_command_is_sent_in_the_middle_of_a_tick():
    for part in (0.0, 0.1, 0.24, 0.26, 0.5, 0.74, 0.8, 0.99):
        wait = sent_after(part * TICK_S, TICK_S)
        assert 0.25 <= (part + wait / TICK_S) % 1.0 <= 0.75
        assert 0.0 <= wait < TICK_S


def test_guiding_reaches_the_rates_of_its_divisors():
    rates = GuideRates.of(125000 / 226 / 2, 4)
    assert rates.faster == pytest.approx(125000 / 222 / 2)
    assert rates.slower == pytest.approx(125000 / 230 / 2)
    sidereal = 277.120269  # the manual's own figure
    assert rates.faster / sidereal - 1.0 == pytest.approx(0.0159, abs=1e-4)
    assert rates.slower / sidereal - 1.0 == pytest.approx(-0.0194, abs=1e-4)


@pytest.mark.parametrize("ahead", [-12.0, -3.0, 0.0, 5.0])
@pytest.mark.parametrize("since", [0.12, 0.23, 0.34])
def test_a_pulse_leads_the_error_from_one_side_to_the_other(ahead, since):
    rates, wanted = GuideRates.of(276.548673, 4), 277.120269
    made = pulse(ahead, wanted, rates, since, TICK_S)
    gained = 0.0 if made is None else made.duration * ((rates.faster if made.sign > 0 else rates.slower) - rates.own)
    at_the_end = ahead + gained + (rates.own - wanted) * EVERY_S
    half = (wanted - rates.own) * EVERY_S / 2.0
    assert at_the_end == pytest.approx(-half, abs=0.52 * (rates.faster - rates.own) * TICK_S + 0.9)
