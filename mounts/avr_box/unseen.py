"""Ways that an encoder did not see: of a cable that came off, or a motor that stands.

An axis that is led on while its encoder stands is on a missed way. One is an accident, as a command that was lost;
two, one after the other, tell that the encoder sees nothing. Where the axis is believed to be plays no part in that,
for that follows the encoder.
"""

import math
from typing import NamedTuple

from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.encoders import SEEN_COUNTS

_WAY_COUNTS = 4.0  # that no rounding and no play of the gears hides: 17 s of tracking
_STANDS_COUNTS = 1  # by which an encoder that stands may be said otherwise
_OFTEN = 2  # times that it is no accident
_OFTEN_ON_A_BAD_LINE = 4  # where one command in twenty is lost, four in a row are one in 160 000


class _Stood(NamedTuple):
    """An encoder that stood."""

    said: int
    led: float  # microsteps, where the axis had been led
    time: float  # POSIX seconds


class Unseen:
    """What the encoder of one axis did not see."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """A person says where it is."""
        self._moved: _Stood | None = None  # when it last moved
        self._since: _Stood | None = None  # from when the present way counts
        self._until = -math.inf  # POSIX seconds, when the move ends that was missed: it is one, however long
        self.missed = 0
        """Ways, one after the other."""
        self.steps = 0.0
        """Microsteps by which the axis may be from where it stands still by its encoder, beside its rounding."""

    def look(self, axis: BoxAxis, said: int, time: float) -> None:
        """See what it says at a time, POSIX seconds."""
        if axis.encoder is None:
            return
        now, step = _Stood(said, axis.led(time), time), axis.encoder.step
        if self._moved is None or self._since is None or abs(said - self._moved.said) > _STANDS_COUNTS:
            self._moved, self._since, self._until, self.missed, self.steps = now, now, -math.inf, 0, 0.0
            return
        led = abs(now.led - self._moved.led)
        self.steps = max(self.steps, led) if led > SEEN_COUNTS * step else self.steps
        if self._since.time < self._until:
            self._since = now
        elif abs(now.led - self._since.led) > _WAY_COUNTS * step:
            self._since, self._until = now, axis.reckoning.ends
            self.missed += 1

    def is_blind(self, *, bad_line: bool) -> bool:
        """Whether it sees nothing of what the axis is told."""
        return self.missed >= (_OFTEN_ON_A_BAD_LINE if bad_line else _OFTEN)
