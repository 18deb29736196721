"""One telescope over many nights: what stays, what drifts, and what the next run will be like.

    nights = fit_nights(runs, "IH ID CH NP MA ME TF")
    nights.predict_next()              # before the first star of the night
    nights.predict_next(first_stars)   # after a few: they set the index terms, and all else as far as they tell

A coefficient of run i is c + w_i, w a random walk from run to run; an index term has a jump of each run besides,
c + w_i + j_i, as after homing. The variances of walks and jumps are found from all runs together by restricted
maximum likelihood (`pointing.model.variance_components`); where they are zero the term stays, and all runs tell its
one value. Every run weighs by its own normal equations, so runs of few stars, too few for a fit of their own, take
part as well.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.degeneracy import refuse_inseparable
from pointing.model.design import blocks
from pointing.model.fit import fit
from pointing.model.normal_equations import SINGULAR, NormalEquations
from pointing.model.pointing_model import PointingModel
from pointing.model.prediction import Prediction
from pointing.model.run import PointingRun
from pointing.model.terms import Term, terms
from pointing.model.variance_components import Component, Estimate, RunsModel, independent, random_walk

Array = NDArray[np.float64]

_ROUNDS = 10  # of linearising every run at what all runs say of it
_SETTLED = 1e-9  # rad
_ARCSEC = math.degrees(1.0) * 3600.0


@dataclass(frozen=True)
class Wandering:
    """How one term changes from run to run, arcseconds.

    Parameters
    ----------
    name : str
        The term.
    arcsec, sigma_arcsec : float
        What it is expected to be in the next run, and how surely.
    drift_arcsec : float
        Likeliest standard deviation of its walk from one run to the next; 0 where it stays.
    jump_arcsec : float
        Likeliest standard deviation of what only the one run has; 0 where there is none.
    """

    name: str
    arcsec: float
    sigma_arcsec: float
    drift_arcsec: float
    jump_arcsec: float

    @property
    def stays(self) -> bool:
        """Whether it is the same in all runs."""
        return self.drift_arcsec == 0.0 and self.jump_arcsec == 0.0


@dataclass(frozen=True, eq=False)
class Nights:
    """The fit of many runs.

    Parameters
    ----------
    model : PointingModel
        As it is expected to be in the next run.
    estimate : Estimate
        The linear model of all runs with its variances.
    scatter : float
        Standard deviation of one component of a single observation of mean weight, radians.
    mean_weight : float
        Of the observations of all runs.
    runs : int
        How many there were.
    n : int
        Observations in all of them.
    """

    model: PointingModel
    estimate: Estimate
    scatter: float
    mean_weight: float
    runs: int
    n: int

    @property
    def terms(self) -> tuple[Wandering, ...]:
        """The terms in their order, with how they change."""
        values, covariance = self.estimate.expected.coefficients(-1)
        sizes = np.zeros((len(values), 2))
        for each, variance in zip(self.estimate.model.components, self.estimate.variances, strict=True):
            sizes[each.term, int(each.kind == "jump")] = math.sqrt(variance)
        sigma = np.sqrt(np.diag(covariance))
        return tuple(
            Wandering(term.name, *(float(number) * _ARCSEC for number in numbers))
            for term, *numbers in zip(self.model.terms, values, sigma, sizes[:, 0], sizes[:, 1], strict=True)
        )

    def __getitem__(self, name: str) -> Wandering:
        """Return how a term changes."""
        for each in self.terms:
            if each.name == name.upper():
                return each
        raise KeyError(f"{name} is no term of these nights: {' '.join(each.name for each in self.model.terms)}")

    def of_run(self, run: int) -> Prediction:
        """What all runs together say of one of them, counted from 0.

        Raises
        ------
        PointingError
            There is no such run.
        """
        if not 0 <= run < self.runs:
            raise PointingError(f"run {run}; there are {self.runs}, counted from 0")
        return self._prediction(*self.estimate.expected.coefficients(run))

    def predict_next(self, first: PointingRun | None = None) -> Prediction:
        """Predict the model of the next run.

        Parameters
        ----------
        first : PointingRun, optional
            The first stars of the run: they tell the index terms, which may have jumped, and all else as far as it
            may have drifted. Their weights are in the unit of those of the runs.

        Returns
        -------
        Prediction
            The model, the covariance of its coefficients, and the scatter of a single observation.

        Raises
        ------
        PointingError
            The stars are of another kind of mount.
        """
        values, covariance = self.estimate.expected.coefficients(-1)
        if first is None:
            return self._prediction(values, covariance)
        _refuse_other(first, self.model)
        at = values
        for _ in range(_ROUNDS):
            observed, design, _ = _whitened(_equations(first, self.model.with_coefficients(at.tolist())), at)
            unit = self.scatter * math.sqrt(self.mean_weight)  # of weight one
            observed, design = observed / unit, design / unit
            gain = covariance @ design.T @ np.linalg.inv(np.eye(len(observed)) + design @ covariance @ design.T)
            before, at = at, values + gain @ (observed - design @ values)
            if np.max(np.abs(at - before)) < _SETTLED:
                break
        return self._prediction(at, covariance - gain @ design @ covariance)

    def _prediction(self, values: Array, covariance: Array) -> Prediction:
        free = (True,) * len(values)
        return Prediction(self.model.with_coefficients(values.tolist()), free, covariance, self.scatter)

    def __repr__(self) -> str:
        drifting = " ".join(each.name for each in self.terms if not each.stays)
        return (
            f"Nights({self.runs} runs, {self.n} observations, scatter {self.scatter * _ARCSEC:.2f}″, "
            f"changing: {drifting or 'nothing'})"
        )

    def _repr_html_(self) -> str:
        heads = ("term", "next run", "σ", "drift a run", "jump of a run", "")
        rows = "".join(
            f"<tr><td>{escape(each.name)}</td><td>{each.arcsec:.2f}″</td><td>{each.sigma_arcsec:.2f}″</td>"
            f"<td>{each.drift_arcsec:.2f}″</td><td>{each.jump_arcsec:.2f}″</td>"
            f"<td>{'stays' if each.stays else ''}</td></tr>"
            for each in self.terms
        )
        return (
            f"<table><caption>{escape(repr(self))}</caption><tr>"
            + "".join(f"<th>{head}</th>" for head in heads)
            + f"</tr>{rows}</table>"
        )


def fit_nights(
    runs: Sequence[PointingRun],
    model: str | Sequence[Term | str],
    *,
    staying: str | Sequence[Term | str] = "",
    outliers: bool = False,
) -> Nights:
    """Fit the runs of one telescope together.

    Parameters
    ----------
    runs : sequence of PointingRun
        In the order in which they were observed, two or more; σ of drifts mean something from about five on.
    model : str or sequence of Term or str
        The terms, as for `fit`: names as in `"IH ID CH"`, or names and terms as in `["IH", "ID", own_term(...)]`.
    staying : str or sequence of Term or str
        Terms that are known to be the same in all runs. All others may drift, as far as the runs say.
    outliers : bool
        Mask in every run what does not belong to it.

    Returns
    -------
    Nights
        What stays, what drifts, and the prediction of the next run.

    Raises
    ------
    PointingError
        Runs of different mounts, fewer than two, none that can be fitted alone, or terms that all of them together
        do not tell apart.
    """
    if len(runs) < 2:
        raise PointingError(f"{len(runs)} runs; nights need two or more: fit(run, …) fits one")
    listed = terms(model, runs[0].mount)
    held = {each.name for each in terms(staying, runs[0].mount)} if staying else set()
    absent = held - {each.name for each in listed}
    if absent:
        raise PointingError(
            f"{min(absent)} is to stay, but is no term of the model: {' '.join(each.name for each in listed)}"
        )
    runs, models = _begun(runs, listed, outliers=outliers)
    weights = np.concatenate([run.weight[run.kept & (run.weight > 0.0)] for run in runs])
    n, mean_weight = len(weights), float(np.mean(weights))
    changing = [(each.name not in held, each.is_index) for each in listed]
    at = np.array([model.coefficients for model in models])
    variances: Array | None = None
    for _ in range(_ROUNDS):
        equations = [_equations(run, models[0].with_coefficients(x)) for run, x in zip(runs, at, strict=True)]
        _refuse_unseen(listed, equations, n)
        estimate, unit = _estimated(equations, at, n, changing, variances)
        variances = estimate.variances
        before, at = at, np.array([estimate.coefficients(i)[0] for i in range(len(runs))])
        if np.max(np.abs(at - before)) < _SETTLED:
            break
    expected = models[0].with_coefficients(estimate.expected.coefficients(-1)[0].tolist())
    return Nights(expected, estimate, unit / math.sqrt(mean_weight), mean_weight, len(runs), n)


def _begun(
    runs: Sequence[PointingRun], listed: Sequence[Term], *, outliers: bool
) -> tuple[list[PointingRun], list[PointingModel]]:
    """Every run, its outliers masked, and a model near it: its own fit, or the mean of the others'."""
    kept, refused = list(runs), None
    models: list[PointingModel | None] = []
    for i, run in enumerate(runs):
        if run.mount != runs[0].mount:
            raise PointingError(f"run {i} is of an {run.mount} mount, run 0 of an {runs[0].mount} one")
        try:
            result = fit(run, listed, outliers=outliers)
        except PointingError as error:
            models.append(None)
            refused = error
        else:
            kept[i] = result.run
            models.append(result.model)
    fitted = [model for model in models if model is not None]
    if not fitted:
        raise PointingError(f"none of the {len(runs)} runs can be fitted alone; the last one: {refused}")
    mean = fitted[0].with_coefficients(np.mean([model.coefficients for model in fitted], axis=0).tolist())
    return kept, [mean if model is None else model for model in models]


def _equations(run: PointingRun, model: PointingModel) -> NormalEquations:
    weight = np.where(run.kept, run.weight, 0.0)
    equations = NormalEquations.empty(len(model.terms))
    for block in blocks(run, replace(model, latitude=run.latitude)):
        equations = equations.added(block.residual, block.design, weight[block.where])
    return equations


def _whitened(equations: NormalEquations, at: Array) -> tuple[Array, Array, float]:
    """Observations of the same normal equations, one a direction that the run sees; their design; Σd² left."""
    scale = equations.scale
    values, vectors = np.linalg.eigh(equations.matrix / np.outer(scale, scale))
    seen = values > SINGULAR * values[-1]
    root, vectors = np.sqrt(values[seen]), vectors[:, seen]
    design = root[:, None] * vectors.T * scale
    projected = vectors.T @ (equations.right / scale) / root
    return projected + design @ at, design, equations.square - float(projected @ projected)


def _estimated(
    equations: Sequence[NormalEquations],
    at: Array,
    n: int,
    changing: Sequence[tuple[bool, bool]],
    start: Array | None,
) -> tuple[Estimate, float]:
    """The variances, sought from the last ones or from how much the runs differ; and the scatter at weight one."""
    whitened = [_whitened(each, x) for each, x in zip(equations, at, strict=True)]
    freedom = 2 * n - sum(len(observed) for observed, _, _ in whitened)
    left = sum(square for _, _, square in whitened)
    if not (freedom > 0 and left > 0.0):
        raise PointingError(f"{n} observations leave nothing of the terms to tell their scatter: observe more")
    scatter = math.sqrt(left / freedom)
    observed = np.concatenate([each for each, _, _ in whitened]) / scatter
    design = np.concatenate([each for _, each, _ in whitened]) / scatter
    rows = np.repeat(np.arange(len(whitened)), [len(each) for each, _, _ in whitened])
    parts = tuple(_components(design, rows, changing))
    if start is None:
        noise = 1.0 / np.mean(np.sum(design**2, axis=0)) + np.mean(np.diff(at, axis=0) ** 2, axis=0)
        start = np.array([noise[each.term] for each in parts])
    return RunsModel(observed, design, parts).estimated(start), scatter


def _components(design: Array, rows: NDArray[np.intp], changing: Sequence[tuple[bool, bool]]) -> Iterator[Component]:
    """The walks and jumps of the terms; `rows` is the run of each whitened observation."""
    runs = int(rows[-1]) + 1
    for term, (drifts, jumps) in enumerate(changing):
        each_run = np.where(rows[:, None] == np.arange(runs), design[:, term, None], 0.0)
        if drifts:
            yield Component(term, "walk", each_run, random_walk(runs))
        if drifts and jumps:
            yield Component(term, "jump", each_run, independent(runs))


def _refuse_unseen(listed: Sequence[Term], equations: Sequence[NormalEquations], n: int) -> None:
    """Refuse terms that all runs together do not tell apart."""
    everything = NormalEquations(
        np.sum([each.matrix for each in equations], axis=0),
        np.sum([each.right for each in equations], axis=0),
        sum(each.square for each in equations),
    )
    shares = everything.inseparable()
    if shares is not None:
        refuse_inseparable(listed, shares, n)


def _refuse_other(first: PointingRun, model: PointingModel) -> None:
    if first.mount != model.kind:
        raise PointingError(f"the nights are of an {model.kind} mount, the first stars of an {first.mount} one")
