"""The commands that take time: goto, park, home, jog. Each is a run of steps in the control loop's foreground."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from clockdrive.control import Steps
from clockdrive.errors import ArgumentError, Refused
from clockdrive.pursuit import Pursuit
from clockdrive.reporting import ReportFailed, tell
from clockdrive.session import MOVING, Session
from clockdrive.state import Activity
from clockdrive.waiting import Waiting
from mounts.drive import ROTATOR, AxisSlew, Reading, Stowing
from pointing.mount import Posture
from pointing.pass_plan import UP_S, PassPlan
from pointing.plan import Axis, Plan, Timing
from pointing.planner import Planner
from pointing.rotator_plan import turned_to
from pointing.slew import SlewModel
from pointing.targets import Target
from pointing.vectors import azimuth_altitude
from pointing.way_round import to_axes

_SLEW_PERIOD_S = 0.25
_LANDING_PERIOD_S = 0.02  # polls around the predicted landing, which the drive learns from
_LANDING_WINDOW_S = 0.4
_ABSORBED_ARCSEC = 60.0  # an error on arrival that tracking closes by itself
_SETTLING_PERIOD_S = 0.5
_SETTLE_S = 15.0
_MOST_SLEWS = 4
_LONGEST_JOG_S = 3600.0
_LINK_LOST_S = 15.0  # after which a slew is given up
_WAITING_PERIOD_S = 1.0
_LED_OVER = math.radians(30.0 / 3600.0)  # by which a path may change and the axes go on, displaced
_READY_S = 0.2  # in which a drive is ready to lead without the plan being made again


@dataclass(frozen=True)
class Progress:
    """A slew under way, or the waiting for a target that is not up yet."""

    target: str
    remaining_s: float
    eta_s: float
    counts: tuple[float, float]
    waiting: Waiting | None = None  # instead of slewing, for a target that is not up yet


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


Report = Callable[[Progress], None]


class Slewing:
    """Moves the telescope of a session.

    Parameters
    ----------
    session : Session
        Reads, checks and stops it meanwhile.
    """

    def __init__(self, session: Session) -> None:
        self._session = session

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

    def escape(self, where: Callable[[], Plan], report: Report) -> Steps[Plan]:
        """Leave a place where the telescope must not stay, and rest where `where` says."""
        self._session.require_free()
        self._session.poll()
        plan = where()
        yield from self._slew(plan, "slewing", report)
        self._require_landed(plan)
        self._session.now_doing("idle")
        return plan

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

    @contextmanager
    def _given_up(self) -> Iterator[None]:
        """Stop what has begun when it cannot go on; where nothing has, what is tracked goes on."""
        try:
            yield
        except BaseException as error:
            if self._session.doing in MOVING:
                self._session.stop_and_fail(str(error))
            raise

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
                yield _SLEW_PERIOD_S
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

    def jog(self, axis: int, rate: float, seconds: float, report: Report) -> Steps[Plan]:
        """Move one axis, by number from 0, at `rate` radians a second for a time: a slew that goes no further.

        Raises
        ------
        Refused, Unreachable
            The speed is impossible, or as for `goto`.
        """
        session = self._session
        session.require_free()
        if not 0.0 < seconds <= _LONGEST_JOG_S:
            raise ArgumentError(
                f"a jog for {seconds:g} s: above 0 up to {_LONGEST_JOG_S:g} s; use `goto` for longer ways"
            )
        session.poll()
        moved, model = _moved(session.planner, session.timing(), axis)
        per_radian = abs(moved.gearing.counts_per_radian)
        speed, most = abs(rate) * per_radian, model.max_rate
        if not 0.0 < speed <= most:
            highest = math.degrees(most / per_radian)
            raise Refused(
                f"a jog at {math.degrees(rate):g}°/s: {moved.name} goes at up to ±{highest:.3f}°/s, and not at 0"
            )
        least = 2.0 * abs(session.drive.capabilities.goes_on_at) if axis == 0 else 0.0
        if speed < least:
            raise Refused(
                f"a jog at {math.degrees(rate):g}°/s: {moved.name} tracks by itself at half of "
                f"{math.degrees(least / per_radian):.5f}°/s, so it goes at no less than that"
            )
        plan = self._jogged(moved.name, axis, rate * seconds, _limited(session.timing(), axis, speed))
        yield from self._slew(plan, "jogging", report, {axis: speed})
        self._require_landed(plan)
        session.now_doing("idle")
        return plan

    def _jogged(self, name: str, axis: int, by: float, timing: Timing) -> Plan:
        """A plan of one axis by an angle, radians, from where it is."""
        planner, start = self._session.planner, self._session.start()
        angles = list(planner.angles(start.counts))
        if axis < len(angles):
            angles[axis] += by
        plan = planner.plan_axes(f"jog of {name}", (angles[0], angles[1]), start, timing)
        if axis < len(angles) or planner.rotator is None or start.rotator is None:
            return plan
        angle = planner.rotator.axis.gearing.angle(start.rotator[0]) + by
        return turned_to(planner, plan, angle, start, timing)

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
        session.begin(_activity(plan, "slewing"))
        pursuit = session.pursue(target, plan)
        with self._stopped_on_failure():
            while session.clock.now() < plan.arrival:
                began = session.clock.now()
                reading = session.poll()
                if reading is None:
                    self._give_up_on_silence()
                else:
                    tell(report, _progress(plan, reading))
                due = min(began + session.follow(), plan.arrival)
                yield max(0.0, due - session.clock.now())
            session.poll()
        return pursuit

    def _slew(
        self,
        plan: Plan,
        doing: str,
        report: Report,
        speeds: dict[int, float] | None = None,
        onto: Target | None = None,
    ) -> Steps[None]:
        """Slew and wait for the landing; a drive of path nodes is given those of a target, `onto`, meanwhile."""
        session, speeds = self._session, speeds or {}
        stays = onto is not None and self._stays(plan)
        session.begin(_activity(plan, doing))
        if stays and onto is not None:
            with self._stopped_on_failure():
                session.pursue(onto, plan)
                session.follow()
                yield from self._landing(plan, report, plan.arrival)
            return
        turns = plan.rotator
        slews = self._slews(plan, speeds)
        if turns is not None:
            target, rate = turns.axis.target_counts, turns.axis.rate_counts
            slews.append(AxisSlew(target, rate, speeds.get(ROTATOR), turns.arrival))
        with self._stopped_on_failure():
            session.drive.start(slews, session.clock.now())
            session.remember()
            if onto is not None and session.drive.capabilities.path_nodes:
                session.pursue(onto, plan)
                session.follow()  # at once, that no short way ends before the first look
            yield from self._landing(plan, report)

    def _stays(self, plan: Plan) -> bool:
        """Whether the axes are on their way already, so that the rotator alone is led over to another one."""
        session, pursuit = self._session, self._session.pursuit
        if session.doing != "tracking" or pursuit is None or pursuit.led or pursuit.posture != plan.posture:
            return False
        if not session.drive.capabilities.path_nodes or plan.via is not None:
            return False
        there = pursuit.angles(plan.arrival)
        off = (abs(axis.angle - angle) for axis, (angle, _) in zip(plan.axes, there, strict=True))
        return max(off) <= _LED_OVER

    def _slews(self, plan: Plan, speeds: dict[int, float]) -> list[AxisSlew]:
        """What each axis is told; one that goes on at a rate of its own, for the moment when both have landed."""
        drive, gearings = self._session.drive, [axis.gearing for axis in self._session.planner.axes]
        if not (drive.capabilities.rate_control or drive.capabilities.path_nodes):
            return [
                AxisSlew(
                    gearing.counts(axis.angle), axis.rate * gearing.counts_per_radian, speeds.get(i), plan.arrival
                )
                for i, (axis, gearing) in enumerate(zip(plan.axes, gearings, strict=True))
            ]
        due = plan.landings if not drive.axes_land_together else (max(plan.landings),) * 2
        return [
            AxisSlew(axis.target_counts, axis.rate_counts, speeds.get(i), due[i]) for i, axis in enumerate(plan.axes)
        ]

    @contextmanager
    def _stopped_on_failure(self) -> Iterator[None]:
        try:
            yield
        except (GeneratorExit, Refused):
            raise  # whoever ended it, or refused to go on, stops the telescope
        except ReportFailed as failed:
            self._session.stop_and_fail(str(failed))
            raise failed.error from None
        except BaseException as error:
            self._session.stop_and_fail(str(error) or repr(error))
            raise

    def _landing(self, plan: Plan, report: Report, until: float = -math.inf) -> Steps[None]:
        """Wait until no axis slews any more, and until a time; what is pursued is followed meanwhile."""
        session = self._session
        while True:
            left = plan.arrival - session.clock.now()
            far = left > _LANDING_WINDOW_S or left < -_LANDING_WINDOW_S
            yield min(_SLEW_PERIOD_S, abs(left) - _LANDING_WINDOW_S + _LANDING_PERIOD_S) if far else _LANDING_PERIOD_S
            reading = session.poll()
            if reading is None:
                self._give_up_on_silence()
                continue
            tell(report, _progress(plan, reading))
            if not any(axis.slewing for axis in reading.axes) and reading.time >= until:
                return
            session.follow()

    def _give_up_on_silence(self) -> None:
        session = self._session
        since = session.link_lost_since
        if since is not None and session.clock.now() - since > _LINK_LOST_S:
            session.halt(
                f"the drive has not answered for {_LINK_LOST_S:.0f} s; it ends its slew by itself, and what it does "
                "then is stopped as soon as it answers. Check the link"
            )

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

    def _require_landed(self, plan: Plan) -> None:
        """A slew that ends at rest must end where it was sent; the reading that saw it end may be older than that."""
        self._session.poll()
        reading, held = self._session.synchronised(), self._session.drive.capabilities.rests_within
        planner, turns = self._session.planner, plan.rotator
        ends, axes = list(plan.axes), list(planner.axes)
        if turns is not None and planner.rotator is not None:
            ends, axes = [*ends, turns.axis], [*axes, planner.rotator.axis]
        for axis, setup, read in zip(ends, axes, reading.axes, strict=False):
            off = abs(read.counts - axis.target_counts)
            if off > setup.landed + held + read.uncertainty_counts:
                short = f"{off:.5f}°" if setup.units == "degrees" else f"{off:.0f} counts"
                self._session.halt(f"{plan.target}: {axis.name} ended {short} short; check what blocks it")


def _activity(plan: Plan, doing: str) -> Activity:
    one, two = plan.axes
    return Activity(
        doing,
        plan.start,
        plan.arrival,
        (one.from_counts, two.from_counts),
        (one.target_counts, two.target_counts),
        plan.target,
    )


def _progress(plan: Plan, reading: Reading) -> Progress:
    return Progress(plan.target, max(0.0, plan.arrival - reading.time), plan.eta, reading.counts)


def _moved(planner: Planner, timing: Timing, axis: int) -> tuple[Axis, SlewModel]:
    """An axis by its number from 0, and its law of motion."""
    if axis < len(planner.axes):
        return planner.axes[axis], timing.slew[axis]
    if planner.rotator is None or timing.rotator is None:
        raise Refused("this telescope has no rotator: a table [rotator] in its configuration says that there is one")
    return planner.rotator.axis, timing.rotator


def _limited(timing: Timing, axis: int, rate: float) -> Timing:
    """The same laws, one axis no faster than `rate` counts per second."""
    one, two, turns = *timing.slew, timing.rotator
    if axis == ROTATOR and turns is not None:
        return replace(timing, rotator=turns.limited(rate))
    return replace(timing, slew=(one.limited(rate), two) if axis == 0 else (one, two.limited(rate)))
