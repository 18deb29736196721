"""Where a telescope is held whose drive tracks on whatever it is told.

It is held where it stands when everything else has ended: no hold leads back over a way that anything else made, for
no path is checked on it. Axis 2 stands by itself.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from clockdrive.safety import moved_by_others
from mounts.drive import Capabilities, Reading
from pointing.plan import Axis
from pointing.planner import Planner

_HOLDS = 2.0  # widths of the holding beyond which it was moved by something else
_MOVED = (
    "{} was found {:.2f}° from where it rested, moved by nothing that this program sent; it rests where it is now, "
    "and nothing leads it back but `goto` or `park`"
)
_PARTS = 8  # of a width, that are left before the limit ahead: four seconds of tracking


@dataclass(frozen=True)
class Rest:
    """A place as a path, of axis 1 alone; keeps `mounts.drive.AxisPath`."""

    counts: tuple[float, float]
    led: ClassVar[bool] = False
    axes: ClassVar[int] = 1

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:  # noqa: ARG002
        """(counts, counts per second) of each axis, which is the same at any time."""
        one, two = self.counts
        return (one, 0.0), (two, 0.0)

    def axis_at(self, axis: int, time: float) -> tuple[float, float]:  # noqa: ARG002 - likewise
        """The same of one axis."""
        return self.counts[axis], 0.0


class Holding:
    """Where one telescope is held.

    Parameters
    ----------
    planner : Planner
        Knows the travel of the axes.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.rest: Rest | None = None
        """Where it is held; None while it is not."""

    def end(self) -> None:
        """Hold it no more."""
        self.rest = None

    def moved(self, reading: Reading, capabilities: Capabilities) -> str:
        """How far it was moved from where it was held, as people read it, and give that place up; or nothing."""
        if self.rest is None:
            return ""
        for axis, read, held in zip(self._planner.axes, reading.axes, self.rest.counts, strict=False):
            off = abs(read.counts - held)
            if off > _HOLDS * capabilities.rests_within + read.uncertainty_counts:
                self.end()
                return _MOVED.format(axis.name, abs(off * axis.gearing.step_deg_float))
        return ""

    def at(self, reading: Reading, capabilities: Capabilities) -> Rest | None:
        """Where to hold it now; None while something else moves it still."""
        if any(axis.slewing for axis in reading.axes) or moved_by_others(reading):
            self.end()
        elif self.rest is None:
            self.rest = Rest(place(self._planner, reading.counts, capabilities, reading.time))
        return self.rest


def place(
    planner: Planner, counts: tuple[float, float], capabilities: Capabilities, time: float
) -> tuple[float, float]:
    """`inside` of its travel, and as far on as keeps the holding clear of what `counts` is clear of at a time.

    Horizon and Sun may forbid the far end of the holding where they allow the place: it is then held a width later,
    to where its own tracking takes it. What comes to it while it is held, as the Sun, comes to all that rests.
    """
    one, two = inside(planner.axes[0], counts, capabilities)
    width = math.copysign(capabilities.rests_within, capabilities.goes_on_at)

    def worse(end: float) -> bool:
        failed, allowed = (
            {check.name for check in planner.standing(planner.angles((here, two)), time) if not check.ok}
            for here in (end, one)
        )
        return bool(failed - allowed)

    onwards = inside(planner.axes[0], (one + width, two), capabilities)[0]
    return (onwards, two) if worse(one - width) and not worse(onwards) else (one, two)


def inside(axis: Axis, counts: tuple[float, float], capabilities: Capabilities) -> tuple[float, float]:
    """The place nearest to `counts` from which axis 1 can be held within its travel; `counts` itself if none is near.

    It is held to the side from which it tracks, over `rests_within`.
    """
    one, two = counts
    width = capabilities.rests_within
    behind, ahead = width, width / _PARTS
    low, high = sorted((axis.gearing.counts(axis.minimum), axis.gearing.counts(axis.maximum)))
    before, after = (behind, ahead) if capabilities.goes_on_at > 0.0 else (ahead, behind)
    place = min(max(one, low + before), high - after)
    return (place if abs(place - one) <= _HOLDS * width else one), two
