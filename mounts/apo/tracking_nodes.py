"""How close the nodes of a path must lie, so that a controller's cubic stays within a milliarcsecond of it.

Through exact positions and velocities h apart, a cubic errs by at most |x⁗| h⁴/384 (the Hermite remainder), in the
middle. The fourth derivative is told by third differences of the path's own velocity, asked at two spacings, of which
the larger answer counts.
"""

from collections.abc import Callable

LONGEST_S = 5.0
"""Between two nodes; a controller is never left alone for longer."""
SHORTEST_S = 0.05
_MOST_DEG = 1e-3 / 3600.0
_REMAINDER = 384.0
_SAFE = 2.0  # the derivative may grow within the interval
_ROUNDS = 6

Where = Callable[[float], tuple[float, float]]
"""Position and velocity at a time, degrees and degrees per second."""


def interval_s(where: Where, when: float) -> float:
    """Seconds from a node at `when` to the next: at most 5, and such that the cubic errs by at most 1 mas.

    Parameters
    ----------
    where : callable
        The path.
    when : float
        POSIX seconds.
    """
    h = LONGEST_S
    for _ in range(_ROUNDS):
        strays = strays_deg(where, when, h) * _SAFE
        if strays <= _MOST_DEG:
            return h
        h = max(SHORTEST_S, h * min(0.7, (_MOST_DEG / strays) ** 0.25))
        if h == SHORTEST_S:
            break
    return h


def strays_deg(where: Where, when: float, span: float) -> float:
    """By how many degrees a cubic errs at most between nodes at `when` and `span` seconds later."""
    return max(_fourth(where, when, span, 2), _fourth(where, when, span, 1)) * span**4 / _REMAINDER


def _fourth(where: Where, when: float, span: float, sixths: int) -> float:
    """Largest fourth derivative of the position from `when` on, degrees per second⁴, by steps of so many sixths."""
    sixth = span / 6.0
    v0, v1, v2, v3 = (where(when + k * sixths * sixth)[1] for k in range(4))
    return abs(v3 - 3.0 * v2 + 3.0 * v1 - v0) / (sixths * sixth) ** 3
