"""The file of an ephemeris table: ECSV, read by astropy, and refused with the row where it is not as it must be.

Columns: `time` (ISO 8601 in UTC, or astropy's `Time` in any scale) or `jd` (Julian days of UTC, good to 0.04 ms),
`ra` and `dec` with units, optionally `distance` with a unit. Meta data, all optional: `name`, `observer` (geocentric
or topocentric), `frame` (nothing but ICRS). Rows are counted from 1.
"""

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pointing.errors import PointingError, TargetError
from pointing.instant import DAY, Instant
from pointing.spline import LEAST_POINTS

if TYPE_CHECKING:
    from astropy.table import Column, Table

_JD_MJD = 2400000.5
_OBSERVERS = ("geocentric", "topocentric")
_WAY = "write it with astropy: Table.write(FILE, format='ascii.ecsv')"


class Rows(NamedTuple):
    """What a table says: n rows, n ≥ 4, in radians and au; `observer` is empty where it is not known."""

    name: str
    times: tuple[Instant, ...]
    ra: tuple[float, ...]
    dec: tuple[float, ...]
    distances_au: tuple[float, ...]
    observer: str


def read_rows(path: str | Path) -> Rows:
    """Read a table; `distances_au` only where they are needed, of geocentric places.

    Raises
    ------
    TargetError
        It cannot be read, a column or unit is missing, or a row is impossible.
    """
    file = Path(path)
    table = _read(file)
    meta = {str(name).casefold(): str(value) for name, value in table.meta.items()}
    times = _times(file.name, table)
    refuse_disorder(file.name, times)
    ra, dec = (_column(file.name, table, name, "rad", "deg or hourangle") for name in ("ra", "dec"))
    for row, angle in enumerate(dec, 1):
        if abs(angle) > math.pi / 2:
            degrees = f"dec {math.degrees(angle):.10g}°; possible are −90° to 90°"
            raise TargetError(f"{file.name}, row {row}: {degrees}: check the unit")
    observer = _observer(file.name, meta, has_distances="distance" in table.colnames)
    distances = _column(file.name, table, "distance", "au", "au or km") if observer == "geocentric" else ()
    return Rows(meta.get("name") or file.stem, times, ra, dec, distances, observer)


def _observer(file: str, meta: dict[str, str], *, has_distances: bool) -> str:
    """Whose places they are: as the meta data say, else geocentric when there are distances."""
    frame = meta.get("frame", "icrs")
    if frame.casefold() != "icrs":
        raise TargetError(f"{file}: frame {frame!r} in its meta data; only astrometric ICRS places are read")
    observer = meta.get("observer", _OBSERVERS[0] if has_distances else "")
    if observer and observer not in _OBSERVERS:
        raise TargetError(f"{file}: observer {observer!r} in its meta data; possible are {' and '.join(_OBSERVERS)}")
    if observer == "geocentric" and not has_distances:
        raise TargetError(f"{file}: geocentric places need a column distance, in au or km, for the parallax")
    return observer


def _read(file: Path) -> "Table":
    from astropy.table import Table  # noqa: PLC0415 - astropy takes 0.8 s to import; only its users pay

    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise TargetError(f"{str(file)!r} cannot be read ({why}): give an ECSV table") from None
    try:
        table = Table.read(text.splitlines(), format="ascii.ecsv")
    except Exception as error:  # noqa: BLE001 - whatever astropy and YAML make of a damaged file
        raise TargetError(f"{file.name} is no ECSV table ({_one_line(error)}): {_WAY}") from None
    return table


def refuse_disorder(file: str, times: tuple[Instant, ...]) -> None:
    """Refuse times that do not increase, and fewer than a spline needs.

    Raises
    ------
    TargetError
        With the row.
    """
    if len(times) < LEAST_POINTS:
        raise TargetError(f"{file} has {len(times)} rows: a spline needs at least {LEAST_POINTS}")
    for row, (before, after) in enumerate(pairwise(times), 2):
        if not after.since(before) > 0.0:
            how = "is the time of the row before again" if after == before else "is before the row before it"
            raise TargetError(f"{file}, row {row}: {after.utc_iso()} {how}; sort the rows by time, each time once")


def _times(file: str, table: "Table") -> tuple[Instant, ...]:
    if "time" in table.colnames:
        column = table["time"]
        return _from_times(file, column) if hasattr(column, "scale") else _each(file, column, _from_iso)
    if "jd" in table.colnames:
        return _each(file, table["jd"], _from_jd)
    raise TargetError(f"{file} has columns {', '.join(table.colnames)}: give time (ISO, UTC) or jd")


def _each(file: str, column: "Column", read: Callable[[Any], Instant]) -> tuple[Instant, ...]:
    found = []
    for row, value in enumerate(column, 1):
        try:
            found.append(read(value))
        except (PointingError, TypeError, ValueError, OverflowError) as error:
            raise TargetError(f"{file}, row {row}: {column.name} {str(value)!r} is no time in UTC: {error}") from None
    return tuple(found)


def _from_iso(value: object) -> Instant:
    return Instant.from_utc_iso(str(value))


def _from_jd(value: object) -> Instant:
    day, fraction = divmod(float(str(value)) - _JD_MJD, 1.0)
    return Instant.from_utc(int(day), fraction * DAY)


def _from_times(file: str, column: Any) -> tuple[Instant, ...]:  # noqa: ANN401 - astropy's Time
    from astropy.utils.iers import conf  # noqa: PLC0415 - as in `_read`

    for row, masked in enumerate(np.broadcast_to(np.asarray(column.mask), column.shape), 1):
        if masked:
            raise TargetError(f"{file}, row {row}: no time; give every row one")
    try:
        # UT1 needs Earth orientation, for which astropy must not reach for the network.
        with conf.set_temp("auto_download", value=False), conf.set_temp("auto_max_age", None), _no_warnings():
            tt = column.tt
    except Exception as error:  # noqa: BLE001 - a scale without an epoch, or without Earth orientation
        raise TargetError(f"{file}: times of scale {column.scale} ({_one_line(error)}): give them in UTC") from None
    found = []
    for row, (whole, part) in enumerate(zip(tt.jd1, tt.jd2, strict=True), 1):
        if not math.isfinite(whole + part):
            raise TargetError(f"{file}, row {row}: the time is no number; give every row one")
        day = math.floor(whole - _JD_MJD)
        found.append(Instant(day, 0.0).plus((whole - _JD_MJD - day + part) * DAY))
    return tuple(found)


def _column(file: str, table: "Table", name: str, unit: str, advice: str) -> tuple[float, ...]:
    """Values of a column in a unit; every row has one."""
    from astropy import units  # noqa: PLC0415 - as in `_read`

    if name not in table.colnames:
        raise TargetError(f"{file} has columns {', '.join(table.colnames)}: {name} is missing")
    column = table[name]
    if column.unit is None:
        raise TargetError(f"{file}: column {name} has no unit; give it {advice}")
    try:
        given: np.ma.MaskedArray[Any, Any] = np.ma.asarray(getattr(column, "value", column), float)
        values = units.Quantity(np.ma.filled(given, math.nan), column.unit).to_value(unit).tolist()
    except (units.UnitsError, TypeError, ValueError) as error:
        raise TargetError(f"{file}: column {name}: {_one_line(error)}; give numbers in {advice}") from None
    for row, value in enumerate(values, 1):
        if not math.isfinite(value):
            raise TargetError(f"{file}, row {row}: {name} is no number; give every row one")
    return tuple(values)


@contextmanager
def _no_warnings() -> Iterator[None]:
    """ERFA calls UTC of other decades dubious, as their leap seconds are not known yet."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
