"""SPK's file of observations: caption, `A` or `E`, latitude in degrees, then four columns in degrees.

Azimuth, north through east, and elevation, or hour angle, west positive, and declination: first those of the star as
observed, then those the telescope was set to. Read so, a fit has the published signs; exchanged, all of them turn.
"""

import math
from pathlib import Path

import numpy as np

from pointing.errors import PointingError
from pointing.model.place import MountKind
from pointing.model.records import Record, read_lines, write_lines
from pointing.model.run import COORDINATES, PointingRun

LETTERS: dict[str, MountKind] = {"A": "altazimuth", "E": "equatorial"}


def read_spk(path: str | Path) -> PointingRun:
    """Read a run.

    Raises
    ------
    PointingError
        It is none; with file, line, column and text.
    """
    lines = [line for line in read_lines(path) if line.text.strip()]
    if len(lines) < 3:
        raise PointingError(f"{Path(path).name} is no SPK file: give caption, A or E, latitude in degrees, stars")
    caption, kind, latitude, *rest = lines
    mount = LETTERS.get(kind.text.strip().upper())
    if mount is None:
        kind.refuse("wanted is A (altazimuth) or E (equatorial)")
    rows = np.array([_row(record, mount) for record in rest], float).reshape(-1, 4)
    return PointingRun.from_degrees(
        mount, _latitude_deg(latitude), *rows.T, line=np.array([record.line for record in rest], int),
        caption=caption.text.strip(), source=str(path),
    )  # fmt: skip


def _latitude_deg(record: Record) -> float:
    numbers = record.numbers("the latitude in degrees")
    if len(numbers) != 1 or abs(numbers[0].value) > 90.0:
        record.refuse("wanted is the latitude in degrees, −90 to 90")
    return numbers[0].value


def _row(record: Record, mount: MountKind) -> list[float]:
    wanted = f"{' and '.join(COORDINATES[mount])} of star and telescope in degrees"
    numbers = record.numbers(wanted)
    if len(numbers) != 4:
        record.refuse(f"{len(numbers)} columns; wanted are 4: {wanted}")
    if abs(numbers[1].value) > 90.0:
        record.refuse(f"{COORDINATES[mount][1]} of a star; possible are −90° to 90°", numbers[1].column)
    return [number.value for number in numbers]


def write_spk(run: PointingRun, path: str | Path) -> None:
    """Write a run; the format has room for angles only, to 1e-10°. Masked observations are left out.

    Raises
    ------
    PointingError
        Observations have weights.
    """
    if np.any(run.weight != 1.0):
        raise PointingError("the run has weights, for which SPK's format has no room: write ECSV")
    letter = next(letter for letter, mount in LETTERS.items() if mount == run.mount)
    kept = run.subset(run.kept)
    rows = np.degrees([kept.star1, kept.star2, kept.axis1, kept.axis2]).T
    lines = [" ".join(run.caption.split()) or "Pointing run", letter, f"{math.degrees(run.latitude):+.12f}"]
    lines += [" ".join(f"{value:.10f}" for value in row) for row in rows]
    write_lines(path, lines)
