"""Whether keys and events are off their times by as much as configured: every motion says something of that.

A motion lasts longer or shorter than the hold that was sent by the jitter of press, release and both events. In units
of what is expected of that its square is 1 on the average. Where it is clearly more, all that is stated is widened by
as much, and said.
"""

import math
from collections import deque
from dataclasses import replace

from mounts.awr.cascade import Press
from mounts.awr.uncertainty import Jitter

_LAST = 60  # motions
_EXPECTED = 10.0  # of them, for which the configuration stands
_CLEARLY = 1.5  # times the expected, RMS; of 1000 rows of motions as expected one is that far off, before it is long
_MOST = 5.0  # beyond which it is no jitter: the host was held up


class Punctuality:
    """What the motions say.

    Parameters
    ----------
    expected : Jitter
        As configured.
    """

    def __init__(self, expected: Jitter) -> None:
        self.expected = expected
        self._squares: deque[float] = deque(maxlen=_LAST)

    def heard(self, press: Press, hold: float, duration: float) -> None:
        """A press that was sent to last `hold` seconds moved its axis for `duration`."""
        late = duration - replace(press, hold=hold).duration
        sigma = self.expected.late_s(press.key, hold)
        if sigma and abs(late) < _MOST * sigma * self.widened:
            self._squares.append((late / sigma) ** 2)

    @property
    def widened(self) -> float:
        """By how many times everything is off its time more than configured; 1 where that is not clear."""
        mean = (_EXPECTED + sum(self._squares)) / (_EXPECTED + len(self._squares))
        return math.sqrt(mean) if mean > _CLEARLY**2 else 1.0

    @property
    def jitter(self) -> Jitter:
        """As it is to be reckoned with."""
        return Jitter(self.expected.press_s * self.widened, self.expected.stamp_s * self.widened)

    @property
    def note(self) -> str:
        """What a person should know; empty where it is as configured."""
        if self.widened == 1.0:
            return ""
        press, stamp = (1e3 * each for each in (self.expected.press_s, self.expected.stamp_s))
        return (
            f"the last {len(self._squares)} motions lasted longer or shorter than planned, by {self.widened:.1f} "
            f"times as much as press_jitter_s and event_jitter_s say, {press:g} and {stamp:g} ms: what is stated is "
            "widened; raise them, or look after the load of this computer"
        )
