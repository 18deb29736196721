"""Slews that end at rest: park, home, and away from where the telescope must not stay."""

from collections.abc import Callable
from dataclasses import replace

from clockdrive.control import Steps
from clockdrive.slewing.one_slew import SLEW_PERIOD_S, OneSlew, Report
from mounts.drive import Stowing
from pointing.plan import Plan
from pointing.rotator_plan import turned_to
from pointing.way_round import to_axes


class ToRest(OneSlew):
    """To axis angles, and to rest there."""

    def park(self, angles: tuple[float, float], report: Report) -> Steps[Plan]:
        """Slew to axis angles, radians, and allow no motion from there until `unpark`; parking again is harmless.

        Raises
        ------
        Refused, Unreachable
            As for `goto`.
        """
        session = self._session
        plan = yield from self.to_angles("park", angles, report, parked=True)
        session.store.record_parked(parked=True, time=session.clock.now())
        session.now_doing("parked")
        return plan

    def to_angles(
        self, name: str, angles: tuple[float, float], report: Report, *, parked: bool = False
    ) -> Steps[Plan]:
        """Slew to axis angles, radians, and stay there; a parked telescope only where `parked` allows it.

        Raises
        ------
        Refused, Unreachable
            As for `goto`.
        """
        session = self._session
        session.require_free(parked=parked)
        session.poll()
        rotator = session.planner.rotator
        park = rotator.park if parked and rotator is not None else None
        plan = yield from self._rest_at(name, angles, report, park)
        if parked:
            yield from self._stow()
        session.now_doing("idle")
        return plan

    def _stow(self) -> Steps[None]:
        """Let parked axes go to the stow of a drive that has one."""
        session = self._session
        with self._stopped_on_failure():
            if not isinstance(session.drive, Stowing) or not session.drive.stow(session.clock.now()):
                return
            slews = True
            while slews:
                yield SLEW_PERIOD_S
                reading = session.poll()
                if reading is None:
                    self._give_up_on_silence()
                else:
                    slews = any(axis.slewing for axis in reading.axes)

    def _rest_at(
        self, name: str, angles: tuple[float, float], report: Report, rotator: float | None = None
    ) -> Steps[Plan]:
        """Slew to axis angles and come to rest there, in two legs where only horizon or Sun bar the straight way.

        A rotator goes to an angle of its own, if one is given, on the last leg.
        """
        session = self._session
        angles = session.held_at(angles)
        plan = to_axes(session.planner, name, angles, session.start(), session.timing())
        if plan.via is not None:
            yield from self._slew(plan.via, "slewing", report)
            self._require_landed(plan.via)
            with self._stopped_on_failure():
                onwards = session.planner.plan_axes(name, angles, session.start(), session.timing())
            plan = replace(onwards, start=plan.start)
        if rotator is not None:
            plan = turned_to(session.planner, plan, rotator, session.start(), session.timing())
        yield from self._slew(plan, "slewing", report)
        self._require_landed(plan)
        return plan

    def escape(self, where: Callable[[], Plan], report: Report) -> Steps[Plan]:
        """Leave a place where the telescope must not stay, and rest where `where` says."""
        self._session.require_free()
        self._session.poll()
        plan = where()
        yield from self._slew(plan, "slewing", report)
        self._require_landed(plan)
        self._session.now_doing("idle")
        return plan
