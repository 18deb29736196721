"""Nights on a bad line in which something else goes wrong as well: keys, words kept for good, and every reading."""

import math
import os

import pytest
from awr_fault_bench import DEEDS, WRITTEN, Judged, Night

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
FIRST = int(os.environ.get("CLOCKDRIVE_SEED", "0"))
RUNS = 1000 if FULL else 2 * len(DEEDS)
BLIND_S = 6.0  # power cut for 5 s at most, and a second until the unit is asked


def most_of(count, chance):
    """How many of so many cases of that chance are no more than chance, once in a thousand times."""
    return count * chance + 3.1 * math.sqrt(count * chance * (1.0 - chance)) + 1.0


@pytest.mark.campaign
@pytest.mark.timeout(1800)
def test_on_a_bad_night_no_key_is_held_long_nothing_unasked_is_kept_for_good_and_every_reading_is_right_or_unknown():
    judged = Judged()
    for seed in range(FIRST, FIRST + RUNS):
        Night(seed, judged).run()
    known, beyond = judged.ends["within"] + judged.ends["beyond"], judged.ends["beyond"]
    print(f"\n{RUNS} runs: {judged}")
    assert not judged.late
    assert set(judged.worn) <= {WRITTEN}
    assert judged.worn[WRITTEN] <= RUNS // len(DEEDS) + 1
    assert not judged.unsaid
    assert not judged.gross
    assert not judged.moving
    assert beyond <= most_of(known, 0.05)
    assert judged.beyond <= most_of(judged.readings, 0.05)
    assert judged.blind_s < BLIND_S
