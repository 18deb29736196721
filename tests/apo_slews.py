"""The axes of both telescopes, random slews of them, and a second reading of the manual's path between two nodes."""

import math
import random
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from mounts.apo.slew_model import ApoSlewModel
from mounts.apo.slew_profile import MARGIN

AXES = {
    "3.5 m azimuth": (ApoSlewModel(1.75, 0.1, 0.5), -180.0, 360.0),
    "3.5 m altitude": (ApoSlewModel(1.5, 0.1, 0.5), 6.0, 85.0),
    "3.5 m rotator": (ApoSlewModel(3.5, 0.7, 7.0), -180.0, 180.0),
    "SDSS azimuth": (ApoSlewModel(2.0, 0.2, 0.2), -195.0, 435.0),
    "SDSS altitude": (ApoSlewModel(1.5, 0.08, 0.08), 18.2, 90.0),
    "SDSS rotator": (ApoSlewModel(2.0, 0.25, 0.25), -180.0, 361.0),
}


@dataclass(frozen=True)
class Slew:
    """A random slew of a random axis."""

    model: ApoSlewModel
    start: float
    start_rate: float
    end: float
    end_rate: float

    @property
    def planned(self):
        """Velocity, acceleration and jerk with which it may be planned."""
        return tuple(MARGIN * limit for limit in self.model.limits)


def random_slews(seed, count, *, fastest_end=0.99):
    """So many random slews, each with the generator that made it."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    for _ in range(count):
        yield rng, random_slew(rng, fastest_end=fastest_end)


def random_slew(rng, *, fastest_end=0.99):
    """Far and near, from drifting fast, slowly or not at all to a target that is fast, slow or at rest."""
    model, low, high = rng.choice(list(AXES.values()))
    start = rng.uniform(low, high)
    distance = rng.choice([1.0, 0.1, 1e-2, 1e-3, 1e-5, 1e-7]) * rng.uniform(low - start, high - start)
    start_rate, end_rate = (
        rng.uniform(-fast, fast) * model.max_rate * rng.choice([1.0, 0.1, 2e-3, 0.0]) for fast in (0.99, fastest_end)
    )
    return Slew(model, start, start_rate, start + distance, end_rate)


def as_printed(value, digits=12):
    """A number as a controller reads it that was sent with so many decimals."""
    return Decimal(f"{value:.{digits}f}")


def largest(one, two):
    """Largest velocity, acceleration and jerk between two nodes (time, position, velocity) as numbers of decimals.

    The manual's path written as Bernstein polynomials: the four control points of the cubic are 3 apart in velocity;
    their differences are the control points of velocity and acceleration, of which the velocity's peak follows.
    """
    (t_i, x_i, v_i), (t_f, x_f, v_f) = one, two
    dt = t_f - t_i
    inner = [x_i, x_i + v_i * dt / 3, x_f - v_f * dt / 3, x_f]
    velocity = [3 * (b - a) / dt for a, b in pairwise(inner)]
    acceleration = [float(2 * (b - a) / dt) for a, b in pairwise(velocity)]
    jerk = (acceleration[1] - acceleration[0]) / float(dt)
    speeds = [abs(float(v)) for v in (velocity[0], velocity[2])]
    if acceleration[0] * acceleration[1] < 0.0:
        u = acceleration[0] / (acceleration[0] - acceleration[1])
        a, b, c = map(float, velocity)
        speeds.append(abs((1 - u) ** 2 * a + 2 * u * (1 - u) * b + u * u * c))
    return max(speeds), max(map(abs, acceleration)), abs(jerk)


def between(one, two, when):
    """Position and velocity between two nodes, by de Casteljau's construction, floats."""
    (t_i, x_i, v_i), (t_f, x_f, v_f) = one, two
    dt = t_f - t_i
    u = (when - t_i) / dt
    points = [x_i, x_i + v_i * dt / 3.0, x_f - v_f * dt / 3.0, x_f]
    while len(points) > 2:
        points = [(1.0 - u) * a + u * b for a, b in pairwise(points)]
    return (1.0 - u) * points[0] + u * points[1], 3.0 * (points[1] - points[0]) / dt


def bent(rng, axis):
    """A path that speeds up and slows down as a satellite's does: an arc tangent, within what an axis can do."""
    fastest = rng.uniform(0.02, 0.9) * axis.max_rate * rng.choice([-1.0, 1.0])
    width = rng.uniform(3.0, 40.0) + abs(fastest) / axis.acceleration * 2.0
    culmination, middle = rng.uniform(-60.0, 120.0), rng.uniform(-60.0, 60.0)

    def where(elapsed):
        u = (elapsed - culmination) / width
        return middle + fastest * width * math.atan(u), fastest / (1.0 + u * u)

    return where
