"""Where the drive said its axes were during the last minutes: an image is solved after the telescope has moved on.

Times come with the readings. Between two readings the axes go straight. What was said under another position, before
a sync or a loss of the position, is forgotten with the reason.
"""

from collections import deque

from clockdrive.errors import Refused
from clockdrive.utc import utc
from mounts.drive import Reading

SPAN_S = 1200.0
_LONGEST_GAP_S = 5.0  # between two readings; an idle telescope is read every 2 s
_ADVICE = "give the middle of an exposure taken since, in UTC"


class History:
    """The readings of the last 20 minutes that belong to one position of the axes."""

    def __init__(self) -> None:
        self._readings: deque[Reading] = deque()
        self._forgotten = "the telescope was not read before"

    def add(self, reading: Reading) -> None:
        """Take note of a reading."""
        if reading.unsynchronised:
            self.forget("the position was lost after it")
            return
        if self._readings and reading.time < self._readings[-1].time:
            self.forget("the clock was set back after it")
        self._readings.append(reading)
        while reading.time - self._readings[0].time > SPAN_S:
            self._readings.popleft()
            self._forgotten = f"{SPAN_S / 60.0:.0f} minutes are kept"

    def forget(self, why: str) -> None:
        """Forget all; `why` is told to whoever asks for it."""
        self._readings.clear()
        self._forgotten = why

    def counts(self, time: float) -> tuple[float, float]:
        """Counts of both axes at a moment, POSIX seconds.

        Raises
        ------
        Refused
            Nothing is known of that moment, or the telescope was slewing then.
        """
        before = after = None
        for reading in reversed(self._readings):
            if reading.time <= time:
                before = reading
                break
            after = reading
        if before is None:
            raise Refused(f"nothing is known of the telescope at {utc(time)}: {self._forgotten}; {_ADVICE}")
        if before.time == time:
            after = before
        if after is None:
            raise Refused(f"{utc(time)} lies after the last reading, of {utc(before.time)}; {_ADVICE}")
        if after.time - before.time > _LONGEST_GAP_S:
            gap = f"{after.time - before.time:.0f} s without a reading, at most {_LONGEST_GAP_S:.0f} s can be bridged"
            raise Refused(f"{utc(time)} lies in {gap}; {_ADVICE}")
        if any(axis.slewing for reading in (before, after) for axis in reading.axes):
            raise Refused(f"the telescope was slewing at {utc(time)}; {_ADVICE}")
        part = (time - before.time) / (after.time - before.time) if after is not before else 0.0
        one, two = (
            a.counts + (b.counts - a.counts) * part for a, b in zip(before.axes[:2], after.axes[:2], strict=True)
        )
        return one, two
