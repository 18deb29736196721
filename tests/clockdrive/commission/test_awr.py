"""What a commissioning finds out about a simulated AWR Microstep of which the configuration is wrong."""

import pytest
from telescope_bench import T0

from clockdrive import Telescope, VirtualClock

CASES = [
    ({}, {}),
    ({"simulator.frequency_unit": 0.5}, {"frequency unit": 0.5}),
    ({"simulator.acceleration_unit": 2.0}, {"acceleration unit": 2.0}),
    ({"simulator.rate_reference": "sky"}, {"rate reference": "sky"}),
    ({"simulator.reversed2": True}, {"axis2 sense": True}),
    (
        {"simulator.backlash_arcsec": 60.0, "simulator.takes_up_backlash": False, "axis2.backlash_arcsec": 60.0},
        {"axis1 backlash": 60.0},
    ),
]


@pytest.mark.parametrize(("ways", "expected"), CASES, ids=[" ".join(ways) or "as configured" for ways, _ in CASES])
def test_what_is_opposite_is_refuted_with_what_it_is_and_all_else_confirmed(tmp_path, ways, expected):
    overrides = {"state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0, "limits.horizon_deg": -5.0, **ways}
    with Telescope.simulated("awr", clock=VirtualClock(T0), overrides=overrides) as scope:
        found = {each.subject: each for each in scope.commission(witness="simulator")}
        refuted = {name: each.found for name, each in found.items() if each.verdict == "refuted"}
        for each in found.values():
            print(each.subject, each.verdict, each.detail)
        assert set(refuted) == set(expected)
        for name, value in expected.items():
            assert refuted[name] == (pytest.approx(value, rel=0.03) if isinstance(value, float) else value)
        scope.wait(1.0)
        assert scope.status().json["synchronised"] is (not set(refuted) - {"axis2 sense", "axis1 backlash"})
        assert not scope.simulator.wear
        assert scope.simulator.keys == [0, 0]


def test_without_a_witness_nothing_is_moved_to_find_out(tmp_path):
    overrides = {"state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0}
    with Telescope.simulated("awr", clock=VirtualClock(T0), overrides=overrides) as scope:
        scope.simulator.advance(scope.clock.now())
        before = scope.simulator.true_position(2)
        found = {each.subject: each for each in scope.commission(only=["units"])}
        scope.simulator.advance(scope.clock.now())
        assert found["units"].verdict == "untested"
        assert scope.simulator.true_position(2) == before
