"""The true place of a telescope's pointing origin on the sky, and the plate solution that an image would give.

The mechanics are those of `mounts.true_mount`, in arcseconds of the simulated unit's own position. An origin (x, y)
is a further collimation x of that mount, seen at axis 2 + y: both turn with the tube.
"""

import math
from types import SimpleNamespace

from telescope_bench import Witness

from mounts.true_mount import TrueMount
from pointing.instant import Instant
from pointing.targets import Star
from pointing.vectors import horizon_to_equatorial, hour_angle_declination, longitude_latitude

ARCSEC = math.pi / 648_000.0


class Sky:
    """What a perfect camera on the pointing origin sees."""

    def __init__(self, scope):
        self.scope = scope
        self.witness = Witness(scope)

    def observed(self):
        """Where the pointing origin in force truly points now, horizon frame."""
        configuration = self.scope.configuration
        origin = configuration.instruments[self.scope.status()["instrument"]]
        kind = configuration.mount.type
        across = origin.x_arcsec * (-1.0 if kind == "altaz-fork" else 1.0)
        errors = SimpleNamespace(
            **{
                name: getattr(configuration.simulator, name)
                for name in configuration.simulator.__dataclass_fields__
                if name.endswith("_arcsec")
            }
        )
        errors.collimation_arcsec += across
        mount = TrueMount(errors, kind, math.radians(configuration.site.latitude_deg))
        axis1, axis2 = self.witness.angles(self.witness.now())
        return mount.observed(axis1, axis2 + origin.y_arcsec * ARCSEC)

    def frame(self):
        return self.scope._session.planner.sky.at(Instant.from_posix(self.scope.clock.now()))

    def solution(self):
        """The ICRS place of the image taken now."""
        frame = self.frame()
        ra, dec = longitude_latitude(frame.astrometric(self.observed()))
        return Star("image", ra, dec, epoch=2000.0 + frame.years)

    def off(self, target):
        """Arcseconds east and north on the sky from a target to where the telescope truly points, by RA and Dec."""
        latitude = math.radians(self.scope.configuration.site.latitude_deg)
        frame = self.frame()
        (h, d), (h0, d0) = (
            hour_angle_declination(horizon_to_equatorial(v, latitude))
            for v in (self.observed(), target.observed(frame))
        )
        east = math.remainder(h0 - h, math.tau) * math.cos((d + d0) / 2.0)
        return east / ARCSEC, (d - d0) / ARCSEC


