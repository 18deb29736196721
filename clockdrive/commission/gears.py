"""The gears that a witness shows, with their uncertainty: a line through looks in both directions, and tooth counts.

The axis follows its motor only once the gears' play is taken up, so each direction has an intercept of its own; the
slope is common. What lies within k standard deviations of the configuration is consistent with it: nothing is found.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

SIGNIFICANCE = 4.0
"""Standard deviations beyond which a difference is one."""

_TEETH_OFF = 0.05  # of a gear's teeth that may have been miscounted


@dataclass(frozen=True)
class Point:
    """One look: what was commanded and what was seen, degrees, and the direction of the last motion."""

    commanded: float
    seen: float
    direction: int


@dataclass(frozen=True)
class Line:
    """Degrees seen for a degree commanded, its standard deviation, and the play between both directions, degrees."""

    slope: float
    sigma: float
    play: float


def fitted(points: Sequence[Point], sigma_deg: float) -> Line:
    """Least squares with a common slope and an intercept for each direction.

    Parameters
    ----------
    points : sequence of Point
        At least two in one direction.
    sigma_deg : float
        Standard deviation of what was seen; scatter beyond it makes the uncertainty larger.
    """
    groups = [[p for p in points if p.direction == sign] for sign in (1, -1)]
    means = [(_mean(p.commanded for p in group), _mean(p.seen for p in group)) for group in groups]
    spread = along = 0.0
    for group, (x0, y0) in zip(groups, means, strict=True):
        spread += sum((p.commanded - x0) ** 2 for p in group)
        along += sum((p.commanded - x0) * (p.seen - y0) for p in group)
    slope = along / spread
    left = [
        p.seen - y0 - slope * (p.commanded - x0) for group, (x0, y0) in zip(groups, means, strict=True) for p in group
    ]
    freedom = len(points) - 1 - sum(bool(group) for group in groups)
    scatter = math.sqrt(sum(each * each for each in left) / freedom) if freedom > 0 else 0.0
    play = 0.0
    if all(groups):
        (x1, y1), (x2, y2) = means
        play = abs((y2 - slope * x2) - (y1 - slope * x1))
    return Line(slope, max(sigma_deg, scatter) / math.sqrt(spread), play)


def _mean(values: Iterator[float]) -> float:
    listed = list(values)
    return sum(listed) / len(listed) if listed else 0.0


@dataclass(frozen=True)
class Candidate:
    """Gears that would explain what was seen: key, value as a file has it, by how many teeth it differs."""

    key: str
    value: str
    teeth: int
    off: float  # relative, from what was seen


def candidates(main: tuple[int, int], secondary: tuple[int, int], ratio: float, sigma: float) -> list[Candidate]:
    """Tooth counts within the uncertainty of the ratio seen, the likeliest first; never the configured ones.

    A tooth more that was miscounted makes a candidate as much less likely as a standard deviation squared does.

    Parameters
    ----------
    main, secondary : tuple of int
        Configured teeth, as written: (1, 285), (16, 40).
    ratio : float
        True over configured axis turns for a turn of the motor.
    sigma : float
        Its standard deviation.
    """
    found = []
    for key, (top, bottom) in (("main_gear", main), ("secondary_gear", secondary)):
        for a, b in _near(top, bottom):
            off = a / b * bottom / top / ratio - 1.0
            if abs(off) <= SIGNIFICANCE * sigma:
                found.append(Candidate(key, f"{a}/{b}", abs(a - top) + abs(b - bottom), off))
    return sorted(found, key=lambda each: (each.off / sigma) ** 2 + each.teeth)


def _near(top: int, bottom: int) -> Iterator[tuple[int, int]]:
    """One wheel with other teeth: each of the two in turn, a worm's single start not."""
    for b in range(bottom - _reach(bottom), bottom + _reach(bottom) + 1):
        if b != bottom and b > 0:
            yield top, b
    if top > 2:
        for a in range(top - _reach(top), top + _reach(top) + 1):
            if a != top and a > 0:
                yield a, bottom


def _reach(teeth: int) -> int:
    return max(1, math.ceil(_TEETH_OFF * teeth))


def measured_gear(secondary: Fraction, ratio: float, sigma: float) -> str:
    """The simplest secondary gear that gives the ratio seen, to one standard deviation, where no teeth do."""
    wanted = float(secondary) * ratio
    limit = 10
    while True:
        found = Fraction(wanted).limit_denominator(limit)
        if limit >= 65535 or (found > 0 and abs(float(found) / wanted - 1.0) <= max(sigma, 1e-6)):
            return f"{found.numerator}/{found.denominator}"
        limit = min(65535, limit * 2)
