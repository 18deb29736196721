"""Terms that no observation can tell apart, told by name before and after a fit has seen the run."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.amount import Beyond, Factor, OwnFunction
from pointing.model.place import MountKind
from pointing.model.terms import Term

_SETS: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"IA", "ECES", "NRX"}), "NRX displaces like −IA and −ECES together"),
    (frozenset({"NPAE", "ECEC", "NRY"}), "NRY displaces like NPAE and ECEC together"),
    (frozenset({"NP", "HCEC", "DAF"}), "DAF displaces like NP and HCEC together"),
)
_TOLD_APART = 0.1  # share of a term in the unseen combination below which it is not to blame


def refuse_degenerate(terms: Sequence[Term], kind: MountKind) -> None:
    """Refuse free terms that are the same whatever is observed.

    Raises
    ------
    PointingError
        Names the terms, why they are the same, and what to leave out.
    """
    for one, other in combinations(terms, 2):
        if _same(one, other, kind):
            raise PointingError(f"{one.name} and {other.name} are one term under two names: leave one of them out")
    names = {each.name for each in terms}
    for together, why in _SETS:
        if together <= names:
            listed = ", ".join(each.name for each in terms if each.name in together)
            raise PointingError(f"{listed} cannot be told apart: {why}; leave one of them out or hold it fixed")


def refuse_inseparable(terms: Sequence[Term], shares: NDArray[np.float64], n: int) -> None:
    """Refuse free terms that this run does not tell apart.

    Parameters
    ----------
    terms : sequence of Term
        The free terms.
    shares : (k,) array
        Of each in the combination that the run does not see.
    n : int
        Observations.

    Raises
    ------
    PointingError
        Always; names the terms and what would tell them apart.
    """
    blamed = [each.name for each, share in zip(terms, shares, strict=True) if share > _TOLD_APART]
    if len(blamed) == 1:
        raise PointingError(
            f"{blamed[0]} has no effect on any of the {n} observations: leave it out, or observe where it has one"
        )
    raise PointingError(
        f"{', '.join(blamed)} cannot be told apart by these {n} observations: leave one out, hold it fixed, or "
        "observe more of the sky (high and low, east and west, both sides of the pier)"
    )


def _same(one: Term, other: Term, kind: MountKind) -> bool:
    """Whether two terms have the same effect, the sign apart; TF of an altazimuth mount is ECEC."""
    return _canonical(one, kind) == _canonical(other, kind)


def _canonical(term: Term, kind: MountKind) -> tuple[object, ...]:
    """Result and factors, vertical displacements of an altazimuth mount written as elevation ones."""
    result, factors = term.same_as
    if kind == "altazimuth" and result == "Z":
        result, factors = "E", tuple(_from_zenith(factor) for factor in factors)
    return result, frozenset(factors), len(factors)


_COMPLEMENT = {"S": "C", "C": "S"}


def _from_zenith(factor: Factor | OwnFunction | Beyond) -> Factor | OwnFunction | Beyond:
    """A factor of Z as one of E where that is one: sin Z = cos E, cos Z = sin E."""
    if isinstance(factor, Factor) and factor.letter == "Z" and factor.number == 1 and factor.function in _COMPLEMENT:
        return Factor(_COMPLEMENT[factor.function], "E")
    return factor
