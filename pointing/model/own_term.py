"""A term of one's own: any function of the mechanical coordinates, that moves what a generic term can move."""

import re
from collections.abc import Callable

import numpy as np

from pointing.errors import PointingError
from pointing.model.amount import OwnFunction
from pointing.model.functions import Real
from pointing.model.results import RESULTS
from pointing.model.terms import Term, known

_NAME = re.compile(r"[A-Z][A-Z0-9_]*")


def own_term(name: str, result: str, function: Callable[[Real, Real], Real], sentence: str = "") -> Term:
    """Make a term of a function of one's own.

    Parameters
    ----------
    name : str
        A word of letters and digits that no other term has.
    result : str
        What it moves: a key of `RESULTS`, such as H, D, X on an equatorial and A, E, S on an altazimuth mount.
    function : callable
        (lon, lat) → amount for a coefficient of one; mechanical coordinates in radians, in the turn that
        `pointing.model.place` tells however the axes are wound; floats or arrays alike: made of NumPy's functions.
    sentence : str
        What it stands for on the telescope.

    Returns
    -------
    Term
        To be listed beside the others: `fit(run, ["IH", "ID", own])`.

    Raises
    ------
    PointingError
        The name is taken or no word, there is no such result, or the function does not take arrays.
    """
    wanted = name.strip().upper()
    if not _NAME.fullmatch(wanted):
        raise PointingError(f"{name!r} is no name for a pointing term: give letters and digits, a letter first")
    if known(wanted):
        raise PointingError(f"{wanted} is a pointing term already: give one's own another name")
    if result not in RESULTS:
        listed = ", ".join(f"{letter} ({each.sentence})" for letter, each in RESULTS.items())
        raise PointingError(f"the term {wanted} is to move {result!r}: possible are {listed}")
    _try_out(wanted, function)
    return Term(wanted, result, (OwnFunction(function),), sentence or "a term of one's own", own=True)


def _try_out(name: str, function: Callable[[Real, Real], Real]) -> None:
    """Refuse a function that does not give a finite number for one place and for each of an array."""
    lon, lat = np.array([0.3, -2.0]), np.array([0.7, 2.0])
    try:
        many = np.broadcast_to(np.asarray(function(lon, lat), float), lon.shape)
        each = [float(function(*place)) for place in zip(lon.tolist(), lat.tolist(), strict=True)]
    except (TypeError, ValueError) as error:
        raise PointingError(
            f"the function of the term {name} does not take floats and arrays alike ({error}): make it of NumPy's "
            "functions"
        ) from error
    if not np.allclose(many, each, rtol=1e-9, atol=1e-12):
        raise PointingError(
            f"the function of the term {name} gives {many[0]:g} for a place in an array and {each[0]:g} for the same "
            "place alone: it must treat both alike, and be finite"
        )
