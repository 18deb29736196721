"""When a target can be observed: the intervals in which horizon, Sun and mount allow it.

From each moment the search goes on by no more than the time in which nothing can change: the angle to the nearest
limit by the greatest speed that the target can have. So no pass is missed but one shorter than a second. A target
that knows its own bound has `steady(frame)`, as satellites do; any other is taken to move at most twice as fast as it
does now, and as the sky. Satellites, which give their `altitudes` at many times at once, are first looked for on a
grid of minutes; what lies between two of its points is bounded by the same speed. Times are POSIX seconds, to 0.1 s;
angles radians.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from pointing.errors import PointingError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.sky import SkyFrame
from pointing.targets import Target
from pointing.vectors import Vector, azimuth_altitude

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pointing.satellite import Satellite

_FINEST = 1.0  # s
_PRECISE = 0.05  # s
_LONGEST = 600.0  # s
_GRID = 60.0  # s, for satellites
_SAMPLES = 300.0  # s, for others, when nothing but the highest place is wanted
_AIR = math.radians(1.0)  # what refraction may lift and the grid leaves out
_SKY_RATE = 7.3e-5  # rad/s
_SUN_RATE = 8e-5  # rad/s, above the Earth's turn


class Sighting(NamedTuple):
    """Where a target is seen at a time."""

    time: float
    azimuth: float
    altitude: float


@dataclass(frozen=True)
class Pass:
    """An interval in which a target can be observed.

    Parameters
    ----------
    target : Target
        What can be observed.
    rise, set : Sighting
        The first and the last of it.
    culmination : Sighting
        The highest of it.
    begun, unfinished : bool
        Whether it was under way already when the search began, and still when it ended.
    """

    target: Target
    rise: Sighting
    culmination: Sighting
    set: Sighting
    begun: bool = False
    unfinished: bool = False

    @property
    def duration(self) -> float:
        """Seconds from rise to set."""
        return self.set.time - self.rise.time


class _Look(NamedTuple):
    """What is found at a time: whether all allows it, for how many seconds surely no less or more, how it climbs."""

    time: float
    allowed: bool
    free: float
    observed: Vector
    climb: float

    @property
    def sighting(self) -> Sighting:
        return Sighting(self.time, *azimuth_altitude(self.observed))


def passes(
    geometry: Geometry,
    target: Target,
    after: float,
    until: float,
    *,
    above: float = -math.pi / 2.0,
    progress: Callable[[float], object] | None = None,
) -> Iterator[Pass]:
    """Find the intervals in which the telescope can observe a target.

    Parameters
    ----------
    geometry : Geometry
        Site, mount and limits.
    target : Target
        Any target.
    after, until : float
        POSIX seconds.
    above : float
        An altitude that must be exceeded besides the limits, radians.
    progress : callable, optional
        Called with the fraction that is done.

    Yields
    ------
    Pass
        In the order of time.

    Raises
    ------
    PointingError
        The time is none.
    TargetError
        The target has no place at a time; passes before it have been given.
    """
    if not 0.0 < until - after < math.inf:
        raise PointingError(f"a search of {until - after:g} s: give a positive time")
    search = _Search(geometry, target, above)
    told = progress or (lambda fraction: None)  # noqa: ARG005 - nobody listens
    for begin, end in search.windows(after, until):
        for found in search.between(begin, end, lambda time: told((time - after) / (until - after))):
            first, last = found[0].sighting, found[-1].sighting
            yield Pass(target, first, search.highest(found).sighting, last, first.time == after, last.time == until)
    told(1.0)


def never(geometry: Geometry, target: Target, after: float, until: float, *, above: float = -math.pi / 2.0) -> str:
    """Say why a target has no pass between two times: how high it gets, and what forbids it there.

    Raises
    ------
    TargetError
        The target has no place at a time.
    """
    search = _Search(geometry, target, above)
    time, azimuth, altitude = search.summit(after, until).sighting
    lowest = max(geometry.limits.horizon.altitude(azimuth), above)
    when = f"{math.degrees(altitude):.2f}° at {Instant.from_posix(time).utc_iso(0)}"
    if altitude < lowest:
        return f"{target.name} does not rise above {math.degrees(lowest):.2f}°: the highest is {when}"
    forbidden = "; ".join(
        check.detail.replace(" now ", " then ") for check in geometry.no_placement(target, time) if not check.ok
    )
    return f"{target.name} rises to {when}, but is never allowed: {forbidden or 'not for a second'}"


def forbidden_s(geometry: Geometry, target: Target, time: float) -> float:
    """For how many seconds a target surely stays at forbidden places; 0 where it stands at an allowed one.

    Raises
    ------
    TargetError
        The target has no place at the time.
    """
    with suppress(Unreachable):  # where the origin passes the pole of axis 1 by, nobody says how far
        look = _Search(geometry, target, -math.pi / 2.0).look(time)
        return 0.0 if look.allowed else look.free
    return 0.0


class _Search:
    """The search for one target."""

    def __init__(self, geometry: Geometry, target: Target, above: float) -> None:
        self._geometry = geometry
        self._target = target
        self._satellite = cast("Satellite", target) if hasattr(target, "altitudes") else None
        self._above = above

    def windows(self, after: float, until: float) -> Iterator[tuple[float, float]]:
        """Intervals outside of which the target is certainly too low."""
        satellite = self._satellite
        if satellite is None:
            yield after, until
            return
        seconds, altitudes, distances = self._grid(satellite, after, until)
        swing = np.arcsin(np.minimum(1.0, satellite.fastest_m_s * _GRID / 2.0 / distances))
        lowest = max(min(altitude for _, altitude in self._geometry.limits.horizon.altitudes), self._above)
        possible = ~(altitudes + swing < lowest - _AIR)  # so that NaN is possible, and will be told
        edges = np.flatnonzero(np.diff(np.concatenate(([False], possible[:-1] | possible[1:], [False]))))
        for first, last in edges.reshape(-1, 2).tolist():
            yield after + float(seconds[first]), min(after + float(seconds[last]), until)

    def between(self, begin: float, end: float, told: Callable[[float], object]) -> Iterator[list[_Look]]:
        """All that was seen of each pass, from its first moment to its last."""
        before = self.look(begin)
        seen = [before] if before.allowed else []
        while before.time < end:
            later = self.look(min(end, before.time + max(before.free, _FINEST)))
            if later.allowed != before.allowed:
                outer, inner = self._edge(before, later)
                seen.append(inner if later.allowed else outer)
                if not later.allowed:
                    yield seen
                    seen = []
            if later.allowed:
                seen.append(later)
            before = later
            told(before.time)
        if seen:
            yield seen

    def highest(self, seen: list[_Look]) -> _Look:
        """Return the highest of some looks, or of what is between them."""
        summits = [
            self._bisected(one, two, lambda look: look.climb > 0.0)[0]
            for one, two in pairwise(seen)
            if one.climb > 0.0 >= two.climb
        ]
        return max((*seen, *summits), key=lambda look: look.observed[2])

    def summit(self, after: float, until: float) -> _Look:
        """Return the highest place between two times, whatever is allowed."""
        if self._satellite is not None:
            seconds, altitudes, _ = self._grid(self._satellite, after, until)
            top = int(np.argmax(np.where(np.isnan(altitudes), np.inf, altitudes)))
            near = seconds[max(top - 1, 0) : top + 2]
        else:
            near = np.append(np.arange(0.0, until - after, _SAMPLES), until - after)
        return self.highest([self.look(min(after + float(s), until)) for s in near])

    def _grid(
        self, target: "Satellite", after: float, until: float
    ) -> tuple["NDArray[np.float64]", "NDArray[np.float64]", "NDArray[np.float64]"]:
        seconds = np.arange(math.ceil((until - after) / _GRID) + 1, dtype=np.float64) * _GRID
        return seconds, *target.altitudes(self._geometry.sky, Instant.from_posix(after), seconds)

    def look(self, time: float) -> _Look:
        """Look at the target at a time."""
        geometry, limits = self._geometry, self._geometry.limits
        frame = geometry.sky.at(Instant.from_posix(time))
        observed, rate = self._target.observed_with_rate(frame)
        low = math.copysign(limits.horizon.distance(observed), limits.horizon.margin(observed))
        fixed = min(low, math.asin(observed[2]) - self._above, geometry.reach(observed))
        sun = limits.sun_margin(observed, geometry.sun(frame))
        # While several forbid it, the farthest of them decides; while all allow it, the nearest.
        steady = self._steady(frame, rate)
        free = steady(abs(fixed))
        if math.isfinite(sun):
            sunny = min(steady(abs(sun) / 2.0), abs(sun) / 2.0 / _SUN_RATE)
            free = _first_change((fixed, free), (sun, sunny))
        return _Look(time, fixed >= 0.0 and sun >= 0.0, free, observed, rate[2])

    def _steady(self, frame: SkyFrame, rate: Vector) -> Callable[[float], float]:
        """Give the seconds for which the target surely stays within an angle."""
        # A displacement is small against what it is laid over.
        known = getattr(self._target, "steady", None) or getattr(getattr(self._target, "base", None), "steady", None)
        if known is not None:
            return cast("Callable[[float], float]", known(frame))
        fastest = 2.0 * max(math.hypot(*rate), _SKY_RATE)
        return lambda angle: min(angle / fastest, _LONGEST)

    def _edge(self, before: _Look, later: _Look) -> tuple[_Look, _Look]:
        return self._bisected(before, later, lambda look: look.allowed == before.allowed)

    def _bisected(self, one: _Look, two: _Look, early: Callable[[_Look], bool]) -> tuple[_Look, _Look]:
        """The last look that is `early` and the first that is not, closer than the precision."""
        while two.time - one.time > _PRECISE:
            middle = self.look((one.time + two.time) / 2.0)
            one, two = (middle, two) if early(middle) else (one, middle)
        return one, two


def _first_change(*limits: tuple[float, float]) -> float:
    """Seconds until what is allowed can change, from the margin and the seconds of each limit."""
    forbidden = [seconds for margin, seconds in limits if margin < 0.0]
    return max(forbidden) if forbidden else min(seconds for _, seconds in limits)
