"""The embedded simulator from one command to the next: as it was left, or anew where that cannot be read."""

import pytest
from telescope_bench import T0, simulated

from clockdrive.clock import VirtualClock
from clockdrive.configuration import load
from clockdrive.embedded import Embedded


class Store:
    """Remembers one snapshot."""

    def __init__(self, kept=None):
        self.kept = kept

    def simulator(self):
        return self.kept and (self.kept, T0)

    def record_simulator(self, snapshot, _):
        self.kept = dict(snapshot)


@pytest.mark.parametrize("kind", ["tc410", "avr-box", "apo", "awr"])
def test_a_simulator_whose_snapshot_lacks_anything_begins_anew_and_says_so(kind):
    given = {"drive.kind": kind, "drive.link": "sim:"}
    if kind == "awr":
        given |= {"drive.sidereal_steps_per_s": 50.0, "axis2.steps_per_degree": 12000.0}
    configuration, clock, store = load(None, {}, given), VirtualClock(T0), Store()
    first = Embedded(configuration, store, clock)
    assert (first.new, first.inherited) == (True, "")
    first.keep(at_once=True)
    whole = store.kept
    again = Embedded(configuration, Store(dict(whole)), clock)
    assert not again.new
    assert "goes on as it was left" in again.inherited
    for missing in whole:
        lacking = {name: value for name, value in whole.items() if name != missing}
        found = Embedded(configuration, Store(lacking), clock)
        assert found.new, missing
        assert "begins anew at park" in found.inherited
        assert found.device.snapshot().keys() == whole.keys()


def test_the_telescope_of_a_simulator_that_began_anew_is_synchronised_at_park(tmp_path):
    clock = VirtualClock(T0)
    with simulated("awr", tmp_path, clock) as scope:
        scope.goto("hadec:10,0")
        scope._store.record_simulator({"t0": clock.now()}, clock.now())
        scope._embedded.keep = lambda **_: None
    with simulated("awr", tmp_path, clock) as scope:
        status = scope.status().json
        assert status["synchronised"]
        truly = [scope.simulator.true_position(axis) for axis in (1, 2)]
        assert [axis["counts"] for axis in status["axes"]] == pytest.approx(truly, abs=1.0)
        assert any("begins anew at park" in event.text for event in scope.events())
