"""From a name to a target: Sun, Moon, planets; IAU-named stars from our table; Messier, NGC, IC and more from pyongc.

Names are compared without case, accents, spaces and punctuation. Only a deep-sky name costs the import of pyongc.
A name that is not known is answered with the nearest ones that are.
"""

import csv
import re
import unicodedata
from collections.abc import Callable
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

from pointing.bodies import BODIES
from pointing.errors import TargetError
from pointing.targets import Star, Target

# Designations as they are written → pyongc's prefix, our way to write it, and the last number.
_CATALOGUES = {
    "m": ("M", "M{}", 110),
    "messier": ("M", "M{}", 110),
    "ngc": ("NGC", "NGC {}", 7840),
    "ic": ("IC", "IC {}", 5386),
    "c": ("C", "Caldwell {}", 109),
    "caldwell": ("C", "Caldwell {}", 109),
    "b": ("B", "Barnard {}", 370),
    "barnard": ("B", "Barnard {}", 370),
    "cr": ("CL", "Collinder {}", 471),
    "collinder": ("CL", "Collinder {}", 471),
    "mel": ("MEL", "Melotte {}", 245),
    "melotte": ("MEL", "Melotte {}", 245),
    "ugc": ("UGC", "UGC {}", 12921),
}
_DESIGNATION = re.compile(r"([a-z]+)0*(\d+)([a-z]?)", re.ASCII)
_HIPPARCOS = re.compile(r"hip0*(\d+)", re.ASCII)
_ELSEWHERE = frozenset(  # moons, minor planets and satellites that people ask for by name
    (
        *("ceres", "pallas", "juno", "vesta", "phobos", "deimos", "io", "europa", "ganymede", "callisto"),
        *("rhea", "iapetus", "titan", "titania", "oberon", "triton", "charon", "iss", "hubble"),
    )
)
_SUGGESTIONS = 3


class NamedStar(NamedTuple):
    """A row of the star table."""

    star: Star
    hip: int
    v_mag: float


def find(name: str, kernel: Path | None = None) -> Target:
    """Find the target of a name; Sun, Moon and planets come before stars.

    Parameters
    ----------
    name : str
        As it is written.
    kernel : Path, optional
        An SPK file for bodies of the solar system, as in `SolarSystemBody`.

    Raises
    ------
    TargetError
        The name is unknown, with the nearest names that are known; it is that of a moon, a minor planet or a
        satellite; the kernel is of no use.
    """
    key = _key(name)
    if key in BODIES:
        from pointing.solar_system import SolarSystemBody  # noqa: PLC0415 - 5 ms: only its users pay

        return SolarSystemBody(key, kernel)
    if key in _ELSEWHERE:
        raise TargetError(
            f"{name!r} is of the solar system, of which this version points at Sun, Moon and planets by name:"
            " give one of these, a star, a deep-sky object or a place"
        )
    for search in _SEARCHES:
        target = search(key)
        if target is not None:
            return target
    raise TargetError(f"no target is called {name!r}: {_advice(key)}")


def bright_stars(faintest_mag: float = 3.0) -> tuple[Star, ...]:
    """Return the named stars down to a V magnitude, brightest first."""
    return tuple(row.star for row in named_stars() if row.v_mag <= faintest_mag)


@cache
def named_stars() -> tuple[NamedStar, ...]:
    """Return the whole star table, brightest first."""
    with files("pointing").joinpath("data/stars.csv").open(encoding="utf-8") as file:
        return tuple(_named_star(row) for row in csv.DictReader(file))


def _named_star(row: dict[str, str]) -> NamedStar:
    star = Star.from_degrees(
        float(row["ra_deg"]),
        float(row["dec_deg"]),
        row["name"],
        pm_ra_cosdec_mas=float(row["pm_ra_cosdec_mas"]),
        pm_dec_mas=float(row["pm_dec_mas"]),
        parallax_mas=float(row["parallax_mas"]),
        rv_km_s=float(row["rv_km_s"]),
    )
    return NamedStar(star, int(row["hip"]), float(row["v_mag"]))


def _key(name: str) -> str:
    plain = unicodedata.normalize("NFKD", name).casefold()
    return "".join(character for character in plain if character.isalnum())


@cache
def _stars_by_name() -> dict[str, Star]:
    return {_key(row.star.name): row.star for row in named_stars()}


def _star(key: str) -> Target | None:
    return _stars_by_name().get(key)


def _hipparcos(key: str) -> Target | None:
    match = _HIPPARCOS.fullmatch(key)
    return match and next((row.star for row in named_stars() if row.hip == int(match[1])), None)


def _designated(key: str) -> Target | None:
    """A deep-sky object by its catalogue number."""
    match = _DESIGNATION.fullmatch(key)
    if match is None or match[1] not in _CATALOGUES:
        return None
    prefix, written, last = _CATALOGUES[match[1]]
    number, part = int(match[2]), match[3].upper()
    name = written.format(f"{number}{part}")
    if not 1 <= number <= last:
        raise TargetError(f"{name}: its catalogue goes from 1 to {last}; check the number")
    from pyongc.exceptions import ObjectNotFound, UnknownIdentifier  # noqa: PLC0415 - 30 ms: only its users pay
    from pyongc.ongc import Dso  # noqa: PLC0415 - as above

    try:
        place = Dso(f"{prefix}{number}{part}").rad_coords
    except (ObjectNotFound, UnknownIdentifier):
        raise TargetError(
            f"{name} is not in OpenNGC: check the number, or give right ascension and declination"
        ) from None
    if place is None:
        raise TargetError(f"{name} has no place, it is listed as nonexistent: give right ascension and declination")
    return Star(name, float(place[0]), float(place[1]))


def _popular(key: str) -> Target | None:
    """A deep-sky object by the name people have for it."""
    name = _popular_names().get(key)
    if name is None:
        return None
    from pyongc.ongc import Dso  # noqa: PLC0415 - 30 ms: only its users pay

    place = Dso(name.designation).rad_coords
    return Star(name.text, float(place[0]), float(place[1]))


class _PopularName(NamedTuple):
    text: str
    designation: str


@cache
def _popular_names() -> dict[str, _PopularName]:
    from pyongc.ongc import listObjects  # noqa: PLC0415 - 30 ms: only its users pay

    return {
        _key(text): _PopularName(text, thing.name)
        for thing in listObjects(withname=True)
        for text in thing.identifiers[3] or ()
        if thing.rad_coords is not None
    }


_SEARCHES: tuple[Callable[[str], Target | None], ...] = (_designated, _hipparcos, _star, _popular)


def _advice(key: str) -> str:
    known = {
        **{k: name.text for k, name in _popular_names().items()},
        **{k: s.name for k, s in _stars_by_name().items()},
        **{k: body.name for k, body in BODIES.items()},
    }
    near = [known[match] for match in get_close_matches(key, known, _SUGGESTIONS)]
    if near:
        return f"did you mean {' or '.join(near)}?"
    return "give a name like M31, NGC 7000 or Vega, or right ascension and declination"
