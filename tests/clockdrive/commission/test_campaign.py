"""Mounts of chance are commissioned: every wrong key is found, none is invented, no move goes beyond its bound."""

import os
from collections import Counter
from fractions import Fraction

import pytest
from commission_bench import mount, random_truth, wrong_keys

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
MOUNTS = 200 if FULL else 6
RIGHT = ("top speed", "encoder ratio", "soft-limit registers", "maximum-speed register")  # of every mount here


def told(findings):
    """What the findings would change, gears as the true ratio they mean."""
    changes = {}
    for each in findings:
        if not each.changes:
            continue
        if each.subject.endswith("gears"):
            main, secondary = Fraction("1/285"), Fraction("16/40")
            value = Fraction(each.found)
            changes[each.subject] = value * secondary if each.key.endswith("main_gear") else main * value
        else:
            changes[each.key] = each.found
    return changes


@pytest.mark.campaign
@pytest.mark.timeout(1800)
def test_every_wrong_key_is_found_and_none_invented_within_the_bounds(tmp_path, monkeypatch):
    tally, untested, teeth = Counter(), Counter(), Counter()
    worst_gear, scales, landings = 0.0, [], []
    nearest = closest = 1e9
    for seed in range(MOUNTS):
        truth = random_truth(seed)
        with mount(tmp_path / str(seed), truth, monkeypatch) as watched:
            findings = watched.commission()
            models = watched.scope._session.drive.slew_models
        wrong, changes = wrong_keys(truth), told(findings)
        open_keys = {each.key for each in findings if each.verdict == "untested"}
        untested.update(each.subject for each in findings if each.verdict == "untested")
        for key, value in wrong.items():
            assert key in changes, (seed, key, value, [f for f in findings if f.verdict == "untested"])
            if key.endswith("gears"):
                off = abs(float(changes[key] / value) - 1.0)
                worst_gear = max(worst_gear, off)
                assert off < 0.008, (seed, key, changes[key], value)
                teeth["exact" if changes[key] == value else "within the uncertainty"] += 1
            else:
                assert changes[key] == value, (seed, key)
        said = {each.subject: each.verdict for each in findings}
        assert said["slew bit"] == ("confirmed" if truth.simulator["slew_bit_clears"] else "refuted"), seed
        for subject, verdict in said.items():
            assert verdict != "refuted" or not subject.endswith(RIGHT), (seed, subject)
            tally["top speeds seen"] += subject.endswith("top speed") and verdict == "confirmed"
        assert set(changes) <= set(wrong), (seed, set(changes) - set(wrong))
        tally["found"] += len(wrong)
        zeros = {n: axis.zeros_apart_deg for n, axis in enumerate(truth.axes, 1) if axis.encoder_bits}
        closest = min([closest, *(apart for n, apart in zeros.items() if f"axis{n}.encoder_zero_at" in wrong)])
        tally["mounts"] += 1
        tally["right keys confirmed"] += sum(each.verdict == "confirmed" for each in findings if each.key)
        for step, (gone, bound) in watched.excursions.items():
            assert gone <= bound, (seed, step, gone, bound)
            nearest = min(nearest, bound - gone) if bound else nearest
            if not bound:
                assert gone < 1e-9
        error, landing = truth.simulator["acceleration_error"], truth.simulator["landing_s"]
        for model in models:
            scales.append(abs(model.acceleration_scale - 1.0 - error))
            landings.append(abs(model.landing_s - landing))
        tally["left open"] += len(open_keys - {""})
    print(dict(tally), dict(teeth), f"encoder zeros told apart down to {closest:.2f}°")
    good = [sum(off < 0.02 for off in scales), sum(off < 0.1 for off in landings)]
    print(f"gears within {100 * worst_gear:.2f} %, the tightest bound had {nearest:.2f}° left; of {len(scales)} axes "
          f"{good[0]} accelerations within 2 % (worst {100 * max(scales):.2f} %), {good[1]} landings within 0.1 s "
          f"(worst {max(landings):.3f} s); untested: {dict(untested)}")  # fmt: skip
    assert min(good) > 0.9 * len(scales)
    assert max(scales) < 0.11  # nothing taught is worse than nothing
