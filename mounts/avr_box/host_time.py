"""Between a clock that nobody sets, by which the moves of a box are timed, and the computer's, by which paths go."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from mounts.drive import AxisPath, AxisSlew


@dataclass(frozen=True)
class SeenSooner:
    """A path by a clock that is so many seconds behind that of the path."""

    path: AxisPath
    behind: float

    @property
    def led(self) -> bool:
        """As of the path."""
        return self.path.led

    @property
    def axes(self) -> int:
        """As of the path."""
        return self.path.axes

    def at(self, time: float) -> Sequence[tuple[float, float]]:
        """(counts, counts per second) of each axis."""
        return self.path.at(time + self.behind)

    def axis_at(self, axis: int, time: float) -> tuple[float, float]:
        """The same of one axis."""
        return self.path.axis_at(axis, time + self.behind)


def sooner(slews: Sequence[AxisSlew], by: float) -> list[AxisSlew]:
    """Slews that were planned to arrive so much sooner."""
    return [replace(slew, arrival=None if slew.arrival is None else slew.arrival - by) for slew in slews]
