"""The residuals of a fit, one row an observation, with what became of each.

`dx` and `dy` are those of the fit: cos lat · Δlon and Δlat in mechanical angles, in the frame of the tube. In normal
posture they point west and north of an equatorial mount, towards increasing azimuth and up of an altazimuth one.
Beyond the pole the tube has turned over and both are reversed; the columns named by their directions are of the sky
on either side.
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from astropy import units
from astropy.table import QTable

from pointing.model.outliers import sigmas_off
from pointing.model.place import MountKind
from pointing.model.run_table import angle_columns

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

DIRECTIONS: dict[MountKind, tuple[str, str]] = {"equatorial": ("west", "north"), "altazimuth": ("right", "up")}
"""Where dX and dY point on the sky in normal posture; right is towards increasing azimuth."""


def residual_table(fit: "Fit") -> QTable:
    """Return the table of a fit's residuals.

    Returns
    -------
    QTable
        `index` from 0, `line` of the file, star and telescope in degrees, posture, `dx`, `dy` and the same as
        directions on the sky, `distance`, all in arcseconds; `sigmas`, the distance from what the other observations
        predict in units of its standard deviation; `weight` in the fit; `masked` and `reason`. Meta data: the
        coefficients and the statistics.
    """
    run = fit.run
    dx, dy = np.degrees(fit.residuals) * 3600.0
    side = np.where(run.beyond, -1.0, 1.0)
    table = QTable()
    table["index"], table["line"] = np.arange(len(run)), run.line
    for name, values in zip(angle_columns(run.mount), (run.star1, run.star2, run.axis1, run.axis2), strict=True):
        table[name] = np.degrees(values) * units.deg
    table["posture"] = np.where(run.beyond, "beyond", "normal")
    first, second = DIRECTIONS[run.mount]
    columns = {"dx": dx, "dy": dy, first: side * dx, second: side * dy, "distance": np.hypot(dx, dy)}
    for name, values in columns.items():
        table[name] = values * units.arcsec
    table["sigmas"], table["weight"] = sigmas_off(fit), fit.weight
    table["masked"] = fit.weight == 0.0
    table["reason"] = _reasons(fit)
    table.meta.update(_meta(fit))
    return table


def write_residuals(fit: "Fit", path: str | Path) -> None:
    """Write the table as ECSV."""
    residual_table(fit).write(path, format="ascii.ecsv", overwrite=True)


def _reasons(fit: "Fit") -> list[str]:
    """Why an observation took no part, or less than its full part; empty for the others."""
    tested = {each.index: each.reason for each in fit.outliers}
    reasons = []
    for i, (kept, given, weight) in enumerate(zip(fit.run.kept, fit.run.weight, fit.weight, strict=True)):
        if i in tested:
            reasons.append(tested[i])
        elif given == 0.0:
            reasons.append("weight 0")
        elif not kept:
            reasons.append("masked by the user")
        elif weight < given:
            reasons.append(f"weighed down to {weight / given:.2f} by the robust fit")
        else:
            reasons.append("")
    return reasons


def _meta(fit: "Fit") -> dict[str, object]:
    return {
        "caption": fit.run.caption,
        "source": fit.run.source,
        "latitude_deg": float(np.degrees(fit.run.latitude)),
        "coefficients_arcsec": {each.name: each.arcsec for each in fit.coefficients},
        "sigma_arcsec": {each.name: each.sigma_arcsec for each in fit.coefficients},
        "n": fit.n,
        "sky_rms_arcsec": fit.sky_rms_arcsec,
        "popn_sd_arcsec": fit.popn_sd_arcsec,
        "condition": fit.condition,
    }
