"""The derivative of a changing place, measured: what every analytic rate is held against."""

import math

import pytest
from planning_bench import MIDNIGHT, random_star

from pointing.instant import Instant
from pointing.mount import Mount

ALLOWED_DEG_S = 1e-9  # and 1e-8 of the rate itself
ALLOWED_SHARE = 1e-8


def extrapolated(place, instant, step):
    """Derivative of `place(instant)`, a sequence, by central differences extrapolated after Richardson.

    Over h, h/2 and h/4 of the two-part time; their errors in h² and h⁴ cancel.
    """
    differences = []
    for h in (step, step / 2, step / 4):
        ahead, behind = place(instant.plus(h)), place(instant.plus(-h))
        differences.append([(a - b) / (2 * h) for a, b in zip(ahead, behind, strict=True)])
    return [(64 * c - 20 * b + a) / 45 for a, b, c in zip(*differences, strict=True)]


def share_of_allowed(target, sky, instant, step=40.0):
    """By how much of what is allowed the rate of a target differs from the measured one; at most 1 is right."""
    observed, rate = target.observed_with_rate(sky.at(instant))
    assert math.dist(observed, target.observed(sky.at(instant))) < 1e-15
    measured = extrapolated(lambda i: target.observed(sky.at(i)), instant, step)
    allowed = math.radians(ALLOWED_DEG_S) + ALLOWED_SHARE * math.hypot(*rate)
    return math.dist(rate, measured) / allowed


def share_of_allowed_on_axes(subject, sky, posture, rng, farthest, stars=6):
    """By how much of what is allowed axis rates differ from measured ones, of stars of chance 10° up and higher.

    The tube stands at most `farthest`, radians, from the equator of axis 1: rates at its pole have no bound.
    """
    bare = Mount(subject.type, subject.latitude, subject.x, subject.y)
    worst = tried = 0
    while tried < stars:
        star, instant = random_star(rng), Instant.from_posix(MIDNIGHT + rng.uniform(-5e8, 5e8))
        observed, rate = star.observed_with_rate(sky.at(instant))
        if observed[2] < math.sin(math.radians(10.0)) or abs(bare.axes(observed, "normal")[1]) > farthest:
            continue
        tried += 1
        here = subject.axes(observed, posture)

        def angles(at, star=star, near=here):
            found = subject.axes(star.observed(sky.at(at)), posture)
            return [a - math.tau * round((a - b) / math.tau) for a, b in zip(found, near, strict=True)]

        state = subject.axes_and_rates(observed, rate, posture)
        assert [angle for angle, _ in state] == pytest.approx(here, abs=1e-15)
        for (_, stated), measured in zip(state, extrapolated(angles, instant, 32.0), strict=True):
            error = abs(math.degrees(stated - measured))
            worst = max(worst, error / (ALLOWED_DEG_S + ALLOWED_SHARE * abs(math.degrees(stated))))
    return worst
