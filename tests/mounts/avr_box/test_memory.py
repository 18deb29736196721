"""What a driver of a box is given back: the same, judged, or nothing that could mispoint."""

import json
import math
from dataclasses import replace

import pytest

from mounts.avr_box.memory import (
    REINTERPRETED,
    Kept,
    KeptAxis,
    KeptMove,
    at_park,
)
from mounts.remembered import NEVER, UNREADABLE

KEPT = Kept(
    "",
    1_800_000_000.25,
    (KeptAxis(1.5, 2.0, (KeptMove(700, -1, 1_799_999_999.0),), -12.25, 2e4), KeptAxis(-3.0, 0.5)),
    crystal=1.00002,
    crystal_uncertainty=3e-6,
    resting=True,
    doubted=1_799_999_998.0,
    proved=True,
    meaning="gears",
)


def stored(kept):
    """Through the file in which it is stored."""
    return json.loads(json.dumps(kept.as_json(), allow_nan=False))


def test_what_is_kept_comes_back_as_it_was():
    assert Kept.of(stored(KEPT), "gears") == KEPT


def test_what_was_never_known_is_stored_without_a_number_that_is_none():
    nothing = Kept()
    assert Kept.of(stored(nothing), "") == nothing
    assert nothing.time == -math.inf
    assert Kept.of({}, "gears") == Kept(unsynchronised=NEVER, meaning="gears")


@pytest.mark.parametrize(
    ("kept", "why"),
    [
        (KEPT, REINTERPRETED),
        (replace(KEPT, sending=True), REINTERPRETED),
        (replace(KEPT, unsynchronised="a hand"), "a hand"),
        (replace(KEPT, unsynchronised="a hand", sending=True), "a hand"),
    ],
)
def test_what_may_mean_another_place_is_unsynchronised_with_its_first_reason(kept, why):
    found = Kept.of(stored(kept), "other gears")
    assert found.unsynchronised == why
    assert found.axes == KEPT.axes  # near enough to say how far it tracked
    assert found.sending == kept.sending  # half a move may stand in the box, whatever else is so


def broken():
    """Every key of it left out, or with something else in it."""
    whole = stored(KEPT)
    for key in whole:
        if key != "crystal_uncertainty":
            yield {name: value for name, value in whole.items() if name != key}
        for other in ("text", [1], {"a": 1}, True, math.nan, math.inf, None, 10**400):
            legal = {
                "unsynchronised": isinstance(other, str),
                "meaning": isinstance(other, str),
                "time": other is None,
                "crystal_uncertainty": other is None,
                "resting": True,
                "sending": True,
                "doubted": other is None,
                "proved": True,
            }
            if not legal.get(key, False):
                yield whole | {key: other}
    for key in ("counts", "uncertainty", "moves", "encoder_zero", "unproved_steps"):
        yield whole | {"axes": [{k: v for k, v in whole["axes"][0].items() if k != key}, whole["axes"][1]]}
    yield whole | {"axes": whole["axes"][:1]}


def test_what_is_broken_anywhere_is_unreadable_and_never_a_place():
    cases = list(broken())
    for memory in cases:
        found = Kept.of(memory, "gears")
        assert found == Kept(unsynchronised=UNREADABLE, meaning="gears"), memory
    print(f"\n{len(cases)} broken memories are unreadable")
    assert len(cases) == 66


def test_a_telescope_left_at_park_rests_there_without_a_doubt():
    found = Kept.of(json.loads(json.dumps(at_park((5, -7), 10.0, "gears"))), "gears")
    assert [axis.counts for axis in found.axes] == [5.0, -7.0]
    assert [axis.uncertainty for axis in found.axes] == [0.0, 0.0]
    assert (found.resting, found.time, found.unsynchronised) == (True, 10.0, "")
