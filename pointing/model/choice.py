"""Which terms a run asks for: forward and backward, by BIC and by patches of sky left out.

    choice = choose_terms(run)
    choice.fit.model, choice.path, choice.left

A term is taken when it lowers the Bayesian information criterion, 2n ln(Σd²/2n) + k ln 2n with the 2n components of n
observations (Schwarz 1978, Ann. Stat. 6, 461), by more than it must (`pointing.model.candidates`), *and* when patches
of the sky that were left out (`pointing.model.sky_blocks`) are predicted better with it, *and* when the run can carry
it (`pointing.model.admission`). Between such steps a term is dropped that has become needless, or exchanged for a
better one; where no single one helps, two are tried together. No step predicts patches left out worse.

The geometric terms are the base: they come first, both tilts of axis 1 as a pair, since an axis leans in two
directions, and none is dropped or exchanged once another term is there. All moves are judged by the normal equations
of the fit so far, linear in the candidates; what is taken is fitted rigorously and judged again.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from html import escape
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np

from pointing.errors import PointingError
from pointing.model.admission import refusal
from pointing.model.candidates import INDEX, Tier, geometric, tiers
from pointing.model.cross_validation import CrossValidation
from pointing.model.degeneracy import refuse_degenerate
from pointing.model.fit import fit
from pointing.model.fitted import Fit
from pointing.model.outliers import Outlier, find_outliers
from pointing.model.polar_alignment import TILTS
from pointing.model.run import PointingRun
from pointing.model.terms import Term, terms

Action = Literal["begun with", "taken", "dropped", "exchanged", "left"]


_Group = tuple[Term, ...]  # terms that are taken and dropped together


class _Move(NamedTuple):
    """What may be done, to which terms, why, and the terms afterwards."""

    action: Action
    name: str
    why: str
    model: tuple[Term, ...]


_BETTER = "patches left out are predicted to {1:.2f}″ instead of {0:.2f}″"
_MASKINGS = 3  # rounds of choosing and masking


@dataclass(frozen=True)
class Step:
    """One term, or a pair, that was taken, dropped, exchanged or left.

    Parameters
    ----------
    action : str
        What was done.
    term : str
        Its name, or both; of an exchange the new one's.
    delta_bic : float
        By how much BIC changes with it; of a term that was left, as if it were added to the chosen ones.
    cv_sky_rms_arcsec : float
        Of patches of the sky predicted by a fit without them; infinite where such a fit is not possible.
    sky_rms_arcsec : float
        Of the observations themselves.
    why : str
        One sentence.
    """

    action: Action
    term: str
    delta_bic: float
    cv_sky_rms_arcsec: float
    sky_rms_arcsec: float
    why: str


@dataclass(frozen=True, eq=False)
class Choice:
    """The chosen terms, fitted, and how they were found.

    Parameters
    ----------
    fit : Fit
        Of the chosen terms.
    path : tuple of Step
        From the first terms to the chosen ones.
    left : tuple of Step
        The other candidates, each as if it were added.
    """

    fit: Fit
    path: tuple[Step, ...]
    left: tuple[Step, ...]

    @property
    def terms(self) -> str:
        """Names of the chosen terms."""
        return " ".join(each.name for each in self.fit.model.terms)

    @property
    def cv_sky_rms_arcsec(self) -> float:
        """Sky RMS of patches of the sky predicted by a fit without them."""
        return self.path[-1].cv_sky_rms_arcsec

    def __repr__(self) -> str:
        return (
            f"Choice({self.terms!r}, sky RMS {self.fit.sky_rms_arcsec:.2f}″, of patches left out "
            f"{self.cv_sky_rms_arcsec:.2f}″, {len(self.left)} candidates left)"
        )

    def _repr_html_(self) -> str:
        heads = ("", "term", "ΔBIC", "sky RMS of patches left out", "sky RMS", "why")
        rows = "".join(_html_row(each) for each in (*self.path, *self.left))
        return (
            f"<table><caption>{escape(repr(self))}</caption><tr>"
            + "".join(f"<th>{head}</th>" for head in heads)
            + f"</tr>{rows}</table>"
        )


def choose_terms(
    run: PointingRun, candidates: str | None = None, start: str = "index terms", *, outliers: bool = False
) -> Choice:
    """Choose the terms that a run asks for.

    Parameters
    ----------
    run : PointingRun
        What was observed.
    candidates : str, optional
        Names of the terms to try; absent, the physical ones of the mount and then low harmonics.
    start : str
        Names of the terms that are there in any case; `"index terms"` are IH ID or IA IE.
    outliers : bool
        Mask observations that do not belong: to the geometric terms first, then, all tested again, to the chosen.

    Returns
    -------
    Choice
        The chosen terms, fitted, with the path to them.

    Raises
    ------
    PointingError
        A name is no term of this mount, or the run is too short even for the first terms.
    """
    first = terms(INDEX[run.mount] if start == "index terms" else start, run.mount)
    tried = tiers(run.mount, candidates)
    if not outliers:
        return _Search(run, first, tried).choice()
    masked = _masked_by_geometry(run, first)
    for _ in range(_MASKINGS):
        choice = _Search(masked, first, tried).choice()
        before, (masked, found) = masked, _tested_again(run, choice.fit, masked)
        if np.array_equal(masked.kept, before.kept):
            break
    else:
        choice = _Search(masked, first, tried).choice()
    return replace(choice, fit=replace(choice.fit, outliers=found))


def _masked_by_geometry(run: PointingRun, first: tuple[Term, ...]) -> PointingRun:
    """The run without what does not belong to the geometric terms, which are few and told apart."""
    standard = [*first, *(each for each in tiers(run.mount)[0].terms if each not in first)]
    if int(np.count_nonzero(run.kept)) <= len(standard):
        return fit(run, first, outliers=True).run
    try:
        return fit(run, standard, outliers=True).run
    except PointingError:  # a star degrees off bends their fit; by the first terms alone it is found
        return fit(fit(run, first, outliers=True).run, standard, outliers=True).run


def _tested_again(run: PointingRun, chosen: Fit, masked: PointingRun) -> tuple[PointingRun, tuple[Outlier, ...]]:
    """Test all observations against the chosen terms, fitted without those masked so far: none bends the fit."""
    return find_outliers(run, lambda kept, robust: fit(kept, chosen.model, robust=robust), masked.kept)


class _Search:
    """One search: the terms so far with their fit, and what all candidates would do."""

    def __init__(self, run: PointingRun, first: tuple[Term, ...], tried: tuple[Tier, ...]) -> None:
        self.run, self.first = run, first
        self.worth = dict.fromkeys(first, 0.0)
        for tier in tried:
            self.worth |= {each: tier.worth for each in tier.terms if each not in self.worth}
        self.tiers = [_groups([each for each in tier.terms if each not in first], run) for tier in tried]
        self.seen = {frozenset(first)}
        self.path: list[Step] = []
        self._settle(fit(run, first))
        self.path.append(self._step("begun with", _names(first), 0.0, "the first terms"))

    def _settle(self, fitted: Fit) -> None:
        """Go on from a fit."""
        self.fit, self.chosen = fitted, fitted.model.terms
        more = tuple(each for each in self.worth if each not in self.chosen)
        wide = replace(
            fitted.model, terms=self.chosen + more, coefficients=fitted.model.coefficients + (0.0,) * len(more)
        )
        self.place = {each: i for i, each in enumerate(wide.terms)}
        self.judge = CrossValidation.of(self.run, wide)
        self.bic, self.cv, self.rms = self._judged(self.chosen)

    def _judged(self, model: tuple[Term, ...]) -> tuple[float, float, float]:
        """BIC, sky RMS of patches left out and sky RMS of terms."""
        columns = [self.place[each] for each in model]
        return (
            self.judge.bic(columns),
            self.judge.cv_sky_rms_arcsec(columns),
            self.judge.sky_rms_arcsec(columns),
        )

    def choice(self) -> Choice:
        """Search tier after tier, until nothing makes it better; the geometric terms have the first word in each."""
        base, *others = self.tiers
        while self._stepped(self._moves(base)) or self._stepped(self._pairs(base)):
            pass
        tried = list(base)
        for tier in others:
            tried += tier
            while any(self._stepped(moves) for moves in (self._taken(base), self._moves(tried), self._pairs(tier))):
                pass
        left = [each for each in tried if not set(each) & set(self.chosen)]
        return Choice(self.fit, tuple(self.path), tuple(self._left(each) for each in left))

    def _stepped(self, offered: Iterable[_Move]) -> bool:
        """Make the best move of those that make it better."""
        moves = [(self._score(move.model), move) for move in offered if self._possible(move.model)]
        now = self._score(self.chosen)
        for score, move in sorted(moves, key=lambda pair: pair[0]):
            if score >= now:
                break
            if self._made(move):
                return True
        return False

    def _made(self, move: _Move) -> bool:
        """Fit the terms of a move and go on from there; False where patches left out or the fit refuse it."""
        bic, cv, _ = self._judged(move.model)
        if not cv < self.cv:
            return False
        self.seen.add(frozenset(move.model))
        values = dict(zip(self.chosen, self.fit.model.coefficients, strict=True))
        begun = tuple(values.get(each, 0.0) for each in move.model)
        try:
            fitted = fit(self.run, replace(self.fit.model, terms=move.model, coefficients=begun))
        except PointingError:  # terms that cannot be together; what is left says why
            return False
        delta, before, cv_before = bic - self.bic, self.fit, self.cv
        self._settle(fitted)
        if not self.cv < cv_before:  # it was better in the linear forecast alone
            self._settle(before)
            return False
        self.path.append(self._step(move.action, move.name, delta, move.why.format(cv_before, self.cv)))
        return True

    def _score(self, model: tuple[Term, ...]) -> float:
        return self.judge.bic([self.place[each] for each in model]) + sum(self.worth[each] for each in model)

    def _possible(self, model: tuple[Term, ...]) -> bool:
        columns = [self.place[each] for each in model]
        return frozenset(model) not in self.seen and self.judge.separable(columns) and self._refusal(model) is None

    def _refusal(self, model: tuple[Term, ...]) -> str | None:
        """Why the run cannot carry these terms."""
        return refusal(model, self.judge.whole.part([self.place[each] for each in model]), self.judge.n)

    def _taken(self, tried: Sequence[_Group]) -> Iterator[_Move]:
        """All that may be added."""
        for each in self._fresh(tried):
            yield _Move("taken", _names(each), f"{_sentences(each)}; {_BETTER}", (*self.chosen, *each))

    def _moves(self, tried: Sequence[_Group]) -> Iterator[_Move]:
        """All changes of a single term, or of both tilts."""
        yield from self._taken(tried)
        only_base = all(geometric(each) for each in self.chosen)
        there = [each for each in tried if set(each) <= set(self.chosen)]
        for old in there:
            if geometric(old[0]) and not only_base:
                continue
            rest = tuple(each for each in self.chosen if each not in old)
            yield _Move("dropped", _names(old), f"the others have made it needless; {_BETTER}", rest)
            for new in () if geometric(old[0]) else self._fresh(tried):
                why = f"{_sentences(new)}, in place of {_names(old)}; {_BETTER}"
                yield _Move("exchanged", _names(new), why, (*rest, *new))

    def _pairs(self, tier: Sequence[_Group]) -> Iterator[_Move]:
        """Two of a tier together: each alone may be of no use, as collimation without non-perpendicularity."""
        for one, other in combinations(self._fresh(tier), 2):
            why = f"{_sentences((*one, *other))}, neither of use alone; {_BETTER}"
            yield _Move("taken", _names((*one, *other)), why, (*self.chosen, *one, *other))

    def _fresh(self, tried: Sequence[_Group]) -> list[_Group]:
        return [each for each in tried if not set(each) & set(self.chosen)]

    def _inseparable(self, model: tuple[Term, ...]) -> str:
        """Why terms cannot be fitted together; empty where they can."""
        try:
            refuse_degenerate(model, self.fit.model.frame)
        except PointingError as error:
            return str(error)
        if self.judge.separable([self.place[each] for each in model]):
            return ""
        return f"{self.judge.n} observations do not tell it apart from the chosen terms: observe more of the sky"

    def _step(self, action: Action, name: str, delta_bic: float, why: str) -> Step:
        return Step(action, name, delta_bic, self.cv, self.rms, why)

    def _left(self, each: _Group) -> Step:
        """What a candidate that was left would do with the chosen terms."""
        model, name = (*self.chosen, *each), _names(each)
        if inseparable := self._inseparable(model):
            return Step("left", name, math.nan, math.nan, math.nan, inseparable)
        bic, cv, rms = self._judged(model)
        delta, worth = bic - self.bic, sum(self.worth[one] for one in each)
        refused = self._refusal(model)
        if delta > -worth:
            why = f"it explains too little: BIC changes by {delta:+.1f}, to be taken by {-worth:+.0f}"
        elif refused is not None:
            why = refused
        elif not cv < self.cv:
            why = f"it overfits: patches left out are predicted to {cv:.2f}″ instead of {self.cv:.2f}″"
        else:
            why = "it was there before, and other terms together do as well"
        return Step("left", name, delta, cv, rms, why)


def _groups(listed: Sequence[Term], run: PointingRun) -> list[_Group]:
    """Each term by itself, but both tilts of axis 1 together."""
    tilts = tuple(each for each in listed if each.name in TILTS[run.mount])
    alone: list[_Group] = [(each,) for each in listed if each not in tilts]
    return [*alone, tilts] if tilts else alone


def _names(listed: Sequence[Term]) -> str:
    return " ".join(each.name for each in listed)


def _sentences(listed: Sequence[Term]) -> str:
    return ", and ".join(each.sentence for each in listed)


def _html_row(step: Step) -> str:
    numbers = (f"{step.delta_bic:+.1f}", f"{step.cv_sky_rms_arcsec:.2f}″", f"{step.sky_rms_arcsec:.2f}″")
    cells = (step.action, step.term, *numbers, step.why)
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"
