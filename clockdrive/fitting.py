"""From a file of observations to a fitted pointing model and what is said of it; and what model files say.

Answers are plain values, as the command line prints them: angles in arcseconds, indices from 0.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from clockdrive.errors import InputError
from pointing.errors import PointingError
from pointing.model.choice import Choice, choose_terms
from pointing.model.degeneracy import refuse_degenerate
from pointing.model.diagnosis import diagnose
from pointing.model.fit import fit
from pointing.model.fitted import Fit
from pointing.model.model_file import ModelFile, ModelRow, read_model_file
from pointing.model.model_on_file import ModelOnFile, kind_of, read_model
from pointing.model.place import MountKind
from pointing.model.polar_alignment import TILTS, polar_alignment
from pointing.model.possible import refuse_nonsense
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run
from pointing.model.terms import term, terms
from pointing.model.words import Places, Pole
from pointing.site import Weather

DEFAULT_TERMS: dict[MountKind, str] = {
    "equatorial": "IH ID CH NP MA ME TF",
    "altazimuth": "IA IE CA NPAE AN AW TF",
}
"""What is fitted where nobody says: zero points, collimation, non-perpendicularity, tilt of axis 1, tube flexure."""

ANY_LATITUDE_DEG = 45.0  # of a model whose file does not tell and whose coefficients alone are judged


@dataclass(frozen=True)
class Wanted:
    """How a run shall be fitted.

    Parameters
    ----------
    terms : str
        Names; empty for `DEFAULT_TERMS`.
    auto : bool
        Choose the terms instead.
    fixed : mapping
        Terms that keep a coefficient, arcseconds.
    places : str or None
        Frame of an equatorial file's right ascensions.
    weather : Weather or None
        The air that refracts them, instead of that in the file.
    robust, outliers, by_pier : bool
        As for `pointing.fit`.
    mask : tuple of int
        Observations to leave out.
    pole : str
        To which the polar axis shall point.
    by_run : bool
        Of a kept run: choose the terms and find outliers where it has stars enough for that.
    """

    terms: str = ""
    auto: bool = False
    fixed: Mapping[str, float] = field(default_factory=dict)
    places: Places | None = None
    weather: Weather | None = None
    robust: bool = False
    outliers: bool = False
    by_pier: bool = False
    mask: tuple[int, ...] = ()
    pole: Pole = "true"
    by_run: bool = False

    def free(self, kind: MountKind) -> int:
        """How many terms are fitted; where they are chosen, those of which as many as usual are."""
        names = {each.name for each in terms(self.terms or DEFAULT_TERMS[kind], kind)}
        return len(names - set(self.fixed))


@dataclass(frozen=True)
class Fitted:
    """A fit, what was found wrong with its run, and how its terms were chosen, if they were."""

    fit: Fit
    findings: tuple[str, ...] = ()
    choice: Choice | None = None
    pole: Pole = "true"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to beware of, that of the run first."""
        return (*self.findings, *self.fit.warnings)

    @property
    def advice(self) -> str:
        """What to turn to put axis 1 right; empty where the model has no tilt."""
        names = {each.name for each in self.fit.model.terms}
        if not names & set(TILTS[self.fit.model.kind]):
            return ""
        return polar_alignment(self.fit, self.pole).text

    @property
    def json(self) -> dict[str, Any]:
        """The answer."""
        answer: dict[str, Any] = {
            "ok": True,
            "terms": [
                {"name": each.name, "arcsec": each.arcsec, "sigma_arcsec": each.sigma_arcsec, "fixed": each.fixed}
                for each in self.fit.coefficients
            ],
            "n": self.fit.n,
            "masked": [i for i, weight in enumerate(self.fit.weight.tolist()) if weight == 0.0],
            "sky_rms_arcsec": self.fit.sky_rms_arcsec,
            "popn_sd_arcsec": self.fit.popn_sd_arcsec if math.isfinite(self.fit.popn_sd_arcsec) else None,
            "condition": self.fit.condition,
            "outliers": [
                {"index": each.index, "line": each.line, "reason": each.reason} for each in self.fit.outliers
            ],
            "warnings": list(self.warnings),
            "advice": self.advice.split("\n") if self.advice else [],
        }
        if self.choice is not None:
            answer["choice"] = [
                {"action": step.action, "term": step.term, "why": step.why}
                for step in (*self.choice.path, *self.choice.left)
            ]
        return answer


def fit_file(path: str | Path, wanted: Wanted) -> Fitted:
    """Read a run, look for its faults, and fit it.

    Raises
    ------
    PointingError
        The run cannot be read or a fit of it would mean nothing; the text says what is wrong and what to do.
    """
    return fit_run(read_run(path, places=wanted.places, weather=wanted.weather), wanted)


def fit_run(run: PointingRun, wanted: Wanted) -> Fitted:
    """Look for the faults of a run, and fit it.

    Raises
    ------
    PointingError
        As for `fit_file`.
    """
    run = run.masked(wanted.mask)
    names = wanted.terms or DEFAULT_TERMS[run.mount]
    findings = diagnose(run, 2 if wanted.auto else max(wanted.free(run.mount), 1))
    refused = [str(each) for each in findings if each.severity == "refuse"]
    if refused:
        raise PointingError("; ".join(refused))
    found, choice = _fitted(run, names, wanted)
    refuse_nonsense(found)
    return Fitted(found, tuple(str(each) for each in findings), choice, wanted.pole)


def _fitted(run: PointingRun, names: str, wanted: Wanted) -> tuple[Fit, Choice | None]:
    if not wanted.auto:
        return fit(
            run, names, fixed=wanted.fixed, robust=wanted.robust, outliers=wanted.outliers, by_pier=wanted.by_pier
        ), None
    choice = choose_terms(run, outliers=wanted.outliers)
    if not (wanted.robust or wanted.by_pier):
        return choice.fit, choice
    chosen = fit(choice.fit.run, choice.fit.model.terms, robust=wanted.robust, by_pier=wanted.by_pier)
    return replace(chosen, outliers=choice.fit.outliers), choice


def show_models(paths: Sequence[str]) -> dict[str, Any]:
    """What each model file says, with what its terms are."""
    return {"ok": True, "models": [_shown(path, read_model_file(path)) for path in paths]}


def check_models(paths: Sequence[str]) -> dict[str, Any]:
    """As `show_models`, for files that can point a telescope.

    Raises
    ------
    PointingError
        One cannot; each fault is named with its file.
    """
    problems = []
    for path in paths:
        try:
            _refuse_degenerate(read_model(path, ANY_LATITUDE_DEG))
        except PointingError as error:
            problems.append(str(error))
    if problems:
        raise PointingError("; ".join(problems))
    return show_models(paths)


def compare_models(paths: Sequence[str]) -> dict[str, Any]:
    """Terms of several models beside each other, each with its difference from the first in units of its σ.

    Raises
    ------
    InputError
        There is only one.
    PointingError
        One cannot be read, or they are of different mounts.
    """
    if len(paths) < 2:
        raise InputError(f"{paths[0]} alone: name two or more model files to compare")
    files = [read_model_file(path) for path in paths]
    kind_of(
        ModelFile("together", rows=tuple(row for file in files for row in file.rows)), "a comparison of these models"
    )
    tables = [{row.name: row for row in file.rows} for file in files]
    names = list(dict.fromkeys(name for table in tables for name in table))
    return {
        "ok": True,
        "files": [Path(path).name for path in paths],
        "terms": [
            {
                "name": name,
                "arcsec": [table[name].arcsec if name in table else None for table in tables],
                "sigmas_apart": [_sigmas_apart(tables[0].get(name), table.get(name)) for table in tables[1:]],
            }
            for name in names
        ],
    }


def _sigmas_apart(first: ModelRow | None, other: ModelRow | None) -> float | None:
    """Difference in units of its standard deviation; None where a file does not tell."""
    if first is None or other is None:
        return None
    variance = sum((row.sigma_arcsec or 0.0) ** 2 for row in (first, other))
    return (other.arcsec - first.arcsec) / math.sqrt(variance) if variance > 0.0 else None


def _shown(path: str, file: ModelFile) -> dict[str, Any]:
    name = Path(path).name
    kind = kind_of(file, name)
    return {
        "file": name,
        "caption": file.caption,
        "mount": kind,
        "n": file.n,
        "sky_rms_arcsec": file.sky_rms_arcsec,
        "terms": [
            {
                "name": row.name,
                "arcsec": row.arcsec,
                "sigma_arcsec": row.sigma_arcsec,
                "fixed": row.fixed,
                "sentence": term(row.name, kind).sentence,
                "evidence": term(row.name, kind).evidence(kind),
            }
            for row in file.rows
        ],
    }


def _refuse_degenerate(model: ModelOnFile) -> None:
    """Refuse fitted terms that no run tells apart: each coefficient alone means nothing."""
    fitted = [each for each, is_free in zip(model.terms, model.free, strict=True) if is_free]
    try:
        refuse_degenerate(fitted, model.frame)
    except PointingError as error:
        raise PointingError(f"{model.path.name}: {error}") from None
