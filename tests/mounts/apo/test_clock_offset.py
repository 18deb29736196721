"""How far a controller's clock is off: bounded by every answer, never by more than its way allows."""

import random

import pytest

from mounts.apo.clock_offset import ClockOffset


def watched(offset: float, *, way_s: tuple[float, float], looks: int, drift: float = 0.0, seed: int = 1):
    """Look at a clock that is `offset` s ahead, over a line that takes up to `way_s` there and back."""
    chance = random.Random(seed)  # noqa: S311 - nothing secret
    found, stepped = ClockOffset(), False
    for k in range(looks):
        sent = 1_800_000_000.0 + k
        there, back = (chance.uniform(0.2, 1.0) * way for way in way_s)
        told = round((sent + there) + offset + drift * k, 3)
        stepped |= found.see(told, sent, sent + there + back)
    return found, stepped


def test_a_clock_that_may_be_right_is_taken_to_be_right():
    found, _ = watched(0.0, way_s=(0.002, 0.002), looks=50)
    assert found.value == 0.0


def test_an_offset_of_milliseconds_is_told_from_none_over_a_slow_way():
    found, _ = watched(0.008, way_s=(0.04, 0.04), looks=200)
    assert found.value == pytest.approx(0.008, abs=0.003)


def test_an_offset_is_found_within_its_stated_uncertainty():
    worst = 0.0
    for seed in range(100):
        offset = random.Random(seed).uniform(-0.4, 0.4)  # noqa: S311
        found, stepped = watched(offset, way_s=(0.001, 0.001), looks=60, seed=seed)
        assert not stepped
        assert abs(found.value - offset) <= found.uncertainty_s
        worst = max(worst, abs(found.value - offset))
    print(f"worst error of the offset over a 1 ms line: {worst * 1e3:.3f} ms")
    assert worst < 0.0011


@pytest.mark.parametrize("offset", [-0.9e-3, -0.6e-3, 0.3e-3, 0.9e-3])
def test_an_offset_below_the_printed_digit_is_found_where_answers_differ_in_it(offset):
    found = ClockOffset()
    for k in range(64):
        sent = 1_800_000_000.0 + 0.7137618 * k  # another part of a millisecond each time
        found.see(round(sent + 0.001 + offset, 3), sent, sent + 0.002)
    missed = found.value - offset
    print(f"{1e3 * offset:+.1f} ms: {1e3 * missed:+.4f} ms off, {3600.0 * abs(missed):.2f}″ at 1°/s")
    assert abs(missed) < 5e-5


def test_a_right_clock_asked_at_the_same_part_of_each_millisecond_is_taken_to_be_right():
    found = ClockOffset()
    for k in range(64):
        sent = 1_800_000_000.0004 + k
        found.see(round(sent + 0.001, 3), sent, sent + 0.002)
    assert found.value == 0.0


def test_a_slow_way_states_a_large_uncertainty():
    found, _ = watched(0.2, way_s=(0.3, 0.3), looks=10)
    assert found.uncertainty_s > 0.05
    assert abs(found.value - 0.2) <= found.uncertainty_s


def test_a_drifting_clock_is_no_step_and_is_followed():
    found, stepped = watched(0.05, way_s=(0.001, 0.001), looks=600, drift=1e-4)
    assert not stepped
    assert found.value == pytest.approx(0.05 + 599 * 1e-4, abs=0.0006)
    assert found.at(1_800_000_609.0) == pytest.approx(0.05 + 609 * 1e-4, abs=0.0006)


def seen_at_a_slew(ppm, assumed_ppm, looks):
    """A clock that gains, seen four times a second; and by how much 40 s later is missed, seconds."""
    found, chance = ClockOffset(), random.Random(3)  # noqa: S311 - nothing secret
    found.assumed_gain = 1e-6 * assumed_ppm
    for k in range(looks):
        sent = 1_800_000_000.0 + 0.25 * k + chance.uniform(0.0, 0.001)
        found.see(round((sent + 0.001) + 1e-6 * ppm * 0.25 * k, 3), sent, sent + 0.002)
    later = 0.25 * looks + 40.0
    missed = found.at(1_800_000_000.0 + later) - 1e-6 * ppm * later
    print(f"{ppm:+g} ppm, assumed {assumed_ppm:+g}, {looks} looks: {1e3 * missed:+.3f} ms off 40 s later")
    return found, missed


@pytest.mark.parametrize("ppm", [50.0, -50.0])
@pytest.mark.parametrize("assumed_ppm", [0.0, 20.0])
def test_a_gain_is_known_after_half_a_minute_of_a_slews_looks(ppm, assumed_ppm):
    assert abs(seen_at_a_slew(ppm, assumed_ppm, 120)[1]) < 3e-4


@pytest.mark.parametrize("ppm", [50.0, -50.0, 5.0])
@pytest.mark.parametrize("looks", [12, 120])
def test_a_gain_that_a_clock_had_before_is_assumed_from_the_first_looks_on(ppm, looks):
    assert abs(seen_at_a_slew(ppm, ppm, looks)[1]) < 3e-4


def test_a_right_clock_does_not_gain_by_the_steps_of_its_rounding():
    found = ClockOffset()
    for k in range(160):
        sent, step = 1_800_000_000.0 + 0.25 * k, -0.00045 if k < 80 else 0.00045
        found.see(sent + 0.001 + step, sent, sent + 0.002)
    assert found.value == found.line.gain == 0.0


@pytest.mark.parametrize("assumed_ppm", [50.0, -50.0])
def test_a_clock_that_no_longer_gains_is_believed_after_half_a_minute(assumed_ppm):
    found, missed = seen_at_a_slew(0.0, assumed_ppm, 120)
    assert found.value == found.line.gain == missed == 0.0


def test_a_gain_at_the_edge_of_being_one_does_not_come_and_go():
    found, chance, steps = ClockOffset(), random.Random(5), []  # noqa: S311 - nothing secret
    for k in range(300):
        sent, before = 1_800_000_000.0 + 0.5 * k + chance.uniform(0.0, 0.001), found.value
        found.see(round((sent + 0.02) + 0.006 + 20e-6 * 0.5 * k, 3), sent, sent + 0.04)
        steps.append(abs(found.value - before))
    changes = sum(step > 3e-4 for step in steps[1:])
    print(f"{changes} changes by more than 0.3 ms")
    assert changes <= 2


def test_a_clock_that_was_set_is_noticed():
    found, _ = watched(0.3, way_s=(0.001, 0.001), looks=10)
    sent = 1_800_000_100.0
    assert found.see(sent + 0.001, sent, sent + 0.002)
    assert found.value == 0.0


def test_a_first_answer_that_was_long_under_way_makes_no_step_of_the_next_one():
    sent, found = 1_800_000_000.0, ClockOffset()
    assert not found.see(sent + 0.001, sent, sent + 0.4)
    assert not found.see(sent + 1.001, sent + 1.0, sent + 1.002)
    assert found.value == 0.0
    assert found.uncertainty_s < 0.003


def test_nothing_is_known_before_the_first_answer():
    assert not ClockOffset().known
    assert ClockOffset().value == 0.0
