"""What a driver is given back of what it wanted remembered, read as whatever may stand in a file by now."""

import math
from collections.abc import Callable, Mapping
from typing import TypeVar

T = TypeVar("T")

NEVER = "the position of this drive was never synchronised; `sync` on a known star"
UNREADABLE = "what was remembered of this drive's position cannot be read; `sync` on a known star"


def reinterpreted(what: str) -> str:
    """Say that counts mean other places since `what` was configured anew."""
    return (
        f"{what}, centre, sense, mount type or site were configured anew since the last sync, so counts mean other "
        "places; `sync` on a known star"
    )


def recalled(memory: Mapping[str, object], read: Callable[[Mapping[str, object]], T]) -> tuple[T | None, str]:
    """Return what `read` makes of a memory; or None, and why the position is unsynchronised.

    What `read` cannot make anything of it says by `KeyError`, `TypeError`, `ValueError` or `OverflowError`.
    """
    if not memory:
        return None, NEVER
    try:
        return read(memory), ""
    except (KeyError, TypeError, ValueError, OverflowError):
        return None, UNREADABLE


def number(stored: object) -> float:
    """Return a finite number.

    Raises
    ------
    TypeError
        It is none.
    """
    if isinstance(stored, bool) or not isinstance(stored, int | float) or not math.isfinite(stored):
        raise TypeError(stored)
    return float(stored)


def whole(stored: object) -> int:
    """Return a whole number.

    Raises
    ------
    TypeError
        It is none.
    """
    if isinstance(stored, bool) or not isinstance(stored, int):
        raise TypeError(stored)
    return stored


def text(stored: object) -> str:
    """Return a text.

    Raises
    ------
    TypeError
        It is none.
    """
    if not isinstance(stored, str):
        raise TypeError(stored)
    return stored
