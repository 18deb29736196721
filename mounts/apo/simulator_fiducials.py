"""The fiducials of a simulated axis, and the corrections made by them.

Where a fiducial truly is, is known; what the position is off there is the error, and the mean of the errors at both
edges is what is added to the position at the second. Edges are found between two samples of the servo.
"""

from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from mounts.apo.simulator_path import Piece
from mounts.apo.simulator_settings import AxisHardware

KEPT = 20
_HALVINGS = 40


@dataclass
class Fiducials:
    """What has been seen of them.

    Attributes
    ----------
    hardware : AxisHardware
        Where they are, and what error is corrected.
    on : bool
        Whether corrections are made (MS.ON).
    off_at : float, optional
        The count at which they end.
    saved : float, optional
        The error of the last fiducial, not yet corrected.
    too_large : bool
        Whether that was too large to be corrected by itself.
    passages : deque
        Rows of MS.DUMP: count, position, velocity, error, edge (0 rising, 1 falling), correction.
    entered : tuple, optional
        The number of the edge by which a fiducial was entered, and the error there.
    """

    hardware: AxisHardware
    on: bool = False
    off_at: float | None = None
    saved: float | None = None
    too_large: bool = False
    passages: deque[list[float]] = field(default_factory=lambda: deque(maxlen=KEPT))
    entered: tuple[int, float] | None = None

    def __post_init__(self) -> None:
        half = self.hardware.fiducial_width_deg / 2.0
        self._edges = [place + side for place in sorted(self.hardware.fiducials_deg) for side in (-half, half)]

    @property
    def edges(self) -> list[float]:
        """True positions of all edges, degrees, rising; two to a fiducial."""
        return self._edges

    def switch(self, *, on: bool, off_at: float | None = None) -> None:
        """MS.ON, MS.OFF, MS.OFF time; each forgets a pending end."""
        self.on, self.off_at = on, off_at

    def is_on(self, count: float) -> bool:
        """Whether corrections are made at a count."""
        if self.off_at is not None and count >= self.off_at:
            self.switch(on=False)
        return self.on

    def take_saved(self) -> float:
        """Return what the last fiducial wants added, and forget it."""
        correction, self.saved, self.too_large = self.saved or 0.0, None, False
        return correction

    def cross(self, motion: Piece, slip: float) -> float:
        """Note the edges passed on this motion; return what is to be added to the position.

        Parameters
        ----------
        motion : Piece
            The motion, in positions as the controller believes them.
        slip : float
            The true position minus the one believed.
        """
        correction = 0.0
        begin, end = motion.at(motion.start)[0] + slip, motion.at(motion.end)[0] + slip
        first, last = bisect_left(self._edges, min(begin, end)), bisect_left(self._edges, max(begin, end))
        numbers = range(first, last)
        for number in numbers if begin < end else reversed(numbers):
            correction += self._pass(motion, number, self._edges[number] - slip, slip)
        return correction

    def _pass(self, motion: Piece, number: int, believed: float, error: float) -> float:
        time = _time_at(motion, believed)
        leaves = self.entered is not None and self.entered[0] == number ^ 1  # by the other edge of the same fiducial
        correction = 0.0
        if leaves and self.entered:
            mean = (error + self.entered[1]) / 2.0
            self.too_large = abs(mean) > self.hardware.fiducial_threshold_deg
            self.saved = mean
            if self.is_on(time) and not self.too_large:
                correction = self.take_saved()
        self.entered = None if leaves else (number, error)
        self.passages.append([time, believed, motion.at(time)[1], error, float(leaves), correction])
        return correction

    def state(self) -> dict[str, Any]:
        """Return the state as JSON-able values."""
        return {
            "on": self.on,
            "off_at": self.off_at,
            "saved": self.saved,
            "too_large": self.too_large,
            "passages": [list(row) for row in self.passages],
            "entered": None if self.entered is None else list(self.entered),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to a state."""
        self.on, self.off_at, self.saved = state["on"], state["off_at"], state["saved"]
        self.too_large, entered = state["too_large"], state["entered"]
        self.passages = deque((list(row) for row in state["passages"]), maxlen=KEPT)
        self.entered = None if entered is None else (entered[0], entered[1])


def _time_at(motion: Piece, place: float) -> float:
    """The time at which a motion, whose ends lie on both sides of it, passes a place."""
    low, high = motion.start, motion.end
    rising = motion.at(high)[0] > place
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        if (motion.at(middle)[0] > place) == rising:
            high = middle
        else:
            low = middle
    return high
