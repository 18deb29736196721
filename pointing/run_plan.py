"""Where a pointing run looks: places spread evenly over all that the telescope reaches, on a short way.

Places are fixed on the sky over the horizon, so that a plan holds for as long as a run takes, or for another night.
Candidates are the points of a Fibonacci lattice, which covers a sphere evenly by area (Á. González 2010, Math.
Geosci. 42, 49); both postures have one of their own. Each point is shaken by a part of their distance, always the
same: the lattice itself is a comb in azimuth, under which the error of a worm of 285 teeth passes for three waves a
turn, as 288 is twice a Fibonacci number, and a fit would take that for a term. The lattice is as coarse as gives just
enough candidates that are reached. The way is the nearest next place, improved by turning stretches of it round and
by moving single places (2-opt and or-opt); what it is measured by is the time of the slower axis.
"""

import math
import random
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import separation
from pointing.mount import POSTURES, Posture
from pointing.targets import Star
from pointing.vectors import Vector, azimuth_altitude, from_azimuth_altitude

MOST_PLACES = 1000
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))
_INSIDE = math.radians(2.0)  # of every limit, so that a place can be tracked for minutes
_KEYHOLE = math.radians(3.0)  # about the pole of axis 1, where axis 1 must hurry
_GROWTH = 2.0  # of the lattice from try to try at most
_CAUTION = 0.97  # of what should give enough, as more would be thinned, which leaves holes
_SHAKEN = 0.1  # of the distance of neighbours, to each side
_FINEST = 64  # times as many points as places
_AGAIN = 30  # times that the way is improved at most
_PART_OF_A_TURN = 1e-9


@dataclass(frozen=True)
class RunPlace:
    """One place of a run.

    Parameters
    ----------
    azimuth, altitude : float
        Observed, radians.
    posture : Posture
        How the telescope points there.
    name : str
        Of the star that stands there, or empty.
    """

    azimuth: float
    altitude: float
    posture: Posture
    name: str = ""

    @property
    def direction(self) -> Vector:
        """Observed direction, horizon frame."""
        return from_azimuth_altitude(self.azimuth, self.altitude)


def spread_places(
    geometry: Geometry, n: int, time: float, lasts_s: float = 0.0, other: int = 0
) -> tuple[RunPlace, ...]:
    """Spread n places evenly over the sky that the telescope reaches, in both postures where it has them.

    Parameters
    ----------
    geometry : Geometry
        Site, mount, axes and limits.
    n : int
        How many.
    time, lasts_s : float
        POSIX seconds of the beginning, and for how long no place may come near the Sun.
    other : int
        Each number gives other places: for a run that has some already.

    Raises
    ------
    PointingError
        n is impossible, or nothing is reached.
    """
    if not 1 <= n <= MOST_PLACES:
        raise PointingError(f"a run of {n} places: 1 to {MOST_PLACES} are possible")
    suns = _suns(geometry, time, lasts_s)
    points = math.ceil(n / len(POSTURES))
    while len(found := list(_reached(geometry, points, suns, other))) < n:
        growth = _CAUTION * n / max(len(found), 1)
        points = max(points + 1, int(points * min(growth, _GROWTH)))
        if points > _FINEST * n:
            raise PointingError(
                f"the telescope reaches {len(found)} of {points} places of the sky, too few for a run of {n}: "
                "look at [limits], min_deg and max_deg, and at the Sun"
            )
    return _thinned(found, n)


def star_places(
    geometry: Geometry,
    n: int,
    time: float,
    lasts_s: float,
    stars: Iterable[Star],
    other: int = 0,
    taken: Iterable[str] = (),
) -> tuple[RunPlace, ...]:
    """Choose those of some stars that are nearest to n places spread evenly.

    None is chosen twice in a posture, and none again, in the other posture or after it was `taken` before, as long as
    there is one that was chosen less often. A star moves on; who goes there asks where it is by then.

    Raises
    ------
    PointingError
        As for `spread_places`; fewer than n of the stars are reached.
    """
    frame = geometry.sky.at(Instant.from_posix(time))
    suns = _suns(geometry, time, lasts_s)
    there = [(star, star.observed(frame)) for star in stars]
    candidates = [
        RunPlace(*azimuth_altitude(direction), posture, star.name)
        for star, direction in there
        for posture in POSTURES
        if _is_reached(geometry, direction, posture, suns)
    ]
    chosen: list[RunPlace] = []
    times = Counter(taken)
    for place in spread_places(geometry, n, time, lasts_s, other):
        free = [each for each in candidates if each.posture == place.posture and each not in chosen]
        if free:
            nearest = min(free, key=lambda each: (times[each.name], separation(each.direction, place.direction)))
            times[nearest.name] += 1
            chosen.append(nearest)
    if len(chosen) < n:
        raise PointingError(f"{len(chosen)} of the bright stars are reached now, fewer than {n}: ask for fewer")
    return tuple(chosen)


def short_way(
    geometry: Geometry, places: Sequence[RunPlace], start: tuple[float, float], speeds: tuple[float, float]
) -> tuple[RunPlace, ...]:
    """Order places so that the axes are soon round.

    Parameters
    ----------
    geometry : Geometry
        Gives the axis angles of a place.
    places : sequence of RunPlace
        In any order.
    start : tuple of float
        Axis angles from which it goes, radians.
    speeds : tuple of float
        Of the axes, radians a second; their ratio matters.
    """
    if not places:
        return ()
    angles = np.array([start, *(place_angles(geometry, place) for place in places)])
    cost = np.max(np.abs(angles[:, None] - angles[None]) / np.array(speeds), axis=2)
    order = _nearest_next(cost)
    for _ in range(_AGAIN):
        before = way_length(cost, order)
        order = _moved(cost, _turned(cost, order))
        if way_length(cost, order) > before - _PART_OF_A_TURN:
            break
    return tuple(places[i - 1] for i in order[1:])


def place_angles(geometry: Geometry, place: RunPlace) -> tuple[float, float]:
    """Axis angles of a place, of its windings that nearest to the middle of the travel.

    Raises
    ------
    Unreachable
        There are none within the limits.
    """
    middle = [(axis.minimum + axis.maximum) / 2.0 for axis in geometry.free]
    wound = geometry.windings(geometry.mount.axes(place.direction, place.posture), (0.0, 0.0))
    best = min(wound, key=lambda pair: abs(pair[0] - middle[0]) + abs(pair[1] - middle[1]), default=None)
    if best is None:
        raise Unreachable(f"{place}: no winding of the axes is within their limits")
    return best


def _suns(geometry: Geometry, time: float, lasts_s: float) -> tuple[Vector, ...]:
    if not geometry.limits.sun_avoidance:
        return ()
    return tuple(geometry.sky.at(Instant.from_posix(time + part * lasts_s)).sun() for part in (0.0, 0.5, 1.0))


def _reached(geometry: Geometry, points: int, suns: Sequence[Vector], other: int) -> Iterator[RunPlace]:
    shaken = _SHAKEN * math.sqrt(math.tau / points)
    for turn, posture in enumerate(POSTURES):
        chance = random.Random(f"{points} {posture} {other}")  # noqa: S311 - the same every time
        for i in range(points):
            z = (i + 0.5 + chance.uniform(-_SHAKEN, _SHAKEN)) / points
            aside = chance.uniform(-shaken, shaken) / math.sqrt(1.0 - z * z)
            azimuth = math.remainder((i + 0.5 * turn) * _GOLDEN + other + aside, math.tau)
            direction = from_azimuth_altitude(azimuth, math.asin(z))
            if _is_reached(geometry, direction, posture, suns):
                yield RunPlace(*azimuth_altitude(direction), posture)


def _is_reached(geometry: Geometry, direction: Vector, posture: Posture, suns: Sequence[Vector]) -> bool:
    """Whether a direction is inside all limits, and away from the pole of axis 1."""
    limits = geometry.limits
    if limits.horizon.margin(direction) < _INSIDE or any(limits.sun_margin(direction, sun) < _INSIDE for sun in suns):
        return False
    try:
        angles = geometry.mount.axes(direction, posture)
    except Unreachable:
        return False
    if abs(math.cos(angles[1])) < math.sin(_KEYHOLE):
        return False
    return any(True for _ in geometry.windings(angles, (-_INSIDE, -_INSIDE)))


def _thinned(places: list[RunPlace], n: int) -> tuple[RunPlace, ...]:
    """Leave out, one by one, the place that has the nearest neighbour in its own posture."""
    left = list(places)
    directions = np.array([place.direction for place in left])
    postures = np.array([place.posture == "normal" for place in left])
    near = directions @ directions.T
    near[postures[:, None] != postures[None]] = -1.0
    np.fill_diagonal(near, -1.0)
    alive = list(range(len(left)))
    while len(alive) > n:
        part = near[np.ix_(alive, alive)]
        alive.pop(int(np.argmax(part.max(axis=1))))
    return tuple(left[i] for i in alive)


def way_length(cost: NDArray[np.float64], order: Sequence[int]) -> float:
    """What an order of places costs."""
    return float(cost[list(order[:-1]), list(order[1:])].sum())


def _nearest_next(cost: NDArray[np.float64]) -> list[int]:
    order, left = [0], set(range(1, len(cost)))
    while left:
        here = cost[order[-1]]
        order.append(min(left, key=lambda i: (here[i], i)))
        left.remove(order[-1])
    return order


def _turned(cost: NDArray[np.float64], order: list[int]) -> list[int]:
    """Turn round each stretch of the way that is shorter so; the beginning stays."""
    n = len(order)
    for i in range(1, n - 1):
        for j in range(i + 1, n):
            after = order[j + 1] if j + 1 < n else None
            old = cost[order[i - 1], order[i]] + (0.0 if after is None else cost[order[j], after])
            new = cost[order[i - 1], order[j]] + (0.0 if after is None else cost[order[i], after])
            if new < old - _PART_OF_A_TURN:
                order[i : j + 1] = order[i : j + 1][::-1]
    return order


def _moved(cost: NDArray[np.float64], order: list[int]) -> list[int]:
    """Move each single place to where it costs least."""
    for place in list(order[1:]):
        at = order.index(place)
        rest = order[:at] + order[at + 1 :]
        extra = [
            cost[rest[i], place]
            + (cost[place, rest[i + 1]] - cost[rest[i], rest[i + 1]] if i + 1 < len(rest) else 0.0)
            for i in range(len(rest))
        ]
        best = int(np.argmin(extra))
        order = [*rest[: best + 1], place, *rest[best + 1 :]]
    return order
