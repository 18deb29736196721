"""How far a controller's clock is ahead of the host's, from every answer that tells its time.

The controller read its clock somewhere between the end of the request and the end of the answer, and printed it to a
millisecond: each answer bounds the offset from both sides. The middle of the bounds counts, of the quickest answers,
for the longer one was under way, the less its middle says. A clock is taken to be right where no middle is farther
off than rounding makes it, or their mean no farther than their spread; any other keeps the mean. What remains, if
times are cut and not rounded, or all answers come at the same part of a millisecond, is half of one: 1.8″ at 1°/s.

A gain of 50 ppm shows after 25 s, one of 20 ppm after a minute; more answers help little, as each sweep through a
millisecond looks like a gain. So the one that a clock had when it was last seen is assumed, until the answers tell
another or speak against it: a quartz keeps its own.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

_PRINTED_S = 0.001  # to which times are printed, rounded or cut
_KEPT_S = 60.0
_MOST = 256  # answers: a minute of a slew's looks
_TELLING_S = 20.0  # over which answers tell how fast the offset changes
_FEW, _CERTAIN = 5, 4.0  # answers, and standard deviations, below which a gain is none
_CHANCE = 3.0  # standard deviations of the mean, within which it says nothing
_ROUNDING_S = 1e-6  # of POSIX times in floats
_RAMP_S = 1.2 * _PRINTED_S  # more than the rounding of one sweep through a millisecond looks like a gain
_KEEPS = 0.5  # of that, above which a gain that is known remains so, lest it comes and goes
_QUICK = 1.5  # times the quickest round trip
_STEP_S = 0.005  # beyond the bounds, by which a clock was set and has not drifted


@dataclass(frozen=True)
class ClockLine:
    """What is known of a clock: its offset at a POSIX time, seconds, and its gain, seconds a second."""

    time: float = 0.0
    offset: float = 0.0
    gain: float = 0.0

    def at(self, time: float) -> float:
        """The offset at a POSIX time, as the clock gains or loses."""
        return self.offset + self.gain * (time - self.time)


class _Sight(NamedTuple):
    """The middle of the bounds of the offset, and half their width, seconds, at a POSIX time."""

    time: float
    middle: float
    half: float

    def may_be(self, offset: float, unsure: float = 0.0) -> bool:
        """Whether an offset is within the bounds."""
        return abs(offset - self.middle) <= self.half + unsure


class ClockOffset:
    """The offset of one controller's clock: what its clock reads minus what it should.

    Attributes
    ----------
    value : float
        The offset, seconds; 0 while nothing is known or speaks against it.
    uncertainty_s : float
        By how much it may be off, seconds.
    assumed_gain : float
        What it gains, seconds a second, for all that is known from before.
    """

    def __init__(self) -> None:
        self.assumed_gain = 0.0
        self._sights: deque[_Sight] = deque(maxlen=_MOST)
        self.value = self.uncertainty_s = self._gain = 0.0

    def see(self, told: float, sent: float, received: float) -> bool:
        """Take an answer that told a time, as POSIX seconds; return whether the clock was set since the last one.

        Parameters
        ----------
        told : float
            What the controller's clock read, POSIX seconds by the table of leap seconds.
        sent, received : float
            POSIX seconds, by the host's clock, between which it was read.
        """
        low, high = told - _PRINTED_S - received, told + _PRINTED_S - sent
        seen = _Sight(received, (low + high) / 2.0, (high - low) / 2.0)
        stepped = self.known and not seen.may_be(self.value, self.uncertainty_s + _STEP_S)
        if stepped:
            self.forget()
        self._sights.append(seen)
        while self._sights[0].time < received - _KEPT_S:
            self._sights.popleft()
        self._estimate()
        return stepped

    def forget(self) -> None:
        """Begin anew, after the controller has restarted."""
        self._sights.clear()
        self.value = self.uncertainty_s = self._gain = 0.0

    @property
    def known(self) -> bool:
        """Whether the controller has told its time."""
        return bool(self._sights)

    @property
    def line(self) -> ClockLine:
        """By which the offset goes on from the last answer; a clock that is right while nothing is known."""
        return ClockLine(self._sights[-1].time, self.value, self._gain) if self._sights else ClockLine()

    def at(self, time: float) -> float:
        """The offset at a POSIX time, as the clock gains or loses."""
        return self.line.at(time)

    def _estimate(self) -> None:
        shortest = min([sight.half for sight in self._sights])
        quick = [sight for sight in self._sights if sight.half <= _QUICK * shortest]
        last, count = self._sights[-1].time, len(quick)
        times = [sight.time - last for sight in quick]
        middles = [sight.middle for sight in quick]
        time, middle, gain = sum(times) / count, sum(middles) / count, self.assumed_gain
        if -times[0] >= _TELLING_S and count > _FEW:
            gain = self._told_gain([when - time for when in times], [each - middle for each in middles])
        assumed = gain != 0.0 and gain == self.assumed_gain  # of which these answers need not tell yet
        right = not assumed and self._right(middles, middle)
        self.value, self._gain = (0.0, 0.0) if right else (middle - gain * time, gain)
        self.uncertainty_s = max([abs(sight.middle - self.value) + sight.half for sight in quick])

    def _told_gain(self, times: Sequence[float], middles: Sequence[float]) -> float:
        """The gain that answers tell, both from their means; the assumed one where they tell none, or none at all."""
        spread, lasts = sum([when**2 for when in times]), times[-1] - times[0]
        gain = sum([when * each for when, each in zip(times, middles, strict=True)]) / spread
        left = [each - gain * when for when, each in zip(times, middles, strict=True)]
        unsure = sum([each**2 for each in left]) / (len(times) - 2) / spread

        def is_told(other: float, ramp_s: float) -> bool:
            """Whether the answers speak against another gain."""
            return (gain - other) ** 2 > _CERTAIN**2 * unsure and abs(gain - other) * lasts > ramp_s

        if is_told(0.0, _RAMP_S * (_KEEPS if self._gain else 1.0)):
            return gain
        return 0.0 if is_told(self.assumed_gain, _RAMP_S) else self.assumed_gain

    def _right(self, middles: Sequence[float], mean: float) -> bool:
        """Whether the clock may be right, for all that the quick answers say; no answer speaks against it."""
        rounded = max(map(abs, middles)) <= _PRINTED_S / 2.0 + _ROUNDING_S
        if not rounded:
            spread = sqrt(sum([(middle - mean) ** 2 for middle in middles])) / len(middles)
            if abs(mean) > min(_CHANCE * spread, _PRINTED_S):
                return False
        return all(sight.may_be(0.0) for sight in self._sights)
