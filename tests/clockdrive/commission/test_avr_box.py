"""Commissioning a stepper box whose ways are opposite to what is configured, one after the other."""

import pytest
from telescope_bench import T0

from clockdrive import Telescope, VirtualClock

CASES = [
    ({}, {}),
    ({"simulator.move_count": "half"}, {"move count": "half"}),
    ({"simulator.move_count": "half", "drive.move_count": "half"}, {}),
    ({"drive.move_count": "half"}, {"move count": "total"}),
    ({"simulator.axis_bit": 0}, {"axis bit": 0}),
    ({"simulator.guide_counts": 3}, {"guide counts": 3}),
    ({"drive.guide_counts": 6}, {"guide counts": 4}),
    ({"simulator.encoder_counts_per_turn": 10000}, {"encoder ratio": 10000}),
    (
        {"simulator.encoder_counts_per_turn": 32768, "simulator.move_count": "half"},
        {"encoder ratio": 32800, "move count": "half"},
    ),
    ({"simulator.encoder_reversed1": True}, {"axis1 sense": None}),
    ({"simulator.encoder_reversed2": True}, {"axis2 sense": None}),
    ({"simulator.reversed1": True}, {"axis1 sense": None}),
    ({"simulator.reversed2": True}, {"axis2 sense": None}),
    ({"simulator.north_reversed": True}, {"north": True}),
]


@pytest.mark.parametrize(("ways", "expected"), CASES, ids=[" ".join(ways) or "as configured" for ways, _ in CASES])
def test_what_is_opposite_is_refuted_with_what_it_is_and_all_else_confirmed(tmp_path, ways, expected):
    overrides = {"state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0, **ways}
    with Telescope.simulated("avr-box", clock=VirtualClock(T0), overrides=overrides) as scope:
        scope.simulator.advance(T0)
        began = [scope.simulator.true_position(axis) for axis in (1, 2)]
        found = {each.subject: each for each in scope.commission()}
        scope.simulator.advance(scope.clock.now())
        turns = (23_877_818.0, 11_938_909.0)
        far = [360.0 * abs(scope.simulator.true_position(i + 1) - began[i]) / turns[i] for i in (0, 1)]
    refuted = {name: each.found for name, each in found.items() if each.verdict == "refuted"}
    for name in ("move count", "guide counts", "encoder ratio"):
        print(f"\n{ways}: {found[name].detail}", end="")
    print(f"\n{far[0]:.2f}° and {far[1]:.2f}° from where it began")
    assert refuted == expected
    assert {"axis bit", "move count", "axis1 sense", "axis2 sense", "encoder ratio", "guide counts"} <= set(found)
    unsaid = {"link", "north"} if "axis2 sense" in expected else {"link"}
    assert all(found[name].verdict in {"confirmed", "refuted"} for name in found if name not in unsaid)
    assert max(far) < 2.0


def test_without_encoders_nothing_is_moved_to_find_out(tmp_path):
    overrides = {"state.path": str(tmp_path), "drive.encoder_counts_per_turn": 0}
    with Telescope.simulated("avr-box", clock=VirtualClock(T0), overrides=overrides) as scope:
        before = scope.simulator.motors[1].position
        assert {each.subject for each in scope.commission()} == {"link"}
        assert scope.simulator.motors[1].position == before
