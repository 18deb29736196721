"""Words that a person writes in RAM and commits: what is kept for good, and that the position is kept meanwhile."""

import os
from contextlib import suppress
from dataclasses import replace
from functools import partial

import pytest
from awr_bench import SETTINGS, SIDEREAL, Bench, Line

from mounts.awr.dead_man_frames import safe_frames
from mounts.awr.errors import AwrError
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"


def next_program(bench, settings=SETTINGS):
    """The same unit in the hands of a program that begins with what the last one remembered."""
    again = Bench(settings, memory=dict(bench.kept), clock=bench.clock)
    again.awr = again.line.device = bench.awr
    return again


@pytest.mark.parametrize("rates", [(0.0, 0.0), (2.4 * SIDEREAL, 30.0)], ids=["at rest", "tracking"])
def test_a_commit_keeps_the_position(rates):
    bench = Bench()
    bench.connect(make_safe=True)
    bench.slew(200.0, 200.0, rates=rates)
    before = bench.off()
    bench.drive.hand.soft_write("guide_up_counts", 50000)
    assert bench.drive.hand.commit() == ("guide_up_counts",)
    bench.clock.sleep(60.0)
    bench.read()
    moved = [abs(now - then) for now, then in zip(bench.off(), before, strict=True)]
    print(f"\n{max(moved):.2f} steps off by a commit")
    assert max(moved) < 0.5
    assert dict(bench.awr.wear) == {0x05: 1}
    assert [axis.rate for axis in bench.drive.axes] == pytest.approx(rates, rel=1e-3)


def test_a_drive_that_a_person_sets_is_reckoned_from_when_it_was_heard_and_reload_takes_it_back():
    bench = Bench()
    bench.connect()
    for name, value in (("drive_dec_counts", 20000), ("drive_dec_flags", 0x0103)):
        bench.drive.hand.soft_write(name, value)
        bench.clock.sleep(5.0)
        bench.read()
    assert bench.drive.axes[1].rate
    bench.drive.hand.discard()
    bench.clock.sleep(5.0)
    bench.read()
    assert max(map(abs, bench.off())) < 0.5


def test_a_commit_keeps_no_word_of_an_earlier_program_on_a_unit_that_tells_no_ram():
    bench = Bench(unit=SimulatorSettings(reads_ram=False))
    bench.connect()
    bench.slew(3000.0, 3000.0, rates=(40.0, 5.0))
    bench.drive.close(bench.clock.now(), keep_tracking=True)
    again = next_program(bench)
    again.connect()
    again.drive.hand.soft_write("guide_up_counts", 50000)
    again.drive.hand.commit()
    assert dict(bench.awr.wear) == {0x05: 1}


@pytest.mark.parametrize("reads_ram", [True, False])
def test_the_next_program_commits_what_one_before_it_was_told_to_write(reads_ram):
    bench = Bench(unit=SimulatorSettings(reads_ram=reads_ram))
    bench.connect(make_safe=True)
    bench.drive.hand.soft_write("guide_up_counts", 50000)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    looking = next_program(bench)
    looking.connect()
    looking.drive.close(bench.clock.now(), keep_tracking=False)
    again = next_program(looking)
    again.connect()
    assert again.drive.hand.commit() == ("guide_up_counts",)
    assert dict(bench.awr.wear) == {0x05: 1}
    last = next_program(again)
    last.connect()
    with pytest.raises(AwrError, match="nothing was soft-written"):
        last.drive.hand.commit()


def test_what_was_written_before_the_power_was_cut_is_committed_by_nobody():
    bench = Bench()
    bench.connect(make_safe=True)
    bench.drive.hand.soft_write("guide_up_counts", 50000)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    bench.awr.ram = dict(bench.awr.lasting)
    again = next_program(bench)
    assert "switched off and on" in again.connect().unsynchronised
    with pytest.raises(AwrError, match="nothing was soft-written"):
        again.drive.hand.commit()


@pytest.mark.parametrize("cut", [False, True], ids=["on", "off and on"])
def test_a_unit_that_tells_no_ram_is_at_rest_where_it_was_left_so_and_said_to_be_as_far_off_as_it_may_be(cut):
    bench = Bench(unit=SimulatorSettings(reads_ram=False))
    bench.connect(make_safe=True)
    bench.slew(3000.0, 3000.0)
    bench.drive.stop(bench.clock.now())
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    if cut:
        bench.awr.ram = dict(bench.awr.lasting)
        bench.awr._aim()
    bench.clock.sleep(60.0)
    again = next_program(bench)
    reading = again.connect()
    assert not reading.unsynchronised
    assert any("may have been switched off and on in the 6" in note for note in again.drive.notes)
    one, two = (axis.uncertainty_counts for axis in reading.axes)
    assert one == pytest.approx(61.0 * SIDEREAL, rel=0.05)
    assert two < 10.0
    off = again.off()
    assert abs(off[0]) < one
    assert (abs(off[0]) > 0.9 * one) == cut
    assert abs(off[1]) < two
    again.drive.sync(again.true(), again.clock.now())
    again.clock.sleep(600.0)
    reading = again.read()
    assert not reading.tracking
    assert not reading.unsynchronised
    assert max(map(abs, again.off())) < 0.5
    again.slew(2000.0, 1000.0)
    assert max(map(abs, again.off())) < 3.0


def test_the_position_of_a_unit_that_tells_no_ram_is_lost_where_it_may_be_far_off():
    bench = Bench(replace(SETTINGS, near=(60_000.0, 60_000.0)), unit=SimulatorSettings(reads_ram=False))
    bench.connect(make_safe=True)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    bench.kept = dict(bench.drive.memory)
    bench.clock.sleep(1300.0)
    again = next_program(bench, replace(SETTINGS, near=(60_000.0, 60_000.0)))
    assert "may be 65" in again.connect().unsynchronised


@pytest.mark.parametrize("after_s", [0.3, 2.0])
def test_where_a_dead_man_has_switched_the_drives_off_it_is_stated_how_far_that_may_be(after_s):
    bench = Bench()
    bench.connect(make_safe=True)
    path = Line((0.0, 0.0), (180.0, -30.0), bench.clock.now())
    bench.follow(path, 5.0)
    bench.read()
    kept = dict(bench.drive.memory)  # the owner is killed
    bench.clock.sleep(after_s)
    for frame in safe_frames():
        bench.awr.receive(frame.data, bench.clock.now())
    bench.clock.sleep(8.0)
    bench.kept = kept
    again = next_program(bench)
    reading = again.connect(make_safe=True)
    assert not reading.unsynchronised
    assert not reading.tracking
    assert any("as since a dead-man process switched them off" in note for note in again.drive.notes)
    for axis, off in zip(reading.axes, again.off(), strict=True):
        print(f"{off:+.0f} steps off, ±{axis.uncertainty_counts:.0f} stated")
        assert 0.5 * axis.uncertainty_counts < abs(off) < axis.uncertainty_counts


def test_a_commit_on_a_bad_line_leaves_the_position_right_or_says_how_far_it_may_be_off():
    wrong, unknown, runs = [], 0, 120 if FULL else 24
    for seed in range(80, 80 + runs):
        bench = Bench(seed=seed)
        bench.connect(make_safe=True)
        bench.slew(200.0, 200.0, rates=(0.0, 0.0))
        bench.line.garbles, bench.line.rate = False, 0.1
        with suppress(TransportError, DriveError):
            bench.drive.hand.soft_write("guide_up_counts", 50000)
            bench.drive.hand.commit()
        bench.line.rate = 0.0
        for _ in range(4):
            bench.clock.sleep(1.0)
            reading = bench.read()
        assert bench.drive.words.ram == bench.awr.ram | {0xFF: bench.awr.version}
        unknown += bool(reading.unsynchronised)
        stated = [3.0 * axis.uncertainty_counts + 1.0 for axis in reading.axes]
        if not reading.unsynchronised and any(abs(o) > most for o, most in zip(bench.off(), stated, strict=True)):
            wrong.append((seed, bench.off()))
        assert set(bench.awr.wear) <= {0x05}
    print(f"\n{runs} commits with every tenth packet damaged: unsynchronised in {unknown}, wrong in {len(wrong)}")
    assert not wrong


@pytest.mark.parametrize("value", [19000, 20000], ids=["another", "the same"])
@pytest.mark.parametrize("reads_ram", [True, False])
def test_the_word_by_which_a_unit_is_known_again_may_be_written_and_committed(value, reads_ram):
    bench = Bench(unit=SimulatorSettings(reads_ram=reads_ram))
    bench.connect(make_safe=True)
    bench.drive.hand.soft_write("max_accel_dec", value)
    bench.clock.sleep(5.0)
    assert not bench.read().unsynchronised
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    again = next_program(bench)
    assert not again.connect().unsynchronised
    if value != bench.awr.lasting[0x17]:
        assert again.drive.hand.commit() == ("max_accel_dec",)
        assert bench.awr.lasting[0x17] == value
    again.clock.sleep(5.0)
    assert not again.read().unsynchronised
    again.drive.close(again.clock.now(), keep_tracking=False)
    if reads_ram:
        bench.awr.ram = dict(bench.awr.lasting)
        assert "switched off and on" in next_program(again).connect().unsynchronised


@pytest.mark.parametrize("tracking", [False, True], ids=["at rest", "tracking"])
def test_a_sense_that_a_person_writes_reloads_or_commits_makes_the_position_unknown(tracking):
    bench = Bench()
    bench.connect(make_safe=not tracking)
    hand = bench.drive.hand
    turned = partial(hand.soft_write, "directions", 0x2)
    for turn in (turned, hand.discard, turned, hand.commit):
        assert not bench.read().unsynchronised
        turn()
        assert "direction senses" in bench.read().unsynchronised
        bench.drive.sync(bench.true(), bench.clock.now())
    hand.soft_write("directions", 0x2)
    assert not bench.read().unsynchronised  # it is so already


def test_a_sense_that_is_another_in_ram_since_a_program_looked_makes_the_position_unknown():
    bench = Bench()
    bench.connect(make_safe=True)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    bench.kept = dict(bench.drive.memory)
    bench.awr.ram[0x00] ^= 0x2
    again = next_program(bench)
    assert "direction senses" in again.connect().unsynchronised
    again.drive.sync(again.true(), again.clock.now())
    again.drive.close(again.clock.now(), keep_tracking=False)
    again.kept = dict(again.drive.memory)
    assert not next_program(again).connect().unsynchronised
