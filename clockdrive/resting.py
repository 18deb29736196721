"""A telescope at rest, as a path: for a drive that tracks on whatever it is told, and must be held."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class Rest:
    """Both axes stay where they are; keeps `mounts.drive.AxisPath`."""

    counts: tuple[float, float]
    led: ClassVar[bool] = False
    axes: ClassVar[int] = 2

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:  # noqa: ARG002
        """(counts, counts per second) of each axis, which is the same at any time."""
        one, two = self.counts
        return (one, 0.0), (two, 0.0)

    def axis_at(self, axis: int, time: float) -> tuple[float, float]:  # noqa: ARG002 - likewise
        """The same of one axis."""
        return self.counts[axis], 0.0
