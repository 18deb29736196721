"""By which clock the keys of an AWR Microstep are timed."""

from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives.awr.kind import drive
from mounts.steady import SteadyClock


def test_keys_of_a_unit_are_timed_by_a_clock_that_nobody_sets(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(
        '[drive]\nkind = "awr"\nlink = "tcp://127.0.0.1:9"\nsidereal_steps_per_s = 50.0\n'
        "[axis2]\nsteps_per_degree = 12000.0\n"
    )
    clock = SystemClock()
    awr, _ = drive(load(path), clock, (), {}, lambda _: None)
    assert isinstance(awr.unit._clock, SteadyClock)
    assert abs(awr.unit.now() - clock.now()) < 1.0
