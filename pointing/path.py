"""Whether a slew's whole path is clear of the horizon and the Sun.

The proof is by conservative advancement: from each point it steps no further than the room to the nearest forbidden
zone, so nothing is skipped but what a step of 0.02° can hide: a dip of 0.01° where the path grazes a limit. A path
that begins inside a zone may only lead out of it: nowhere deeper than it has been by more than 0.01°.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from pointing.gearing import Gearing
from pointing.limits import Check, Limits
from pointing.mount import Mount
from pointing.slew import Travel
from pointing.vectors import Vector

_FINEST_STEP = math.radians(0.02)  # the step of a path that grazes a limit
DEEPER = math.radians(0.01)  # what a path out of a forbidden zone may lose on its way
_SUN_RATE = 8e-5  # rad/s, above the Earth's turn


class Leg(NamedTuple):
    """One axis during a slew, in radians.

    Attributes
    ----------
    gearing : Gearing
        Turns counts into angle.
    travel : Travel
        The way of the axis, counts.
    fastest : float
        Its largest speed, radians per second.
    start_rate : float
        Its rate as the motion begins; it may lead the wrong way, or too fast to stop in time.
    resumed : float
        Its rate after landing, for a drive whose axes resume tracking one by one.
    joined : float
        Its rate as it joins a target with that one's velocity, for which it may have to go beyond it and back.
    """

    gearing: Gearing
    travel: Travel
    fastest: float
    start_rate: float = 0.0
    resumed: float = 0.0
    joined: float = 0.0

    def angle(self, elapsed: float) -> float:
        """Axis angle `elapsed` seconds after the motion began."""
        angle = self.gearing.angle(self.travel.position(elapsed))
        if self.resumed and elapsed > self.travel.duration:
            angle += self.resumed * (elapsed - self.travel.duration)
        return angle


@dataclass(frozen=True)
class SlewPath:
    """The way of both axes through the sky during one slew.

    Parameters
    ----------
    mount : Mount
        Turns axis angles into directions.
    legs : tuple of Leg
        What each axis does.
    suns : tuple of Vector
        Direction of the Sun at the beginning and the end, horizon frame.
    """

    mount: Mount
    legs: tuple[Leg, Leg]
    suns: tuple[Vector, Vector]

    @property
    def duration(self) -> float:
        """Seconds until the later axis has landed."""
        return max(self.legs[0].travel.duration, self.legs[1].travel.duration)

    def angles(self, elapsed: float) -> tuple[float, float]:
        """Axis angles, radians, `elapsed` seconds after the motion began."""
        return self.legs[0].angle(elapsed), self.legs[1].angle(elapsed)

    def sun(self, elapsed: float) -> Vector:
        """Direction of the Sun, not normalised; its straight line stands for the arc of a few degrees."""
        (x, y, z), (u, v, w) = self.suns
        k = elapsed / self.duration if elapsed else 0.0
        return x + (u - x) * k, y + (v - y) * k, z + (w - z) * k

    def checks(self, limits: Limits, *, ends_clear: bool) -> tuple[Check, Check]:
        """The horizon and the Sun along the whole path.

        Parameters
        ----------
        limits : Limits
            What is forbidden.
        ends_clear : bool
            Whether a path that begins inside a zone must lead all the way out.
        """
        total = self.duration
        # While an axis goes astray it is no faster than it began, and it comes back the same way.
        astray = _SUN_RATE
        for leg in self.legs:
            astray += 2.0 * (abs(leg.start_rate) + abs(leg.resumed) + abs(leg.joined))
        speed = self.legs[0].fastest + self.legs[1].fastest + _SUN_RATE
        end = self.angles(total)
        angles, elapsed = self.angles(0.0), 0.0
        observed, sun = self.mount.observed(*angles), self.suns[0]
        horizon = _Zone(limits.horizon.margin(observed), observed)
        bright = _Zone(limits.sun_margin(observed, sun), observed)
        while elapsed < total:
            room = min(limits.horizon.room(observed, horizon.floor), limits.sun_margin(observed, sun) - bright.floor)
            left = abs(end[0] - angles[0]) + abs(end[1] - angles[1]) + astray * (total - elapsed)
            if left <= room:
                break
            elapsed = min(total, elapsed + max(abs(room), _FINEST_STEP) / speed)
            angles = self.angles(elapsed)
            observed, sun = self.mount.observed(*angles), self.sun(elapsed)
            horizon.see(limits.horizon.margin(observed), observed, elapsed)
            bright.see(limits.sun_margin(observed, sun), observed, elapsed)
        arrival = self.mount.observed(*end)
        direction, elapsed, ok = horizon.told(limits.horizon.margin(arrival), arrival, total, ends_clear=ends_clear)
        low = horizon_check(limits, direction, self._when(elapsed), ok)
        direction, elapsed, ok = bright.told(
            limits.sun_margin(arrival, self.suns[1]), arrival, total, ends_clear=ends_clear
        )
        return low, sun_check(limits, self.sun(elapsed), direction, self._when(elapsed), ok)

    def _when(self, elapsed: float) -> str:
        return "at arrival" if elapsed == self.duration else f"{elapsed:.1f} s after the start"


class _Zone:
    """How a path stands to one forbidden zone: the deepest it got into it, and where."""

    def __init__(self, margin: float, observed: Vector) -> None:
        self.floor = min(0.0, margin - DEEPER)
        self._least = 0.0
        self._observed = observed
        self._elapsed = 0.0

    def see(self, margin: float, observed: Vector, elapsed: float) -> None:
        room = margin - self.floor
        if room < self._least:
            self._least, self._observed, self._elapsed = room, observed, elapsed
        if self.floor < 0.0:  # what was gained is not given back
            self.floor = min(0.0, max(self.floor, margin - DEEPER))

    def told(self, margin: float, arrival: Vector, total: float, *, ends_clear: bool) -> tuple[Vector, float, bool]:
        """Direction and moment to speak of, and whether all is well; the arrival comes first."""
        refused = self._least < 0.0
        if margin < 0.0 and (ends_clear or refused):
            return arrival, total, False
        return (self._observed, self._elapsed, False) if refused else (arrival, total, True)


_SHOWN_DEG = 0.01  # to which altitudes are told


def horizon_check(limits: Limits, observed: Vector, when: str, ok: bool | None = None) -> Check:
    """Say how a direction stands to the horizon."""
    x, y, z = observed
    altitude = math.degrees(math.atan2(z, math.hypot(x, y)))
    lowest = math.degrees(limits.horizon.altitude(math.atan2(y, -x)))
    margin = math.radians(altitude - lowest)
    clear = altitude >= lowest if ok is None else ok
    if clear:
        detail = f"altitude {altitude:.2f}° {when}, {lowest:.2f}° is the lowest allowed"
    else:
        below = lowest - altitude
        by = "at" if below < _SHOWN_DEG / 2.0 else f"{below:.2f}° below"  # as it comes to it there is no figure
        detail = f"altitude {altitude:.2f}° {when} is {by} the horizon limit of {lowest:.2f}°"
    return Check("horizon", clear, detail, margin)


def sun_check(limits: Limits, sun: Vector, observed: Vector, when: str, ok: bool | None = None) -> Check:
    """Say how a direction stands to the Sun's zone."""
    if limits.sun_avoidance <= 0.0:
        return Check("Sun", ok=True, detail="no zone of avoidance is configured")
    margin = limits.sun_margin(observed, sun)
    zone = math.degrees(limits.sun_avoidance)
    distance = math.degrees(margin) + zone
    clear = margin >= 0.0 if ok is None else ok
    if clear:
        detail = f"{distance:.1f}° from the Sun {when}, {zone:.1f}° must be kept"
    else:
        detail = f"{distance:.1f}° from the Sun {when} is {zone - distance:.1f}° inside its zone of {zone:.1f}°"
    return Check("Sun", clear, detail, margin)
