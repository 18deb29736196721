"""A second star in the field of a telescope with a rotator, by ERFA and rotation matrices written here.

ERFA places the stars; the mount is a product of matrices, each axis one rotation, with the focal plane as two vectors
that are carried along. Nothing of the chain under test is in it but the angles that are commanded.
"""

import math
from fractions import Fraction

import erfa
import numpy as np

from pointing.earth_orientation import earth_orientation
from pointing.gearing import Gearing
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.limits import Horizon, Limits
from pointing.model.pointing_model import PointingModel
from pointing.mount import Mount, MountType
from pointing.plan import Axis
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.targets import Star
from pointing.vectors import from_azimuth_altitude

ARCSEC = math.pi / 648_000.0
TIME = 1_800_000_000.0
LATITUDE, LONGITUDE, HEIGHT = 32.780361, -105.820417, 2788.0
AIR = Weather(pressure_hpa=730.0, temperature_c=8.0, relative_humidity=0.3, wavelength_um=0.55)
NO_AIR = Weather(refraction=False)
ERRORS = {"CA": 95.0, "NPAE": -40.0, "AN": 35.0, "AW": -60.0, "IA": 200.0, "IE": -150.0}
EQUATORIAL = {"CH": 95.0, "NP": -40.0, "MA": 35.0, "ME": -60.0, "IH": 200.0, "ID": -150.0}
TURN = Axis("rotator", Gearing(Fraction(1), 0, 0.0), -math.pi, math.pi, units="degrees")


def subject(air=AIR, kind=MountType.ALTAZ_FORK, terms=None, misaligned=True):
    site = Site.from_degrees(LATITUDE, LONGITUDE, HEIGHT, air)
    word = "altazimuth" if kind is MountType.ALTAZ_FORK else "equatorial"
    model = PointingModel.of(word, LATITUDE, **terms) if terms else None
    x, y = (0.003, -0.002) if misaligned else (0.0, 0.0)
    mount = Mount(kind, site.latitude, x, y, model=model)
    degree = Gearing(Fraction(1), 0, 0.0)
    axes = (Axis("axis1", degree, -10.0, 10.0, "degrees"), Axis("axis2", degree, -10.0, 10.0, "degrees"))
    return Geometry(Sky(site), mount, axes, Limits(Horizon.level(5.0), 0.0))


def erfas(ra, dec, air, time, place=(LATITUDE, LONGITUDE, HEIGHT)):
    """Where ERFA sees ICRS places: horizon vectors (n, 3), x south, y east, z zenith."""
    instant, (latitude, longitude, height) = Instant.from_posix(time), place
    day, seconds = instant.utc()
    orientation = earth_orientation(instant)
    azimuth, zenith_distance, *_ = erfa.atco13(
        *(ra, dec, 0.0, 0.0, 0.0, 0.0, 2400000.5 + day, seconds / 86400.0, orientation.dut1),
        *(math.radians(longitude), math.radians(latitude), height, orientation.xp, orientation.yp),
        *(air.pressure_hpa if air.refraction else 0.0, air.temperature_c, air.relative_humidity, air.wavelength_um),
    )
    level = np.sin(zenith_distance)
    return np.stack((-level * np.cos(azimuth), level * np.sin(azimuth), np.cos(zenith_distance)), -1)


def around(x, y, z):
    """The active rotation by a vector, as the exponential of its cross-product matrix."""
    generator = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    values, vectors = np.linalg.eig(generator)
    return (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)).real if generator.any() else np.eye(3)


def focal_plane(geometry, axis1, axis2, rotator, terms):
    """Where the tube looks and the instrument's x and y on the sky, as a train of matrices has them."""
    mount, altazimuth = geometry.mount, geometry.mount.type is MountType.ALTAZ_FORK
    names = ("CA", "NPAE", "AN", "AW", "IA", "IE") if altazimuth else ("CH", "NP", "MA", "ME", "IH", "ID")
    aside, skew, tilt1, tilt2, index1, index2 = (ARCSEC * terms.get(name, 0.0) for name in names)
    sense = 1.0 if altazimuth else -1.0
    axis1, axis2 = axis1 + (-index1 if altazimuth else index1), axis2 + index2
    tilt = around(tilt2, 0.0, 0.0) @ around(0.0, -tilt1, 0.0) if altazimuth else (
        around(0.0, -tilt2, 0.0) @ around(-tilt1, 0.0, 0.0)
    )  # fmt: skip
    about_pole = math.pi - axis1 if altazimuth else -axis1
    horizon = np.eye(3) if altazimuth else around(0.0, mount.latitude - math.pi / 2, 0.0)
    train = (
        horizon
        @ around(mount.x, mount.y, 0.0)
        @ tilt
        @ around(0.0, 0.0, about_pole)
        @ around(-sense * skew, 0.0, 0.0)
        @ around(0.0, -axis2, 0.0)
        @ around(0.0, 0.0, sense * aside)
    )
    tube, across, up = train.T  # `across` is to the east of an upright tube seen from inside
    turn = around(*(-rotator * tube))  # from north to east is clockwise about the direction of sight
    return tube, turn @ across, turn @ up


def in_the_field(star, plane):
    """Gnomonic coordinates of a star in a focal plane, arcseconds: along the instrument's x and y."""
    tube, across, up = plane
    return np.array((star @ across, star @ up)) / (star @ tube) / ARCSEC


def ring(star, degrees, angles):
    """ICRS places at a distance from a star, at position angles."""
    d, p = math.radians(degrees), np.asarray(angles)
    dec = np.arcsin(math.sin(star.dec) * math.cos(d) + math.cos(star.dec) * math.sin(d) * np.cos(p))
    east = np.sin(p) * math.sin(d) * math.cos(star.dec)
    return star.ra + np.arctan2(east, math.cos(d) - math.sin(star.dec) * np.sin(dec)), dec


def star_at(geometry, azimuth, altitude, time=TIME):
    frame = geometry.sky.at(Instant.from_posix(time))
    direction = from_azimuth_altitude(math.radians(azimuth), math.radians(altitude))
    x, y, z = frame.astrometric(direction)
    return Star("a star", math.atan2(y, x) % math.tau, math.asin(z))


def across_the_field(scope, star, held_deg):
    """How far a star 1° off the axis stands beside its direction in the field of a simulated telescope, arcseconds.

    Asked of the true axes and the true rotator, now, for a rotator that is to hold `held_deg` on the sky.
    """
    time = scope.clock.now()
    scope.simulator.advance(time)
    one, two, turned = (math.radians(scope.simulator.true_position(i)) for i in (1, 2, 3))
    planner = scope._session.planner
    site, configured = planner.sky.site, scope.configuration.site
    place = configured.latitude_deg, configured.longitude_deg, configured.height_m
    ra, dec = ring(star, 1.0, [math.radians(held_deg)])
    seen = erfas(ra, dec, site.weather, time, place)
    return in_the_field(seen[0], focal_plane(planner, one, two, turned, {}))[0]
