"""A pointing model as a model file gives it, for one mount: what points the telescope, and how well it is known.

A model file says neither the kind of mount, which follows from the terms, nor the latitude. What is read here can
point a telescope; what a file says is read unjudged by `pointing.model.model_file`. Files hold all digits, so that a
model that was saved is read back to a rounding of arcseconds to radians.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from pointing.errors import PointingError
from pointing.model.model_file import ModelFile, ModelRow, read_model_file
from pointing.model.place import KINDS, MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.possible import refuse_impossible
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
    free : tuple of bool
        Which terms a fit may change; the others are marked `=`.
    """

    path: Path = field(default=Path(), compare=False)
    modified: float = field(default=0.0, compare=False)
    n: int = field(default=0, compare=False)
    sky_rms: float = field(default=0.0, compare=False)
    sigmas: tuple[float | None, ...] = field(default=(), compare=False)
    free: tuple[bool, ...] = field(default=(), compare=False)

    @classmethod
    def read(cls, path: str | Path, kind: MountKind | None, latitude: float) -> Self:
        """Read a TPOINT model file for a mount, of which kind its terms say where it is None, at a latitude, radians.

        Raises
        ------
        PointingError
            It is no model file, has no term, is not of this kind of mount, or displaces as no telescope does; with
            the file, and the line that is wrong.
        """
        path = Path(path)
        file = read_model_file(path)
        if not file.rows:
            raise PointingError(
                f"{path.name}: the model has no term, and would leave the telescope unmodelled: write NAME and "
                "coefficient in arcseconds, a line a term"
            )
        of = kind or kind_of(file, path.name)
        PointingModel(of, latitude, (), ())  # a wrong latitude is no fault of a line
        found = cls(
            of,
            latitude,
            tuple(_term(path, row, of, latitude) for row in file.rows),
            tuple(row.arcsec * _ARCSEC for row in file.rows),
            file.caption,
            path,
            path.stat().st_mtime,
            file.n,
            file.sky_rms_arcsec * _ARCSEC,
            tuple(None if row.sigma_arcsec is None else row.sigma_arcsec * _ARCSEC for row in file.rows),
            tuple(not row.fixed for row in file.rows),
        )
        try:
            refuse_impossible(found)
        except PointingError as error:
            raise PointingError(f"{path.name}: {error}") from None
        return found

    @property
    def text(self) -> str:
        """File, terms and what it left, in one line."""
        fitted = f", fitted to {self.n} stars" if self.n else ""
        left = f", {self.sky_rms / _ARCSEC:.3g}″ left on the sky" if self.sky_rms else ""
        return f"{self.path.name}: {' '.join(each.name for each in self.terms)}{fitted}{left}"


def read_model(path: str | Path, latitude_deg: float, kind: MountKind | None = None) -> ModelOnFile:
    """Read a TPOINT model file, as `result.save` writes it, as a model that points: `read_model("model.mod", 40.0)`.

    Parameters
    ----------
    path : path
        The file.
    latitude_deg : float
        Of the mount, north positive.
    kind : {"equatorial", "altazimuth"}, optional
        The mount's coordinates. Without it the terms say; equatorial where both kinds have all of them.

    Raises
    ------
    PointingError
        It is no model file, has no term, its terms are of no one kind of mount, or the latitude is none; with the
        file, and the line that is wrong.
    """
    return ModelOnFile.read(path, kind, math.radians(latitude_deg))


def kind_of(file: ModelFile, name: str) -> MountKind:
    """Return the kind of mount that has all terms of a file of some name; equatorial where both have.

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
    raise PointingError(f"{name} is for no mount: {'; '.join(refusals)}")


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
