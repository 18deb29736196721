"""What moves a telescope."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from clockdrive.answers import (
    Answer,
    PassAnswer,
    PlanAnswer,
    arrival_answer,
    plan_answer,
)
from clockdrive.axis_names import axis_of
from clockdrive.control import Steps
from clockdrive.errors import finite
from clockdrive.planning import (
    answered,
    drift_of,
    notes_at,
    plan_or_pass,
)
from clockdrive.rotating import hold_of
from clockdrive.slewing import Arrival, Progress, Report
from clockdrive.telescope.parts import Parts
from pointing.errors import Unreachable
from pointing.pass_plan import PassPlan
from pointing.plan import Plan
from pointing.rotator import Hold
from pointing.targets import Target

if TYPE_CHECKING:
    from clockdrive.planning import TargetLike, TimeLike

_LONGEST_WAIT_S = 1800.0  # that `goto` waits for a satellite
_NO_HOME = "home is where both axes are at centre_deg: `park` goes to park_deg instead"


def nobody(progress: Progress) -> None:
    """Watch no progress."""


class Moving(Parts):
    """Plan, go, park, jog."""

    def plan(
        self,
        target: "TargetLike",
        at: "TimeLike | None" = None,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> PlanAnswer | PassAnswer:
        """Plan a slew, or the pass of a satellite that is not up yet; nothing moves.

        Parameters
        ----------
        target : str, SkyCoord or Target
            Whatever the command line takes, or a place.
        at : float, datetime, Time or str, optional
            When the slew would start; now by default.
        rate_arcsec_s : sequence of two floats, optional
            Rates of one's own, east (with cos Dec) and north on the sky, on top of the target's own motion.
        rate_from : float, datetime, Time or str, optional
            When these have not displaced the target yet; when the slew starts by default.
        rotator : str, optional
            What the instrument rotator is to hold: `sky`, `horizon` or `mount`; as configured by default.
        position_angle_deg : float, optional
            At which angle: to the east of north, of the zenith, or of the tube's upper side.

        Raises
        ------
        TargetError, Unreachable, Refused
            It is no target; it cannot be reached; the position is not synchronised.
        """
        self._control.require_open()
        time = self._time(at)
        resolved = self._target(target, time, drift_of(rate_arcsec_s, rate_from))
        hold = hold_of(self._session.planner.rotator, rotator, position_angle_deg)
        found = self._planned(resolved, None if at is None else time, hold)
        around = self._session.surroundings
        notes, unsure = self._instruments.notes, self._control.call(self._session.uncertainty_counts)
        return answered(found, time, self._session.planner, around, resolved, notes, unsure)

    def goto(
        self,
        target: "TargetLike",
        progress: Report = nobody,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> Answer:
        """Slew to a target and track it; returns on arrival, tracking goes on until `stop` or `close`.

        Rates of one's own and what the rotator holds, as for `plan`, go on for as long as it is tracked. A satellite
        that comes up within half an hour is waited for.
        """
        resolved = self._target(target, self.clock.now(), drift_of(rate_arcsec_s, rate_from))
        self._control.call(self._session.require_free)
        hold = hold_of(self._session.planner.rotator, rotator, position_angle_deg)
        found = self._planned(resolved, None, hold)
        ahead = found if isinstance(found, PassPlan) else None
        if ahead is not None and ahead.reachable > self.clock.now() + _LONGEST_WAIT_S:
            most = f"`goto` waits for at most {_LONGEST_WAIT_S / 60:.0f} minutes: give it again then"
            raise Unreachable(f"{ahead.target} is not up yet; {most}", ahead.reachable)
        arrival = self._perform(self._gone_to(resolved, progress, ahead, hold))
        return self._arrived(arrival, resolved)

    def flip(self, progress: Report = nobody) -> Answer:
        """Take up the tracked target in the other posture, by a safe way; a German mount changes sides."""
        arrival = self._perform(self._slewing.flip(progress))
        return self._arrived(arrival)

    def park(self, progress: Report = nobody) -> PlanAnswer:
        """Go to the park position and stay there."""
        plan = self._perform(self._slewing.park(self._configured("park_deg"), progress))
        return self._answered(plan)

    def unpark(self) -> bool:
        """Allow motion again; return whether it was parked."""
        return self._control.call(self._session.unpark)

    def home(self, progress: Report = nobody) -> PlanAnswer:
        """Go to the centre of both axes and stay there.

        Raises
        ------
        Refused, Unreachable
            As for `goto`; the text names `park` where the centre is out of reach.
        """
        try:
            plan = self._perform(self._slewing.to_angles("home", self._configured("centre_deg"), progress))
        except Unreachable as refusal:
            raise Unreachable(f"{refusal}; {_NO_HOME}", refusal.reachable, refusal.checks) from refusal
        return self._answered(plan)

    def jog(
        self,
        axis: int | str,
        deg_s: float,
        seconds: float,
        progress: Report = nobody,
    ) -> PlanAnswer:
        """Move one axis at a speed for a time; it cannot go further than that, whatever happens to the host.

        Parameters
        ----------
        axis : int or str
            1, `axis1` or `azimuth`; 2, `axis2` or `altitude`; 3 or `rotator`.
        deg_s, seconds : float
            Degrees a second, and for how long.
        progress : callable
            Told of the way.

        Raises
        ------
        ArgumentError, Refused, Unreachable
            There is no such axis; the speed is impossible; a limit forbids the way.
        """
        which = axis_of(axis, 2 if self._session.planner.rotator is None else 3)
        rate = math.radians(finite("a jog at", deg_s, "degrees a second"))
        steps = self._slewing.jog(which, rate, finite("a jog for", seconds, "seconds"), progress)
        return self._answered(self._perform(steps))

    def drive_at(self, deg_s_1: float, deg_s_2: float, seconds: float, progress: Report = nobody) -> Answer:
        """Move both axes at speeds for a time, then ramp them down; a dead-man process stands beside the drive.

        Raises
        ------
        Refused, Unreachable, DriveError
            Not now, not so fast or not that way; the telescope is at rest.
        """
        one, two = (finite("a speed of", each, "degrees a second") for each in (deg_s_1, deg_s_2))
        rates, seconds = (math.radians(one), math.radians(two)), finite("a speed for", seconds, "seconds")
        moved = self._perform(self._direct.move(rates, seconds, progress))
        ends = {"from_deg": moved.start, "to_deg": moved.end}
        shown = {name: [math.degrees(angle) for angle in angles] for name, angles in ends.items()}
        return Answer({"ok": True, "seconds": moved.seconds, **shown})

    def wait(self, seconds: float) -> None:
        """Let time pass while the telescope goes on tracking."""
        self._control.let_pass(finite("a wait of", seconds, "seconds"))

    def _gone_to(self, target: Target, progress: Report, ahead: PassPlan | None, hold: Hold | None) -> Steps[Arrival]:
        """Slew to a new target; what was found of the last one is not taken along."""
        self._session.require_free()
        with self._session.holding(hold):
            if ahead is None:
                self._session.plan(target)  # what is refused leaves all as it was
        self._session.forget_target()
        return (yield from self._slewing.goto(target, progress, ahead))

    def _notes(self, plan: Plan, target: Target | None = None) -> tuple[str, ...]:
        said = notes_at(self._session.surroundings, plan.arrival, plan.observed, target)
        left = self._session.left_alone
        return (*said, *self._instruments.notes, *(() if left is None else (left.said(self.clock.now()),)))

    def _arrived(self, arrival: Arrival, target: Target | None = None) -> Answer:
        session = self._session
        return arrival_answer(
            arrival, session.planner, self._notes(arrival.plan, target), target, warnings=session.warnings
        )

    def _answered(self, plan: Plan) -> PlanAnswer:
        return plan_answer(plan, self._session.planner, self._notes(plan))

    def _planned(self, target: Target, time: float | None, hold: Hold | None) -> Plan | PassPlan:
        """Plan on the caller's thread: a refusal may search the whole day, and the control thread has a telescope."""
        wanted, start, timing = self._control.call(lambda: self._session.whence(target, time))
        return plan_or_pass(self._session.planner, wanted, start, timing, hold)

    def _configured(self, name: str) -> tuple[float, float]:
        one, two = (math.radians(getattr(section, name)) for section in self.configuration.axes)
        return one, two
