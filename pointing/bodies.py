"""The bodies of the solar system that the telescope can be pointed at, by name and by NAIF's numbers."""

import math
from typing import NamedTuple

SUN, EARTH, MOON = 10, 399, 301
SERIES_YEARS = (1560, 2640)  # over which the errors of ERFA's series were measured, against DE440


class Body(NamedTuple):
    """A row of the table of bodies.

    Parameters
    ----------
    name : str
        As it is written.
    numbers : tuple of int
        NAIF's, the first that a kernel holds is taken: the body, else the barycentre of it and its moons.
    series_arcsec : float
        What ERFA's series may be off as seen from the Earth over `SERIES_YEARS`; infinite where there is none.
    """

    name: str
    numbers: tuple[int, ...]
    series_arcsec: float


BODIES: dict[str, Body] = {
    body.name.casefold(): body
    for body in (
        Body("Sun", (SUN,), 0.5),
        Body("Moon", (MOON,), 20.0),
        Body("Mercury", (199, 1), 4.0),
        Body("Venus", (299, 2), 20.0),
        Body("Mars", (499, 4), 90.0),
        Body("Jupiter", (599, 5), 120.0),
        Body("Saturn", (699, 6), 130.0),
        Body("Uranus", (799, 7), 120.0),
        Body("Neptune", (899, 8), 20.0),
        Body("Pluto", (999, 9), math.inf),
    )
}
