"""A model to and from a TPOINT model file, which says neither the kind of mount nor its latitude.

The kind follows from the terms. Coefficients are written with all their digits, so a model read back is the same one.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from pointing.errors import PointingError
from pointing.model.model_file import ModelFile, ModelRow, write_model
from pointing.model.place import KINDS, MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import term

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
    try:
        write_model(model_file(fit), path)
    except OSError as error:
        raise PointingError(f"{path} cannot be written: {error.strerror}; name a folder that is there") from None


def model_of(file: ModelFile, latitude_deg: float, kind: MountKind | None = None) -> PointingModel:
    """Return what a model file says as a model.

    Raises
    ------
    PointingError
        Its terms are not of one kind of mount, or not of `kind`.
    """
    of = kind or kind_of(file)
    listed = tuple(term(row.name, of) for row in file.rows)
    coefficients = tuple(math.radians(row.arcsec / 3600.0) for row in file.rows)
    return PointingModel(of, math.radians(latitude_deg), listed, coefficients, file.caption)


def kind_of(file: ModelFile) -> MountKind:
    """Return the kind of mount that has all terms of a file; equatorial where both have.

    Raises
    ------
    PointingError
        Neither has, or a name is no term.
    """
    refusals = []
    for kind in KINDS:
        try:
            for row in file.rows:
                term(row.name, kind)
        except PointingError as error:
            refusals.append(f"{kind}: {error}")
        else:
            return kind
    raise PointingError(f"{file.caption or 'the model'} is for no mount: {'; '.join(refusals)}")
