"""Axis controllers are commissioned: what is otherwise than configured is found, and the axes stand afterwards."""

import pytest
from apo_bench import apo_telescope

WRONG = {"simulator__on_expiry": "extrapolate", "simulator__max_nodes": 20}


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_controllers_that_are_as_configured_are_confirmed(kind, tmp_path):
    with apo_telescope(kind, tmp_path) as scope:
        findings = scope.commission(witness="simulator")
        assert {each.verdict for each in findings} <= {"confirmed", "measured", "untested"}
        confirmed = {each.subject for each in findings if each.verdict == "confirmed"}
        for i, name in enumerate(("azimuth", "altitude"), start=1):
            assert {f"{name} MAXV", f"{name} buffer", f"{name} expiry", f"axis{i} sense"} <= confirmed
        assert scope.status()["doing"] == "idle"


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_what_is_otherwise_is_found_with_its_key(kind, tmp_path):
    with apo_telescope(kind, tmp_path, **WRONG) as scope:
        findings = scope.commission(["buffer", "expiry"], witness="simulator")
        changes = {each.subject: (each.key, each.found) for each in findings if each.changes}
        print(*(f"{each.subject}: {each.detail}" for each in findings), sep="\n")
        for name in ("azimuth", "altitude"):
            assert changes[f"{name} buffer"] == ("drive.max_nodes", 20)
            assert changes[f"{name} expiry"] == ("drive.on_expiry", "extrapolate")
        scope.wait(10.0)
        scope.simulator.advance(scope.clock.now())
        assert all(axis.servo.velocity == 0.0 for axis in scope.simulator.axes)
