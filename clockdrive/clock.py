"""The one place where time comes from: the system's clock, or a virtual one that jumps instead of waiting.

Both keep the `Clock` of `transports.link`: `now()` in POSIX seconds (UTC) and `sleep(seconds)`. Whatever needs the
time is handed one of them.
"""

import threading
import time
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from astropy.time import Time


@final
class SystemClock:
    """The computer's own clock."""

    def now(self) -> float:
        """POSIX seconds (UTC)."""
        return time.time()

    def sleep(self, seconds: float) -> None:
        """Wait for `seconds`; not at all when negative."""
        if seconds > 0.0:
            time.sleep(seconds)


@final
class VirtualClock:
    """A clock that moves only when somebody sleeps, so that a night passes in seconds.

    Parameters
    ----------
    start : float or Time
        POSIX seconds (UTC), or astropy's moment, at which it stands first.
    """

    def __init__(self, start: "float | Time") -> None:
        self._now = float(getattr(start, "unix", start))  # NumPy's own numbers would go through every answer
        self._lock = threading.Lock()

    def now(self) -> float:
        """POSIX seconds (UTC)."""
        with self._lock:
            return self._now

    def sleep(self, seconds: float) -> None:
        """Let `seconds` pass at once; the clock never goes back."""
        if seconds > 0.0:
            with self._lock:
                self._now += seconds
