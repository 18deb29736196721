"""What the telescope does by itself between people's commands: it flips in time, and leaves the Sun's way.

It acts only where the configuration says so, while it tracks or rests, and never when it is parked. Whatever moves it
then is a command like any other: `stop` ends it, and all limits bind it.
"""

import logging
import math

from clockdrive.control import Steps
from clockdrive.failures import FAILURES
from clockdrive.session import Session
from clockdrive.slewing import Progress, Slewing
from pointing.instant import Instant
from pointing.refuge import refuge

_FLIP_AHEAD_S = 60.0  # before the limit
_SUN_AHEAD_S = 240.0  # in which the Sun moves by a degree
_AGAIN_S = 60.0  # after which what could not be done is tried again

_COMES = "comes to where the telescope looks"
_LOG = logging.getLogger(__name__)


class Automatic:
    """The background cycle of a telescope, with what it does by itself.

    Parameters
    ----------
    session : Session
        Whose cycle it is.
    slewing : Slewing
        Moves the telescope.
    flips : bool
        Whether a German mount changes sides when its tracking would end at the window.
    escapes : bool
        Whether the telescope leaves a place to which the Sun's zone comes; else it only says so.
    """

    def __init__(self, session: Session, slewing: Slewing, *, flips: bool, escapes: bool) -> None:
        self._session = session
        self._slewing = slewing
        self._flips = flips
        self._escapes = escapes
        self._steps: Steps[object] | None = None
        self._not_before = -math.inf

    def cycle(self) -> float:
        """Do one cycle; return the seconds to the next. Never raises."""
        if self._steps is not None:
            return self._advanced(self._steps)
        wait = self._session.cycle()
        try:
            self._steps = self._wanted()
        except FAILURES as error:
            self._failed(str(error))
        return wait if self._steps is None else self._advanced(self._steps)

    def cancel(self) -> None:
        """Give up what it does by itself; the telescope is stopped by whoever calls."""
        steps, self._steps = self._steps, None
        if steps is not None:
            steps.close()

    def _advanced(self, steps: Steps[object]) -> float:
        try:
            return next(steps)
        except StopIteration:
            self._steps = None
        except FAILURES as error:
            self._failed(str(error))
        except Exception as error:  # noqa: BLE001 - the control thread goes on, whatever it is
            _LOG.exception("what the telescope does by itself failed")
            self._session.stop_and_fail(f"internal error, the telescope was stopped: {error!r}")
            self._failed(repr(error))
        return 0.0

    def _failed(self, why: str) -> None:
        self._steps = None
        self._not_before = self._session.clock.now() + _AGAIN_S
        self._session.note("automatic", f"did not succeed: {why}")

    def _wanted(self) -> Steps[object] | None:
        session, now = self._session, self._session.clock.now()
        reading = session.reading
        if reading is None or reading.unsynchronised or session.doing not in {"idle", "tracking", "parked"}:
            return None
        if self._sun_comes(now):
            return self._escape(now)
        session.sun_warning = ""
        if now >= self._not_before and self._must_flip(now):
            session.note("flip", "by itself: the end of the window is near")
            return self._slewing.flip(_nobody)
        return None

    def _must_flip(self, now: float) -> bool:
        session = self._session
        if not self._flips or session.pursuit is None or session.pursuit.led or session.doing != "tracking":
            return False
        found = session.pursuit.next_limit(now)
        return found is not None and found[0] < now + _FLIP_AHEAD_S and found[1].name in _WINDOW

    def _sun_comes(self, now: float) -> bool:
        """Whether the Sun's zone reaches the place where the telescope looks within minutes."""
        session, reading = self._session, self._session.reading
        limits = session.planner.limits
        if reading is None or not limits.sun_avoidance:
            return False
        looks = session.planner.observed(reading.counts)
        sun = session.planner.sky.at(Instant.from_posix(now + _SUN_AHEAD_S)).sun()
        return limits.sun_margin(looks, sun) < 0.0

    def _escape(self, now: float) -> Steps[object] | None:
        session = self._session
        if session.doing == "parked" or not self._escapes:
            if not session.sun_warning:
                session.note("Sun", f"its zone {_COMES}; move it away, or cover it")
            session.sun_warning = f"the Sun's zone {_COMES}: move it away, or cover it"
            return None
        session.sun_warning = ""
        if now < self._not_before:
            return None
        self._not_before = now + _AGAIN_S
        session.note("Sun", f"its zone {_COMES}; it moves away by itself")
        return self._slewing.escape(lambda: refuge(session.planner, session.start(), session.timing()), _nobody)


_WINDOW = frozenset({"hour-angle window", "axis1 soft limit"})


def _nobody(progress: Progress) -> None:
    """Nobody watches the progress."""
