"""The ledger: every correction in force has a name, a value, an origin and an age.

A person's *offset* displaces every target, on purpose. *Guide* and *centre* belong to the target that is tracked and
to the way it is pointed at: a new goto and a sync end them. All three are arcseconds east and north on the sky, and
add up.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from clockdrive.configuration import Configuration
from clockdrive.state import Correction
from clockdrive.surroundings import Surroundings
from clockdrive.utc import utc
from pointing.instant import Instant
from pointing.limits import separation
from pointing.mount import Mount
from pointing.planner import Planner

if TYPE_CHECKING:
    from pointing.model.model_on_file import ModelOnFile
    from pointing.model.pointing_model import PointingModel

SYNC = "sync"
OFFSETS = ("offset east", "offset north")
GUIDE = ("guide east", "guide north")
CENTRE = ("centre east", "centre north")
OF_A_TARGET = (*GUIDE, *CENTRE)
CLEARED = {"offset": OFFSETS, "guide": GUIDE, "centre": CENTRE}  # names that stand for two
DISPLACEMENTS = (*OFFSETS, *OF_A_TARGET)
_ARCSEC = 180.0 / math.pi * 3600.0


def displacement(corrections: Iterable[Correction], names: Sequence[str]) -> tuple[float, float]:
    """Sum of the corrections with these names, arcseconds east and north."""
    east = north = 0.0
    for each in corrections:
        if each.name in names:
            east, north = (east + each.value, north) if each.name.endswith("east") else (east, north + each.value)
    return east, north


def ledger(
    planner: Planner,
    corrections: Iterable[Correction],
    instrument: str,
    configuration: Configuration,
    around: Surroundings,
    angles: tuple[float, float],
    time: float,
) -> list[dict[str, Any]]:
    """List all corrections in force.

    Parameters
    ----------
    planner, corrections, configuration, around
        Where they come from; `corrections` are those that a person has made.
    instrument : str
        Whose pointing origin is in force.
    angles : tuple of float
        Where the axes stand, radians: model and refraction are stated for that place.
    time : float
        POSIX seconds.
    """
    origin, observed = configuration.origins, planner.mount.observed(*angles)
    altitude = math.asin(max(-1.0, min(1.0, observed[2])))
    rows = [
        _row("mount x", planner.mount.x * _ARCSEC, "arcsec", origin["mount.mount_x_mas"]),
        _row("mount y", planner.mount.y * _ARCSEC, "arcsec", origin["mount.mount_y_mas"]),
        _row("pointing origin x", planner.mount.origin_x * _ARCSEC, "arcsec", instrument),
        _row("pointing origin y", planner.mount.origin_y * _ARCSEC, "arcsec", instrument),
        _row("refraction", planner.sky.refraction(altitude) * _ARCSEC, "arcsec", _air(configuration, around, time)),
    ]
    if planner.mount.model is not None:
        rows.insert(2, _model(planner.mount, planner.mount.model, angles, time))
    earth = planner.sky.at(Instant.from_posix(time)).earth_orientation
    rows.append(_row("Earth orientation UT1−UTC", earth.dut1, "s", earth.note or "bundled IERS table"))
    clock = around.clock(time)
    rows.append(_row("host clock", clock.error_s or 0.0, "s", clock.text))
    for each in corrections:
        row = _row(each.name, each.value, each.unit, each.origin)
        rows.append({**row, "utc": utc(each.time), "age_s": time - each.time})
    return rows


def _row(name: str, value: float, unit: str, origin: str) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "origin": origin}


def _model(mount: Mount, model: "PointingModel", angles: tuple[float, float], time: float) -> dict[str, Any]:
    """The pointing model in force: how far it moves the place at which the axes stand."""
    from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - only where there is one

    moved = separation(mount.observed(*angles), replace(mount, model=None).observed(*angles))
    row = _row("pointing model", moved * _ARCSEC, "arcsec", model.caption or "given") | {"terms_arcsec": model.arcsec}
    if not isinstance(model, ModelOnFile):
        return row
    return {
        **row,
        "origin": f"{model.text}{_changed(model)}",
        "file": str(model.path),
        "utc": utc(model.modified),
        "age_s": time - model.modified,
    }


def _changed(model: "ModelOnFile") -> str:
    """Whether the file is another one by now; what was read goes on."""
    try:
        same = model.path.stat().st_mtime == model.modified
    except OSError:
        return "; the file is gone since it was read"
    return "" if same else "; the file has changed since it was read: close the telescope and open it again"


def _air(configuration: Configuration, around: Surroundings, time: float) -> str:
    if not configuration.weather.refraction:
        return "switched off in [site.weather]"
    air, reading = around.air.weather, around.air.reading
    said = f"{air.pressure_hpa:.1f} hPa, {air.temperature_c:.1f} °C, humidity {air.relative_humidity:.2f}"
    return said if reading is None else f"{said}, {reading.origin}, {reading.age_s(time):.0f} s old"
