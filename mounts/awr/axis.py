"""One axis of the unit as its driver knows it: its drive goes on, and keys move it on top of that.

Where it is follows from the rate of its drive and from how long each key moved it, by the two events of every motion.
"""

from typing import TYPE_CHECKING

from mounts.awr.cascade import Press
from mounts.awr.settings import CLOCK_UNCERTAINTY
from mounts.awr.uncertainty import TWO_SIDED_95, Way
from mounts.reckoning import Motion, Reckoned, Reckoning

if TYPE_CHECKING:
    from collections.abc import Callable


class AwrAxis:
    """One axis.

    Parameters
    ----------
    index : int
        0 or 1.
    counts, time, uncertainty : float
        Where it was, when, and within how many steps in 95 of 100 cases.
    turned : int
        The sense in which a key moved it last; 0 where nobody knows.
    """

    def __init__(self, index: int, counts: float, time: float, uncertainty: float, turned: int = 0) -> None:
        self.index = index
        self.turned = turned
        self.led: Callable[[float], None] = lambda steps: None  # noqa: ARG005 - until somebody wants to know
        """Told how many steps each key moved it."""
        self._rate = 0.0
        self._reckoning = Reckoning(counts, time, uncertainty, 0.0, CLOCK_UNCERTAINTY)
        self.press: Press | None = None
        """The key that is or was to be held, until its motion has ended."""
        self._begun: tuple[float, Reckoned] | None = None

    @property
    def rate(self) -> float:
        """Steps a second of its drive."""
        return self._rate

    def at(self, time: float) -> Reckoned:
        """Where it is."""
        return self._reckoning.at(time)

    def drives_at(self, rate: float, time: float) -> None:
        """Its drive goes at another rate from a time on."""
        self._rate = rate
        self._reckoning.goes_on(rate, time)

    def pressed(self, press: Press, time: float) -> None:
        """A key moves it from a time on, as far as is known yet."""
        self.press, self.turned = press, press.sign
        self._begun = time, self.at(time)
        self._reckoning.moves(Motion(time, press.duration, press.made, suspends=False))

    def began(self, time: float) -> None:
        """Its motion began then."""
        if self.press is not None and self._begun is not None:
            before = self._begun[1].counts + self._rate * (time - self._begun[0])
            self._reckoning.halted(before, time, self._begun[1].uncertainty)
            self.pressed(self.press, time)

    def ended(self, way: Way, time: float) -> None:
        """Its motion is over, and how far it went is known."""
        if self._begun is None:
            return
        begin, start = self._begun
        drifted = self._rate * (time - begin)
        spread = (start.uncertainty + abs(drifted) * CLOCK_UNCERTAINTY) ** 2 + (TWO_SIDED_95 * way.sigma) ** 2
        self._reckoning.halted(start.counts + drifted + way.steps, time, spread**0.5)
        self.press = self._begun = None
        self.led(way.steps)

    def known(self, counts: float, time: float, uncertainty: float) -> None:
        """It is known where it is; whatever moved it is over."""
        self._reckoning.halted(counts, time, uncertainty)
        self.press = self._begun = None
