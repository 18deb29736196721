"""Whether a slew's whole path is clear of the horizon and the Sun.

The proof is by conservative advancement: from each point it steps no further than the margin to the nearest forbidden
zone, so nothing is skipped. A path that begins inside a zone may only lead out of it.
"""

import math
from dataclasses import dataclass

from pointing.gearing import Gearing
from pointing.limits import Check, Limits
from pointing.mount import Mount
from pointing.slew import Travel
from pointing.vectors import Vector

_FINEST_STEP = math.radians(0.02)  # the step of a path that grazes a limit
_DEEPER = math.radians(0.01)  # a path out of a forbidden zone may not lead deeper than this


@dataclass
class _Zone:
    """The least room seen so far to one forbidden zone, and where."""

    floor: float
    least: float = math.inf
    observed: Vector = (0.0, 0.0, 1.0)
    elapsed: float = 0.0

    def see(self, margin: float, observed: Vector, elapsed: float) -> float:
        room = margin - self.floor
        if room < self.least:
            self.least, self.observed, self.elapsed = room, observed, elapsed
        return room


class SlewPath:
    """The way of both axes through the sky during one slew."""

    def __init__(self, mount: Mount, gearings: tuple[Gearing, Gearing], travels: tuple[Travel, Travel]) -> None:
        self._mount = mount
        self._gearings = gearings
        self._travels = travels

    def angles(self, elapsed: float) -> tuple[float, float]:
        """Axis angles, radians, `elapsed` seconds after the motion began."""
        (one, two), (first, second) = self._gearings, self._travels
        return one.angle(first.position(elapsed)), two.angle(second.position(elapsed))

    def checks(self, limits: Limits, sun: Vector, max_rates: tuple[float, float]) -> tuple[Check, Check]:
        """The horizon and the Sun along the whole path.

        Parameters
        ----------
        limits : Limits
            What is forbidden.
        sun : Vector
            Direction of the Sun, horizon frame; it moves less than 0.5° during any slew.
        max_rates : tuple of float
            Largest speeds of the axes, counts per second.
        """
        travels = self._travels
        total = max(travels[0].duration, travels[1].duration)
        speed = sum(
            rate / abs(gearing.counts_per_radian) for rate, gearing in zip(max_rates, self._gearings, strict=True)
        )
        end = self.angles(total)
        angles = self.angles(0.0)
        observed = self._mount.observed(*angles)
        horizon = _Zone(min(0.0, limits.horizon.margin(observed) - _DEEPER))
        bright = _Zone(min(0.0, limits.sun_margin(observed, sun) - _DEEPER))
        elapsed = 0.0
        while True:
            room = min(
                horizon.see(limits.horizon.margin(observed), observed, elapsed),
                bright.see(limits.sun_margin(observed, sun), observed, elapsed),
            )
            left = abs(end[0] - angles[0]) + abs(end[1] - angles[1])
            if left <= room or elapsed >= total:
                break
            elapsed = min(total, elapsed + max(room, _FINEST_STEP) / speed)
            angles = self.angles(elapsed)
            observed = self._mount.observed(*angles)
        arrival = self._mount.observed(*end)
        return (
            horizon_check(limits, *_told(horizon, arrival)),
            sun_check(limits, sun, *_told(bright, arrival)),
        )


def horizon_check(limits: Limits, observed: Vector, when: str, ok: bool | None = None) -> Check:
    """Say how a direction stands to the horizon."""
    x, y, z = observed
    altitude = math.degrees(math.atan2(z, math.hypot(x, y)))
    lowest = math.degrees(limits.horizon.altitude(math.atan2(y, -x)))
    clear = altitude >= lowest if ok is None else ok
    if clear:
        return Check(
            "horizon", ok=True, detail=f"altitude {altitude:.2f}° {when}, {lowest:.2f}° is the lowest allowed"
        )
    detail = f"altitude {altitude:.2f}° {when} is {lowest - altitude:.2f}° below the horizon limit of {lowest:.2f}°"
    return Check("horizon", ok=False, detail=detail)


def sun_check(limits: Limits, sun: Vector, observed: Vector, when: str, ok: bool | None = None) -> Check:
    """Say how a direction stands to the Sun's zone."""
    if limits.sun_avoidance <= 0.0:
        return Check("Sun", ok=True, detail="no zone of avoidance is configured")
    margin = limits.sun_margin(observed, sun)
    zone = math.degrees(limits.sun_avoidance)
    distance = math.degrees(margin) + zone
    clear = margin >= 0.0 if ok is None else ok
    if clear:
        return Check("Sun", ok=True, detail=f"{distance:.1f}° from the Sun {when}, {zone:.1f}° must be kept")
    detail = f"{distance:.1f}° from the Sun {when} is {zone - distance:.1f}° inside its zone of {zone:.1f}°"
    return Check("Sun", ok=False, detail=detail)


def _told(zone: _Zone, arrival: Vector) -> tuple[Vector, str, bool]:
    if zone.least >= 0.0:
        return arrival, "at arrival", True
    return zone.observed, f"{zone.elapsed:.1f} s after the start", False
