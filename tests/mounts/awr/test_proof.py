"""No goto leads far before the sky has shown that keys move the axes as far, and the way, that is assumed."""

from dataclasses import replace

import pytest
from awr_bench import SETTINGS, Bench

from mounts.awr.factory import factory
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.errors import DriveRefused

FAR, NEAR = 4e5, 6e4  # steps; 33° and 5°
CAREFUL = replace(SETTINGS, near=(NEAR, NEAR))
UNITS = {"frequency_unit": 2.0, "acceleration_unit": 2.0}


def led(settings=CAREFUL, way=(3e4, 3e4), **opposite):
    """A telescope after a goto of 2.5° and a sync on what it truly points at."""
    bench = Bench(settings, unit=SimulatorSettings(words=factory(), **opposite))
    bench.connect()
    bench.slew(*way)
    bench.drive.sync(bench.true(), bench.clock.now())
    return bench


def goes_far(bench, axis):
    here = bench.true()
    targets = [here[i] + (FAR if i == axis else 0.0) for i in (0, 1)]
    try:
        bench.slew(*targets)
    except DriveRefused as refused:
        return "nobody has seen yet" not in str(refused)
    return True


def test_a_sync_after_a_way_by_keys_that_agrees_frees_both_axes_for_good():
    bench = led()
    assert goes_far(bench, 0)
    assert goes_far(bench, 1)
    again = Bench(CAREFUL, memory=dict(bench.drive.memory), clock=bench.clock)
    again.line.device = again.awr = bench.awr
    again.connect()
    assert goes_far(again, 0)


@pytest.mark.parametrize(
    ("opposite", "free"),
    [(UNITS, (False, False)), ({"sense1": -1}, (False, True)), ({"sense2": -1}, (True, False))],
    ids=str,
)
def test_a_sync_that_shows_another_scale_or_sense_frees_no_axis_and_is_said(opposite, free):
    bench = led(**opposite)
    assert any("are not as configured" in note for note in bench.drive.notes)
    assert (goes_far(bench, 0), goes_far(bench, 1)) == free


def test_a_way_too_short_to_tell_frees_no_axis():
    bench = led(way=(3e3, 3e3))
    assert not goes_far(bench, 0)
    assert not goes_far(bench, 1)


def test_what_was_seen_with_other_units_is_not_believed():
    bench = led()
    memory = dict(bench.drive.memory)
    again = Bench(replace(CAREFUL, frequency_unit=1.5, acceleration_unit=1.5), memory=memory, clock=bench.clock)
    again.line.device = again.awr = bench.awr
    again.connect()
    assert not goes_far(again, 0)


def test_a_sync_of_an_axis_that_was_lost_tells_nothing():
    bench = Bench(CAREFUL)
    bench.connect()
    bench.slew(3e4, 3e4)
    bench.awr.override(stopped=True)
    bench.clock.sleep(0.5)
    assert bench.read().unsynchronised
    bench.awr.override(stopped=False)
    bench.clock.sleep(0.5)
    bench.read()
    bench.drive.sync(bench.true(), bench.clock.now())
    assert not goes_far(bench, 0)
