"""What a plan tells of a drive that is moved by keys: its presses, what each leaves to go, how sure the end is."""

import pytest
from telescope_bench import telescope

from clockdrive.drives.awr.kind import timing


def test_a_plan_tells_its_presses_with_their_errors_and_a_goto_ends_as_sure_as_that(tmp_path):
    with telescope(tmp_path, drive__kind="awr") as scope:
        plan = scope.plan("hadec:60,-10")
        for axis in plan.json["axes"]:
            speeds = [press["speed"] for press in axis["key_presses"]]
            errors = [press["error_arcsec"] for press in axis["key_presses"]]
            assert speeds[0] == "slew"
            assert errors == sorted(errors, reverse=True)
            assert errors[-1] < 0.45 < errors[0]  # a guide step: 0.1 s at 30 % of 15.04″/s
            assert 0.0 < axis["uncertainty_arcsec"] < 0.9
            assert sum(press["hold_s"] for press in axis["key_presses"]) == pytest.approx(axis["travel_s"], abs=3.0)
        one, two = (axis["travel_s"] for axis in plan.json["axes"])
        assert two < one - 10.0  # the axis that has less to go does not wait for the other
        goto = scope.goto("hadec:60,-10")
        print(f"arrived {goto.json['arrival_error_arcsec']:.2f}″ off, {goto.json['slews']} slew")
        assert goto.json["arrival_error_arcsec"] < 0.9
        told = scope._session.drive.registers()["last_goto"]
        assert told.startswith("slew ")
        assert "known to ±" in told


@pytest.mark.parametrize("baud", [2400, 9600])
def test_a_plan_that_asks_no_unit_has_its_keys_as_far_apart_as_one_of_a_unit_on_such_a_line(tmp_path, baud):
    with telescope(tmp_path, drive__kind="awr", simulator__baud=baud) as scope:
        drive = scope._session.drive
        asked, delay_s = drive.ladder.exchange_s, drive.unit.delay_s
        alone = timing(scope.configuration).slew[0].ladder.exchange_s
    print(f"\n{baud} baud: {1e3 * alone:.1f} ms, with a unit {1e3 * asked:.1f} ms")
    assert alone == pytest.approx(17 * 10 / baud + 0.002 + 4.0 * 2.0**0.5 * 0.005, abs=1e-9)
    assert asked == pytest.approx(alone + 2.0 * delay_s, abs=1e-9)
    assert delay_s < 2e-3
