"""Cubic splines by what defines them."""

import math

import numpy as np
import pytest

from pointing.spline import Spline

TIMES = [0.0, 1.0, 2.5, 3.0, 4.2, 7.0]


def through(function, times):
    return Spline(times, np.column_stack([function(np.array(times))]))


@pytest.mark.parametrize("times", [TIMES, TIMES[:5], TIMES[:4]])
def test_a_cubic_is_its_own_spline_up_to_the_ends(times):
    spline = through(lambda t: t**3 - 2 * t**2 + t - 1, times)
    for t in np.linspace(times[0], times[-1], 41):
        (value,), (slope,) = spline.at(t)
        assert value == pytest.approx(t**3 - 2 * t**2 + t - 1, abs=1e-12)
        assert slope == pytest.approx(3 * t**2 - 4 * t + 1, abs=1e-12)


def test_it_goes_through_its_points_and_is_smooth_twice_there():
    rng = np.random.default_rng(4)
    points = rng.normal(size=(6, 3))
    spline = Spline(TIMES, points)
    h = 1e-5
    for t, point in zip(TIMES, points, strict=True):
        assert spline.at(t)[0] == pytest.approx(point, abs=1e-12)
    for t in TIMES[1:-1]:
        before, here, after = (np.array(spline.at(t + step)[1]) for step in (-h, 0.0, h))
        assert before == pytest.approx(after, abs=1e-3)
        # The slopes of the slope on both sides are the same second derivative.
        assert (here - before) / h == pytest.approx((after - here) / h, abs=2e-2)


def test_the_error_goes_with_the_fourth_power_of_the_step_at_the_ends_too():
    errors = []
    for points in (41, 81):
        spline = through(np.sin, list(np.linspace(0.0, 6.0, points)))
        errors.append(max(abs(spline.at(t)[0][0] - math.sin(t)) for t in np.linspace(0.0, 6.0, 1201)))
    print(f"errors {errors[0]:.1e} and {errors[1]:.1e}, ratio {errors[0] / errors[1]:.1f}")
    assert 14.0 < errors[0] / errors[1] < 32.0
