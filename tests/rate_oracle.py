"""The derivative of a changing place, measured: what every analytic rate is held against."""

import math

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
