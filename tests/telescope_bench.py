"""A whole telescope under a virtual clock, and a witness who asks the simulated unit what is true.

What is true comes from the unit's own 48-bit positions, from the gears multiplied out here, and from the rigid mount
of `mounts.true_mount`; none of it passes through the planner.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clockdrive import Telescope, VirtualClock
from clockdrive.state import Activity
from mounts.true_mount import TrueMount, separation_arcsec
from pointing.instant import Instant
from pointing.targets import Star, Target

T0 = 1_800_000_000.0
CENTRE = 0x800000
DEG_PER_COUNT = 360.0 / 200.0 / 10.0 / 285.0 * 16.0 / 40.0  # the manual's gears, ten microsteps a step
ARCSEC_PER_COUNT = DEG_PER_COUNT * 3600.0
QUICK = {"axis1.acceleration_register": 255, "axis2.acceleration_register": 255,
         "axis1.deceleration_register": 255, "axis2.deceleration_register": 255}  # fmt: skip


def simulated(kind: str, folder: Path, clock: VirtualClock | None = None, **overrides: object) -> Telescope:
    """Open an embedded telescope of a kind; `axis1__min_deg` stands for `axis1.min_deg`."""
    dotted = {name.replace("__", "."): value for name, value in overrides.items()}
    return Telescope.simulated(
        kind,
        clock=clock or VirtualClock(T0),
        overrides={"state.path": str(folder), "limits.sun_avoidance_deg": 0.0, **dotted},
    )


@contextmanager
def telescope(folder: Path, start: float = T0, **overrides: object) -> Iterator[Telescope]:
    """Open a simulated TC410."""
    with simulated("tc410", folder, VirtualClock(start), **overrides) as scope:
        yield scope


def axes_off_arcsec(scope: Telescope, scales: tuple[float, float]) -> list[float]:
    """Angle of each axis from where the target wants it, by the motors themselves; arcseconds a count are given."""
    now = scope.clock.now()
    scope.simulator.advance(now)
    wanted = scope._session.pursuit.at(now)
    return [
        (scope.simulator.true_position(i + 1) - counts) * scale
        for i, ((counts, _), scale) in enumerate(zip(wanted, scales, strict=True))
    ]


class Witness:
    """Sees where the axes truly are at the arrival that was announced, and how often they were sent off."""

    def __init__(self, scope: Telescope) -> None:
        self.scope = scope
        self.device = scope.simulator
        self.arrivals: list[float] = []
        self.counts_at_arrival: tuple[float, float] | None = None
        session, advance, begin = scope._session, self.device.advance, scope._session.begin

        def begun(activity: Activity) -> None:
            self.arrivals.append(activity.until)
            self.counts_at_arrival = None
            begin(activity)

        def advanced(t: float) -> None:
            if self.arrivals and self.counts_at_arrival is None and t >= self.arrivals[-1]:
                advance(self.arrivals[-1])
                self.counts_at_arrival = self.counts()
            advance(t)

        session.begin, self.device.advance = begun, advanced

    def counts(self) -> tuple[float, float]:
        return self.device.true_position(1), self.device.true_position(2)

    def now(self) -> tuple[float, float]:
        """Counts at this moment."""
        self.device.advance(self.scope.clock.now())
        return self.counts()

    def angles(self, counts: tuple[float, float]) -> tuple[float, float]:
        """Axis angles, radians, by the gears."""
        one, two = (
            math.radians(section.centre_deg + (-1.0 if section.reversed else 1.0) * (count - CENTRE) * DEG_PER_COUNT)
            for section, count in zip(self.scope.configuration.axes, counts, strict=True)
        )
        return one, two

    def off_counts(self, target: Target, counts: tuple[float, float], time: float) -> tuple[float, float]:
        """By how many counts each axis is off where the target wants it, in the posture in which it is followed."""
        planner, posture = self.scope._session.planner, self.scope._session.pursuit.posture
        state = planner.track(target, time, posture, self.angles(counts))
        one, two = (
            true - axis.gearing.counts(angle)
            for true, axis, (angle, _) in zip(counts, planner.axes, state, strict=True)
        )
        return one, two

    def at_arrival(self) -> tuple[float, float]:
        """Counts at the arrival that was announced, for which a telescope that is early waits."""
        if self.counts_at_arrival is None:
            self.scope.wait(0.1)
            self.now()
        assert self.counts_at_arrival is not None
        return self.counts_at_arrival

    def on_sky_arcsec(self, target: Target, counts: tuple[float, float], time: float) -> float:
        """Angle between the target and where the tube really looks."""
        configuration = self.scope.configuration
        mount = TrueMount(
            configuration.simulator, configuration.mount.type, math.radians(configuration.site.latitude_deg)
        )
        frame = self.scope._session.planner.sky.at(Instant.from_posix(time))
        return separation_arcsec(mount.observed(*self.angles(counts)), target.observed(frame))


def star_at(scope: Telescope, azimuth_deg: float, altitude_deg: float, time: float | None = None) -> Star:
    """Make a star that stands there at a time, now by default."""
    frame = scope._session.planner.sky.at(Instant.from_posix(scope.clock.now() if time is None else time))
    a, e = math.radians(azimuth_deg), math.radians(altitude_deg)
    x, y, z = frame.astrometric((-math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)))
    name = f"star at {azimuth_deg:.3f}, {altitude_deg:.3f}"
    ra_deg, dec_deg = math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z))
    return Star.from_degrees(ra_deg, dec_deg, name, epoch=2000.0 + (scope.clock.now() - 946728000.0) / 31557600.0)
