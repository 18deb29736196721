"""What a person is told of a fit: coefficients, statistics, and what to beware of. As text and as HTML."""

from collections.abc import Iterator
from html import escape
from itertools import combinations, pairwise
from typing import TYPE_CHECKING

from pointing.errors import PointingError
from pointing.model.outliers import far_off
from pointing.model.possible import refuse_nonsense

if TYPE_CHECKING:
    from pointing.model.fitted import Coefficient, Fit

CONDITION = 30.0  # of the scaled design above which terms share what they explain
CORRELATION = 0.95  # of two coefficients that are hardly told apart
_MASKED = 0.1  # share of a run beyond which what does not belong may be the model
_NAMED = 3  # observations
_HEADS = ("term", "″", "σ″", "", "what it is")


def warnings(fit: "Fit") -> tuple[str, ...]:
    """Return what to beware of in a fit, a sentence each, the gravest first."""
    return (
        *_nonsense(fit),
        *_far_off(fit),
        *_few(fit),
        *_many_masked(fit),
        *_inseparable(fit),
        *_condition(fit),
        *_unconfirmed(fit),
    )


def text(fit: "Fit") -> str:
    """The fit as plain text, a line a term."""
    rows = [_cells(fit, each) for each in fit.coefficients]
    wide = [max((len(row[i]) for row in rows), default=0) for i in range(4)]
    lines = [
        f"  {name:<{wide[0]}}  {value:>{wide[1]}}″ ± {sigma:>{wide[2]}}″  {mark:<{wide[3]}}  {sentence}".rstrip()
        for name, value, sigma, mark, sentence in rows
    ]
    return "\n".join(
        [_title(fit), *lines, _statistics(fit), *_masked(fit), *(f"beware: {each}" for each in warnings(fit))]
    )


def html(fit: "Fit") -> str:
    """The fit as a table of a notebook."""
    head = "".join(f"<th>{cell}</th>" for cell in _HEADS)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(fit, each)) + "</tr>"
        for each in fit.coefficients
    )
    beware = "".join(f"<li>{escape(each)}</li>" for each in (*_masked(fit), *warnings(fit)))
    return (
        f"<table><caption>{escape(_title(fit))}</caption><tr>{head}</tr>{rows}</table>"
        f"<p>{escape(_statistics(fit))}</p>" + (f"<ul>{beware}</ul>" if beware else "")
    )


def _title(fit: "Fit") -> str:
    caption = f"{fit.model.caption}: " if fit.model.caption else ""
    terms = f"{fit.k} term{'' if fit.k == 1 else 's'}"
    return f"{caption}{fit.model.kind} mount, {fit.n} observations, {terms} fitted"


def _cells(fit: "Fit", each: "Coefficient") -> tuple[str, str, str, str, str]:
    term = fit.model.terms[[other.name for other in fit.model.terms].index(each.name)]
    evidence = term.evidence(fit.model.kind)
    marks = ["fixed"] if each.fixed else []
    marks += ["unconfirmed"] if evidence == "unconfirmed" else []
    return each.name, f"{each.arcsec:+.3f}", f"{each.sigma_arcsec:.3f}", ", ".join(marks), term.sentence


def _statistics(fit: "Fit") -> str:
    popn_sd = f"{fit.popn_sd_arcsec:.3f}″" if fit.n > fit.k else f"unknown ({fit.n} observations for {fit.k} terms)"
    return f"sky RMS {fit.sky_rms_arcsec:.3f}″, population SD {popn_sd}, condition {fit.condition:.1f}"


def _nonsense(fit: "Fit") -> Iterator[str]:
    try:
        refuse_nonsense(fit)
    except PointingError as error:
        yield str(error)


def _many_masked(fit: "Fit") -> Iterator[str]:
    """Outliers are few; many, and in succession, are another telescope: one that was moved, or has another term."""
    count, n = len(fit.outliers), fit.n + len(fit.outliers)
    if count <= _MASKED * n:
        return
    indices = [each.index for each in fit.outliers]
    longest = length = 1
    for before, after in pairwise(indices):
        length = length + 1 if after == before + 1 else 1
        longest = max(longest, length)
    yield (
        f"{count} of {n} observations were masked, {count / n:.0%} where {_MASKED:.0%} are many, up to {longest} in "
        "succession: look whether the telescope was bumped, reset or badly read there, or a term is missing, before "
        "you trust the rest"
    )


def _far_off(fit: "Fit") -> Iterator[str]:
    found = far_off(fit)
    if found:
        named = ", ".join(f"{each.index}" + (f" (line {each.line})" if each.line else "") for each in found[:_NAMED])
        more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        yield (
            f"{len(found)} of {fit.n} observations do not belong to the others: observation {named}{more}, the "
            f"farthest {found[0].sigmas:.1f}σ off: look at them, mask them, or fit with outliers=True"
        )


def _few(fit: "Fit") -> Iterator[str]:
    if fit.n < 2 * fit.k:
        yield (
            f"{fit.n} observations for {fit.k} terms: σ says little below {2 * fit.k}; observe more stars or fit "
            "fewer terms"
        )


def _inseparable(fit: "Fit") -> Iterator[str]:
    names = [each.name for each in fit.coefficients if not each.fixed]
    pairs = combinations(range(len(names)), 2)
    close = [(i, j) for i, j in pairs if abs(fit.correlation[i, j]) > CORRELATION]
    for i, j in sorted(close, key=lambda pair: -abs(fit.correlation[pair])):
        yield (
            f"{names[i]} and {names[j]} are nearly inseparable: correlation {fit.correlation[i, j]:+.3f}; they are "
            "good together where the run has stars, and not one by one"
        )


def _condition(fit: "Fit") -> Iterator[str]:
    if fit.condition > CONDITION:
        yield (
            f"condition {fit.condition:.0f} is above {CONDITION:.0f}: some terms share what they explain; observe "
            "more of the sky (high and low, both sides of the pier) or fit fewer terms"
        )


def _unconfirmed(fit: "Fit") -> Iterator[str]:
    names = [each.name for each in fit.model.terms if each.evidence(fit.model.kind) == "unconfirmed"]
    if names:
        yield (
            f"{', '.join(names)}: no published fit confirms sign and form on this kind of mount; before other "
            "software takes the model over, compare one star"
        )


def _masked(fit: "Fit") -> Iterator[str]:
    yield from (f"masked: {each.reason}" for each in fit.outliers)
