"""One axis of the unit as its driver knows it: its drive goes on, and keys move it on top of that.

Where it is follows from the rate of its drive, from how long each key moved it, by the two events of every motion,
and from where in the play of its gears the motor stands.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

from mounts.awr.cascade import Press
from mounts.awr.play import Play
from mounts.awr.settings import CLOCK_UNCERTAINTY
from mounts.awr.uncertainty import TWO_SIDED_95, Way
from mounts.reckoning import Motion, Reckoned, Reckoning

if TYPE_CHECKING:
    from collections.abc import Callable

_NONE = Play()


class _Start(NamedTuple):
    """An axis as a press began: POSIX seconds, the reckoning of its motor, and its side of the play."""

    time: float
    motor: Reckoned
    side: float


class AwrAxis:
    """One axis.

    Parameters
    ----------
    index : int
        0 or 1.
    counts, time, uncertainty : float
        Where it was, when, and within how many steps in 95 of 100 cases.
    side : float
        Where its motor stood in the play then, `Play`; 0 where nobody knows.
    """

    def __init__(self, index: int, counts: float, time: float, uncertainty: float, side: float = 0.0) -> None:
        self.index = index
        self.play = Play()
        """That of its gears, as far as the unit does not take it up."""
        self.led: Callable[[float], None] = lambda steps: None  # noqa: ARG005 - until somebody wants to know
        """Told how many steps each key moved it."""
        self.unsure: Callable[[], float] = lambda: 0.0
        """By how many steps a second the key that moves it may be off, all the time the same way."""
        self._rate = 0.0
        self._reckoning = Reckoning(counts, time, uncertainty, 0.0, CLOCK_UNCERTAINTY)
        self._since, self._counts, self._side = time, counts, side  # when the motor was reckoned with the axis, where
        self._known = side or None  # at which side the axis was known last
        self.press: Press | None = None
        """The key that is or was to be held, until its motion has ended."""
        self._begun: _Start | None = None

    @property
    def rate(self) -> float:
        """Steps a second of its drive."""
        return self._rate

    def at(self, time: float) -> Reckoned:
        """Where it is."""
        motor = self._reckoning.at(time)
        if self.play == _NONE:
            return motor
        side = self.side(time)
        doubt = math.hypot(motor.uncertainty, self._doubt(side))
        return motor._replace(counts=motor.counts - self._fallen(side), uncertainty=doubt)

    def side(self, time: float) -> float:
        """Where its motor stands in the play."""
        if time < self._since:
            return self._side
        motor = self._reckoning.at(time).counts
        if self.press is None or self._begun is None or time <= self._begun.time:
            return self._gap.pushed(self._side, motor - self._counts)
        return self._gap.pressed(self._begun.side, motor - self._begun.motor.counts, self.press.key, self._rate)

    @property
    def _gap(self) -> Play:
        """What its motor crosses from side to side."""
        return self.play if self._known is not None else self.play.unblipped

    def slack(self, time: float, sense: float) -> float:
        """Steps that its motor goes in a sense before it follows, where no drive takes them up before long."""
        return 0.0 if self.play.settles(self._rate) else self.play.slack(self.side(time), sense)

    def falls(self, time: float) -> float:
        """Steps, signed as its drive, by which it will yet fall behind that, where that takes up the play soon."""
        if not self.play.settles(self._rate):
            return 0.0
        return math.copysign(1.0, self._rate) * self.play.slack(self.side(time), self._rate)

    def settled(self, time: float) -> bool:
        """Whether it surely goes with its drive, where that takes up the play soon."""
        return not self.play.settles(self._rate) or self.side(time) == math.copysign(1.0, self._rate)

    def has(self, play: Play, time: float) -> None:
        """Its gears are found to have another play, from a time on."""
        self._settle(time)
        self.play = play

    def drives_at(self, rate: float, time: float, unsure: float = 0.0) -> None:
        """Its drive goes at another rate from a time on, which may be another one by a fraction."""
        self._settle(time)
        if self.press is None and self._reckoning.rate_uncertainty != CLOCK_UNCERTAINTY + unsure:
            here = self._reckoning.at(time)
            self._reckoning.halted(here.counts, time, here.uncertainty)
            self._reckoning.rate_uncertainty = CLOCK_UNCERTAINTY + unsure
        self._rate = rate
        self._reckoning.goes_on(rate, time)

    def pressed(self, press: Press, time: float) -> None:
        """A key moves it from a time on, as far as is known yet."""
        self._settle(time)
        self.press = press
        self._begun = _Start(time, self._reckoning.at(time), self._side)
        self._reckoning.moves(Motion(time, press.duration, press.made, suspends=False))

    def began(self, time: float) -> None:
        """Its motion began then."""
        if self.press is not None and self._begun is not None:
            begin, motor, side = self._begun
            self._stands(motor.counts + self._rate * (time - begin), time, motor.uncertainty, side)
            self.pressed(self.press, time)

    def shortened(self, press: Press) -> None:
        """The key that moves it was released before its time."""
        if self._begun is not None:
            self.press = press
            self.began(self._begun.time)

    def ended(self, way: Way, time: float) -> None:
        """Its motion is over, and how far it went is known."""
        if self._begun is None or self.press is None:
            return
        begin, start, side = self._begun
        drifted = self._rate * (time - begin)
        after = self._gap.pressed(side, drifted + way.steps, self.press.key, self._rate)
        fallen = self.play.lag(after) - self.play.lag(side)
        before = start.uncertainty + abs(drifted) * self._reckoning.rate_uncertainty
        spread = math.hypot(before, TWO_SIDED_95 * way.sigma) + self.unsure() * max(0.0, time - begin)
        self._stands(start.counts + drifted + way.steps - fallen, time, spread, after)
        self.press = self._begun = None
        self.led(way.steps)

    def leads(self, time: float) -> float:
        """Steps, signed, by which the key that moves it will have done so, if it is released by then."""
        if self.press is None or self._begun is None:
            return 0.0
        return self.press.key.way(min(self.press.hold, time - self._begun.time))

    def known(self, counts: float, time: float, uncertainty: float) -> None:
        """It is known where it is; whatever moved it is over."""
        side = self.side(time)
        self._stands(counts, time, uncertainty, side)
        self._known = side if self._known is not None or abs(side) == 1.0 else None
        self.press = self._begun = None

    def forget_side(self) -> None:
        """Nobody knows where its motor stands in the play, as what moved it was not told, or cut short."""
        self._side, self._known = 0.0, None
        if self._begun is not None:
            self._begun = self._begun._replace(side=0.0)

    def _stands(self, counts: float, time: float, uncertainty: float, side: float) -> None:
        self._reckoning.halted(counts, time, uncertainty)
        self._since, self._counts, self._side = time, counts, side

    def _settle(self, time: float) -> None:
        """From now on its motor is reckoned from where the axis is."""
        if self.press is not None:
            return
        motor, side = self._reckoning.at(time), self.side(time)
        counts = motor.counts - self._fallen(side)
        self._reckoning.known(counts, time, motor.uncertainty)
        self._since, self._counts, self._side = time, counts, side

    def _fallen(self, side: float) -> float:
        """Steps by which it fell behind its motor since that was reckoned."""
        return self.play.lag(side) - self.play.lag(self._side)

    def _doubt(self, side: float) -> float:
        """Steps, in 95 of 100 cases, by which the play makes unsure where it is."""
        if self._known is None:  # it was at either side then, and a blip was made too much or left out
            return abs(self.play.steps) / 2.0 + self.play.blip if side else 0.0
        return TWO_SIDED_95 * self.play.doubt(side, self._known)
