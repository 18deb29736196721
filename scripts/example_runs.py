"""`python -m scripts.example_runs [--check]`: write the pointing runs that the notebooks read, or check them.

They are of simulated telescopes, seen with the matrices of `mounts.true_mount`, which know nothing of the terms and
formulas that fit them. What is wrong with each telescope stands here, so it can be told whether a fit finds it.
"""

import datetime as dt
import math
import random
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mounts.true_mount import MountType, TrueMount
from pointing.model.run import PointingRun
from pointing.model.tpoint_file import write_tpoint
from pointing.site import Weather
from pointing.vectors import from_azimuth_altitude, horizon_to_equatorial, hour_angle_declination
from scripts.sections import CHECKOUT

FOLDER = CHECKOUT / "notebooks"
ARCSEC = math.radians(1.0 / 3600.0)
LATITUDE = math.radians(-42.4)
LOWEST = math.sin(math.radians(20.0))
GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # from star to star, so that none stands above another
TURN_A_STAR = math.tau * 3.0 / 1440.0  # three minutes
AIR = Weather(pressure_hpa=1010.0, temperature_c=12.0, relative_humidity=0.6)


@dataclass(frozen=True)
class Errors:
    """What is wrong with a telescope, arcseconds; keeps `mounts.true_mount.MountErrors` with X = −MA and Y = −ME."""

    index_hour_angle: float
    index_declination: float
    misalignment_x_arcsec: float
    misalignment_y_arcsec: float
    collimation_arcsec: float
    nonperpendicularity_arcsec: float
    flexure_arcsec: float
    periodic_error_arcsec: float = 0.0
    backlash_arcsec: float = 0.0


GERMAN = Errors(-310.0, 145.0, 240.0, -430.0, 95.0, -60.0, 38.0, periodic_error_arcsec=3.0)
STARS = 48
NOISE_ARCSEC = 1.5  # of a component
WRONG = {17: (170.0, -60.0), 31: (-22.0, 25.0)}  # stars that do not belong: by how much, west and north, arcseconds

FORK = Errors(80.0, -40.0, 65.0, -120.0, 45.0, 20.0, 30.0)
NIGHTS, STARS_A_NIGHT, DAYS_APART = 16, 18, 3
HOMING_ARCSEC = (20.0, 8.0)  # standard deviation of what homing leaves in each axis, anew every night
SINKING_ARCSEC = 4.0  # of the tilt of the pier to north or south, from one run to the next


def german_run() -> PointingRun:
    """A German mount, both sides of the pier, with two observations that do not belong."""
    about = {"caption": "German mount, simulated", "date": dt.date(2026, 3, 14)}
    return _observed("german", GERMAN, STARS, random.Random(314), WRONG, **about)  # noqa: S311 - nothing secret


def fork_nights() -> Iterator[PointingRun]:
    """One fork mount over many nights: homing jumps, the pier sinks, all else stays."""
    chance, errors = random.Random(1609), FORK  # noqa: S311 - likewise
    for night in range(NIGHTS):
        jumps = [chance.gauss(0.0, size) for size in HOMING_ARCSEC]
        here = replace(
            errors,
            index_hour_angle=errors.index_hour_angle + jumps[0],
            index_declination=errors.index_declination + jumps[1],
        )
        date = dt.date(2026, 3, 14) + dt.timedelta(days=DAYS_APART * night)
        about = {"caption": f"Fork mount, simulated, night {night}", "date": date}
        yield _observed("equatorial-fork", here, STARS_A_NIGHT, chance, {}, **about)
        sunk = errors.misalignment_y_arcsec + chance.gauss(0.0, SINKING_ARCSEC)
        errors = replace(errors, misalignment_y_arcsec=sunk)


def _observed(
    kind: MountType,
    errors: Errors,
    stars: int,
    chance: random.Random,
    wrong: Mapping[int, tuple[float, float]],
    **about: object,
) -> PointingRun:
    """Stars evenly over the sky above 20°, from the zenith downwards."""
    mount, begin = TrueMount(errors, kind, LATITUDE), chance.uniform(0.0, math.tau)
    rows = []
    for i in range(stars):
        altitude = math.asin(1.0 - (1.0 - LOWEST) * (i + 0.5) / stars)
        place = from_azimuth_altitude(begin + GOLDEN * i, altitude)
        hour_angle, declination = hour_angle_declination(horizon_to_equatorial(place, LATITUDE))
        reading = hour_angle, declination
        if kind == "german" and hour_angle < 0.0:  # from the other side of the pier
            reading = hour_angle + math.pi, math.copysign(math.pi, LATITUDE) - declination
        rows.append((*_star(mount, errors, reading, _blur(chance, wrong.get(i, (0.0, 0.0)))), *reading))
    sidereal = [(begin + TURN_A_STAR * i) % math.tau for i in range(stars)]
    columns = (list(column) for column in zip(*rows, strict=True))
    return PointingRun("equatorial", LATITUDE, *columns, sidereal_time=sidereal, weather=AIR, height_m=30.0, **about)


def _star(
    mount: TrueMount, errors: Errors, reading: tuple[float, float], off: tuple[float, float]
) -> tuple[float, float]:
    """Hour angle and declination of the star that is in the middle of the field, but for what is read off."""
    one = reading[0] + errors.index_hour_angle * ARCSEC
    seen = mount.turn(one, reading[1] + errors.index_declination * ARCSEC)
    hour_angle, declination = hour_angle_declination(horizon_to_equatorial(seen, LATITUDE))
    return hour_angle + off[0] * ARCSEC / math.cos(declination), declination + off[1] * ARCSEC


def _blur(chance: random.Random, off: tuple[float, float]) -> tuple[float, float]:
    west, north = (each + chance.gauss(0.0, NOISE_ARCSEC) for each in off)
    return west, north


def written(folder: Path) -> tuple[Path, Path]:
    """Write both files into a folder: one run, and all nights in one file."""
    one, many = folder / "german_run.dat", folder / "fork_nights.dat"
    write_tpoint(german_run(), one)
    texts = []
    for night in fork_nights():
        write_tpoint(night, many)
        texts.append(many.read_text(encoding="utf-8"))
    many.write_text("".join(texts), encoding="utf-8")
    return one, many


def main(arguments: list[str]) -> int:
    """Write the files, or check that they are current; return the exit code."""
    if arguments != ["--check"]:
        print("written:", *(path.name for path in written(FOLDER)))
        return 0
    with tempfile.TemporaryDirectory() as elsewhere:
        stale = [
            path.name
            for path in written(Path(elsewhere))
            if path.read_text(encoding="utf-8") != (FOLDER / path.name).read_text(encoding="utf-8")
        ]
    if stale:
        print("stale, run python -m scripts.example_runs:", ", ".join(stale))
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
