"""POSIX time that no setting of the clock disturbs: it goes by a clock that nobody sets, until it is told to follow.

A key is held for a time, and a motion is reckoned from two events: neither may follow a clock that is set meanwhile.
"""

from collections.abc import Callable

from transports.link import Clock

_LEAST_STEP_S = 0.1
_SLEWED = 5e-4  # a time service corrects by up to so many seconds a second, which is no step


class SteadyClock:
    """A clock that is followed only when that is asked for; keeps `transports.link.Clock`.

    Parameters
    ----------
    clock : Clock
        The clock that somebody may set.
    running : callable
        Seconds from anywhere, by a clock that nobody sets.
    """

    def __init__(self, clock: Clock, running: Callable[[], float]) -> None:
        self._clock = clock
        self._running = running
        self._followed = running()
        self._ahead, _ = self._both()

    def now(self) -> float:
        """POSIX seconds (UTC), as the clock was set when it was followed last."""
        return self._running() + self._ahead

    def sleep(self, seconds: float) -> None:
        """Let `seconds` pass."""
        self._clock.sleep(seconds)

    def behind(self) -> float:
        """Seconds that it goes behind the clock, as that is set now; below 0 where it goes ahead."""
        return self._both()[0] - self._ahead

    def step(self) -> float:
        """Seconds by which the clock was set since, positive forward; 0 for what a time service corrects."""
        ahead, unsure = self._both()
        off = ahead - self._ahead
        most = _LEAST_STEP_S + _SLEWED * (self._running() - self._followed) + unsure
        return off if abs(off) > most else 0.0

    def follow(self) -> float:
        """Go by the clock as it is set now; return by how many seconds that differs from before, 0 for hardly."""
        ahead, unsure = self._both()
        off = ahead - self._ahead
        self._followed = self._running()
        if abs(off) <= 1e-4 + 2.0 * unsure:
            return 0.0
        self._ahead = ahead
        return off

    def _both(self) -> tuple[float, float]:
        """By how much the clock is ahead of the other one, and within how many seconds that is known."""
        before, now, after = self._running(), self._clock.now(), self._running()
        return now - (before + after) / 2.0, (after - before) / 2.0
