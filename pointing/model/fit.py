"""Fit a pointing model to a run: rigorous Gauss-Newton on the sky, with exact derivatives and constant memory.

    result = fit(run, "IH ID CH NP MA ME TF")

The sum of squared distances between star and prediction is minimised. Each round gathers the normal equations of the
whole run block by block. A long run is first fitted on a part spread evenly over it, so that one round over all of it
suffices.

In a short run the step of a round is followed by a second one with the same derivatives (both together converge with
the third order, Traub 1964). What a round leaves of a change is foretold by `Contraction`, so that the last one need
not be made.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.contraction import Contraction
from pointing.model.degeneracy import refuse_degenerate, refuse_inseparable
from pointing.model.design import blocks, residuals
from pointing.model.fitted import Fit
from pointing.model.normal_equations import NormalEquations
from pointing.model.outliers import Outlier, find_outliers, huber_weights
from pointing.model.pointing_model import PointingModel
from pointing.model.possible import INDEX_TERMS, LARGEST, LARGEST_INDEX
from pointing.model.run import PointingRun
from pointing.model.terms import PIER_TERMS, Term, terms

Array = NDArray[np.float64]

_PART = 1500  # observations of a long run that give the start
_LONG = 2 * _PART  # observations; of no more, the derivatives are kept for the next round
_CHORD = 0.1  # of a step; a second one with the same derivatives is taken if it is less than this
_SETTLED = 1e-10  # rad; a change of coefficients below 2e-5″ is none
_SAME = math.radians(1.0 / 3600.0)  # between readings at one place
_WORSE = 1.0 + 1e-9  # growth of the sum of squares that is more than rounding
_ROUNDS = 60
_ROBUST_ROUNDS = 30


def fit(
    run: PointingRun,
    model: str | Sequence[Term | str] | PointingModel,
    *,
    fixed: Mapping[str, float] | Sequence[str] | str = (),
    robust: bool = False,
    outliers: bool = False,
    by_pier: bool = False,
) -> Fit:
    """Fit pointing terms to a run, as it stands: ask `pointing.model.diagnosis.diagnose` for its faults before.

    Parameters
    ----------
    run : PointingRun
        What was observed; masked observations and those of weight 0 take no part.
    model : str, sequence of Term or str, or PointingModel
        The terms in their order, as in `"IH ID CH"`; a model also gives where to start.
    fixed : mapping, str or sequence of str
        Terms that keep their coefficient: arcseconds by name, or names of a model's terms, as in `"CH NP"`.
    robust : bool
        Weigh down observations that lie far off, after Huber.
    outliers : bool
        Find and mask observations that do not belong, each with its reason.
    by_pier : bool
        Let both index errors differ beyond the pole: two more terms.

    Returns
    -------
    Fit
        Coefficients, their uncertainty, residuals and statistics.

    Raises
    ------
    PointingError
        No run or terms, too few observations or places, terms that cannot be told apart, or a fit that does not
        settle; says what to do.
    """
    _refuse_other_kinds(run, model)
    start = _start(run, model)
    if by_pier:
        start = _with_pier_terms(run, start)
    start, free = _held(start, fixed)
    refuse_degenerate([each for each, is_free in zip(start.terms, free, strict=True) if is_free], start.frame)
    if not outliers:
        return _settled(run, start, free, robust=robust)
    run, found = _without_outliers(run, start, free)
    return replace(_settled(run, start, free, robust=robust), outliers=found)


def _without_outliers(
    run: PointingRun, start: PointingModel, free: NDArray[np.bool_]
) -> tuple[PointingRun, tuple[Outlier, ...]]:
    """The run with what does not belong masked.

    A star degrees off bends a fit of many terms until it does not settle, or settles far away. Index errors have no
    bend: what does not belong to them is left out of a second beginning, and tested again with all the others.
    """

    def fitted(kept: PointingRun, heed: bool) -> Fit:
        return _settled(kept, start, free, robust=heed)

    try:
        return find_outliers(run, fitted)
    except PointingError:
        index = np.array([is_free and each.is_index for each, is_free in zip(start.terms, free, strict=True)], bool)
        if not index.any():
            raise
        begun, _ = find_outliers(run, lambda kept, heed: _settled(kept, start, index, robust=heed))
        return find_outliers(run, fitted, begun.kept)


def _refuse_other_kinds(run: object, model: object) -> None:
    if not isinstance(run, PointingRun):
        raise PointingError(f"{run!r:.60} is no PointingRun: read one with read_run(path), or make one of arrays")
    if not isinstance(model, str | Sequence | PointingModel):
        raise PointingError(f'{model!r:.60} are no terms: give names as in "IH ID CH", a list of them, or a model')


def _start(run: PointingRun, model: str | Sequence[Term | str] | PointingModel) -> PointingModel:
    if isinstance(model, PointingModel):
        if model.kind != run.mount:
            raise PointingError(f"the model is for an {model.kind} mount, the run is of an {run.mount} one")
        return replace(model, latitude=run.latitude)
    listed = terms(model, run.mount)
    return PointingModel(run.mount, run.latitude, listed, (0.0,) * len(listed), run.caption)


def _with_pier_terms(run: PointingRun, start: PointingModel) -> PointingModel:
    beyond = run.beyond & run.kept
    if not beyond.any() or beyond[run.kept].all():
        raise PointingError("index errors by pier side need observations on both: leave by_pier out")
    index = {"equatorial": ("IH", "ID"), "altazimuth": ("IA", "IE")}[run.mount]
    more = tuple(PIER_TERMS[name] for name in index if name in {each.name for each in start.terms})
    # first of all, so that the others see the corrected place as they do with the index errors
    return replace(start, terms=(*more, *start.terms), coefficients=(0.0,) * len(more) + start.coefficients)


def _held(
    start: PointingModel, fixed: Mapping[str, float] | Sequence[str] | str
) -> tuple[PointingModel, NDArray[np.bool_]]:
    """The model with its fixed coefficients, and which of its terms are free."""
    wanted = {name.upper(): value for name, value in fixed.items()} if isinstance(fixed, Mapping) else None
    names = [name.upper() for name in (fixed.replace(",", " ").split() if isinstance(fixed, str) else fixed)]
    there = [each.name for each in start.terms]
    absent = [name for name in names if name not in there]
    if absent:
        raise PointingError(
            f"{absent[0]} is to be held fixed, but is no term of the model: {' '.join(there) or 'none'}"
        )
    if wanted is not None:
        _refuse_large(wanted)
        values = [
            math.radians(wanted[name] / 3600.0) if name in wanted else value
            for name, value in zip(there, start.coefficients, strict=True)
        ]
        start = start.with_coefficients(values)
    return start, np.array([name not in names for name in there], bool)


def _refuse_large(fixed: Mapping[str, float]) -> None:
    """Refuse a coefficient, arcseconds, that would displace the star further than any telescope does."""
    for name, arcsec in fixed.items():
        bound = LARGEST_INDEX if name in INDEX_TERMS else LARGEST
        if not abs(arcsec) <= math.degrees(bound) * 3600.0:
            raise PointingError(
                f"{name} is to be held at {arcsec:g}″, {arcsec / 3600.0:.3g}°: possible are "
                f"−{math.degrees(bound):g}° to {math.degrees(bound):g}°; fixed coefficients are arcseconds"
            )


def fewest(k: int) -> int:
    """Observations that are more than `k` free terms can follow: each tells two components."""
    return k // 2 + 1


def _refuse_too_few(n: int, k: int) -> None:
    needed = fewest(k)
    if n < needed:
        raise PointingError(
            f"{n} observations for {k} free terms: at least {needed} are needed, and {2 * k} for a σ that means "
            "something; observe more stars or fit fewer terms"
        )


def _refuse_few_places(run: PointingRun, k: int) -> None:
    """Refuse stars over and over at fewer places than the terms need; asked only where these are not told apart."""
    places, needed = len(np.unique(np.round(np.array([run.axis1, run.axis2]) / _SAME), axis=1).T), fewest(k)
    if places < needed:
        raise PointingError(
            f"{len(run)} observations are of {places} place{'' if places == 1 else 's'}: observe at least {needed} "
            f"places for {k} free terms"
        )


def _settled(run: PointingRun, start: PointingModel, free: NDArray[np.bool_], *, robust: bool) -> Fit:
    """Iterate to the least sum of squares."""
    weight = np.where(run.kept, run.weight, 0.0)
    used = weight.nonzero()[0]
    _refuse_too_few(used.size, int(np.count_nonzero(free)))
    model, contraction = start, Contraction()
    if used.size > _LONG:
        part = run.subset(_spread(len(run), used))
        model, _, contraction = _gauss_newton(part, model, free, part.weight, contraction)
    model, equations, contraction = _gauss_newton(run, model, free, weight, contraction)
    rounds = 0
    while robust:
        heed = huber_weights(residuals(run, model), weight, int(free.sum()))
        before = np.array(model.coefficients)
        model, equations, _ = _gauss_newton(run, model, free, weight * heed, contraction)
        rounds += 1
        if np.max(np.abs(np.array(model.coefficients) - before)) < 1e3 * _SETTLED or rounds == _ROBUST_ROUNDS:
            weight = weight * heed
            break
    return Fit(model, tuple(free.tolist()), run, weight, equations)


def _spread(n: int, used: NDArray[np.intp]) -> NDArray[np.bool_]:
    """A part of the used observations, evenly spread over the run and not in step with a pattern of it."""
    chosen = np.zeros(n, bool)
    picked = np.random.default_rng(n).choice(used, _PART, replace=False)
    chosen[picked] = True
    return chosen


def _gauss_newton(
    run: PointingRun, model: PointingModel, free: NDArray[np.bool_], weight: Array, contraction: Contraction
) -> tuple[PointingModel, NormalEquations, Contraction]:
    """Return the settled model, its normal equations and by how much a round brings it nearer.

    The square of the equations is that of the residuals of the returned model. Where terms are hardly told apart, the
    valley they lie in is bent, and whole steps leap from side to side of it: these are damped (Levenberg 1944).
    """
    listed = [each for each, is_free in zip(model.terms, free, strict=True) if is_free]
    base, change = np.array(model.coefficients), np.zeros(len(listed))
    length, least, damping, settled = math.inf, math.inf, 0.0, NormalEquations.empty(len(listed))
    before: list[Array] = []  # derivatives of the round before, if its step was a whole one
    for _ in range(_ROUNDS):
        equations, projected, derivatives = _gathered(run, model, free, weight, before)
        if equations.square > least * _WORSE:
            damping = settled.next_damping(damping)
            change, before = settled.solution(damping), []
        else:
            shares = equations.inseparable() if least == math.inf else None  # later rounds see the same sky
            if shares is not None:
                _refuse_few_places(run.subset(weight > 0.0), len(listed))
                refuse_inseparable(listed, shares, int(np.count_nonzero(weight)))
            if before:
                contraction = contraction.turned(equations, projected, change)
            base, least, settled = np.array(model.coefficients), equations.square, equations
            last, change, previous = change, equations.solution(damping), length
            if equations.reverses(last, change):
                damping = equations.next_damping(damping)
                change = equations.solution(damping)
            _refuse_nonsense(listed, base[free] + change)
            largest, length = float(np.abs(change).max(initial=0.0)), equations.length(change)
            if not before and 0.0 < previous < math.inf:
                contraction = contraction.at_most(length, previous)
            if min(largest, contraction.left(length) * equations.least_seen) < _SETTLED:
                left = max(equations.square - float(change @ equations.right), 0.0)
                return _moved(model, base, free, change), replace(equations, square=left), contraction
            before = [] if damping else derivatives
            if before and length:
                second = equations.inverse @ _projected(run, _moved(model, base, free, change), weight, before)
                if equations.length(second) < _CHORD * length:
                    contraction = contraction.bent(length, equations.length(second))
                    change = change + second
        model = _moved(model, base, free, change)
    raise PointingError(
        f"the fit does not settle: after {_ROUNDS} rounds a coefficient still changes by "
        f"{math.degrees(largest) * 3600.0:.3g}″; look at the residuals of a fit of the index errors alone for "
        "observations that do not belong, or fit fewer terms"
    )


def _gathered(
    run: PointingRun, model: PointingModel, free: NDArray[np.bool_], weight: Array, before: Sequence[Array]
) -> tuple[NormalEquations, Array, list[Array]]:
    """The normal equations of the free terms at a model.

    And the residuals there on the derivatives `before`, block by block; and the derivatives, if the run is short.
    """
    k = int(np.count_nonzero(free))
    equations, projected, derivatives = NormalEquations.empty(k), np.zeros(k), []
    for n, block in enumerate(blocks(run, model)):
        design = block.design if k == free.size else block.design[:, :, free]
        equations = equations.added(block.residual, design, weight[block.where])
        if before:
            projected = projected + _onto(before[n], block.residual * weight[block.where])
        if len(run) <= _LONG:
            derivatives.append(design)
    return equations, projected, derivatives


def _projected(run: PointingRun, model: PointingModel, weight: Array, derivatives: Sequence[Array]) -> Array:
    """The residuals of a model on derivatives of another."""
    weighted = residuals(run, model) * weight
    found, begin = np.zeros(derivatives[0].shape[-1]), 0
    for each in derivatives:
        end = begin + each.shape[1]
        found, begin = found + _onto(each, weighted[:, begin:end]), end
    return found


def _onto(derivatives: Array, weighted: Array) -> Array:
    return np.asarray(weighted.ravel() @ derivatives.reshape(weighted.size, -1))


def _moved(model: PointingModel, base: Array, free: NDArray[np.bool_], change: Array) -> PointingModel:
    """The model with its free coefficients changed from `base`."""
    coefficients = base.copy()
    coefficients[free] += change
    return model.with_coefficients(coefficients.tolist())


def _refuse_nonsense(listed: Sequence[Term], coefficients: Array) -> None:
    if np.abs(coefficients).max(initial=0.0) <= math.pi / 4:
        return
    for each, value in zip(listed, coefficients, strict=True):
        if not abs(value) <= math.pi / 4:
            raise PointingError(
                f"the fit drives {each.name} to {math.degrees(value):.3g}°, which no telescope has: look for swapped "
                "columns, a wrong latitude, or places of another frame"
            )
