"""Closed forms of two-body motion against an integration of the equation of motion, for every kind of orbit."""

import math
import random

import numpy as np
import pytest
from rate_oracle import extrapolated
from two_body_oracle import GM, at_perihelion, ecliptic_to_equator, integrated

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.two_body import ATTRACTION, Orbit, stumpff, universal_anomaly

ARCSEC = math.pi / 648_000.0
PERIHELION = Instant(61000, 43200.0)
KINDS = (0.0, 0.079, 0.5, 0.967, 0.999, 0.999999, 1.0, 1.000001, 1.001, 1.2, 3.0)


@pytest.mark.parametrize("e", KINDS)
def test_every_orbit_obeys_the_equation_of_motion(e):
    angles = 0.3, 2.1, 4.4
    worst_seen = worst_speed = 0.0
    for q in (0.17, 1.3):
        orbit = Orbit(PERIHELION, q, e, *angles)
        for days in (-400.0, -31.5, -0.01, 0.0, 2.0, 95.0, 700.0):
            place, velocity = orbit.state(PERIHELION.plus(days * 86400.0))
            true = [ecliptic_to_equator(each, *angles) for each in integrated(*at_perihelion(q, e), days)]
            distance = np.linalg.norm(true[0])
            worst_seen = max(worst_seen, np.linalg.norm(place - true[0]) / distance)
            worst_speed = max(worst_speed, np.linalg.norm(velocity - true[1]) / np.linalg.norm(true[1]))
    print(
        f"e {e:g}: place within {worst_seen / ARCSEC:.1e}″ from the Sun, velocity within {worst_speed:.1e} of itself"
    )
    assert worst_seen < 1e-5 * ARCSEC
    assert worst_speed < 1e-10


def test_the_integration_itself_keeps_energy_and_comes_back():
    """The oracle is judged by what it must conserve, not by the code under test."""
    for e in (0.0, 0.9, 1.0, 3.0):
        start = at_perihelion(0.17, e)
        place, velocity = integrated(*start, 500.0)
        energy = velocity @ velocity / 2 - GM / np.linalg.norm(place)
        assert energy == pytest.approx(GM * (e - 1.0) / 0.34, abs=1e-14)
        back = integrated(place, velocity, -500.0)[0]
        print(f"e {e:g}: there and back {math.dist(back, start[0]):.1e} au")
        assert math.dist(back, start[0]) < 1e-11


def test_keplers_equation_is_solved_to_the_last_digits():
    rng = random.Random(3)  # noqa: S311 - nothing secret
    worst = 0.0
    for _ in range(20_000):
        e = rng.choice([*KINDS, rng.random(), 1.0 + 1e-12, 1.0 - 1e-12, rng.uniform(1.0, 10.0)])
        q, days = 10.0 ** rng.uniform(-2.0, 1.5), 10.0 ** rng.uniform(-3.0, 5.0) * rng.choice([-1, 1])
        if e < 1.0:
            days = math.remainder(days, math.tau / math.sqrt(ATTRACTION) * (q / (1.0 - e)) ** 1.5)
        s = universal_anomaly(days, q, e)
        c2, c3 = stumpff(s * s * ATTRACTION * (1.0 - e) / q)
        time = s * (q + ATTRACTION * e * s * s * c3)
        worst = max(worst, abs(time - days) / ((q + ATTRACTION * e * s * s * c2) * abs(s)))
    print(f"universal anomaly: worst {worst:.1e} of itself")
    assert worst < 1e-14


def test_stumpffs_functions_are_one_curve_where_their_two_ways_meet():
    for x in (4.0, -4.0):
        below, above = stumpff(math.nextafter(x, 0.0)), stumpff(x)
        assert below == pytest.approx(above, rel=4e-16)


@pytest.mark.parametrize("e", KINDS)
def test_the_velocity_is_the_derivative_of_the_place(e):
    orbit = Orbit(PERIHELION, 0.6, e, 1.0, 2.0, 3.0)
    when = PERIHELION.plus(40.3 * 86400.0)
    measured = extrapolated(lambda instant: orbit.state(instant)[0], when, 3600.0)
    assert [v / 86400.0 for v in orbit.state(when)[1]] == pytest.approx(measured, rel=1e-8, abs=1e-17)


def test_an_ellipse_closes():
    orbit = Orbit(PERIHELION, 1.2, 0.3, 0.1, 0.2, 0.3)
    turns = PERIHELION.plus(17.0 * orbit.period_days * 86400.0)
    assert math.dist(orbit.state(turns)[0], orbit.state(PERIHELION)[0]) < 1e-11


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((0.0, 0.5, 0.0, 0.0, 0.0), "perihelion distance q 0: possible are 0.0001 to 1000 au"),
        ((math.nan, 0.5, 0.0, 0.0, 0.0), "perihelion distance q nan"),
        ((1.0, -0.1, 0.0, 0.0, 0.0), "eccentricity e -0.1: possible are 0 to 100"),
        ((1.0, 0.1, 3.2, 0.0, 0.0), "inclination 3.2"),
        ((1.0, 0.1, 0.2, math.inf, 0.0), "longitude of the node inf"),
        ((1.0, 0.1, 0.2, 0.0, 7.0), "argument of perihelion 7"),
    ],
)
def test_impossible_elements_are_refused(values, said):
    with pytest.raises(TargetError) as refused:
        Orbit(PERIHELION, *values)
    assert said in str(refused.value)
