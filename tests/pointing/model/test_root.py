"""One equation at many places: solved by secants, searched for where these lose the way, nan where there is none."""

import math

import numpy as np
import pytest

from pointing.model.place import Frame, Place
from pointing.model.root import TOLERANCE, solve

FRAME = Frame("equatorial", 0.6)
HERE = Place(FRAME, 0.0, 0.0)


def test_kepler_s_equation_is_solved_for_an_array_as_for_each_alone():
    e = np.array([0.0, 0.3, 0.9, 0.999])
    places = Place(FRAME, np.zeros(4), np.zeros(4))

    def short(_place, x, e):
        sin = np.sin if isinstance(x, np.ndarray) else math.sin
        return 0.2 + e * sin(x) - x

    found = solve(short, places, e, np.full(4, 0.2), (-4.0, 4.0))
    assert np.max(np.abs(found - e * np.sin(found) - 0.2)) < TOLERANCE
    for i in range(4):
        assert solve(short, HERE, float(e[i]), 0.2, (-4.0, 4.0)) == pytest.approx(found[i], abs=1e-12)


def test_where_there_is_no_solution_there_is_nan():
    assert math.isnan(solve(lambda _place, x, c: c + x * x, HERE, 0.1, 0.0, (-1.0, 1.0)))
    assert math.isnan(solve(lambda _place, x, c: math.nan * x * c, HERE, 0.1, 0.0, (-1.0, 1.0)))


def test_a_jump_through_zero_is_no_solution():
    assert math.isnan(solve(lambda _place, x, c: c * np.copysign(1.0, x - 0.123), HERE, 1.0, 0.0, (-1.0, 1.0)))


def test_solutions_beyond_the_bounds_are_none():
    assert math.isnan(solve(lambda _place, x, c: c - x, HERE, 2.0, 0.0, (-1.0, 1.0)))


def test_of_several_the_search_takes_the_nearest():
    def wave(_place, x, c):
        return np.where(abs(x - 0.1) < 1e-9, np.nan, np.cos(c * x))  # nothing at the start, so that it is searched

    assert solve(wave, HERE, 20.0, 0.1, (-1.0, 1.3)) == pytest.approx(math.pi / 40.0, abs=1e-12)


def test_two_solutions_closer_than_the_points_of_the_search_are_found():
    def valley(_place, x, gap):
        return -((x - 0.3217) ** 2 - gap**2)

    for gap in (1e-2, 1e-3, 1e-4):
        found = solve(valley, HERE, gap, -0.9, (-1.0, 1.0))
        assert abs(abs(found - 0.3217) - gap) < 1e-8


def test_a_solution_beside_the_edge_of_what_can_be_asked_is_found():
    def edge(_place, x, c):
        there = np.asarray(c - x * x)
        return np.where(there >= 0.0, np.sqrt(np.maximum(there, 0.0)) - 1e-3, np.nan)

    found = solve(edge, HERE, 0.01, 0.9, (-1.0, 1.0))
    assert abs(found) == pytest.approx(math.sqrt(0.01 - 1e-6), abs=1e-12)
