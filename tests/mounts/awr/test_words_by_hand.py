"""Words that a person writes in RAM and commits: what is kept for good, and that the position is kept meanwhile."""

import os
from contextlib import suppress

import pytest
from awr_bench import SIDEREAL, Bench

from mounts.awr.errors import AwrError
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.errors import DriveError
from transports.errors import TransportError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"


def next_program(bench):
    """The same unit in the hands of a program that begins with what the last one remembered."""
    again = Bench(memory=dict(bench.kept), clock=bench.clock)
    again.awr = again.line.device = bench.awr
    return again


@pytest.mark.parametrize("rates", [(0.0, 0.0), (2.4 * SIDEREAL, 30.0)], ids=["at rest", "tracking"])
def test_a_commit_keeps_the_position(rates):
    bench = Bench()
    bench.connect(make_safe=True)
    bench.slew(200.0, 200.0, rates=rates)
    before = bench.off()
    bench.drive.soft_write("guide_up_counts", 50000)
    assert bench.drive.commit() == ("guide_up_counts",)
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
        bench.drive.soft_write(name, value)
        bench.clock.sleep(5.0)
        bench.read()
    assert bench.drive.axes[1].rate
    bench.drive.discard()
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
    again.drive.soft_write("guide_up_counts", 50000)
    again.drive.commit()
    assert dict(bench.awr.wear) == {0x05: 1}


@pytest.mark.parametrize("reads_ram", [True, False])
def test_the_next_program_commits_what_one_before_it_was_told_to_write(reads_ram):
    bench = Bench(unit=SimulatorSettings(reads_ram=reads_ram))
    bench.connect(make_safe=True)
    bench.drive.soft_write("guide_up_counts", 50000)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    looking = next_program(bench)
    looking.connect()
    looking.drive.close(bench.clock.now(), keep_tracking=False)
    again = next_program(looking)
    again.connect()
    assert again.drive.commit() == ("guide_up_counts",)
    assert dict(bench.awr.wear) == {0x05: 1}
    last = next_program(again)
    last.connect()
    with pytest.raises(AwrError, match="nothing was soft-written"):
        last.drive.commit()


def test_what_was_written_before_the_power_was_cut_is_committed_by_nobody():
    bench = Bench()
    bench.connect(make_safe=True)
    bench.drive.soft_write("guide_up_counts", 50000)
    bench.drive.close(bench.clock.now(), keep_tracking=False)
    bench.awr.ram = dict(bench.awr.lasting)
    again = next_program(bench)
    assert "switched off and on" in again.connect().unsynchronised
    with pytest.raises(AwrError, match="nothing was soft-written"):
        again.drive.commit()


@pytest.mark.parametrize("cut", [False, True], ids=["on", "off and on"])
def test_a_unit_that_tells_no_ram_is_at_rest_where_it_was_left_so_and_unsynchronised(cut):
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
    assert "does not tell what its RAM holds" in again.connect().unsynchronised
    again.drive.sync(again.true(), again.clock.now())
    again.clock.sleep(600.0)
    reading = again.read()
    assert not reading.tracking
    assert not reading.unsynchronised
    assert max(map(abs, again.off())) < 0.5
    again.slew(2000.0, 1000.0)
    assert max(map(abs, again.off())) < 3.0


def test_a_commit_on_a_bad_line_leaves_the_position_right_or_says_how_far_it_may_be_off():
    wrong, unknown, runs = [], 0, 120 if FULL else 24
    for seed in range(80, 80 + runs):
        bench = Bench(seed=seed)
        bench.connect(make_safe=True)
        bench.slew(200.0, 200.0, rates=(0.0, 0.0))
        bench.line.garbles, bench.line.rate = False, 0.1
        with suppress(TransportError, DriveError):
            bench.drive.soft_write("guide_up_counts", 50000)
            bench.drive.commit()
        bench.line.rate = 0.0
        bench.clock.sleep(1.0)
        reading = bench.read()
        unknown += bool(reading.unsynchronised)
        stated = [3.0 * axis.uncertainty_counts + 1.0 for axis in reading.axes]
        if not reading.unsynchronised and any(abs(o) > most for o, most in zip(bench.off(), stated, strict=True)):
            wrong.append((seed, bench.off()))
        assert set(bench.awr.wear) <= {0x05}
    print(f"\n{runs} commits with every tenth packet damaged: unsynchronised in {unknown}, wrong in {len(wrong)}")
    assert not wrong
