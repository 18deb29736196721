"""FITS cards for an image taken now, from the telescope's status."""

import math
from collections.abc import Mapping
from datetime import datetime
from typing import TYPE_CHECKING, Any

from clockdrive.configuration import Configuration
from clockdrive.errors import Refused

if TYPE_CHECKING:
    from astropy.io.fits import Header


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
        ("CTYPE1", "RA---TAN", ""),
        ("CTYPE2", "DEC--TAN", ""),
        ("CRVAL1", icrs["ra_deg"], "[deg]"),
        ("CRVAL2", icrs["dec_deg"], "[deg]"),
        ("CUNIT1", "deg", ""),
        ("CUNIT2", "deg", ""),
        ("AZIMUTH", place["azimuth_deg"], "[deg] observed, north through east"),
        ("ALTITUDE", place["altitude_deg"], "[deg] observed"),
        ("HA", place["hour_angle_deg"], "[deg] observed, west positive"),
        ("AIRMASS", _airmass(place["altitude_deg"]), "Young and Irvine 1967"),
        ("PIERSIDE", "EAST" if status["posture"] == "normal" else "WEST", "ASCOM's side of pier"),
        ("OBSGEO-B", site.latitude_deg, "[deg] geodetic latitude"),
        ("OBSGEO-L", site.longitude_deg, "[deg] longitude, east positive"),
        ("OBSGEO-H", site.height_m, "[m] above the ellipsoid"),
    ):
        header[name] = (value, comment)
    return header


def _mjd(utc: str) -> float:
    return datetime.fromisoformat(utc).timestamp() / 86400.0 + 40587.0


def _airmass(altitude_deg: float) -> float:
    """Return sec Z · (1 − 0.0012 (sec² Z − 1)), held at its value for 5°."""
    secant = 1.0 / math.sin(math.radians(max(altitude_deg, 5.0)))
    return secant * (1.0 - 0.0012 * (secant * secant - 1.0))
