"""A pointing model as a model file gives it, for one mount: what points the telescope, and how well it is known."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from pointing.errors import PointingError
from pointing.model.model_file import ModelRow, read_model
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.records import read_lines
from pointing.model.terms import Term, term

_ARCSEC = math.pi / 648_000.0


@dataclass(frozen=True)
class ModelOnFile(PointingModel):
    """A pointing model with its file.

    Parameters
    ----------
    path : Path
        The file.
    modified : float
        When it was written, POSIX seconds.
    n : int
        Stars it was fitted to; 0 where the file does not say.
    sky_rms : float
        What it left of them, radians on the sky; 0 where the file does not say.
    sigmas : tuple of float or None
        Standard deviation of each coefficient, radians; None where the file has none.
    """

    path: Path = field(default=Path(), compare=False)
    modified: float = field(default=0.0, compare=False)
    n: int = field(default=0, compare=False)
    sky_rms: float = field(default=0.0, compare=False)
    sigmas: tuple[float | None, ...] = field(default=(), compare=False)

    @classmethod
    def read(cls, path: Path, kind: MountKind, latitude: float) -> Self:
        """Read a TPOINT model file for a mount at a latitude, radians.

        Raises
        ------
        PointingError
            It is no model file, has no term, or is not of this kind of mount; with the file, and the line that is
            wrong.
        """
        file = read_model(path)
        if not file.rows:
            raise PointingError(
                f"{path.name}: the model has no term, and would leave the telescope unmodelled: write NAME and "
                "coefficient in arcseconds, a line a term"
            )
        return cls(
            kind,
            latitude,
            tuple(_term(path, row, kind, latitude) for row in file.rows),
            tuple(row.arcsec * _ARCSEC for row in file.rows),
            file.caption,
            path,
            path.stat().st_mtime,
            file.n,
            file.sky_rms_arcsec * _ARCSEC,
            tuple(None if row.sigma_arcsec is None else row.sigma_arcsec * _ARCSEC for row in file.rows),
        )

    @property
    def text(self) -> str:
        """File, terms and what it left, in one line."""
        fitted = f", fitted to {self.n} stars" if self.n else ""
        left = f", {self.sky_rms / _ARCSEC:.3g}″ left on the sky" if self.sky_rms else ""
        return f"{self.path.name}: {' '.join(each.name for each in self.terms)}{fitted}{left}"


def _term(path: Path, row: ModelRow, kind: MountKind, latitude: float) -> Term:
    """The term of a row, and proof that its coefficient is possible."""
    try:
        found = term(row.name, kind)
        PointingModel(kind, latitude, (found,), (row.arcsec * _ARCSEC,))
    except PointingError as error:
        for record in read_lines(path)[2:]:
            if record.text.strip(" \t&=").upper().split(maxsplit=1)[:1] == [row.name]:
                record.refuse(str(error))
        raise
    return found
