"""A fit as a TPOINT model file; `pointing.model.model_on_file` is the way back."""

from pathlib import Path
from typing import TYPE_CHECKING

from pointing.model.model_file import ModelFile, ModelRow, write_model_file

if TYPE_CHECKING:
    from pointing.model.fitted import Fit


def model_file(fit: "Fit") -> ModelFile:
    """Return a fit as what a model file says of it."""
    rows = tuple(
        ModelRow(each.name, each.arcsec, None if each.fixed else each.sigma_arcsec, each.fixed)
        for each in fit.coefficients
    )
    caption = fit.model.caption or fit.run.caption or "Pointing model"
    return ModelFile(caption, n=fit.n, sky_rms_arcsec=fit.sky_rms_arcsec, rows=rows)


def save(fit: "Fit", path: str | Path) -> None:
    """Write a fit's model.

    Raises
    ------
    PointingError
        The file cannot be written.
    """
    write_model_file(model_file(fit), path)
