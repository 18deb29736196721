"""Steps of the computer's clock, found by comparing it with one that nobody sets.

A clock that a time service corrects by running faster or slower is no concern here; one that is set is.
"""

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from clockdrive.host_clock import SKY_ARCSEC_PER_S

_LEAST_STEP_S = 0.1
_SLEWED = 5e-4  # a time service slews by up to 500 ppm, which not every unsettable clock follows
_TOGETHER_S = 0.01  # two readings twice as far apart were interrupted


@dataclass(frozen=True)
class ClockStep:
    """The clock was set.

    Parameters
    ----------
    step_s : float
        Positive forward.
    before, after : float
        POSIX seconds, each by the clock as it then was, between which it happened.
    """

    step_s: float
    before: float
    after: float

    def during(self, what: str) -> str:
        """The sentence, for what was being done."""
        arcsec = abs(self.step_s) * SKY_ARCSEC_PER_S
        return (
            f"the clock was stepped by {self.step_s:+.1f} s during {what} (bound {_LEAST_STEP_S} s): the telescope "
            f"was or is aimed {arcsec:.0f}″ off; check the time service, then `goto` again, `sync` too if done before"
        )


class ClockWatch:
    """Finds steps of the clock.

    Parameters
    ----------
    now : callable
        The clock that is watched, POSIX seconds.
    unsettable : callable
        A clock that nobody sets, seconds from anywhere, running on while the computer sleeps.
    """

    def __init__(self, now: Callable[[], float] = time.time, unsettable: Callable[[], float] | None = None) -> None:
        self._now = now
        self._unsettable = unsettable or running_time
        self._last = self._both()

    def look(self) -> ClockStep | None:
        """Return the step since the last look, if the two clocks disagree by more than 0.1 s."""
        was, was_running, was_unsure = self._last
        now, running, unsure = self._last = self._both()
        elapsed = running - was_running
        step = now - was - elapsed
        found = abs(step) > _LEAST_STEP_S + _SLEWED * elapsed + was_unsure + unsure
        return ClockStep(step, was, now) if found else None

    def _both(self) -> tuple[float, float, float]:
        """Both clocks at one moment, and how far that may miss: of a few readings the least interrupted."""
        best = (0.0, 0.0, math.inf)
        for _ in range(5):
            before, now, after = self._unsettable(), self._now(), self._unsettable()
            half = 0.5 * (after - before)
            if half < best[2]:
                best = (now, before + half, half)
            if half < _TOGETHER_S:
                break
        return best


def running_time() -> float:
    """Seconds since this computer started, sleep included where the system counts it."""
    if sys.platform.startswith("linux"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()
