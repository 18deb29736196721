"""Gears from looks: the line, the teeth, and no difference where there is none."""

import random
from fractions import Fraction

import numpy as np

from clockdrive.commission.gears import SIGNIFICANCE, Point, candidates, fitted, measured_gear


def points(slope, play, sigma, chance):
    out = [Point(x, slope * x + chance.gauss(0, sigma), 1) for x in (0.15, 1.41, 2.67, 3.93)]
    back = [Point(x, slope * x + play + chance.gauss(0, sigma), -1) for x in (3.78, 2.52, 1.26, 0.0)]
    return out + back


def test_the_line_is_that_of_least_squares_with_an_intercept_for_each_direction():
    looks = points(1.01, 0.02, 1e-3, random.Random(1))  # noqa: S311
    design = np.array([[p.commanded, p.direction > 0, p.direction < 0] for p in looks], dtype=float)
    (slope, out, back), *_ = np.linalg.lstsq(design, np.array([p.seen for p in looks]), rcond=None)
    line = fitted(looks, 1e-3)
    assert abs(line.slope - slope) < 1e-12
    assert abs(line.play - abs(back - out)) < 1e-12


def test_a_difference_is_invented_less_than_once_in_a_thousand():
    chance = random.Random(2)  # noqa: S311
    lines = [fitted(points(1.0, 0.01, 1e-3, chance), 1e-3) for _ in range(5000)]
    invented = sum(abs(line.slope - 1.0) > SIGNIFICANCE * line.sigma for line in lines)
    print(f"{invented} of 5000 right gears called wrong")
    assert invented <= 5


def test_one_tooth_of_the_pinion_or_three_of_the_wheel_are_told():
    assert candidates((1, 285), (16, 40), 40 / 39, 2e-4)[0].value == "16/39"
    assert candidates((1, 285), (16, 40), 285 / 288, 2e-4)[0].value == "1/288"
    assert candidates((1, 285), (16, 40), 17 / 16, 2e-4)[0].value == "17/40"


def test_no_teeth_are_invented_for_a_ratio_that_none_explains():
    assert not candidates((1, 285), (16, 40), 1.2, 1e-4)
    value = Fraction(measured_gear(Fraction(2, 5), 1.2345, 1e-4))
    assert abs(float(value / Fraction(2, 5)) / 1.2345 - 1.0) <= 1e-4
