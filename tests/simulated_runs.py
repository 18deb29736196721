"""Pointing runs of telescopes that are known, from unit vectors turned one way after the other.

A second implementation of POINTING_MATH's chain, telescope to star, independent of `pointing.model`: no coordinate is
corrected, vectors are turned. x points to lon 0 on the mount's equator, y to lon 90°, z to the mount's pole.
"""

import math
from dataclasses import dataclass

import numpy as np

from pointing.model.run import PointingRun

ARCSEC = math.radians(1.0 / 3600.0)
MOUNTS = ("fork", "german", "altazimuth")

TRUTH = {
    "fork": {"IH": 120.0, "ID": -75.0, "CH": 90.0, "NP": -45.0, "MA": -150.0, "ME": 210.0, "TF": 40.0},
    "german": {"IH": -210.0, "ID": 60.0, "CH": -110.0, "NP": 55.0, "MA": 180.0, "ME": -95.0, "TF": 35.0},
    "altazimuth": {"IA": -140.0, "IE": -115.0, "CA": 85.0, "NPAE": -30.0, "AN": -60.0, "AW": 75.0, "TF": 45.0},
}


@dataclass(frozen=True)
class Simulated:
    """A run, and which of its observations do not belong."""

    run: PointingRun
    outlier: np.ndarray


def simulated_run(
    mount, latitude_deg, arcsec, n, rng, *, noise_arcsec=2.0, outliers=0.0, lowest_deg=15.0, extra=None
) -> Simulated:
    """Observe n stars spread evenly over the sky with a telescope of these terms, arcseconds.

    `extra` (lon, lat) → (Δlon, Δlat) is added to the mechanical coordinates before all terms, radians. The noise is
    that of each component. An outlier lies 30″ to 600″ off, each factor alike.
    """
    latitude = math.radians(latitude_deg)
    lon, lat = sky_places(mount, latitude, n, rng, math.radians(lowest_deg))
    if mount == "german":
        other = rng.random(n) < 0.5
        lon, lat = np.where(other, lon + math.pi, lon), np.where(other, math.copysign(math.pi, latitude) - lat, lat)
    corrected = (
        (lon, lat) if extra is None else tuple(a + b for a, b in zip((lon, lat), extra(lon, lat), strict=True))
    )
    v = star_vectors(mount, latitude, arcsec, *corrected)
    bad = np.zeros(n, bool)
    bad[rng.permutation(n)[: round(outliers * n)]] = True
    distance = np.exp(rng.uniform(math.log(30.0), math.log(600.0), n)) * ARCSEC
    angle = rng.uniform(0.0, math.tau, n)
    off = np.where(
        bad, distance * np.array((np.cos(angle), np.sin(angle))), rng.normal(0.0, noise_arcsec, (2, n)) * ARCSEC
    )
    east, north = tangents(v)
    v = v + off[0] * east + off[1] * north
    v /= np.linalg.norm(v, axis=0)
    kind = "altazimuth" if mount == "altazimuth" else "equatorial"
    star = np.arctan2(v[1], v[0]), np.arctan2(v[2], np.hypot(v[0], v[1]))
    return Simulated(PointingRun(kind, latitude, *star, lon, lat), bad)


def sky_places(mount, latitude, n, rng, lowest):
    """Sky coordinates of n directions, evenly spread above an altitude, in the mount's frame."""
    altitude = np.arcsin(rng.uniform(math.sin(lowest), 1.0 - 1e-5, n))
    azimuth = rng.uniform(-math.pi, math.pi, n)
    if mount == "altazimuth":
        return azimuth, altitude
    up, north, west = np.sin(altitude), np.cos(altitude) * np.cos(azimuth), -np.cos(altitude) * np.sin(azimuth)
    s, c = math.sin(latitude), math.cos(latitude)
    x, z = up * c - north * s, up * s + north * c
    return np.arctan2(west, x), np.arctan2(z, np.hypot(x, west))


def star_vectors(mount, latitude, arcsec, lon, lat):
    """Unit vectors (3, n) of the stars in the middle of the field, telescope at mechanical (lon, lat)."""
    a = {name: value * ARCSEC for name, value in arcsec.items()}
    side = np.where(np.cos(lat) < 0.0, -1.0, 1.0)
    if mount == "altazimuth":
        lon, lat = lon - a.pop("IA", 0.0), lat + a.pop("IE", 0.0)
        cone, skew = -a.pop("CA", 0.0), -a.pop("NPAE", 0.0)
        west, north = a.pop("AW", 0.0), -a.pop("AN", 0.0)
        zenith = np.array((0.0, 0.0, 1.0))
    else:
        lon, lat = lon + a.pop("IH", 0.0), lat + a.pop("ID", 0.0)
        cone, skew = a.pop("CH", 0.0), a.pop("NP", 0.0)
        west, north = a.pop("MA", 0.0), a.pop("ME", 0.0)
        zenith = np.array((math.cos(latitude), 0.0, math.sin(latitude)))
    flexure = a.pop("TF", 0.0)
    assert not a, f"the simulation has no {' '.join(a)}"

    v = np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
    v = v * math.cos(cone) + side * tangents(v)[0] * math.sin(cone)
    level = np.array((v[0], v[1], np.zeros_like(v[0])))  # the rest turns about it
    v = level + v[2] * (math.cos(skew) * np.array((0.0, 0.0, 1.0))[:, None] + math.sin(skew) * side * tangents(v)[0])
    v = turned((1, 2), west) @ v
    v = turned((0, 2), north) @ v
    down = v * (zenith @ v) - zenith[:, None]  # its length is sin Z
    bend = flexure * np.linalg.norm(down, axis=0)
    return v * np.cos(bend) + down / np.linalg.norm(down, axis=0) * np.sin(bend)


def turned(plane, angle):
    """Matrix of the rotation that takes the first axis of a plane towards the second."""
    matrix = np.eye(3)
    i, j = plane
    matrix[i, i] = matrix[j, j] = math.cos(angle)
    matrix[j, i], matrix[i, j] = math.sin(angle), -math.sin(angle)
    return matrix


def tangents(v):
    """Unit vectors (3, n) of increasing lon and of increasing lat on the sky."""
    across = np.hypot(v[0], v[1])
    east = np.array((-v[1], v[0], np.zeros_like(across))) / across
    return east, np.array((-v[2] * v[0], -v[2] * v[1], across * across)) / across
