"""Telescopes to plan for: a drive with trapezoidal slews, three mounts, and what a person would call random skies."""

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction

from pointing.gearing import Gearing
from pointing.instant import Instant
from pointing.limits import Horizon, Limits
from pointing.mount import Mount, MountType
from pointing.plan import Axis, Start, Timing
from pointing.planner import Planner
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import Star

MIDNIGHT = 1_800_000_000.0
STEP = Fraction(3, 11875)  # degrees a count
COUNTS_PER_DEGREE = float(1 / STEP)


@dataclass(frozen=True)
class TrapezoidTravel:
    """Phases (duration, start, speed, acceleration) one after the other, then rest at `landed`."""

    phases: tuple[tuple[float, float, float, float], ...]
    landed: float

    @property
    def duration(self):
        return sum(phase[0] for phase in self.phases)

    def position(self, elapsed):
        for duration, start, speed, acceleration in self.phases:
            if elapsed < duration:
                return start + speed * elapsed + acceleration * elapsed * elapsed / 2.0
            elapsed -= duration
        return self.landed


@dataclass(frozen=True)
class Trapezoid:
    """Slews in counts: brakes to rest first when it moves, then accelerates, cruises and brakes alike."""

    max_rate: float
    acceleration: float

    def travel(self, start, end, start_rate, end_rate):  # noqa: ARG002 - it lands at rest
        phases = []
        if start_rate:
            braking = -math.copysign(self.acceleration, start_rate)
            seconds = abs(start_rate) / self.acceleration
            phases.append((seconds, start, start_rate, braking))
            start += start_rate * seconds / 2.0
        distance, sign = abs(end - start), math.copysign(1.0, end - start)
        top = min(self.max_rate, math.sqrt(distance * self.acceleration))
        if top:
            ramp = top / self.acceleration
            cruise = distance / top - ramp
            braked = start + sign * (distance - top * ramp / 2.0)
            phases += [
                (ramp, start, 0.0, sign * self.acceleration),
                (cruise, start + sign * top * ramp / 2.0, sign * top, 0.0),
                (ramp, braked, sign * top, -sign * self.acceleration),
            ]
        return TrapezoidTravel(tuple(phases), end)


def timing(speed_deg_s=4.5, acceleration_deg_s2=1.0, *, second_speed_deg_s=None, latency=0.05, together=True):
    one = Trapezoid(speed_deg_s * COUNTS_PER_DEGREE, acceleration_deg_s2 * COUNTS_PER_DEGREE)
    other = speed_deg_s if second_speed_deg_s is None else second_speed_deg_s
    two = Trapezoid(other * COUNTS_PER_DEGREE, acceleration_deg_s2 * COUNTS_PER_DEGREE)
    return Timing((one, two), latency, together)


def gearing(centre_deg, *, turned=False):
    return Gearing(STEP, 0x800000, centre_deg, turned)


LIMITS_DEG = {
    MountType.EQUATORIAL_FORK: ((-170.0, 170.0), (-100.0, 100.0)),
    MountType.ALTAZ_FORK: ((-270.0, 270.0), (0.0, 92.0)),
    MountType.GERMAN: ((-20.0, 200.0), (-220.0, 220.0)),
}


def planner(
    kind,
    latitude_deg=-42.4,
    *,
    x_deg=0.0,
    y_deg=0.0,
    horizon=None,
    sun_deg=0.0,
    past_deg=10.0,
    limits_deg=None,
    turned=(False, True),
):
    """A planner for one telescope; the horizon is 5° all round unless given."""
    latitude = math.radians(latitude_deg)
    centre2 = 45.0 if kind is MountType.ALTAZ_FORK else latitude_deg
    travel = limits_deg or LIMITS_DEG[kind]
    axes = tuple(
        Axis(f"axis{i + 1}", gearing((0.0, centre2)[i], turned=turned[i]), *map(math.radians, travel[i]))
        for i in range(2)
    )
    return Planner(
        Sky(Site.from_degrees(latitude_deg, 173.7, 30.0)),
        Mount(kind, latitude, math.radians(x_deg), math.radians(y_deg)),
        (axes[0], axes[1]),
        Limits(horizon or Horizon.level(5.0), math.radians(sun_deg)),
        math.radians(past_deg),
    )


def random_star(rng):
    """A star anywhere on the sphere."""
    return Star.from_degrees(rng.uniform(0.0, 360.0), math.degrees(math.asin(rng.uniform(-1.0, 1.0))))


def noon_of(subject):
    """The first moment after MIDNIGHT, of those every five minutes, with the Sun within 3° of the meridian and up."""
    for time in itertools.count(MIDNIGHT, 300.0):
        _, east, up = subject.sky.at(Instant.from_posix(time)).sun()
        if up > 0.0 and abs(east) < 0.05:
            return time
    raise AssertionError("it never is noon")


def start_at(subject, axis1_deg, axis2_deg, time=MIDNIGHT, rates_deg_s=(0.0, 0.0)):
    """A start at axis angles and rates in degrees."""
    one, two = (axis.gearing for axis in subject.axes)
    return Start(
        time,
        (one.counts(math.radians(axis1_deg)), two.counts(math.radians(axis2_deg))),
        tuple(
            math.radians(rate) * gear.counts_per_radian for rate, gear in zip(rates_deg_s, (one, two), strict=True)
        ),
    )
