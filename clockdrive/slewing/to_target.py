"""Slews onto a target, which is tracked from then on."""

import math
from dataclasses import dataclass, replace

from clockdrive.control import Steps
from clockdrive.errors import Refused
from clockdrive.pursuit import Pursuit
from clockdrive.reporting import tell
from clockdrive.slewing.one_slew import Progress, Report, activity_of, progress_of
from clockdrive.slewing.to_rest import ToRest
from clockdrive.state import Activity
from clockdrive.waiting import Waiting
from pointing.mount import Posture
from pointing.pass_plan import UP_S, PassPlan
from pointing.plan import Plan
from pointing.targets import Target
from pointing.vectors import azimuth_altitude

_ABSORBED_ARCSEC = 60.0  # an error on arrival that tracking closes by itself
_SETTLING_PERIOD_S = 0.5
_SETTLE_S = 15.0
_MOST_SLEWS = 4
_WAITING_PERIOD_S = 1.0
_READY_S = 0.2  # in which a drive is ready to lead without the plan being made again


@dataclass(frozen=True)
class Arrival:
    """A slew that ended on its target.

    Parameters
    ----------
    plan : Plan
        The plan of the first slew.
    arrived : float
        POSIX seconds at which both axes had landed.
    error_arcsec : float
        Distance on the sky between telescope and target then.
    slews : int
        1 when the first one hit.
    """

    plan: Plan
    arrived: float
    error_arcsec: float
    slews: int


class ToTarget(ToRest):
    """Goto and flip."""

    def goto(
        self, target: Target, report: Report, ahead: PassPlan | None = None, posture: Posture | None = None
    ) -> Steps[Arrival]:
        """Slew to a target and track it, in a posture or in the best; slew again only when the first did not hit.

        A fast target that is not up yet is waited for where its pass, `ahead`, begins.

        Raises
        ------
        Refused, Unreachable
            Not now, or not there; where it had begun, the telescope was stopped.
        """
        session = self._session
        session.require_free()
        session.poll()
        if ahead is not None:
            yield from self._wait_for(target, ahead, report)
        return (yield from self._reach(target, report, posture if ahead is None else ahead.posture))

    def flip(self, report: Report) -> Steps[Arrival]:
        """Take up the target in the other posture, by a safe way, and go on tracking it.

        Raises
        ------
        Refused, Unreachable
            Nothing is tracked, or it is too fast for that; it cannot be reached in the other posture now.
        """
        session = self._session
        session.require_free()
        pursuit, wanted = session.pursuit, session.wanted
        if pursuit is None or wanted is None:
            raise Refused("a flip takes up the target in the other posture, and none is tracked: `goto` one first")
        if pursuit.led:
            raise Refused(f"{pursuit.target.name} is too fast to be left for a flip; `goto` it again after its pass")
        other: Posture = "beyond" if pursuit.posture == "normal" else "normal"
        session.poll()
        session.plan(wanted, other)  # refused before anything is given up
        return (yield from self._reach(wanted, report, other))

    def _reach(self, target: Target, report: Report, posture: Posture | None) -> Steps[Arrival]:
        """Slew until the target is hit, in a posture or in the best."""
        session = self._session
        plans: list[Plan] = []
        error = math.inf
        while error > _ABSORBED_ARCSEC:
            if len(plans) == _MOST_SLEWS:
                off = f"still {error:.0f}″ off after {_MOST_SLEWS} slews"
                session.halt(f"{target.name}: {off}; check gears, clutches and what blocks the telescope")
            plans.append(self._ready(target, posture))
            if plans[-1].via is not None:
                yield from self._slew(plans[-1].via, "slewing", report)
                self._require_landed(plans[-1].via)
                plans[-1] = replace(self._planned(target, plans[-1].posture), start=plans[-1].start)
                if plans[-1].via is not None:
                    session.halt(f"{target.name}: the horizon or the Sun bars the way on from here; `goto` it again")
            if plans[-1].trajectory is None:
                yield from self._slew(plans[-1], "slewing", report, onto=target)
                pursuit = session.pursuit or session.pursue(target, plans[-1])
            else:
                pursuit = yield from self._lead(target, plans[-1], report)
            landed = session.synchronised()
            session.now_doing("tracking", target.name)
            error = pursuit.error_arcsec(landed)
        yield from self._settle(pursuit)
        session.note("arrived", f"{target.name}, {error:.1f}″ off on landing, {len(plans)} slew(s)")
        return Arrival(plans[0], landed.time, error, len(plans))

    def _ready(self, target: Target, posture: Posture | None) -> Plan:
        """Plan, and have the drive ready for a target to which it must be led: a plan does not wait for that."""
        session, plan = self._session, self._planned(target, posture)
        if plan.trajectory is None:
            return plan
        asked = session.clock.now()
        with self._given_up():
            session.drive.stand_by(asked)
        if session.clock.now() - asked <= _READY_S:
            return plan
        return replace(self._planned(target, plan.posture), start=plan.start)

    def _planned(self, target: Target, posture: Posture | None) -> Plan:
        """Plan; a refusal in the middle of a command leaves nothing that seems to slew."""
        with self._given_up():
            return self._session.plan(target, posture)

    def _wait_for(self, target: Target, ahead: PassPlan, report: Report) -> Steps[None]:
        """Go to where a pass begins, and stay there until it does."""
        session = self._session
        plan = yield from self._rest_at(target.name, ahead.wait, report, ahead.rotator)
        leading = session.drive.leading
        due = ahead.reachable - (0.0 if leading is None else leading.delay_s) + UP_S
        azimuth, altitude = map(math.degrees, azimuth_altitude(plan.observed))
        waiting = Waiting(target.name, session.clock.now(), due, azimuth, altitude)
        session.begin(Activity("waiting", waiting.since, due, detail=target.name))
        session.waiting = waiting
        session.note("waiting", str(waiting))
        with self._stopped_on_failure():
            while (left := due - session.clock.now()) > 0.0:
                reading = session.poll()
                if reading is not None:
                    tell(report, Progress(target.name, left, due - waiting.since, reading.counts, waiting))
                yield min(left, _WAITING_PERIOD_S)

    def _lead(self, target: Target, plan: Plan, report: Report) -> Steps[Pursuit]:
        """Lead both axes to a fast target, until they go along with it."""
        session = self._session
        session.begin(activity_of(plan, "slewing"))
        pursuit = session.pursue(target, plan)
        with self._stopped_on_failure():
            while session.clock.now() < plan.arrival:
                began = session.clock.now()
                reading = session.poll()
                if reading is None:
                    self._give_up_on_silence()
                else:
                    tell(report, progress_of(plan, reading))
                due = min(began + session.follow(), plan.arrival)
                yield max(0.0, due - session.clock.now())
            session.poll()
        return pursuit

    def _settle(self, pursuit: Pursuit) -> Steps[None]:
        """Let tracking close what is left."""
        session = self._session
        deadline = session.clock.now() + _SETTLE_S
        while session.pursuit is pursuit:
            began = session.clock.now()
            due = began + session.follow()
            errors = pursuit.errors(session.synchronised())
            allowed = (
                axis.landed + swing for axis, swing in zip(session.planner.axes, self._swings(pursuit), strict=True)
            )
            if all(abs(off) <= most for off, most in zip(errors, allowed, strict=True)):
                return
            if session.clock.now() > deadline:
                session.note("tracking", "the telescope does not settle on the target; check balance and clutches")
                return
            yield max(0.0, min(due, began + _SETTLING_PERIOD_S) - session.clock.now())
            session.poll()

    def _swings(self, pursuit: Pursuit) -> list[float]:
        """Counts by which each axis goes to and fro about its way, of a drive that is held to it by short moves."""
        session, swings = self._session, []
        for axis, (_, rate) in zip(session.planner.axes, pursuit.at(session.clock.now()), strict=False):
            moves, per_radian = axis.short_moves, abs(axis.gearing.counts_per_radian)
            if moves is None:
                swings.append(0.0)
            elif rate:
                swings.append(axis.beside(rate / axis.gearing.counts_per_radian) * moves.lag_s * per_radian)
            else:
                swings.append(session.drive.capabilities.rests_within)
        return swings
