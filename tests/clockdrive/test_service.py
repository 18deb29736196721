"""Every door offers the same calls, with plain values."""

import json

import pytest
from telescope_bench import telescope

from clockdrive.errors import InputError
from clockdrive.service import Service


@pytest.fixture
def service(tmp_path):
    with telescope(tmp_path) as scope:
        yield Service(scope)


def call(service, name, **args):
    events = []
    return json.loads(json.dumps(service(name, args, events.append))), events


def test_each_call_answers_in_plain_values(service):
    arrived, events = call(service, "goto", target="best")
    assert arrived["slews"] == 1
    assert events[-1]["remaining_s"] == 0.0
    assert events[0]["eta_s"] == pytest.approx(arrived["eta_s"], abs=1e-3)
    for name, args in (
        ("plan", {"target": "Canopus"}), ("rates", {"target": "Canopus"}),
        ("plan", {"target": "Canopus", "rate_arcsec_s": [1.0, -1.0], "rate_from": "2027-01-15T08:00:00Z"}),
        ("rates", {"target": "Canopus", "rate_arcsec_s": [1.0, -1.0]}), ("registers", {}), ("status", {}),
        ("offset", {"east_arcsec": 1.0, "north_arcsec": 2.0}), ("clear", {"correction": "offset"}),
        ("sync", {"target": "best"}), ("home", {}), ("jog", {"axis": 1, "deg_s": 0.5, "seconds": 1.0}),
        ("park", {}), ("unpark", {}), ("power", {"on": True}), ("stop", {}),
    ):  # fmt: skip
        assert call(service, name, **args)[0].get("ok", True), name


def test_a_call_that_does_not_exist_or_lacks_an_argument_is_a_sentence(service):
    with pytest.raises(InputError, match=r"no call 'explode'; there is "):
        call(service, "explode")
    with pytest.raises(InputError, match=r"'goto' needs the argument 'target'"):
        call(service, "goto")
