"""Choosing the instrument on which targets are put, and bringing what is tracked onto it."""

from clockdrive.control import Steps
from clockdrive.errors import Refused
from clockdrive.instruments import Instruments
from clockdrive.session import Session
from clockdrive.slewing import Report, Slewing


class Choosing:
    """Chooses the instrument of a session.

    Parameters
    ----------
    session : Session
        Whose target is brought onto it.
    slewing : Slewing
        Brings it there.
    instruments : Instruments
        Those there are.
    """

    def __init__(self, session: Session, slewing: Slewing, instruments: Instruments) -> None:
        self._session = session
        self._slewing = slewing
        self._instruments = instruments

    def choose(self, name: str, report: Report) -> Steps[bool]:
        """Put targets on an instrument; what is tracked is slewn onto it. Return whether the telescope moved.

        Raises
        ------
        Refused, Unreachable
            There is no such instrument; not now; or the target cannot be put on it. The one before stays in force.
        """
        session, instruments = self._session, self._instruments
        instruments.require(name)
        session.require_free(parked=True)
        if name == instruments.name:
            return False
        if session.pursuit is not None:
            session.poll()
        before = instruments.name
        instruments.take(name)
        try:
            self._require_reachable(name)
        except BaseException:
            instruments.take(before)
            raise
        session.store.record_instrument(name, session.clock.now())
        session.history.forget("another instrument was chosen after it")
        session.note("instrument", f"{name} in place of {before}")
        if session.pursuit is None or session.wanted is None:
            return False
        yield from self._slewing.goto(session.wanted, report)
        return True

    def _require_reachable(self, name: str) -> None:
        """Ask the limits of the new instrument before anything moves."""
        session = self._session
        if session.pursuit is None or session.wanted is None:
            return
        start = session.start()
        checks = session.planner.standing(session.planner.angles(start.counts), start.time)
        failed = [check.detail for check in checks if not check.ok]
        if failed:
            raise Refused(f"with {name} in force the telescope must not point here: {'; '.join(failed)}")
        session.planner.plan(session.corrected(session.wanted), start, session.timing())
