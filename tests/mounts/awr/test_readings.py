"""Readings of the manual that are wrong for a unit: it is noticed and said, or cannot matter."""

from dataclasses import replace

import pytest
from awr_bench import SETTINGS, SIDEREAL, Bench, Line

from mounts.awr.simulator_settings import SimulatorSettings
from mounts.errors import DriveRefused

SLOW = 0.7  # steps/s in declination, as of the Moon: too slow for the usual postscaler


def followed(bench, rates, seconds):
    """Both axes led on a path; returns the worst of off and stated, steps, and how often it was not within."""
    bench.connect()
    bench.drive.sync(bench.true(), bench.clock.now())
    path = Line(bench.true(), rates, bench.clock.now())
    worst, outside = (0.0, 0.0), 0
    for _ in range(seconds // 10):
        bench.follow(path, 10.0)
        reading = bench.read()
        for off, axis in zip(bench.off(), reading.axes, strict=True):
            worst = max(worst, (abs(off), axis.uncertainty_counts))
            outside += abs(off) > axis.uncertainty_counts
    return worst, outside


@pytest.mark.parametrize(("configured", "true"), [("times", "plus-one"), ("plus-one", "times")])
def test_a_rate_at_a_postscaler_that_is_read_otherwise_is_off_by_no_more_than_is_stated(configured, true):
    bench = Bench(replace(SETTINGS, postscaler=configured), SimulatorSettings(postscaler=true))
    (off, stated), outside = followed(bench, (SIDEREAL, SLOW), 300)
    print(f"\n{configured} where it is {true}: {off:.1f} steps off after 300 s, {stated:.1f} stated")
    assert off > 10.0
    assert not outside
    assert any("postscaler" in note for note in bench.drive.notes)


@pytest.mark.parametrize("both", ["times", "plus-one"])
def test_a_postscaler_that_was_seen_to_be_as_configured_makes_nothing_unsure(both):
    bench = Bench(replace(SETTINGS, postscaler=both), SimulatorSettings(postscaler=both))
    bench.drive.proof.confirmed({"drive.postscaler"})
    (off, stated), outside = followed(bench, (SIDEREAL, SLOW), 300)
    print(f"\n{both}: {off:.2f} steps off, {stated:.2f} stated")
    assert stated < 3.0
    assert not outside


def test_how_the_postscaler_is_read_cannot_matter_at_the_one_that_all_rates_have():
    ends = []
    for true in ("times", "plus-one"):
        bench = Bench(SETTINGS, SimulatorSettings(postscaler=true))
        (off, stated), outside = followed(bench, (1.03 * SIDEREAL, 20.0), 60)
        assert off < stated < 3.0
        assert not outside
        ends.append(bench.true())
    assert ends[0] == pytest.approx(ends[1], abs=0.01)


def test_a_unit_that_tells_the_lasting_word_where_ram_was_asked_is_named_with_the_key_that_is_to_be_set():
    unit = SimulatorSettings(reads_plain=True)
    with pytest.raises(DriveRefused, match=r"tells the non-volatile word .* set \[drive\] reads_ram = false"):
        Bench(unit=unit).connect()
    bench = Bench(replace(SETTINGS, reads_ram=False), unit)
    bench.connect()
    bench.slew(1e4, -1e4)
    assert max(map(abs, bench.off())) < 3.0
    assert not bench.read().unsynchronised


@pytest.mark.parametrize(
    "ways", [{"write_answer": "AAY"}, {"stop": "never"}, {"stop": "always", "firmware": 0.59}], ids=str
)
def test_how_writes_are_answered_and_packets_end_cannot_matter(ways):
    bench = Bench(unit=SimulatorSettings(**ways))
    bench.connect()
    bench.slew(1e4, -1e4)
    assert max(map(abs, bench.off())) < 3.0
    assert not bench.read().unsynchronised
    assert bench.unit.damaged == 0
