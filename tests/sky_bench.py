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


MOUNTS = [
    (kind, latitude, posture)
    for kind in ("equatorial-fork", "german", "altaz-fork")
    for latitude in (-42.4, 51.5)
    for posture in ("normal", "beyond")
]


def standing(kind, latitude, posture):
    """Settings of a mount that can reach one side of the pole only, and azimuth and altitude of a place there."""
    settings = {"mount__type": kind, "site__latitude_deg": latitude, "site__longitude_deg": 173.7}
    if kind == "german":  # normal looks west
        return settings, (285.0 if posture == "normal" else 75.0, 52.0)
    if posture == "beyond":
        low, high = {"altaz-fork": (92.0, 175.0)}.get(kind, (92.0, 260.0) if latitude > 0.0 else (-260.0, -92.0))
        settings |= {"axis2__min_deg": low, "axis2__max_deg": high, "limits__horizon_deg": -5.0}  # the way is low
    return settings, (75.0, 52.0)


def crooked(x=150.0, y=-110.0, collimation=90.0, nonperpendicularity=0.0):
    """A mount that nobody knows to be crooked, arcseconds."""
    return {
        "simulator__misalignment_x_arcsec": x,
        "simulator__misalignment_y_arcsec": y,
        "simulator__collimation_arcsec": collimation,
        "simulator__nonperpendicularity_arcsec": nonperpendicularity,
    }
