"""The telescope under control: it reads, checks, tracks, stops, and never points by a position that may be wrong.

Everything here runs on one thread, the control loop's. Between the steps of a command, and in the background, every
reading passes the same safety checks, whoever moved the telescope. The commands are in `slewing` and `adjusting`.
"""

import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, NoReturn

from clockdrive.corrections import DISPLACEMENTS, OF_A_TARGET, OFFSETS, displacement
from clockdrive.errors import Refused, StateError
from clockdrive.history import History
from clockdrive.left_alone import LeftAlone, unheld
from clockdrive.pursuit import Pursuit
from clockdrive.resting import Holding, place
from clockdrive.safety import Guard, moved_by_others, rests_at
from clockdrive.state import Activity, Correction, Event, Position, StateStore
from clockdrive.surroundings import Surroundings
from mounts.drive import Drive, HoldsUnplaced, Reading, Telling
from mounts.errors import DriveError, StillMoving, Unsynchronised
from pointing.errors import PointingError, Unreachable
from pointing.limits import Check
from pointing.mount import Posture
from pointing.offset import OffsetTarget
from pointing.plan import Plan, Start, Timing
from pointing.planner import Planner
from pointing.rotator import Hold
from pointing.rotator_plan import rotator_path, with_rotator
from pointing.targets import Target
from transports.errors import TransportError
from transports.link import Clock

if TYPE_CHECKING:
    from clockdrive.waiting import Waiting

_LOG = logging.getLogger(__name__)
_ARCSEC = math.pi / 648_000.0
_AT_REST = frozenset({"idle", "parked"})
MOVING = frozenset({"slewing", "jogging", "waiting"})
"""What a command does that another must not begin in."""
_DURING = {"slewing": "the slew to {}", "waiting": "the wait for {}", "tracking": "the tracking of {}"}
_TRACKING_PERIOD_S = 1.0
_IDLE_PERIOD_S = 2.0
_MOVED_PERIOD_S = 0.5  # while something else moves what is at rest
_HELD = {"idle": _MOVED_PERIOD_S, "parked": _MOVED_PERIOD_S, "waiting": 1.0}
"""Seconds from one look to the next at what stands and somebody else moves."""
_LARGEST_ERROR_DEG = 2.0  # that tracking may close by itself; a person's offsets reach 1.4°
_LED = "has become fast: it is followed by direct speed control, with the dead-man process beside it"
_NOT_LED = "is slow again: it is left to the drive's own tracking"
_LEFT_ALONE_S = 60.0  # after which it is looked for again
_HELD_AFTER_S = 10.0  # of being open, so that a look at what rests moves nothing, but where a limit is near
_STALE_PLAN_S = 0.05  # a plan that took longer to make is made again
_STALE_LED_S = 0.3  # one whose motion begins later by itself may take longer


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
    surroundings : Surroundings, optional
        The host's clock and the air; without it, the clock and the configured air.
    """

    def __init__(
        self,
        planner: Planner,
        drive: Drive,
        store: StateStore,
        clock: Clock,
        after_reading: Callable[[], None] = lambda: None,
        surroundings: Surroundings | None = None,
    ) -> None:
        self.planner = planner
        self.drive = drive
        self.store = store
        self.clock = clock
        self._after_reading = after_reading
        self.surroundings = surroundings or Surroundings(planner, clock)
        self.pursuit: Pursuit | None = None
        self.wanted: Target | None = None  # what is or was last pursued, as it was asked for
        self.wanted_since = -math.inf
        self.hold: Hold | None = None  # what the rotator was asked to hold at the last goto; None as configured
        self.begun: Activity | None = None  # the last slew, jog or waiting
        self.waiting: Waiting | None = None  # as long as it does
        self.history = History()
        self.doing = self._at_rest()
        self.reading: Reading | None = None
        self._trusted: Reading | None = None  # the last that could be
        self.link_lost_since: float | None = None
        self.trouble = ""
        self.sun_warning = ""  # as long as its zone is near to where the telescope looks, and nothing moves it away
        self._opened = -math.inf
        self._holding = Holding(planner)  # of a drive that cannot stop tracking
        self.held_unplaced = ""  # how, by a drive that holds what nobody knows the place of
        self._must_stop = False
        self._unstopped_because = ""
        self._others_stopped = False  # at the last reading
        self._period = _IDLE_PERIOD_S  # to the next reading
        self.guard = Guard(planner)
        self._left_alone: LeftAlone | None = None

    # Opening and closing ---------------------------------------------------------------------------------------

    def open(self, *, make_safe: bool) -> Reading:
        """Connect; a session that was cut short makes the drive safe first."""
        for text in self.surroundings.open(self.clock.now()):
            self.note("surroundings", text)
        cut_short = self.store.activity()
        self._opened = self.clock.now()
        reading = self.drive.connect(self.clock.now(), make_safe=make_safe or cut_short is not None)
        if cut_short is not None:
            ended = "the drive was stopped" if self.drive.capabilities.can_stop else "no command ends its last move"
            self.trouble = f"{cut_short.kind} {cut_short.detail} was cut short; {ended}"
            self.note("recovery", self.trouble)
            self.store.end_activity()
        for note in self.drive.notes:
            self.note("drive", note)
        if reading.tracking:  # left so by an earlier command; the safety rules bind it again
            self.doing = "tracking"
        self.taken(reading)
        with suppress(Refused):  # it was stopped, and `trouble` says why
            self._guarded(reading)
        return reading

    def close(self, *, keep_tracking: bool = False) -> bool:
        """Leave the drive safe; return whether it goes on tracking.

        With `keep_tracking` a drive that holds its rate alone goes on at it, bounded by its own soft limits, which
        were written and read back; any other is stopped, but for what was found tracking by itself and is left so.
        One that cannot be stopped tracks on in any case.
        """
        capabilities, pursuit = self.drive.capabilities, self.pursuit
        bounded = capabilities.bounds_itself or pursuit is None
        led = pursuit is not None and pursuit.led
        keep = keep_tracking and self.doing == "tracking" and capabilities.holds_rate_alone and bounded and not led
        self.pursuit = None
        try:
            self.drive.close(self.clock.now(), keep_tracking=keep)
        except (DriveError, TransportError) as error:  # it may move on: the next start makes it safe first
            self.store.begin(Activity("stopping", self.clock.now(), detail=str(error)))
            raise
        finally:
            self.remember()
            self._after_reading()
        self.store.end_activity()
        return keep or not self.drive.capabilities.can_stop

    # Reading and safety ----------------------------------------------------------------------------------------

    def cycle(self) -> float:
        """Poll, check, track; return the seconds to the next cycle. Never raises: the loop must go on."""
        try:
            if self._must_stop:
                self._try_to_stop()
            self.poll()
            return self.follow()
        except Refused:
            pass  # it was stopped, and `trouble` says why
        except (DriveError, StateError, PointingError) as error:  # the last from a target that nobody knows further
            self.stop_and_fail(str(error))
        except Exception as error:  # noqa: BLE001 - a telescope that moves must not lose its control thread
            _LOG.exception("the control cycle failed; the telescope is stopped")
            self.stop_and_fail(
                f"internal error, the telescope was stopped: {error!r}; `clockdrive report` helps to find it"
            )
        return self._usual_period

    def follow(self) -> float:
        """Keep the drive on the target in pursuit, if there is one; return the seconds until that is due again.

        A silent link is waited for.

        Raises
        ------
        Refused
            The telescope is too far off its way: a hand or a step of the clock moved one of them; or the target has
            no place any more. The telescope was stopped.
        """
        self._period = self._usual_period
        if self.pursuit is None:
            self._period = self._held()
        if self.pursuit is None or self.link_lost_since is not None:
            return self._period
        name, now = self.pursuit.target.name, self.clock.now()
        try:
            off = 0.0 if self.reading is None else self.pursuit.astray_arcsec(self.reading) / 3600.0
            if (
                off > _LARGEST_ERROR_DEG and self.doing != "slewing"
            ):  # no path is checked on the way that tracking would close it
                self.halt(
                    f"the telescope is {off:.1f}° off {name}, more than {_LARGEST_ERROR_DEG:g}°: `goto` it again"
                )
            if self.pursuit.adapt(now):
                self.note("tracking", f"{name} {_LED if self.pursuit.led else _NOT_LED}")
            self._period = self.drive.follow(self.pursuit, now)
        except TransportError as error:
            self._link_lost(error)
        except Unreachable as error:  # the target has come to where the pointing origin does not
            self.halt(f"{name}: {error}")
        except PointingError as error:  # it has no place any more, as after the end of its table
            self.halt(str(error))
        return self._period

    def _held(self) -> float:
        """Hold a drive that tracks whatever it is told where it came to rest; return the seconds to the next look."""
        reading, what = self.reading, self.drive.capabilities
        if self.doing not in _HELD or what.can_stop or reading is None or reading.unsynchronised:
            self._holding.end()
            self._hold_unplaced(reading)
            return self._usual_period
        self._hold_unplaced(None)
        if self.link_lost_since is not None:
            return self._usual_period
        if moved := self._holding.moved(reading, what):
            self.trouble = moved
            self.note("moved", moved)
        if self._holding.rest is None and self._only_looks:
            return self._usual_period
        rest = self._holding.at(reading, what)
        if rest is None:
            return _MOVED_PERIOD_S
        try:
            return min(self._usual_period, self.drive.follow(rest, self.clock.now()))
        except TransportError as error:
            self._link_lost(error)
            return self._usual_period

    def _hold_unplaced(self, reading: Reading | None) -> None:
        """Hold what is parked where it stands though nobody knows where that is, if the drive can."""
        if not isinstance(self.drive, HoldsUnplaced):
            return
        if self.doing != "parked" or reading is None or not reading.unsynchronised:
            self.drive.leave_unplaced()
            self.held_unplaced = ""
            return
        if self.link_lost_since is not None or self._only_looks:
            return
        try:
            held = self.drive.hold_unplaced(self.clock.now())
        except TransportError as error:
            self._link_lost(error)
            return
        if held and not self.held_unplaced:
            self.note("held", held)
        self.held_unplaced = held

    def held_at(self, angles: tuple[float, float]) -> tuple[float, float]:
        """Axis angles, radians, near to these at which the drive can be held and is allowed to, once it is there."""
        what, (one, two) = self.drive.capabilities, self.planner.axes
        if what.can_stop:
            return angles
        wanted = one.gearing.counts(angles[0]), two.gearing.counts(angles[1])
        held = place(self.planner, wanted, what, self.clock.now())
        return angles if held == wanted else self.planner.angles(held)

    @property
    def _only_looks(self) -> bool:
        """Whether it may be closed again before what rests must be held."""
        due = self._opened + _HELD_AFTER_S
        left = self.left_alone
        near = left is not None and left.limit is not None and left.limit < due + _LEFT_ALONE_S
        return self.clock.now() < due and not near

    @property
    def left_alone(self) -> LeftAlone | None:
        """What comes of a drive that tracks whatever it is told, when nobody holds it; None for one that stops.

        From where it was last known to be; None where that was never so since this program began.
        """
        reading, rate = self._trusted, self.drive.capabilities.goes_on_at
        if not rate or reading is None:
            return None
        if self._left_alone is None or not 0.0 <= reading.time - self._left_alone.time < _LEFT_ALONE_S:
            self._left_alone = LeftAlone.of(self.planner, reading, rate)
        return self._left_alone

    @property
    def unheld(self) -> str:
        """What comes of a drive that tracks on while nobody knows where it is, held or not; or nothing."""
        reading = self.reading
        if not self.drive.capabilities.goes_on_at or reading is None or not reading.unsynchronised:
            return ""
        if self.held_unplaced:
            return self.held_unplaced
        return unheld(self.left_alone, self.clock.now())

    @property
    def trusted_counts(self) -> tuple[float, float] | None:
        """Where the axes were when that was last known."""
        return None if self._trusted is None else self._trusted.counts

    def poll(self) -> Reading | None:
        """Read the drive and check it; None while the link is silent.

        Raises
        ------
        Refused
            A safety rule was broken; the telescope was stopped.
        """
        doing = _DURING.get(self.doing, self.doing).format(self.target_name)
        for text in self.surroundings.follow(self.clock.now(), doing):
            self.note("surroundings", text)
        try:
            reading = self.drive.read(self.clock.now())
        except TransportError as error:
            self._link_lost(error)
            return None
        except Unsynchronised as error:  # what was read before may be as wrong
            if self.reading is not None:
                self.reading = replace(self.reading, unsynchronised=str(error))
            raise
        if self.link_lost_since is not None:
            self.note("link", f"the link is back after {reading.time - self.link_lost_since:.1f} s")
            self.link_lost_since = None
        if isinstance(self.drive, Telling):
            for text in self.drive.told():
                self.note("drive", text)
        self.taken(reading)
        self._guarded(reading)
        return reading

    def _guarded(self, reading: Reading) -> None:
        doing = "at rest" if self.doing in _AT_REST else self.doing
        why = self.guard.why_stop(reading, doing, self._rests(reading), self._barred(reading))
        if not why and doing in {"at rest", "waiting"} and reading.tracking:
            why = "the drive tracks, but nothing is followed; it was stopped"
        if why:
            if doing == "at rest" and not self._others_stopped:  # what cannot be barred is stopped again and again
                self.note("stopped", why)
            self._others_stopped = doing == "at rest"
            self.halt(why)
        self._others_stopped = False

    @property
    def _usual_period(self) -> float:
        """Seconds from one look to the next, where no target asks for more."""
        if self.doing not in _AT_REST:
            return _TRACKING_PERIOD_S
        moved = self.reading is not None and moved_by_others(self.reading)
        return _MOVED_PERIOD_S if moved else _IDLE_PERIOD_S

    def _rests(self, reading: Reading) -> tuple[float, float] | None:
        """Counts at which what is tracked, or what somebody else moves, would come to rest."""
        if self.pursuit is None:
            if self.doing not in _HELD or not moved_by_others(reading):
                return None
            return rests_at(reading, self.drive.slew_models, _HELD[self.doing])
        if self.pursuit.led or self.doing == "slewing":
            return None
        return rests_at(reading, self.drive.slew_models, self._period)

    def _barred(self, reading: Reading) -> tuple[Check, ...]:
        return () if self.pursuit is None else self.pursuit.barred(reading)

    def taken(self, reading: Reading) -> Reading:
        """Take note of a reading, here and in the store."""
        was_held, self.reading = not self.unheld, reading
        if was_held and self.unheld:
            self.note("not held", self.unheld)
        self.history.add(reading)
        if not reading.unsynchronised:
            self._trusted = reading
        uncertainty = reading.axes[0].uncertainty_counts, reading.axes[1].uncertainty_counts
        with self.store.together():
            self.store.record_position(Position(reading.time, reading.counts, uncertainty, reading.unsynchronised))
            self.remember()
            self._after_reading()
        return reading

    def remember(self) -> None:
        """Keep what the drive must be given back."""
        self.store.learn("drive", self.drive.memory, self.clock.now())

    def _link_lost(self, error: TransportError) -> None:
        if self.link_lost_since is None:
            self.link_lost_since = self.clock.now()
            self.note("link", f"the drive does not answer: {error}")

    def halt(self, why: str) -> NoReturn:
        """Stop for a reason, and refuse to go on.

        Raises
        ------
        Refused
            Always.
        """
        self._try_to_stop()
        self.fail(why)
        raise Refused(why)

    def fail(self, why: str) -> None:
        """Give up what was being done; the drive is left as it is."""
        self.trouble = why
        self.pursuit = None
        if self.doing not in _AT_REST:
            self.note("stopped", why)
            self.doing = "idle"
            with self._unwritten():
                self.now_doing("idle")

    def stop_and_fail(self, why: str) -> None:
        """Stop after a failure that leaves the drive's state in doubt; what rests is left alone."""
        if self.doing not in _AT_REST:
            self._try_to_stop()
        self.fail(why)

    def _try_to_stop(self) -> None:
        """Stop; where that fails, every cycle tries again."""
        try:
            self.drive.stop(self.clock.now())
        except StillMoving as moving:
            self._must_stop = False
            self.note("stopped", str(moving))
        except (DriveError, TransportError) as error:
            if not self._must_stop:
                self.note("stop failed", f"{error}; tried again and again; the drive's own switch stops it as well")
            self._must_stop, self._unstopped_because = True, str(error)
        else:
            self._must_stop = False

    # Planning --------------------------------------------------------------------------------------------------

    def timing(self) -> Timing:
        """How the drive moves, with all that has been learnt of it."""
        one, two, *others = self.drive.slew_models
        rotator = others[0] if others else None
        return Timing(
            (one, two), self.drive.start_latency, self.drive.axes_land_together, self.drive.leading, rotator
        )

    def start(self) -> Start:
        """Where the axes are now."""
        reading = self.synchronised()
        now = self.clock.now()
        ahead = now - reading.time
        one, two, *others = reading.axes
        turned = ((other.counts + other.rate * ahead, other.rate) for other in others)
        counts = one.counts + one.rate * ahead, two.counts + two.rate * ahead
        return Start(now, counts, (one.rate, two.rate), next(turned, None))

    def uncertainty_counts(self) -> tuple[float, float]:
        """By how much the position may be off in each axis, counts.

        Raises
        ------
        Refused
            The position is not synchronised.
        """
        one, two = self.synchronised().axes[:2]
        return one.uncertainty_counts, two.uncertainty_counts

    def plan(self, target: Target, posture: Posture | None = None) -> Plan:
        """Plan a slew from here and now, in a posture or in the best.

        Raises
        ------
        Refused
            The position is not synchronised.
        Unreachable
            Nothing allowed leads there.
        """
        self.start()
        plan = self._planned(target, posture)
        stale = _STALE_PLAN_S if plan.trajectory is None else _STALE_LED_S
        if self.clock.now() - plan.start > stale:  # the first plan of a process builds its tables
            plan = self._planned(target, plan.posture)
        return plan

    def _planned(self, target: Target, posture: Posture | None) -> Plan:
        """Plan without the search for when it will be reachable: the control thread has a telescope to look after."""
        wanted, start, timing = self.corrected(target), self.start(), self.timing()
        plan = self.planner.plan(wanted, start, timing, posture, search=False)
        return with_rotator(self.planner, plan, wanted, start, timing, self.hold)

    def whence(self, target: Target, time: float | None) -> tuple[Target, Start, Timing]:
        """What a plan is made of: from where the axes are now, or at another time from there, at rest.

        Raises
        ------
        Refused
            The position is not synchronised.
        """
        start = self.start()
        still = None if start.rotator is None else (start.rotator[0], 0.0)
        begin = start if time is None else Start(time, start.counts, rotator=still)
        return self.displaced(target), begin, self.timing()

    def displaced(self, target: Target) -> Target:
        """The target with the person's offsets."""
        return self._displaced(target, OFFSETS)

    def corrected(self, target: Target) -> Target:
        """The target with the person's offsets and, if it is the one pursued, what guides and centres it."""
        return self._displaced(target, DISPLACEMENTS if target is self.wanted else OFFSETS)

    def _displaced(self, target: Target, names: tuple[str, ...]) -> Target:
        east, north = displacement(self.store.corrections(), names)
        return OffsetTarget(target, east * _ARCSEC, north * _ARCSEC) if east or north else target

    def corrections(self) -> tuple[Correction, ...]:
        """What a person has corrected and is in force: guide and centre while their target is pursued."""
        idle = OF_A_TARGET if self.pursuit is None else ()
        return tuple(each for each in self.store.corrections() if each.name not in idle)

    @contextmanager
    def holding(self, hold: Hold | None) -> Iterator[None]:
        """Let the rotator hold something from now on; as before, where the block fails."""
        before, self.hold = self.hold, hold
        try:
            yield
        except BaseException:
            self.hold = before
            raise

    def forget_target(self) -> None:
        """Begin anew: what guided and centred the last target is cleared, and said so."""
        cleared = [name for name in OF_A_TARGET if self.store.clear_correction(name)]
        if cleared and self.wanted is not None:
            self.note("corrections", f"{', '.join(cleared)} of {self.wanted.name} cleared by a new goto")
        self.wanted = None

    def synchronised(self) -> Reading:
        """The last reading, if its position can be trusted.

        Raises
        ------
        Refused
            It cannot; says why.
        """
        reading = self.reading
        if reading is None:
            raise Refused("the drive has not answered yet; try again in a moment")
        if reading.unsynchronised:
            raise Refused(f"the position is not synchronised: {reading.unsynchronised}")
        return reading

    # What the commands need ------------------------------------------------------------------------------------

    def require_free(self, *, parked: bool = False) -> None:
        """Refuse a command that cannot begin now; `parked` for one that a parked telescope may do.

        Raises
        ------
        Refused
            The telescope moves, or is parked.
        """
        if self._must_stop:
            self._try_to_stop()
        if self._must_stop:
            raise Refused(f"the telescope could not be stopped yet: {self._unstopped_because}")
        if self.doing in MOVING:
            raise Refused(f"the telescope is {self.doing}; wait for it, or `stop` first")
        if self.store.parked() and not parked:
            raise Refused("the telescope is parked; `unpark` first")

    @property
    def target_name(self) -> str:
        """What is followed, slewn to or waited for; empty while there is nothing."""
        if self.pursuit is not None:
            return self.pursuit.target.name
        return self.begun.detail if self.begun is not None and self.doing in {"slewing", "waiting"} else ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What stands and a person must act on."""
        return tuple(text for text in (self.sun_warning, self.surroundings.stepped, self.unheld) if text)

    def begin(self, activity: Activity) -> None:
        """Begin a slew; it is on the disk before anything moves."""
        self.store.begin(activity)
        self.pursuit, self.trouble, self.doing = None, "", activity.kind
        self.begun, self.waiting = activity, None
        self.surroundings.stepped = self.sun_warning = ""  # what they said was of the last target

    def pursue(self, target: Target, plan: Plan) -> Pursuit:
        """Follow a target from the end of a slew on."""
        angles = plan.axes[0].angle, plan.axes[1].angle
        if target is not self.wanted:
            self.wanted, self.wanted_since = target, self.clock.now()
        followed = self.corrected(target) if plan.trajectory is None else plan.trajectory.target
        rotator = rotator_path(self.planner, plan, followed)
        leading, planned = self.drive.leading, plan.trajectory
        self.pursuit = Pursuit(self.planner, followed, plan.posture, angles, leading, planned, rotator)
        return self.pursuit

    def stop(self) -> None:
        """Stop everything, tracking included; a stop that does not reach the drive is tried again every cycle.

        Raises
        ------
        StillMoving
            All was done that can be: what is under way ends by itself.
        DriveError, TransportError
            It did not reach the drive.
        """
        stands = self.doing in _AT_REST and not self._must_stop
        self.pursuit = None
        self._must_stop = True
        self.doing = self._at_rest()
        try:
            self.drive.stop(self.clock.now())
        except StillMoving as moving:
            self._stopped(f"by command: {moving}")
            raise
        self._stopped("" if stands else "by command")  # an interruption stops on its way out as well

    def _stopped(self, said: str) -> None:
        self._must_stop = False
        self.now_doing(self.doing)
        if said:
            self.note("stopped", said)

    def unpark(self) -> bool:
        """Allow motion again; return whether it was parked."""
        was = self.store.parked()
        self.store.record_parked(parked=False, time=self.clock.now())
        if self.doing in _AT_REST:
            self.now_doing("idle")
        return was

    def power(self, *, on: bool) -> None:
        """Power the motors, or stop and send the drive to standby."""
        if not on:
            self.stop()
        self.drive.power(on=on)
        self.note("power", "on" if on else "standby")

    def now_doing(self, doing: str, detail: str = "") -> None:
        """Say what the telescope does from now on."""
        self.doing = doing
        if doing in _AT_REST:
            self.store.end_activity()
        else:
            self.store.begin(Activity(doing, self.clock.now(), detail=detail))

    def note(self, kind: str, text: str) -> None:
        """Write into the history; one that cannot be written must not keep the telescope from being stopped."""
        with self._unwritten():
            self.store.record_event(Event(self.clock.now(), kind, text))

    def _at_rest(self) -> str:
        return "parked" if self.store.parked() else "idle"

    @contextmanager
    def _unwritten(self) -> Iterator[None]:
        """Log what the store cannot take."""
        try:
            yield
        except StateError as error:
            _LOG.error("not remembered: %s", error)
