"""A fit as a TPOINT model file; `pointing.model.model_on_file` is the way back."""

from pathlib import Path
from typing import TYPE_CHECKING

from pointing.errors import PointingError
from pointing.model.model_file import ModelFile, ModelRow, write_model_file
from pointing.model.terms import known

if TYPE_CHECKING:
    from pointing.model.fitted import Fit
    from pointing.model.pointing_model import PointingModel


def save(fit: "Fit", path: str | Path) -> None:
    """Write a fit's model.

    Raises
    ------
    PointingError
        It has a term of one's own, or none at all, so that nothing could read it; or the file cannot be written.
    """
    _refuse_unreadable(fit.model)
    write_model_file(model_file(fit), path)


def save_model(model: "PointingModel", path: str | Path) -> None:
    """Write a model of which nothing more is known.

    Raises
    ------
    PointingError
        As for `save`.
    """
    _refuse_unreadable(model)
    rows = tuple(ModelRow(name, arcsec) for name, arcsec in model.arcsec.items())
    write_model_file(ModelFile(model.caption or "Pointing model", rows=rows), path)


def _refuse_unreadable(model: "PointingModel") -> None:
    own = [each.name for each in model.terms if known(each.name) != each]
    if own:
        raise PointingError(
            f"{' '.join(own)}: a term of one's own is a function, of which a model file has only the name, and no "
            "reader would know it: save a fit without it, or keep the run (`write_ecsv`) and fit it again"
        )
    if not model.terms:
        raise PointingError(
            "the model has no term, and no file without a term is read: fit some, as in fit(run, 'IH ID')"
        )


def model_file(fit: "Fit") -> ModelFile:
    """Return a fit as what a model file says of it."""
    rows = tuple(
        ModelRow(each.name, each.arcsec, None if each.fixed else each.sigma_arcsec, each.fixed)
        for each in fit.coefficients
    )
    caption = fit.model.caption or fit.run.caption or "Pointing model"
    return ModelFile(caption, n=fit.n, sky_rms_arcsec=fit.sky_rms_arcsec, rows=rows)
