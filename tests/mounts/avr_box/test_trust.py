"""How surely it is stated where a box is: its line, its clock and its assumptions may be otherwise than they seem."""

import re
from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, Bench, Line, coarser_table, like
from avr_faults import Watch

from mounts.avr_box.reasons import BAD_LINE, CREEPS, STEPPED
from mounts.avr_box.trust import BELIEVED, GUIDES, MOVES, Trust

BLIND = replace(SETTINGS, encoder_counts_per_turn=0)


def test_a_command_is_believed_after_so_many_answers_in_a_row_and_a_flaw_begins_them_anew():
    trust = Trust()
    trust.sent("M", 10.0)
    for _ in range(BELIEVED - 1):
        trust.answered()
    trust.sent("+", 20.0)
    assert (trust.since(MOVES), trust.since(GUIDES), trust.since()) == (10.0, 20.0, 10.0)
    trust.flawed()
    trust.answered()
    assert trust.since() == 10.0
    for _ in range(BELIEVED - 1):
        trust.answered()
    assert trust.complete
    assert trust.flaws == 1


def blind(**changes):
    bench = Bench(BLIND, like(encoder_counts_per_turn=0, **changes))
    bench.connect()
    return bench, Watch(bench.box, bench.drive)


def slewed(bench, *targets):
    bench.slew(*targets)
    for _ in range(100):
        bench.read()
        bench.clock.sleep(0.25)
    return bench.read()


OPPOSITE = {
    "half": {"move_count": "half"},
    "axis bit": {"axis_bit": 0},
    "reversed": {"reversed1": True, "reversed2": True},
    "slew table": {"slew_table": coarser_table()},
    "north": {"north_reversed": True},
    "guide counts": {"guide_counts": 8},
    "guiding ends": {"guide_ends": "whole"},
    "busy": {"busy": "ignore"},
    "table clocks": {"table_clocks": "byte"},
    "single steps": {"fine_compare": 63},
    "interrupted": {"interrupted": "kept"},
    "crystal": {"clock_drift_ppm": 90.0},
}


@pytest.mark.parametrize("encoders", [0, 20000])
@pytest.mark.parametrize("changes", OPPOSITE.values(), ids=OPPOSITE)
def test_an_assumption_that_is_wrong_is_within_what_every_reading_states_or_leaves_it_unsynchronised(
    changes, encoders
):
    unit = like(encoder_counts_per_turn=encoders, **changes)
    bench = Bench(replace(SETTINGS, encoder_counts_per_turn=encoders), unit)
    bench.connect()
    watch = Watch(bench.box, bench.drive)
    bench.slew(200_000.0, -100_000.0)
    path = Line((bench.read().axes[0].counts, -100_000.0), (SIDEREAL, 0.7), bench.clock.now())
    bench.follow(path, 300.0)
    print(f"\n{watch.readings} readings, {watch.ratio:.2f} of what was stated")
    assert watch.readings
    assert not watch.wrong


CREEPING = {
    "guide counts, twice as many": (0, {"guide_counts": 8}, (0.983 * SIDEREAL, 0.0), 700.0),
    "guide counts, half as many": (0, {"guide_counts": 2}, (0.983 * SIDEREAL, 0.0), 900.0),
    "north": (1, {"north_reversed": True}, (SIDEREAL, 5.0), 300.0),
}


@pytest.mark.parametrize(("axis", "changes", "rates", "seconds"), CREEPING.values(), ids=CREEPING)
def test_what_leads_an_axis_astray_bit_by_bit_is_told_with_the_key_that_is_wrong(axis, changes, rates, seconds):
    bench = Bench(unit=like(**changes))
    bench.connect()
    bench.follow(Line((0.0, 0.0), rates, bench.clock.now()), seconds)
    assert CREEPS[axis] in bench.drive.notes
    assert CREEPS[1 - axis] not in bench.drive.notes


def test_nothing_is_said_to_lead_astray_what_goes_as_it_should():
    bench = Bench(unit=like(clock_drift_ppm=90.0))
    bench.connect()
    bench.follow(Line((0.0, 0.0), (0.983 * SIDEREAL, 5.0), bench.clock.now()), 700.0)
    assert not set(CREEPS) & set(bench.drive.notes)


def test_without_encoders_it_is_said_how_far_moves_may_lead_elsewhere_until_a_sync_has_shown_that_they_do_not():
    bench, _ = blind()
    assert "no `sync` has shown" not in " ".join(bench.drive.notes)
    slewed(bench, 663_273.0, -331_636.0)  # 10° each
    said = " ".join(bench.drive.notes)
    assert re.search(r"axis 1 may be 25\.\d° off, axis 2 40\.\d°, if `move_count`", said)  # 20° + 5°, 20° + 20°
    bench.drive.sync(bench.true(), bench.clock.now())
    assert "no `sync` has shown" not in " ".join(bench.drive.notes)


def test_without_encoders_a_sync_after_a_slew_that_went_right_shows_that_moves_mean_what_is_taken_for_it():
    bench, _ = blind()
    before = slewed(bench, 100_000.0, -80_000.0)
    assert before.axes[1].uncertainty_counts > 80_000.0  # it may have gone the other way
    bench.drive.sync(bench.true(), bench.clock.now())
    after = slewed(bench, 200_000.0, -160_000.0)
    assert after.axes[1].uncertainty_counts == pytest.approx(0.5)
    assert Bench(BLIND, memory=dict(bench.drive.memory), box=bench.box, clock=bench.clock).drive._doubt.proved


def test_without_encoders_a_sync_far_from_where_a_slew_should_have_led_shows_nothing():
    bench, _ = blind(move_count="half")
    slewed(bench, 100_000.0, -80_000.0)
    bench.drive.sync(bench.true(), bench.clock.now())
    assert slewed(bench, 200_000.0, -160_000.0).axes[1].uncertainty_counts > 80_000.0


def test_without_encoders_a_lost_answer_after_a_command_leaves_the_position_unknown_and_one_before_it_does_not():
    bench, _ = blind()
    slewed(bench, 10_000.0, -8000.0)
    assert bench.drive._box.trust.complete
    bench.drive._box.trust.flawed()
    assert bench.read().unsynchronised == ""
    bench.slew(20_000.0, -8000.0)
    bench.drive._box.trust.flawed()
    assert bench.read().unsynchronised == BAD_LINE


def stepped(bench, seconds):
    """Let this computer's clock go on by so many seconds that never were."""
    bench.read()
    bench.box._t0 += seconds
    bench.clock.sleep(seconds)


@pytest.mark.parametrize("seconds", [0.3, 1.0, 3.0, 10.0, 3600.0])
@pytest.mark.parametrize("encoders", [0, 20000])
def test_a_clock_that_was_set_is_noticed_by_the_ticks_or_within_what_is_stated(seconds, encoders):
    bench = Bench(replace(SETTINGS, encoder_counts_per_turn=encoders))
    bench.connect()
    bench.follow(Line((0.0, 0.0), (SIDEREAL, 0.0), bench.clock.now()), 60.0)
    stepped(bench, seconds)
    bench.follow(Line((bench.read().axes[0].counts, 0.0), (SIDEREAL, 0.0), bench.clock.now()), 30.0)
    reading = bench.read()
    bench.box.advance(reading.time)
    off = abs(reading.axes[0].counts - bench.box.true_position(1))
    print(f"\n{seconds} s: {off:.0f} microsteps, stated {reading.axes[0].uncertainty_counts:.0f}")
    assert reading.unsynchronised or off <= reading.axes[0].uncertainty_counts
    if not encoders and seconds >= 3.0:
        assert reading.unsynchronised == STEPPED
