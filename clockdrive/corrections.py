"""The ledger: every correction in force has a name, a value, an origin and an age."""

import math
from typing import Any

from clockdrive.answers import utc
from clockdrive.configuration import Configuration
from clockdrive.state import StateStore
from clockdrive.surroundings import Surroundings
from pointing.instant import Instant
from pointing.planner import Planner

SYNC = "sync"
OFFSETS = ("offset east", "offset north")
_ARCSEC = 180.0 / math.pi * 3600.0


def ledger(
    planner: Planner,
    store: StateStore,
    configuration: Configuration,
    around: Surroundings,
    altitude: float,
    time: float,
) -> list[dict[str, Any]]:
    """List all corrections in force.

    Parameters
    ----------
    planner, store, configuration, around
        Where they come from.
    altitude : float
        Observed altitude of the telescope, radians, at which refraction is stated.
    time : float
        POSIX seconds.
    """
    origin = configuration.origins
    rows = [
        _row("mount x", planner.mount.x * _ARCSEC, "arcsec", origin["mount.mount_x_mas"]),
        _row("mount y", planner.mount.y * _ARCSEC, "arcsec", origin["mount.mount_y_mas"]),
        _row("refraction", planner.sky.refraction(altitude) * _ARCSEC, "arcsec", _air(configuration, around, time)),
    ]
    earth = planner.sky.at(Instant.from_posix(time)).earth_orientation
    rows.append(_row("Earth orientation UT1−UTC", earth.dut1, "s", earth.note or "bundled IERS table"))
    clock = around.clock(time)
    rows.append(_row("host clock", clock.error_s or 0.0, "s", clock.text))
    for each in store.corrections():
        row = _row(each.name, each.value, each.unit, each.origin)
        rows.append({**row, "utc": utc(each.time), "age_s": time - each.time})
    return rows


def _row(name: str, value: float, unit: str, origin: str) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "origin": origin}


def _air(configuration: Configuration, around: Surroundings, time: float) -> str:
    if not configuration.weather.refraction:
        return "switched off in [site.weather]"
    air, reading = around.air.weather, around.air.reading
    said = f"{air.pressure_hpa:.1f} hPa, {air.temperature_c:.1f} °C, humidity {air.relative_humidity:.2f}"
    return said if reading is None else f"{said}, {reading.origin}, {reading.age_s(time):.0f} s old"
