"""A pointing run as an astropy table with named columns and units.

Star and telescope are `hour_angle`, `declination`, `telescope_hour_angle`, `telescope_declination` of an equatorial
mount, `azimuth`, `elevation` and likewise of an altazimuth one (`altitude` serves as well), in any unit of angle.
Optional columns: `weight`, `kept` (bool), `time` (astropy's `Time`, or POSIX seconds), `sidereal_time` and `rotator`
(angles), `auxiliary_1`, `auxiliary_2`, …, `line`. Meta data: `latitude_deg`, which is needed; `caption`, `source`,
`date` (ISO), `height_m`, `lapse_k_m`, `refraction_applied`, `places`, `options`, and `weather` with the fields of
`pointing.site.Weather`. Rows are counted from 1.
"""

import datetime as dt
import math
from dataclasses import asdict
from typing import Any

import numpy as np
from astropy import units
from astropy.table import QTable, Table
from astropy.time import Time
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.place import KINDS, MountKind
from pointing.model.run import COORDINATES, Array, PointingRun
from pointing.site import Weather

_TELESCOPE = "telescope_"
_ALIASES = {"altitude": "elevation", "telescope_altitude": "telescope_elevation"}
_AUXILIARY = "auxiliary_"
_TEXTS = ("caption", "source", "places")
_NUMBERS = ("height_m", "lapse_k_m")


def angle_columns(mount: MountKind) -> tuple[str, str, str, str]:
    """Names of the four columns of star and telescope."""
    first, second = (name.replace(" ", "_") for name in COORDINATES[mount])
    return first, second, _TELESCOPE + first, _TELESCOPE + second


def to_table(run: PointingRun) -> QTable:
    """Return the table of a run, angles in degrees; `from_table` reads it back to 1e-15 of their size."""
    table = QTable()
    names = angle_columns(run.mount)
    for name, values in zip(names, (run.star1, run.star2, run.axis1, run.axis2), strict=True):
        table[name] = np.degrees(values) * units.deg
    for name, values in (("sidereal_time", run.sidereal_time), ("rotator", run.rotator)):
        if not np.all(np.isnan(values)):
            table[name] = np.degrees(values) * units.deg
    if not np.all(np.isnan(run.time)):
        table["time"] = run.time * units.s
    table["weight"], table["kept"], table["line"] = run.weight, run.kept, run.line
    for number, values in enumerate(run.auxiliary.T, 1):
        table[f"{_AUXILIARY}{number}"] = values
    table.meta.update(_meta(run))
    return table


def _meta(run: PointingRun) -> dict[str, Any]:
    meta: dict[str, Any] = {"mount": run.mount, "latitude_deg": math.degrees(run.latitude)}
    meta |= {name: getattr(run, name) for name in _TEXTS if getattr(run, name)}
    meta |= {name: getattr(run, name) for name in _NUMBERS if not math.isnan(getattr(run, name))}
    meta["refraction_applied"] = run.refraction_applied
    if run.options:
        meta["options"] = list(run.options)
    if run.date is not None:
        meta["date"] = run.date.isoformat()
    if run.weather is not None:
        meta["weather"] = asdict(run.weather)
    return meta


def from_table(table: Table, name: str = "table") -> PointingRun:
    """Read a table; `name` stands in the texts of refusals.

    Raises
    ------
    PointingError
        A column, unit or the latitude is missing, or a value is impossible.
    """
    columns = {_ALIASES.get(column, column): table[column] for column in table.colnames}
    mount = _mount(name, list(columns))
    star1, star2, axis1, axis2 = (_angle(name, columns, column) for column in angle_columns(mount))
    n = len(table)
    options: dict[str, Any] = {
        key: _angle(name, columns, key, may_miss=True) for key in ("sidereal_time", "rotator") if key in columns
    }
    for key, kind in (("weight", float), ("kept", bool), ("line", int)):
        if key in columns:
            options[key] = _plain(name, columns, key, kind)
    if "time" in columns:
        options["time"] = _time(name, columns["time"])
    auxiliary = sorted((c for c in columns if c.startswith(_AUXILIARY)), key=lambda c: (len(c), c))
    if auxiliary:
        options["auxiliary"] = np.column_stack([_plain(name, columns, c, float) for c in auxiliary]).reshape(n, -1)
    meta = {str(key).casefold(): value for key, value in table.meta.items()}
    options |= _from_meta(name, meta)
    try:
        return PointingRun(mount, _latitude(name, meta), star1, star2, axis1, axis2, **options)
    except PointingError as error:
        raise error if str(error).startswith(name) else PointingError(f"{name}: {error}") from None


def _mount(name: str, columns: list[str]) -> MountKind:
    for mount in KINDS:
        if set(angle_columns(mount)) <= set(columns):
            return mount
    wanted = " or ".join(", ".join(angle_columns(mount)) for mount in KINDS)
    raise PointingError(f"{name} has columns {', '.join(columns) or 'none'}: wanted are {wanted}")


def _angle(name: str, columns: dict[str, Any], key: str, *, may_miss: bool = False) -> Array:
    column = columns[key]
    if getattr(column, "unit", None) is None:
        raise PointingError(f"{name}: column {key} has no unit; give it deg, hourangle or rad")
    values = _plain(name, columns, key, float)
    try:
        angle = np.asarray(units.Quantity(values, column.unit).to_value("rad"))
    except (units.UnitsError, TypeError, ValueError) as error:
        why = " ".join(str(error).split())
        raise PointingError(f"{name}: column {key}: {why}; give it deg, hourangle or rad") from None
    bad = np.flatnonzero(~np.isfinite(angle))
    if bad.size and not may_miss:
        raise PointingError(f"{name}, row {bad[0] + 1}: {key} is no number; give every row one")
    return angle


def _plain(name: str, columns: dict[str, Any], key: str, kind: type) -> NDArray[Any]:
    """Values of a column without its unit; NaN where masked, which only a float can be."""
    column = columns[key]
    try:
        given: np.ma.MaskedArray[Any, Any] = np.ma.asarray(getattr(column, "value", column))
        if kind is float:
            return np.ma.filled(given.astype(float), math.nan)
        values: NDArray[Any] = np.asarray(given).astype(kind)
        if np.ma.getmaskarray(given).any() or not np.all(values == given):
            raise ValueError("a value is missing or another")  # noqa: TRY301 - ends in the same sentence
    except (TypeError, ValueError) as error:
        raise PointingError(f"{name}: column {key}: {error}; give every row a {kind.__name__}") from None
    return values


def _time(name: str, column: Any) -> Array:  # noqa: ANN401 - astropy's Time, or seconds
    if isinstance(column, Time):
        return np.asarray(np.ma.filled(column.unix, math.nan), float)
    return _plain(name, {"time": column}, "time", float)


def _latitude(name: str, meta: dict[str, Any]) -> float:
    if "latitude_deg" not in meta:
        raise PointingError(f"{name} has no latitude_deg in its meta data: give degrees, north positive")
    return math.radians(_number(name, meta, "latitude_deg"))


def _number(name: str, meta: dict[str, Any], key: str) -> float:
    try:
        return float(meta[key])
    except (TypeError, ValueError):
        raise PointingError(f"{name}: {key} is {meta[key]!r} in its meta data; give a number") from None


def _from_meta(name: str, meta: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {key: str(meta[key]) for key in _TEXTS if key in meta}
    found |= {key: _number(name, meta, key) for key in _NUMBERS if key in meta}
    if "refraction_applied" in meta:
        found["refraction_applied"] = bool(meta["refraction_applied"])
    if "options" in meta:
        found["options"] = tuple(map(str, meta["options"]))
    try:
        if "date" in meta:
            found["date"] = dt.date.fromisoformat(str(meta["date"]))
        if "weather" in meta:
            found["weather"] = Weather(**meta["weather"])
    except (TypeError, ValueError) as error:
        raise PointingError(f"{name}: its meta data: {error}; give date as 2026-03-01, weather as a table") from None
    return found
