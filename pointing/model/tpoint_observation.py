"""A line of observation in a TPOINT file, altazimuth in degrees, equatorial in sexagesimal parts."""

import math
from dataclasses import dataclass, replace

from pointing.model.place import MountKind
from pointing.model.records import Number, Record, sexagesimal

_COLUMNS: dict[MountKind, tuple[int, str]] = {
    "equatorial": (14, "RA h m s, Dec d m s, telescope RA h m s, telescope Dec d m s, sidereal time h m, [rotator]"),
    "altazimuth": (4, "azimuth and elevation of star and telescope in degrees, [rotator]"),
}


@dataclass(frozen=True)
class Observation:
    """What a line says: angles in its order and rotator in radians, auxiliaries as they stand; NaN for no rotator."""

    angles: tuple[float, ...]
    rotator: float
    auxiliary: tuple[float, ...]


def read_observation(mount: MountKind, record: Record) -> Observation:
    """Read an observation, equatorial (RA, Dec, telescope RA and Dec, sidereal time) or altazimuth.

    Raises
    ------
    PointingError
        It is none; with line, column and text.
    """
    columns, wanted = _COLUMNS[mount]
    cut = record.text.find("&")
    numbers = record.numbers(wanted, 0, cut if cut >= 0 else None)
    if len(numbers) not in (columns, columns + 1):
        record.refuse(f"{len(numbers)} columns; wanted are {columns} or, with a rotator, {columns + 1}: {wanted}")
    auxiliary = () if cut < 0 else tuple(
        number.value for number in replace(record, text=record.text.replace("&", " ")).numbers("auxiliaries", cut)
    )  # fmt: skip
    rotator = math.radians(numbers[columns].value) if len(numbers) > columns else math.nan
    angles = _equatorial if mount == "equatorial" else _altazimuth
    return Observation(angles(record, numbers[:columns]), rotator, auxiliary)


def _equatorial(record: Record, numbers: list[Number]) -> tuple[float, ...]:
    ra, dec, axis1, axis2, lst = (numbers[at:end] for at, end in ((0, 3), (3, 6), (6, 9), (9, 12), (12, 14)))
    return (
        math.radians(15.0 * sexagesimal(record, ra, 24.0, "RA")),
        math.radians(sexagesimal(record, dec, 90.0, "Dec")),
        math.radians(15.0 * sexagesimal(record, axis1, 24.0, "telescope RA")),
        math.radians(sexagesimal(record, axis2, 360.0, "telescope Dec")),
        math.radians(15.0 * sexagesimal(record, lst, 24.0, "sidereal time")),
    )


def _altazimuth(record: Record, numbers: list[Number]) -> tuple[float, ...]:
    for number in (numbers[1], numbers[3]):
        if abs(number.value) > 180.0:
            record.refuse("an elevation; possible are −180° to 180°", number.column, number.text)
    if abs(numbers[1].value) > 90.0:
        record.refuse("a star's elevation; possible are −90° to 90°", numbers[1].column, numbers[1].text)
    return tuple(math.radians(number.value) for number in numbers)
