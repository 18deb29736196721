"""A pointing run: where stars were seen, and what the telescope's axes read with each in the middle of the field.

Angles are radians. Axis readings are *mechanical*: beyond the pole (the other side of a German mount's pier) |axis 2|
is above 90°, and wound azimuths stay wound. An observation's offset is star minus telescope, both mechanical: what a
pointing model adds to the reading to find the star.
"""

import datetime as dt
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pointing.errors import PointingError
from pointing.model.functions import once
from pointing.model.place import KINDS, Frame, MountKind
from pointing.site import Weather

if TYPE_CHECKING:
    from astropy.table import QTable
    from astropy.units import Quantity

    from pointing.model.pointing_model import PointingModel

Array = NDArray[np.float64]
COORDINATES = {"equatorial": ("hour angle", "declination"), "altazimuth": ("azimuth", "elevation")}
PER_OBSERVATION = ("weight", "kept", "time", "sidereal_time", "rotator", "auxiliary", "line")

_ANGLES = ("star1", "star2", "axis1", "axis2")
_DEFAULTS: dict[str, tuple[float, type]] = {
    "weight": (1.0, float),
    "kept": (True, bool),
    "time": (math.nan, float),
    "sidereal_time": (math.nan, float),
    "rotator": (math.nan, float),
    "line": (0, int),
}


def _absent() -> Any:  # noqa: ANN401 - an array of the field's kind
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class PointingRun:
    """What a fit reads; all arrays are read-only and have one row an observation.

    Parameters
    ----------
    mount : str
        `equatorial` or `altazimuth`.
    latitude : float
        North positive.
    star1, star2 : (n,) array
        Observed place: hour angle, west positive, and declination; or azimuth, north through east, and elevation.
    axis1, axis2 : (n,) array
        What the axes read.
    weight : (n,) array, optional
        1 where not given.
    kept : (n,) array of bool, optional
        False masks an observation.
    time, sidereal_time, rotator : (n,) array, optional
        POSIX seconds; local apparent sidereal time; rotator angle. NaN where not known.
    auxiliary : (n, m) array, optional
        Auxiliary readings, as they stand in the file.
    line : (n,) array of int, optional
        Line of the file; 0 where there is none.
    caption, source : str
        Title of the run; path of its file.
    date : date or None
        UTC day of the run.
    weather : Weather or None
        The air, where the run tells it.
    height_m, lapse_k_m : float
        As the run tells; NaN where it does not.
    refraction_applied : bool
        The star's places are those in which it is seen through the air.
    places : str
        Frame in which the file's right ascensions were read (`pointing.model.equatorial_places`); empty where there
        were none.
    options : tuple of str
        The file's options with their arguments, in order.

    Raises
    ------
    PointingError
        Arrays are of unequal length or not finite, a weight is negative, or the latitude or mount is impossible.
    """

    mount: MountKind
    latitude: float
    star1: Array
    star2: Array
    axis1: Array
    axis2: Array
    weight: Array = field(default_factory=_absent)
    kept: NDArray[np.bool_] = field(default_factory=_absent)
    time: Array = field(default_factory=_absent)
    sidereal_time: Array = field(default_factory=_absent)
    rotator: Array = field(default_factory=_absent)
    auxiliary: Array = field(default_factory=_absent)
    line: NDArray[np.int_] = field(default_factory=_absent)
    caption: str = ""
    source: str = ""
    date: dt.date | None = None
    weather: Weather | None = None
    height_m: float = math.nan
    lapse_k_m: float = math.nan
    refraction_applied: bool = True
    places: str = ""
    options: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.mount not in KINDS:
            raise PointingError(f"mount {self.mount!r}; possible are {' and '.join(KINDS)}")
        if not abs(self.latitude) <= math.pi / 2:
            raise PointingError(
                f"latitude {math.degrees(self.latitude):.10g}°; possible are −90° to 90°: give radians"
            )
        n = np.size(self.star1)
        for name in _ANGLES:
            self._set(name, _column(name, getattr(self, name), n, float))
            _refuse_nonfinite(name, getattr(self, name))
        for name, (default, kind) in _DEFAULTS.items():
            given = np.asarray(getattr(self, name))
            self._set(name, _column(name, given if given.size else np.full(n, default), n, kind))
        bad = self.weight[~((self.weight >= 0.0) & (self.weight < math.inf))]
        if bad.size:
            raise PointingError(f"weight {bad[0]:g}; possible are numbers from 0")
        auxiliary = np.array(self.auxiliary, float).reshape(n, -1) if np.size(self.auxiliary) else np.empty((n, 0))
        self._set("auxiliary", auxiliary)

    @classmethod
    def from_degrees(
        cls,
        mount: MountKind,
        latitude_deg: float,
        star1_deg: ArrayLike,
        star2_deg: ArrayLike,
        axis1_deg: ArrayLike,
        axis2_deg: ArrayLike,
        **others: Any,  # noqa: ANN401 - the other fields, each of its own type
    ) -> "PointingRun":
        """Make a run from degrees; `others` are the fields that are no angles of star and axes, as they stand."""
        angles = (np.radians(np.array(a, float)) for a in (star1_deg, star2_deg, axis1_deg, axis2_deg))
        return cls(mount, math.radians(latitude_deg), *angles, **others)

    @classmethod
    def from_table(cls, table: "QTable") -> "PointingRun":
        """Read an astropy table; `pointing.model.run_table` says what columns it has."""
        from pointing.model.run_table import from_table  # noqa: PLC0415 - takes astropy along

        return from_table(table)

    def to_table(self) -> "QTable":
        """Return an astropy table with units, one row an observation; `from_table` reads it back."""
        from pointing.model.run_table import to_table  # noqa: PLC0415 - takes astropy along

        return to_table(self)

    @once
    def star_direction(self) -> Array:
        """Unit vectors of the stars: (3, n), to coordinate 1 = 0, to 90° and to the pole of axis 1."""
        level = np.cos(self.star2)
        return np.stack((level * np.cos(self.star1), level * np.sin(self.star1), np.sin(self.star2)))

    @property
    def beyond(self) -> NDArray[np.bool_]:
        """Where the tube is beyond the pole, or beyond the zenith: (n,)."""
        return np.asarray(np.cos(self.axis2) < 0.0)

    def mechanical_star(self) -> tuple[Array, Array]:
        """The star in mechanical angles of the posture in which it was observed, a turn left open: (n,) each."""
        over = Frame(self.mount, self.latitude).beyond_the_pole(self.star1, self.star2)
        return np.where(self.beyond, over[0], self.star1), np.where(self.beyond, over[1], self.star2)

    def offsets(self) -> tuple[Array, Array]:
        """Star minus telescope in axis 1 and axis 2, mechanical, in [−π, π): (n,) each."""
        star1, star2 = self.mechanical_star()
        return nearest_turn(star1 - self.axis1), nearest_turn(star2 - self.axis2)

    def separations(self, model: "PointingModel") -> "Quantity":
        """How far each star is on the sky from where a model says that the telescope points: (n,), arcseconds.

        Of stars that the model was not fitted to, this is how well it points.
        """
        from astropy import units  # noqa: PLC0415 - takes astropy along

        lon, lat = model.star(self.axis1, self.axis2)
        seen = np.stack((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))
        chord = np.linalg.norm(seen - self.star_direction, axis=0)
        return (2.0 * np.arcsin(np.minimum(chord / 2.0, 1.0)) * units.rad).to(units.arcsec)

    def masked(self, indices: Iterable[int]) -> "PointingRun":
        """Return the run with some observations masked, counted from 0, on top of those that are already.

        Raises
        ------
        PointingError
            There is no such observation.
        """
        kept = self.kept.copy()
        for index in indices:
            if not 0 <= index < len(self):
                raise PointingError(f"observation {index}; the run has {len(self)}, counted from 0")
            kept[index] = False
        return replace(self, kept=kept)

    def subset(self, mask: ArrayLike) -> "PointingRun":
        """Return the run of the observations where the mask (n,) is true."""
        chosen = np.asarray(mask, bool)
        if chosen.shape != (len(self),):
            raise PointingError(f"a mask of shape {chosen.shape}; the run has {len(self)} observations")
        return replace(self, **{name: getattr(self, name)[chosen] for name in (*_ANGLES, *PER_OBSERVATION)})

    def __len__(self) -> int:
        return int(self.star1.size)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PointingRun):
            return NotImplemented
        return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))

    __hash__ = None  # type: ignore[assignment] # it holds arrays

    def __repr__(self) -> str:
        masked = len(self) - int(np.count_nonzero(self.kept))
        return (
            f"PointingRun({self.caption!r}, {self.mount}, latitude {math.degrees(self.latitude):.4f}°, "
            f"{len(self)} observations, {int(np.count_nonzero(self.beyond))} beyond the pole, {masked} masked)"
        )

    def _repr_html_(self) -> str:
        heads = (*COORDINATES[self.mount], "axis 1", "axis 2", "Δ1″", "Δ2″", "")
        rows = "".join(_html_row(cells) for cells in self._cells())
        return (
            f"<table><caption>{escape(repr(self))}</caption><tr>"
            + "".join(f"<th>{escape(head)}</th>" for head in heads)
            + f"</tr>{rows}</table>"
        )

    def _cells(self) -> Iterable[tuple[str, ...]]:
        places = np.degrees([getattr(self, name) for name in _ANGLES]).T
        offsets = np.degrees(np.array(self.offsets())).T * 3600.0
        for place, offset, kept in zip(places, offsets, self.kept, strict=True):
            yield (*(f"{a:.5f}°" for a in place), *(f"{a:.1f}" for a in offset), "" if kept else "masked")

    def _set(self, name: str, values: NDArray[Any]) -> None:
        values.flags.writeable = False
        object.__setattr__(self, name, values)


def nearest_turn(angle: Array) -> Array:
    """Bring angles into [−π, π)."""
    return np.asarray((angle + math.pi) % math.tau - math.pi)


def _column(name: str, values: ArrayLike, n: int, kind: type) -> NDArray[Any]:
    column: NDArray[Any] = np.array(values, kind)
    if column.shape != (n,):
        raise PointingError(f"{name} has shape {column.shape}; star1 has {n} observations: give one value for each")
    return column


def _refuse_nonfinite(name: str, values: Array) -> None:
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise PointingError(f"{name}[{bad[0]}] is {values[bad[0]]}; give a finite angle in radians")


def _same(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return bool(np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
    return a == b or (isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b))


def _html_row(cells: Iterable[str]) -> str:
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"
