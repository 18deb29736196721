"""Bounds on something that is not known better."""

from typing import NamedTuple

_INSIDE = 0.25  # of an interval's width, by which a value is moved beyond its edge


class Interval(NamedTuple):
    """Between two values."""

    low: float
    high: float

    def nearest(self, value: float) -> float:
        """`value` where it lies inside, else moved just far enough to lie well inside."""
        if self.low <= value <= self.high:
            return value
        inside = _INSIDE * (self.high - self.low)
        return min(max(value, self.low + inside), self.high - inside)

    def within(self, other: "Interval") -> "Interval | None":
        """What both have in common."""
        low, high = max(self.low, other.low), min(self.high, other.high)
        return Interval(low, high) if low <= high else None
