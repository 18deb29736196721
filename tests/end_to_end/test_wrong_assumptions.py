"""A unit that is not as assumed is found out: nothing mispoints, and after five slews the arrival is met again."""

import random

import pytest
from telescope_bench import ARCSEC_PER_COUNT, Witness, star_at, telescope

from mounts.errors import DriveError
from pointing.errors import Unreachable

WRONG = {
    "left-justified positions": {"simulator__position_format": "left"},
    "axes resume one by one": {"simulator__slew_idle": "per-axis"},
    "axes resume together": {"drive__slew_idle": "per-axis"},
    "3 % faster ramps": {"simulator__acceleration_error": 0.03},
    "3 % slower ramps": {"simulator__acceleration_error": -0.03},
    "a slow landing of 1.5 s": {"simulator__landing_s": 1.5},
    "a late answer": {"simulator__latency_s": 0.05},
    "all of it": {
        "simulator__position_format": "left",
        "simulator__slew_idle": "per-axis",
        "simulator__acceleration_error": -0.03,
        "simulator__landing_s": 1.5,
        "simulator__latency_s": 0.03,
    },
}


@pytest.mark.parametrize("assumption", WRONG)
def test_never_mispoints_and_learns_within_five_slews(assumption, tmp_path):
    chance = random.Random(assumption)  # noqa: S311
    misses, claims = [], []
    with telescope(tmp_path, **WRONG[assumption]) as scope:
        witness = Witness(scope)
        while len(misses) < 10:
            target = star_at(scope, chance.uniform(0.0, 360.0), chance.uniform(25.0, 80.0))
            try:
                arrival = scope.goto(target)
            except Unreachable:
                continue
            misses.append(max(map(abs, witness.off_counts(target, witness.at_arrival(), witness.arrivals[-1]))))
            settled = witness.on_sky_arcsec(target, witness.now(), scope.clock.now())
            assert settled < 4.0 * ARCSEC_PER_COUNT, "it claims to have arrived and has not"
            claims.append(arrival["arrival_error_arcsec"] / ARCSEC_PER_COUNT)
            scope.wait(chance.uniform(5.0, 60.0))
    print(f"{assumption}: counts off at the stated arrival, slew by slew: {' '.join(f'{m:.1f}' for m in misses)}")
    assert max(misses[5:]) <= 2.0
    assert max(claims) < 60.0 / ARCSEC_PER_COUNT


def test_a_stated_position_format_that_is_wrong_is_refused_before_anything_moves(tmp_path):
    wrong = {"drive__position_format": "right", "simulator__position_format": "left"}
    with pytest.raises(DriveError, match=r"left-justified.*position_format"), telescope(tmp_path, **wrong):
        pass
