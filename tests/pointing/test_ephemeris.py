"""The tabulated Earth and pole against ERFA's own series."""

import math
import random
import time
import warnings

import erfa
import numpy as np
import pytest

from pointing.ephemeris import ephemeris, pole_rate, segment
from pointing.instant import DAY, Instant

MAS = math.pi / 648000e3
LIGHT_AU_DAY = 173.1446326846693


def moments(count, seed):
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    return [Instant(rng.randrange(47892, 73500), rng.uniform(0, DAY)) for _ in range(count)]


def series(instants):
    days, fractions = np.array(instants).T
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", erfa.ErfaWarning)
        heliocentric, barycentric = erfa.epv00(2400000.5 + days, fractions / DAY)
        x, y, s = erfa.xys06a(2400000.5 + days, fractions / DAY)
    return np.column_stack([barycentric["p"], barycentric["v"], heliocentric["p"], x, y, s])


def test_segments_follow_erfa_to_a_ten_thousandth_of_a_mas():
    instants = moments(600, 7)
    error = np.abs(np.array([ephemeris(i) for i in instants]) - series(instants)).max(axis=0)
    pole_mas, aberration_mas = error[9:].max() / MAS, error[3:6].max() / LIGHT_AU_DAY / MAS
    print(f"segments: pole {pole_mas:.1e} mas, aberration {aberration_mas:.1e} mas, place {error[:3].max():.1e} au")
    assert pole_mas < 1e-4
    assert aberration_mas < 1e-4
    assert error[[0, 1, 2, 6, 7, 8]].max() < 1e-10


def test_segments_join():
    for day in range(60000, 60010):
        before, after = np.array(ephemeris(Instant(day - 1, DAY))), np.array(ephemeris(Instant(day, 0.0)))
        assert np.abs(before - after).max() < 1e-10
        assert np.abs(before - after)[9:].max() < 1e-4 * MAS


def test_the_poles_rate_is_its_derivative():
    for instant in moments(50, 8):
        before, after = series([instant.plus(-1800), instant.plus(1800)])
        assert pole_rate(instant) == pytest.approx(tuple((after - before)[9:11] / 3600), abs=1e-16)


def test_a_segment_is_made_in_about_a_millisecond():
    best = math.inf
    for index in range(30000, 30010):
        begin = time.perf_counter()
        segment.__wrapped__(index)
        best = min(best, time.perf_counter() - begin)
    print(f"one segment: {best * 1e3:.2f} ms")
    assert best < 10e-3


def test_other_centuries_are_no_exception():
    for day in (-100000, 100000, 1000000):
        assert all(math.isfinite(value) for value in ephemeris(Instant(day, 0.0)))
