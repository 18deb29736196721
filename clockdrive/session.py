"""What the telescope does: slews, tracks, stops, and never points by a position that may be wrong.

Everything here runs on one thread, the control loop's. Commands that take time are steps (`clockdrive.control`);
between them, and in the background, every reading passes the same safety checks, whoever moved the telescope.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass

from clockdrive.control import Steps
from clockdrive.corrections import OFFSETS
from clockdrive.errors import Refused
from clockdrive.pursuit import Pursuit
from clockdrive.safety import Guard
from clockdrive.state import Activity, Correction, Event, Position, StateStore, Synchronisation
from mounts.drive import AxisSlew, Drive, Reading
from mounts.errors import DriveError
from pointing.mount import Posture
from pointing.offset import OffsetTarget
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.targets import Target
from transports.errors import TransportError
from transports.link import Clock

_LOG = logging.getLogger(__name__)
_ARCSEC = math.pi / 648_000.0
_AT_REST = frozenset({"idle", "parked"})
_TRACKING_PERIOD_S = 1.0
_IDLE_PERIOD_S = 2.0
_SLEW_PERIOD_S = 0.25
_LANDING_PERIOD_S = 0.02  # polls around the predicted landing, which the drive learns from
_LANDING_WINDOW_S = 0.4
_STALE_PLAN_S = 0.05  # a plan that took longer to make is made again
_ABSORBED_ARCSEC = 60.0  # an error on arrival that tracking closes by itself
_SETTLED_COUNTS = 2.0
_SETTLE_S = 15.0
_MOST_SLEWS = 4
_LINK_LOST_S = 15.0  # after which a slew is given up; the drive ends it by itself
_LARGEST_OFFSET_ARCSEC = 3600.0
_LARGEST_SYNC_DEG = 5.0  # a sync beyond this asks for confirmation


@dataclass(frozen=True)
class Progress:
    """A slew under way."""

    target: str
    remaining_s: float
    eta_s: float
    counts: tuple[float, float]


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


class Session:
    """One telescope under control.

    Parameters
    ----------
    planner : Planner
        Sky, mount, axes, limits.
    drive : Drive
        Not yet connected.
    store : StateStore
        What outlives this process.
    clock : Clock
        The time.
    after_reading : callable
        Called after every reading; the embedded simulator is kept there.
    """

    def __init__(
        self,
        planner: Planner,
        drive: Drive,
        store: StateStore,
        clock: Clock,
        after_reading: Callable[[], None] = lambda: None,
    ) -> None:
        self.planner = planner
        self.drive = drive
        self.store = store
        self.clock = clock
        self._after_reading = after_reading
        self.pursuit: Pursuit | None = None
        self.doing = "idle"
        self.reading: Reading | None = None
        self.link_lost_since: float | None = None
        self.trouble = ""
        self._guard = Guard(planner)

    # Opening and closing ---------------------------------------------------------------------------------------

    def open(self, *, make_safe: bool) -> Reading:
        """Connect; a session that was cut short makes the drive safe first."""
        cut_short = self.store.activity()
        reading = self.drive.connect(self.clock.now(), make_safe=make_safe or cut_short is not None)
        if cut_short is not None:
            self._note("recovery", f"{cut_short.kind} {cut_short.detail} was cut short; the drive was stopped")
            self.store.end_activity()
        for note in self.drive.notes:
            self._note("drive", note)
        if reading.tracking:  # left so by an earlier command; the safety rules bind it again
            self.doing = "tracking"
        return self._taken(reading)

    def close(self, *, keep_tracking: bool = False) -> bool:
        """Leave the drive safe; return whether it goes on tracking.

        With `keep_tracking` a drive that holds its rate alone goes on at it, bounded by its own soft limits, which
        were written and read back; any other is stopped.
        """
        keep = keep_tracking and self.doing == "tracking" and self.drive.capabilities.holds_rate_alone
        try:
            self.drive.close(self.clock.now(), keep_tracking=keep)
        finally:
            self.pursuit = None
            self.store.end_activity()
            self._remember()
            self._after_reading()
        return keep

    # Reading and safety ----------------------------------------------------------------------------------------

    def cycle(self) -> float:
        """Poll, check, track; return the seconds to the next cycle. Never raises: the loop must go on."""
        try:
            reading = self.poll()
            if reading is not None and self.pursuit is not None:
                self.drive.follow(self.pursuit, self.clock.now())
        except (DriveError, TransportError, Refused) as error:
            self._fail(str(error))
        except Exception as error:  # noqa: BLE001 - a telescope that moves must not lose its control thread
            _LOG.exception("the control cycle failed; the telescope is stopped")
            self._fail(f"internal error, the telescope was stopped: {error!r}; `clockdrive report` helps to find it")
            self._try_to_stop()
        return _IDLE_PERIOD_S if self.pursuit is None else _TRACKING_PERIOD_S

    def poll(self) -> Reading | None:
        """Read the drive and check it; None while the link is silent.

        Raises
        ------
        Refused
            A safety rule was broken; the telescope was stopped.
        """
        try:
            reading = self.drive.read(self.clock.now())
        except TransportError as error:
            self._link_lost(error)
            return None
        if self.link_lost_since is not None:
            self._note("link", f"the link is back after {reading.time - self.link_lost_since:.1f} s")
            self.link_lost_since = None
        self._taken(reading)
        why = self._guard.why_stop(reading, moving=self.doing not in _AT_REST)
        if why:
            self._halt(why)
        return reading

    def _taken(self, reading: Reading) -> Reading:
        self.reading = reading
        uncertainty = reading.axes[0].uncertainty_counts, reading.axes[1].uncertainty_counts
        self.store.record_position(Position(reading.time, _counts(reading), uncertainty, reading.unsynchronised))
        self._remember()
        self._after_reading()
        return reading

    def _remember(self) -> None:
        self.store.learn("drive", self.drive.memory, self.clock.now())

    def _link_lost(self, error: TransportError) -> None:
        if self.link_lost_since is None:
            self.link_lost_since = self.clock.now()
            self._note("link", f"the drive does not answer: {error}")

    def _halt(self, why: str) -> None:
        self._try_to_stop()
        self._fail(why)
        raise Refused(why)

    def _fail(self, why: str) -> None:
        if self.pursuit is not None or self.doing not in _AT_REST:
            self._note("stopped", why)
        self.trouble = why
        self.pursuit = None
        self._now_doing("idle")

    def _try_to_stop(self) -> None:
        try:
            self.drive.stop(self.clock.now())
        except (DriveError, TransportError) as error:
            self._note("stop failed", f"{error}; switch the drive off by hand if the telescope still moves")

    # Planning --------------------------------------------------------------------------------------------------

    def timing(self) -> Timing:
        """How the drive moves, with all that has been learnt of it."""
        one, two = self.drive.slew_models[:2]
        return Timing((one, two), self.drive.start_latency, self.drive.axes_land_together)

    def start(self) -> Start:
        """Where the axes are now."""
        reading = self._synchronised()
        now = self.clock.now()
        ahead = now - reading.time
        one, two = reading.axes[:2]
        return Start(now, (one.counts + one.rate * ahead, two.counts + two.rate * ahead), (one.rate, two.rate))

    def plan(self, target: Target) -> Plan:
        """Plan a slew from here and now.

        Raises
        ------
        Refused
            The position is not synchronised.
        Unreachable
            Nothing allowed leads there.
        """
        self.start()
        plan = self.planner.plan(self.displaced(target), self.start(), self.timing())
        if self.clock.now() - plan.start > _STALE_PLAN_S:  # the first plan of a process builds its tables
            plan = self.planner.plan(self.displaced(target), self.start(), self.timing())
        return plan

    def plan_at(self, target: Target, time: float) -> Plan:
        """Plan a slew that would start at another time from where the axes are now, at rest.

        Raises
        ------
        Refused, Unreachable
            As for `plan`.
        """
        start = Start(time, self.start().counts)
        return self.planner.plan(self.displaced(target), start, self.timing())

    def displaced(self, target: Target) -> Target:
        """The target with the person's offsets."""
        offsets = {correction.name: correction.value for correction in self.store.corrections()}
        east, north = (offsets.get(name, 0.0) for name in OFFSETS)
        return OffsetTarget(target, east * _ARCSEC, north * _ARCSEC) if east or north else target

    def _synchronised(self) -> Reading:
        reading = self.reading
        if reading is None:
            raise Refused("the drive has not answered yet; try again in a moment")
        if reading.unsynchronised:
            raise Refused(f"the position is not synchronised: {reading.unsynchronised}")
        return reading

    # Moving ----------------------------------------------------------------------------------------------------

    def goto(self, target: Target, report: Report) -> Steps[Arrival]:
        """Slew to a target and track it; slew again only when the first did not hit."""
        self._free()
        plans: list[Plan] = []
        error = math.inf
        while error > _ABSORBED_ARCSEC:
            if len(plans) == _MOST_SLEWS:
                self._halt(
                    f"{target.name}: still {error:.0f}″ off after {_MOST_SLEWS} slews; check gears and clutches"
                )
            plans.append(self.plan(target))
            yield from self._slew(plans[-1], "slewing", report)
            landed = self._synchronised()
            pursuit = self._pursue(target, plans[-1])
            error = pursuit.error_arcsec(landed)
        yield from self._settle(pursuit)
        self._note("arrived", f"{target.name}, {error:.1f}″ off on landing, {len(plans)} slew(s)")
        return Arrival(plans[0], landed.time, error, len(plans))

    def go_to_angles(self, name: str, angles: tuple[float, float], report: Report, then: str = "idle") -> Steps[Plan]:
        """Slew to axis angles and stay there: park and home."""
        self._free(parked=True)
        plan = self.planner.plan_axes(name, angles, self.start(), self.timing())
        yield from self._slew(plan, "slewing", report)
        self._now_doing(then)
        return plan

    def jog(self, axis: int, rate: float, seconds: float, report: Report) -> Steps[Plan]:
        """Move one axis at `rate` radians a second for a time: a slew that cannot go further than that."""
        self._free()
        angles = list(self._angles(self._synchronised()))
        angles[axis] += rate * seconds
        gearing, model = self.planner.axes[axis].gearing, self.drive.slew_models[axis]
        speed = abs(rate * gearing.counts_per_radian)
        if not 0.0 < speed <= model.max_rate:
            most = math.degrees(abs(model.max_rate / gearing.counts_per_radian))
            raise Refused(
                f"a jog at {math.degrees(rate):g}°/s: axis {axis + 1} can go faster than 0 up to {most:.3f}°/s"
            )
        plan = self.planner.plan_axes(f"jog axis {axis + 1}", (angles[0], angles[1]), self.start(), self.timing())
        yield from self._slew(plan, "jogging", report, {axis: speed})
        self._now_doing("idle")
        return plan

    def _slew(self, plan: Plan, doing: str, report: Report, speeds: dict[int, float] | None = None) -> Steps[None]:
        self.pursuit = None
        self.trouble = ""
        counts = plan.axes[0].target_counts, plan.axes[1].target_counts
        start = plan.axes[0].from_counts, plan.axes[1].from_counts
        self.store.begin(Activity(doing, plan.start, plan.arrival, start, counts, plan.target))
        self.doing = doing
        speeds = speeds or {}
        slews = [AxisSlew(axis.target_counts, axis.rate_counts, speeds.get(i)) for i, axis in enumerate(plan.axes)]
        try:
            self.drive.start(slews, self.clock.now())
            yield from self._landing(plan, report)
        except (DriveError, TransportError) as error:
            self._try_to_stop()
            self._fail(str(error))
            raise

    def _landing(self, plan: Plan, report: Report) -> Steps[None]:
        self._remember()
        while True:
            left = plan.arrival - self.clock.now()
            near = abs(left) < _LANDING_WINDOW_S
            yield _LANDING_PERIOD_S if near else min(_SLEW_PERIOD_S, max(left - _LANDING_WINDOW_S, _LANDING_PERIOD_S))
            reading = self.poll()
            if reading is None:
                self._give_up_on_silence()
                continue
            report(Progress(plan.target, max(0.0, plan.arrival - reading.time), plan.eta, _counts(reading)))
            if not any(axis.slewing for axis in reading.axes):
                return

    def _give_up_on_silence(self) -> None:
        since = self.link_lost_since
        if since is not None and self.clock.now() - since > _LINK_LOST_S:
            why = f"the drive has not answered for {_LINK_LOST_S:.0f} s; it ends its slew by itself. Check the link"
            self._fail(why)
            raise Refused(why)

    def _pursue(self, target: Target, plan: Plan) -> Pursuit:
        angles = plan.axes[0].angle, plan.axes[1].angle
        self.pursuit = Pursuit(self.planner, self.displaced(target), plan.posture, angles)
        self._now_doing("tracking", target.name)
        return self.pursuit

    def _settle(self, pursuit: Pursuit) -> Steps[None]:
        """Let tracking close what is left."""
        deadline = self.clock.now() + _SETTLE_S
        while self.pursuit is pursuit:
            self.drive.follow(pursuit, self.clock.now())
            if max(map(abs, pursuit.errors(self._synchronised()))) <= _SETTLED_COUNTS:
                return
            if self.clock.now() > deadline:
                self._note("tracking", "the telescope does not settle on the target; check balance and clutches")
                return
            yield _TRACKING_PERIOD_S / 2.0
            self.poll()

    def stop(self) -> None:
        """Stop everything, tracking included."""
        self.pursuit = None
        try:
            self.drive.stop(self.clock.now())
        finally:
            self._now_doing("idle")
            self._note("stopped", "by command")

    def _free(self, *, parked: bool = False) -> None:
        if self.doing in {"slewing", "jogging"}:
            raise Refused(f"the telescope is {self.doing}; wait for it, or `stop` first")
        if self.store.parked() and not parked:
            raise Refused("the telescope is parked; `unpark` first")

    # Position and corrections ----------------------------------------------------------------------------------

    def sync(self, target: Target, posture: Posture | None, *, force: bool) -> float:
        """Declare that the telescope points at a target now; return the correction in degrees on the sky.

        Raises
        ------
        Refused
            It slews; the mount cannot point there; or the correction is beyond 5° and `force` is not given.
        """
        self._free(parked=True)
        reading = self.poll() or self._synchronised()
        now = self.clock.now()
        here = self._angles(reading)
        trusted = not reading.unsynchronised
        side = posture or (self.planner.mount.posture(here[1]) if trusted else "normal")
        near = here if trusted else self._middle()
        (angle1, _), (angle2, _) = self.planner.track(target, now, side, near)
        correction = self._correction(here, (angle1, angle2))
        if trusted and correction > _LARGEST_SYNC_DEG and not force:
            raise Refused(
                f"a sync on {target.name} would move the position by {correction:.2f}°, "
                f"more than {_LARGEST_SYNC_DEG:g}°: check the target, or say --force"
            )
        failed = [check.detail for check in self.planner.standing((angle1, angle2), now) if not check.ok]
        if failed:
            raise Refused(f"the telescope cannot point at {target.name} now: {'; '.join(failed)}")
        axes = self.planner.axes
        counts = axes[0].gearing.counts(angle1), axes[1].gearing.counts(angle2)
        self.drive.sync(counts, now)
        self.store.record_synchronisation(Synchronisation(now, counts, 1.0, f"sync on {target.name}"))
        self._note("sync", f"on {target.name}, by {correction * 3600.0:.1f}″")
        self._taken(self.drive.read(self.clock.now()))
        if self.pursuit is not None:
            self.pursuit = Pursuit(self.planner, self.pursuit.target, side, (angle1, angle2))
        return correction

    def _middle(self) -> tuple[float, float]:
        one, two = self.planner.axes
        return (one.minimum + one.maximum) / 2.0, (two.minimum + two.maximum) / 2.0

    def _correction(self, here: tuple[float, float], there: tuple[float, float]) -> float:
        return math.degrees(max(abs(a - b) for a, b in zip(here, there, strict=True)))

    def offset(self, east_arcsec: float, north_arcsec: float) -> None:
        """Add to the person's offsets; the target in pursuit moves with them.

        Raises
        ------
        Refused
            A value is beyond a degree: that is another target.
        """
        now = self.clock.now()
        values = {correction.name: correction.value for correction in self.store.corrections()}
        for name, add in zip(OFFSETS, (east_arcsec, north_arcsec), strict=True):
            total = values.get(name, 0.0) + add
            if not abs(total) <= _LARGEST_OFFSET_ARCSEC:
                raise Refused(f"{name} of {total:g}″: at most ±{_LARGEST_OFFSET_ARCSEC:g}″; `goto` another target")
            self.store.set_correction(Correction(name, total, "arcsec", "offset command", now))
        self._displace_pursuit()

    def clear(self, name: str) -> None:
        """Remove a correction that a person made, or both offsets by the name `offset`.

        Raises
        ------
        Refused
            No such correction can be removed.
        """
        names = OFFSETS if name == "offset" else (name,)
        cleared = [each for each in names if self.store.clear_correction(each)]
        if not cleared:
            known = [correction.name for correction in self.store.corrections()]
            raise Refused(f"no correction {name!r} to clear; there is {', '.join(known) or 'none'}")
        self._displace_pursuit()

    def _displace_pursuit(self) -> None:
        if self.pursuit is not None:
            target = self.pursuit.target
            base = target.base if isinstance(target, OffsetTarget) else target
            self.pursuit = self.pursuit.moved_to(self.displaced(base))

    def unpark(self) -> None:
        """Allow motion again."""
        self.store.record_parked(parked=False, time=self.clock.now())
        self._now_doing("idle")

    def power(self, *, on: bool) -> None:
        """Power the motors, or stop and send the drive to standby."""
        if not on:
            self.stop()
        self.drive.power(on=on)
        self._note("power", "on" if on else "standby")

    def _angles(self, reading: Reading) -> tuple[float, float]:
        return self.planner.angles(_counts(reading))

    def _now_doing(self, doing: str, detail: str = "") -> None:
        self.doing = doing
        if doing in _AT_REST:
            self.store.end_activity()
        else:
            self.store.begin(Activity(doing, self.clock.now(), detail=detail))

    def _note(self, kind: str, text: str) -> None:
        self.store.record_event(Event(self.clock.now(), kind, text))


def _counts(reading: Reading) -> tuple[float, float]:
    return reading.axes[0].counts, reading.axes[1].counts
