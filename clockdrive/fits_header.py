"""FITS cards for an image taken now, from the telescope's status.

They are what a mount knows. The reference pixel, the scale and the rotation are the camera's: whoever writes the
image adds CRPIX and CD (or CDELT and PC), without which FITS takes pixel 0 and a degree a pixel.
"""

import math
from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any

from clockdrive.configuration import Configuration
from clockdrive.configuration_sections import SiteSection
from clockdrive.errors import Refused

if TYPE_CHECKING:
    from astropy.io.fits import Header

_WGS84 = 1  # ERFA's number of the ellipsoid
_IAU_1976 = 6_378_140.0, 1.0 / 298.2577  # of Rots et al. 2015, A&A 574, A36, section 4.1.3


def cards(status: Mapping[str, Any], configuration: Configuration) -> "Header":
    """Make the header cards of the telescope's pointing.

    Raises
    ------
    Refused
        The position may be wrong: no header is better than a wrong one.
    """
    from astropy.io.fits import Header  # noqa: PLC0415 - only here

    if not status.get("synchronised"):
        raise Refused(f"no header: the position is not synchronised: {status.get('unsynchronised_because', '')}")
    place, icrs, site = status["observed"], status["icrs"], configuration.site
    header = Header()
    for name, value, comment in (
        ("TELESCOP", status["telescope"], "telescope"),
        ("OBJECT", status["target"] or "", "target"),
        ("DATE-OBS", status["position_utc"].removesuffix("Z"), "UTC of the position"),
        ("MJD-OBS", _mjd(status["position_utc"]), "UTC of the position"),
        ("TIMESYS", "UTC", ""),
        ("RADESYS", "ICRS", "of RA, DEC and CRVAL"),
        ("RA", icrs["ra_deg"], "[deg] where the telescope points"),
        ("DEC", icrs["dec_deg"], "[deg] where the telescope points"),
        ("WCSAXES", 2, "CRPIX and CD are the camera's to add"),
        ("CTYPE1", "RA---TAN", ""),
        ("CTYPE2", "DEC--TAN", ""),
        ("CRVAL1", icrs["ra_deg"], "[deg]"),
        ("CRVAL2", icrs["dec_deg"], "[deg]"),
        ("CUNIT1", "deg", ""),
        ("CUNIT2", "deg", ""),
        ("AZIMUTH", place["azimuth_deg"], "[deg] observed, north through east"),
        ("ALTITUDE", place["altitude_deg"], "[deg] observed"),
        ("HA", place["hour_angle_deg"], "[deg] observed, west positive"),
        ("PARANGLE", _parallactic_deg(place, site.latitude_deg), "[deg] zenith from north through east"),
        ("AIRMASS", _airmass(place["altitude_deg"]), "Young and Irvine 1967"),
        *_side_of_pier(status["posture"], configuration.mount.type),
        *_observatory(site),
    ):
        header[name] = (value, comment)
    return header


def _side_of_pier(posture: str, mount_type: str) -> Iterator[tuple[str, str, str]]:
    """Where the tube of a German mount is; a fork has no side."""
    if mount_type == "german":
        yield "PIERSIDE", "EAST" if posture == "normal" else "WEST", "where the tube is"


def _observatory(site: SiteSection) -> Iterator[tuple[str, float, str]]:
    """The geocentric place, and from it the geodetic one, which FITS counts from the ellipsoid of 1976."""
    import erfa  # noqa: PLC0415 - only here

    place = erfa.gd2gc(_WGS84, math.radians(site.longitude_deg), math.radians(site.latitude_deg), site.height_m)
    longitude, latitude, height = erfa.gc2gde(*_IAU_1976, place)
    for name, metres in zip("XYZ", place, strict=True):
        yield f"OBSGEO-{name}", round(float(metres), 3), "[m] geocentric, ITRF"
    yield "OBSGEO-B", round(math.degrees(latitude), 9), "[deg] of the ellipsoid IAU 1976"
    yield "OBSGEO-L", round(math.degrees(longitude), 9), "[deg] east positive"
    yield "OBSGEO-H", round(float(height), 3), "[m] above that ellipsoid"


def _parallactic_deg(place: Mapping[str, float], latitude_deg: float) -> float:
    """Return the position angle of the zenith: tan q = sin H / (tan φ cos δ − sin δ cos H)."""
    hour_angle, declination = (math.radians(place[f"{name}_deg"]) for name in ("hour_angle", "declination"))
    latitude = math.radians(latitude_deg)
    across = math.cos(latitude) * math.sin(hour_angle)
    along = math.sin(latitude) * math.cos(declination)
    along -= math.cos(latitude) * math.sin(declination) * math.cos(hour_angle)
    return math.degrees(math.atan2(across, along))


def _mjd(utc: str) -> float:
    return datetime.fromisoformat(utc).timestamp() / 86400.0 + 40587.0


def _airmass(altitude_deg: float) -> float:
    """Return sec Z · (1 − 0.0012 (sec² Z − 1)), held at its value for 5°."""
    secant = 1.0 / math.sin(math.radians(max(altitude_deg, 5.0)))
    return secant * (1.0 - 0.0012 * (secant * secant - 1.0))
