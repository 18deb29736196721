"""A key that is held, when the unit heard of it, and what it told of the motion.

A motion whose events both come is measured by them. One whose beginning or end is not told is known from when its key
was pressed and released, less well, as long as something shows that it was made: that it was told to move, or that it
was told to stand when it should.
"""

import math
from dataclasses import dataclass, replace

from mounts.awr.cascade import Press
from mounts.awr.uncertainty import TWO_SIDED_95, Jitter, Way
from mounts.awr.unit import Happened, Heard

TOLD_S = 0.25  # after its time in which an event must have come
_STRANGE_S = 0.03  # beside the jitter, by which a motion may last otherwise than its key
_SIGMAS, _EARLY_S = 5.0, 0.01
_DOUBTFUL = 2.5  # standard deviations, by which key and events seldom say otherwise of one motion
_SURELY = 3.5  # of them, by which a motion was longer than its first release says
_NEVER = Heard(math.nan, math.nan)


@dataclass
class Held:
    """A key of a stage.

    Attributes
    ----------
    press : Press
        As it was or is to be held.
    pressed : Heard
        When that was heard.
    released, again : Heard
        When its release was heard, and once more where nothing told that it stands.
    began : Happened, optional
        The event of its beginning.
    moves : bool
        It was told to move, though nobody knows since when.
    early_s : float
        Seconds by which its motion may have begun earlier than its event says, while the delay of keys is not known.
    """

    press: Press
    pressed: Heard = _NEVER
    released: Heard = _NEVER
    again: Heard = _NEVER
    began: Happened | None = None
    moves: bool = False
    early_s: float = 0.0
    later: tuple[float, ...] = ()  # POSIX seconds at which it was released, each time but the first

    @property
    def is_pressed(self) -> bool:
        """Whether the unit heard that."""
        return not math.isnan(self.pressed.first)

    @property
    def is_released(self) -> bool:
        """Whether the unit heard that."""
        return not math.isnan(self.released.first)

    @property
    def is_again(self) -> bool:
        """Whether it was released once more."""
        return not math.isnan(self.again.first)

    @property
    def repeated(self) -> float:
        """POSIX seconds at which it was released last, where that was more than once."""
        return self.later[-1] if self.later else math.nan

    @property
    def is_seen(self) -> bool:
        """Whether the unit told that it moves."""
        return self.began is not None or self.moves

    @property
    def told_s(self) -> float:
        """Seconds after its time in which the end of its motion must be told, be its ramps slower than thought."""
        return TOLD_S + 2.0 * self.press.key.climb_s

    @property
    def hold(self) -> float:
        """Seconds for which it was held, as it was sent."""
        return self.released.first - self.pressed.first

    @property
    def holds(self) -> tuple[float, float]:
        """Seconds for which it was held at least and at most, by all that was answered to its release."""
        return self.released.first - self.pressed.last, self.released.last - self.pressed.first

    def lasted(self, hold: float) -> float:
        """Seconds of the motion of such a hold."""
        return replace(self.press, hold=max(0.0, hold)).duration

    def ends(self, delay_s: float) -> float:
        """When its motion is over, once it was released; a key acts so long after it was heard."""
        began = self.pressed.first + delay_s if self.began is None else self.began.time
        return began + self.lasted(self.released.first + delay_s - began)

    def strange_s(self, jitter: Jitter) -> float:
        """Seconds by which its motion may last otherwise than its hold, and is its own."""
        return _STRANGE_S + _SIGMAS * jitter.late_s(self.press.key, self.hold)

    def begins(self, time: float, jitter: Jitter, delay_s: float, *, unsure: bool) -> float:
        """By how many seconds an event is too early (below 0) or too late for that of its beginning; 0 where not."""
        most = TOLD_S if unsure else _SIGMAS * math.hypot(jitter.press_s, jitter.stamp_s) + _EARLY_S
        late = time - delay_s
        return min(0.0, late - self.pressed.first + most) + max(0.0, late - self.pressed.last - most)

    def lasts_otherwise(self, duration: float, jitter: Jitter, *, alone: bool) -> float:
        """By how many seconds a motion was too short (below 0) or too long for its hold; 0 where it was neither."""
        if not self.is_released:
            return -math.inf
        if alone and self._by_second(duration, jitter):  # an event of both axes says less than the first release
            return 0.0
        strange, (least, most) = self.strange_s(jitter), self.holds
        return min(0.0, duration - self.lasted(least) + strange) + max(0.0, duration - self.lasted(most) - strange)

    def _by_second(self, duration: float, jitter: Jitter) -> bool:
        """Whether a motion lasted until its second release."""
        if not self.is_again:
            return False
        first, last = (each - self.pressed.first for each in self.again)
        late = jitter.late_s(self.press.key, self.hold)
        near = self.lasted(first) - _SIGMAS * late <= duration <= self.lasted(last) + _SIGMAS * late
        return near and duration > self.lasted(self.holds[1]) + _SURELY * late

    @property
    def unsure_s(self) -> float:
        """Seconds within which it is known when it was pressed, by the answer to that."""
        return self.pressed.last - self.pressed.first

    def measured(self, duration: float, jitter: Jitter) -> Way:
        """Its way by both events: seconds from the one to the other."""
        hold = self.again.first - self.pressed.first if self._by_second(duration, jitter) else self.hold
        off = abs(duration - self.lasted(hold))
        if off > self.strange_s(jitter):  # it was not the first release that was heard
            least, most = self.holds
            hold = min(max(self.press.key.held(duration), least), most)
        if hold != self.hold and off <= self.strange_s(jitter):  # what the first became on its way, nobody knows
            gap = self.again.last - self.released.first
            return Way(self.press.key.way(hold), 2.0 * abs(self.press.key.rate) * gap / TWO_SIDED_95)
        way, off = self.press.measured(jitter, duration, hold), max(off, abs(off - self.unsure_s), self.unsure_s)
        if off > _DOUBTFUL * jitter.late_s(self.press.key, hold):  # one of both was held up, and nobody knows which
            return way._replace(sigma=max(way.sigma, self.press.key.peak(hold) * off / TWO_SIDED_95))
        return way

    def most(self, duration: float, jitter: Jitter) -> float:
        """Seconds for which it was held at most that stood so long after it began, by the release that fits that."""
        near = _SIGMAS * jitter.late_s(self.press.key, self.hold)
        holds = (time - self.pressed.first for time in self.later)
        return max((hold for hold in holds if abs(duration - self.lasted(hold)) <= near), default=self.hold)

    def planned(self, jitter: Jitter, most: float = 0.0) -> Way:
        """Its way by when it was pressed and released alone, held for `most` seconds at most where that is more."""
        way = replace(self.press, hold=self.hold).planned(jitter)
        unsure = self.unsure_s + max(self.released.last - self.released.first, most - self.hold)
        return way._replace(sigma=way.sigma + abs(self.press.key.rate) * unsure / TWO_SIDED_95)

    def doubt(self, jitter: Jitter) -> float:
        """Steps within which it is of its plan while it moves, in 95 of 100 cases."""
        unsure = self.unsure_s + self.early_s
        unsure += self.released.last - self.released.first if self.is_released else 0.0
        return TWO_SIDED_95 * self.press.planned(jitter).sigma + abs(self.press.key.rate) * unsure

    def fits_end(self, time: float, jitter: Jitter, delay_s: float) -> bool:
        """Whether it should come to stand at a time, by when it was pressed and released."""
        least, most = self.holds
        strange, since = self.strange_s(jitter), self.pressed.first + delay_s
        return self.lasted(least) - strange <= time - since <= self.lasted(most) + strange
