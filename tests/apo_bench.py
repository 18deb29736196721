"""A telescope of axis controllers under a virtual clock, and a witness who asks the simulated axes what is true.

What is true comes from the simulator's own cubics and from the rigid mount of `mounts.true_mount`; none of it passes
through the planner or through the driver's own cubics.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from telescope_bench import Witness

from clockdrive import Telescope, VirtualClock
from pointing.targets import Target

APACHE_POINT = {"site.latitude_deg": 32.7803, "site.longitude_deg": -105.8203, "site.height_m": 2788.0}
MIDNIGHT = 1_800_057_600.0 - 37.0  # POSIX seconds of a TAI midnight: 2027-01-15T23:59:23 UTC
NIGHT = MIDNIGHT + 4.0 * 3600.0


@contextmanager
def apo_telescope(kind: str, folder: Path, start: float = NIGHT, **overrides: object) -> Iterator[Telescope]:
    """Open an embedded telescope of axis controllers; `axis1__min_deg` stands for `axis1.min_deg`."""
    dotted = {name.replace("__", "."): value for name, value in overrides.items()}
    with Telescope.simulated(
        kind,
        clock=VirtualClock(start),
        overrides={**APACHE_POINT, "state.path": str(folder), "limits.sun_avoidance_deg": 0.0, **dotted},
    ) as scope:
        yield scope


class ApoWitness(Witness):
    """Sees where the axes truly are, degrees, each at the arrival that was announced, whoever lets it run there."""

    def __init__(self, scope: Telescope) -> None:
        self._seen: dict[int, tuple[float, float]] = {}  # by axis: the arrival, and where it was then
        super().__init__(scope)
        for i, axis in enumerate(self.device.axes):
            axis.advance = self._watched(i, axis, axis.advance)

    def _watched(self, i, axis, advance):
        def advanced(t: float) -> None:
            due = self.arrivals[-1] if self.arrivals else math.inf
            if t >= due and self._seen.get(i, (0.0, 0.0))[0] != due:
                advance(due)
                self._seen[i] = due, axis.true_position()
            advance(t)

        return advanced

    def at_arrival(self) -> tuple[float, float]:
        """Degrees at the arrival that was announced last."""
        self.now()
        due = self.arrivals[-1]
        assert self._seen[0][0] == self._seen[1][0] == due
        return self._seen[0][1], self._seen[1][1]

    def angles(self, counts: tuple[float, float]) -> tuple[float, float]:
        """Axis angles, radians, of the controllers' positions."""
        one, two = (
            math.radians(section.centre_deg + (-1.0 if section.reversed else 1.0) * degrees)
            for section, degrees in zip(self.scope.configuration.axes, counts, strict=True)
        )
        return one, two

    def off_arcsec(self, target: Target) -> float:
        """Angle between the target and where the tube really looks, now."""
        return self.on_sky_arcsec(target, self.now(), self.scope.clock.now())

    def tracked_arcsec(self, target: Target, seconds: float, every: float) -> list[float]:
        """How far it is off the target, again and again while it tracks."""
        off, end = [], self.scope.clock.now() + seconds
        while self.scope.clock.now() < end:
            self.scope.wait(every)
            off.append(self.off_arcsec(target))
        return off

    def dry(self) -> list[float]:
        """Times at which a path ran out under a moving axis."""
        return [time for axis in self.device.axes for time in axis.record.dry]


def rms(values: list[float]) -> float:
    """Root mean square."""
    return math.sqrt(sum(value * value for value in values) / len(values))
