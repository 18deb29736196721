"""What the telescope answers as astropy has it: moments, angles, rates and observed places.

astropy takes a second to load, so only who asks for a value pays for it: this module is imported where one is made.
"""

from collections.abc import Sequence
from math import tau

import numpy as np
from astropy import units
from astropy.coordinates import AltAz, SkyCoord
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import ArrayLike

from pointing.pass_plan import PassPlan
from pointing.site import Site


def moment(time: ArrayLike) -> Time:
    """POSIX seconds as UTC."""
    found = Time(time, format="unix", scale="utc")
    found.format = "isot"
    return found


def angles(radians: Sequence[float]) -> Quantity:
    """Angles of the axes, degrees."""
    return Quantity(radians, units.rad).to(units.deg)


def rates(radians_s: Sequence[float]) -> Quantity:
    """Rates of the axes, arcseconds a second."""
    return Quantity(radians_s, units.rad / units.s).to(units.arcsec / units.s)


def observed_place(directions: ArrayLike, time: ArrayLike, site: Site) -> SkyCoord:
    """Observed directions, unit vectors (..., 3) to south, east and zenith, as places of `AltAz` with the site's air.

    Two of one moment and site are of one frame, so that astropy compares them as they are.
    """
    south, east, up = np.moveaxis(np.asarray(directions, float), -1, 0)
    azimuth, altitude = np.arctan2(east, -south) % tau, np.arctan2(up, np.hypot(south, east))
    air = site.weather
    frame = AltAz(
        obstime=moment(time),
        location=site.earth_location(),
        pressure=(air.pressure_hpa if air.refraction else 0.0) * units.hPa,
        temperature=air.temperature_c * units.deg_C,
        relative_humidity=air.relative_humidity,
        obswl=air.wavelength_um * units.micron,
    )
    return SkyCoord(az=azimuth * units.rad, alt=altitude * units.rad, frame=frame)


def way_of_a_pass(ahead: PassPlan, step_s: float) -> QTable:
    """The way of both axes along a pass: time, where the telescope looks, and angle and rate of each axis."""
    trajectory = ahead.trajectory.anew()
    times = np.append(np.arange(ahead.joined, ahead.ends, step_s), ahead.ends)
    states = [trajectory.angles(time) for time in times]
    mount = trajectory.geometry.mount
    directions = [mount.observed(one, two) for (one, _), (two, _) in states]
    place = observed_place(directions, times, trajectory.geometry.sky.site)
    table = QTable({"time": moment(times), "azimuth": place.az.to(units.deg), "altitude": place.alt.to(units.deg)})
    for axis, state in enumerate(zip(*states, strict=True), start=1):
        angle, rate = zip(*state, strict=True)
        table[f"axis{axis}"], table[f"axis{axis}_rate"] = angles(angle), rates(rate).to(units.deg / units.s)
    return table
