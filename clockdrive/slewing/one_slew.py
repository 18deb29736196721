"""One slew, from its beginning to the landing, and what stops it."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from clockdrive.control import Steps
from clockdrive.errors import Refused
from clockdrive.reporting import ReportFailed, tell
from clockdrive.session import MOVING, Session
from clockdrive.state import Activity
from clockdrive.waiting import Waiting
from mounts.drive import ROTATOR, AxisSlew, Reading
from pointing.plan import Plan
from pointing.targets import Target

SLEW_PERIOD_S = 0.25
_LANDING_PERIOD_S = 0.02  # polls around the predicted landing, which the drive learns from
_LANDING_WINDOW_S = 0.4
_LINK_LOST_S = 15.0  # after which a slew is given up
_LED_OVER = math.radians(30.0 / 3600.0)  # by which a path may change and the axes go on, displaced


@dataclass(frozen=True)
class Progress:
    """A slew under way, or the waiting for a target that is not up yet."""

    target: str
    remaining_s: float
    eta_s: float
    counts: tuple[float, float]
    waiting: Waiting | None = None  # instead of slewing, for a target that is not up yet


Report = Callable[[Progress], None]


class OneSlew:
    """A slew and its landing; see `Slewing`."""

    def __init__(self, session: Session) -> None:
        self._session = session

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
        session.begin(activity_of(plan, doing))
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

    @contextmanager
    def _given_up(self) -> Iterator[None]:
        """Stop what has begun when it cannot go on; where nothing has, what is tracked goes on."""
        try:
            yield
        except BaseException as error:
            if self._session.doing in MOVING:
                self._session.stop_and_fail(str(error))
            raise

    def _landing(self, plan: Plan, report: Report, until: float = -math.inf) -> Steps[None]:
        """Wait until no axis slews any more, and until a time; what is pursued is followed meanwhile."""
        session = self._session
        while True:
            left = plan.arrival - session.clock.now()
            far = left > _LANDING_WINDOW_S or left < -_LANDING_WINDOW_S
            yield min(SLEW_PERIOD_S, abs(left) - _LANDING_WINDOW_S + _LANDING_PERIOD_S) if far else _LANDING_PERIOD_S
            reading = session.poll()
            if reading is None:
                self._give_up_on_silence()
                continue
            tell(report, progress_of(plan, reading))
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


def activity_of(plan: Plan, doing: str) -> Activity:
    """What the telescope is about while it does a plan."""
    one, two = plan.axes
    return Activity(
        doing,
        plan.start,
        plan.arrival,
        (one.from_counts, two.from_counts),
        (one.target_counts, two.target_counts),
        plan.target,
    )


def progress_of(plan: Plan, reading: Reading) -> Progress:
    """How far a plan is done at a reading."""
    return Progress(plan.target, max(0.0, plan.arrival - reading.time), plan.eta, reading.counts)
