"""Terms that no observation can tell apart, told by name before and after a fit has seen the run.

Before: the first-order effects of the terms at coefficients of zero, at places all over the sky in both postures. A
term whose effect is a combination of others' there has it everywhere. After: the combination that the run itself did
not see.
"""

import math
from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.place import Frame
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import Term

Array = NDArray[np.float64]

_PLACES = 90  # in each posture
_LOWEST, _HIGHEST = math.radians(5.0), math.radians(87.0)  # elevations
_SAME = 1e-9  # of an effect; what is left of it beside the others' when it is a combination of them
_TOLD_APART = 0.1  # share of a term in the unseen combinations below which it is not to blame


def refuse_degenerate(terms: Sequence[Term], frame: Frame) -> None:
    """Refuse free terms that are the same whatever is observed.

    Raises
    ------
    PointingError
        Names the terms, why they are the same, and what to leave out.
    """
    found = combination(tuple(terms), frame)
    if found is None:
        return
    term, others = found
    like = " and ".join(_multiple(factor, other.name) for other, factor in others)
    names = ", ".join([*(other.name for other, _ in others), term.name])
    raise PointingError(
        f"{names} cannot be told apart: {term.name} displaces like {like} everywhere; leave one of "
        "them out or hold it fixed"
    )


@lru_cache(maxsize=256)
def combination(terms: tuple[Term, ...], frame: Frame) -> tuple[Term, tuple[tuple[Term, float], ...]] | None:
    """Return the first term that is a combination of those before it, and the factors of these; None without one."""
    terms = tuple(term for term in terms if _effect(term, frame).any())  # without effect here: the run will tell
    if not terms:
        return None
    effects = np.stack([_effect(term, frame) for term in terms], axis=1)
    sizes = np.linalg.norm(effects, axis=0)
    triangle = np.asarray(np.linalg.qr(effects / sizes, mode="r"))
    left = np.flatnonzero(np.abs(np.diag(triangle)) < _SAME)
    if not left.size:
        return None
    j = int(left[0])
    shares = np.linalg.solve(triangle[:j, :j], triangle[:j, j])
    factors = shares * sizes[j] / sizes[:j]
    taking_part = np.abs(shares) > math.sqrt(_SAME)
    return terms[j], tuple(
        (other, float(factor)) for other, factor, takes in zip(terms, factors, taking_part, strict=False) if takes
    )


def refuse_inseparable(terms: Sequence[Term], shares: Array, n: int) -> None:
    """Refuse free terms that this run does not tell apart.

    Parameters
    ----------
    terms : sequence of Term
        The free terms.
    shares : (k,) array
        Of each in the combinations that the run does not see.
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


def _multiple(factor: float, name: str) -> str:
    """As it stands in a sum: −0.766·HCEC."""
    sign = "−" if factor < 0.0 else ""
    return f"{sign}{name}" if math.isclose(abs(factor), 1.0, rel_tol=1e-6) else f"{sign}{abs(factor):.3g}·{name}"


@lru_cache(maxsize=1024)
def _effect(term: Term, frame: Frame) -> Array:
    """On-sky displacements by a coefficient of one at first order: (4·places,)."""
    lon, lat = _places(frame)
    _, _, jacobian = PointingModel(frame.kind, frame.latitude, (term,), (0.0,)).star_and_jacobian(lon, lat)
    along, up, _ = np.broadcast_arrays(*jacobian.by_coefficient[0], lon)
    return np.concatenate((along, up))


@cache
def _places(frame: Frame) -> tuple[Array, Array]:
    """Mechanical coordinates of places spread evenly over the sky, in both postures."""
    i = np.arange(_PLACES)
    azimuth = math.pi * (3.0 - math.sqrt(5.0)) * i
    elevation = np.arcsin(np.interp((i + 0.5) / _PLACES, (0.0, 1.0), (math.sin(_LOWEST), math.sin(_HIGHEST))))
    lon, lat = azimuth, elevation
    if frame.equatorial:  # azimuth and elevation are hour angle and declination with the poles exchanged
        turned = Frame("altazimuth", frame.latitude).place(azimuth, elevation)
        lon, lat = turned.angle("H")[0], turned.angle("D")[0]
    both = zip((lon, lat), frame.beyond_the_pole(lon, lat), strict=True)
    normal_and_beyond = tuple(np.concatenate(pair) for pair in both)
    return normal_and_beyond[0], normal_and_beyond[1]
