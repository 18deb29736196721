"""Stages of a goto carried out: keys pressed and released at their times, and what their events tell.

Between two looks a key may be held; within half a second of its release the look lasts until that. A motion whose
beginning or end is not told in time makes the position unknown, and an axis that moves with no key of ours pressed is
released at once.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from mounts.awr import commands
from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Attended
from mounts.awr.cascade import Press, Stage
from mounts.awr.commands import Speed
from mounts.awr.messages import Backlash, Event, Moving
from mounts.awr.punctuality import Punctuality
from mounts.awr.uncertainty import Jitter
from mounts.awr.unit import Happened, Unit
from mounts.errors import DriveError
from transports.errors import NoAnswer, TransportError

SOON_S = 0.6  # before a release from which on a look lasts until it
_TOLD_S = 0.25  # after its time in which an event must have come
_TRIAL_S = 5.0  # longer that the end of a motion is waited for whose ramps are to be found out
_STRANGE_S = 0.03  # beside the jitter, by which a motion may last otherwise than its key
_SIGMAS, _EARLY_S = 5.0, 0.01
_INSTANT_S = 5e-4  # within which the stamps of two events are alike that follow one another on the line
_LEARNT = 0.2  # weight of a new delay among the old ones
_USUAL_S = 0.02  # from hearing a key to its acting
_FEW = 4  # keys of which that must be known before an event that comes otherwise is another's
_LATEST_S = 0.08  # likewise, so that the event of a key is seen at once
LOST = (
    "the unit did not tell when axis {} {} its motion, so nobody knows where it is; check the line, then `sync` on a "
    "known star"
)
ODD = (
    "axis {} moved for {:.2f} s instead of {:.2f} s: a damaged event, or frequency_unit or acceleration_unit is not "
    "as configured (`commission` finds them out); `sync` on a known star"
)
FOREIGN = (
    "axis {} moved with no key of this program pressed: the hand box, or a garbled command; its keys were released. "
    "`sync` on a known star"
)


@dataclass
class _Held:
    """A key of a stage."""

    press: Press
    pressed: float = math.nan  # POSIX seconds at which it was heard
    released: float = math.nan
    began: Happened | None = None

    @property
    def told_s(self) -> float:
        """Seconds after its time in which the end of its motion must be told, be its ramps slower than thought."""
        return _TOLD_S + 2.0 * self.press.key.climb_s


class Trial(NamedTuple):
    """A motion, and for how long its key was held, seconds."""

    duration: float
    hold: float


class Holding:
    """The keys of one unit.

    Parameters
    ----------
    unit : Unit
        The unit.
    beside : Attended
        Who stands beside a key that is held.
    axes : tuple of AwrAxis
        What the keys move.
    jitter : Jitter
        By how much keys and events are off their times.
    lose : callable
        Told why the position is unknown.
    """

    def __init__(
        self,
        unit: Unit,
        beside: Attended,
        axes: tuple[AwrAxis, AwrAxis],
        jitter: Jitter,
        lose: Callable[[str], None],
    ) -> None:
        self._unit = unit
        self._beside = beside
        self._axes = axes
        self.punctuality = Punctuality(jitter)
        """Whether keys and events are off their times by no more than that."""
        self._lose = lose
        self.speed: Speed | None = None
        """The speed in force, where that is known."""
        self.delay_s = _USUAL_S
        self._delays = 0  # of how many keys it is known
        """Seconds from hearing a key to its acting, as learnt."""
        self.trials: list[Trial] | None = None
        """What motions lasted, while it is found out what they should; None in all else."""
        self._held: dict[int, _Held] = {}
        self._due: list[tuple[float, int, bool]] = []
        self._must_release = False  # the unit has not confirmed that all keys are released, though it was told to
        self._suspect = (0, -math.inf)  # an axis whose key was perhaps heard, and until when that would be told
        self.unheard: int | None = None
        """The axis of a key of this stage that was not heard."""
        self.moving = (False, False)
        """What the unit told last."""

    @property
    def known_delay_s(self) -> float | None:
        """Seconds from hearing a key to its acting; None while too few keys were pressed to know."""
        return self.delay_s if self._delays >= _FEW else None

    def remember_delay(self, delay_s: float) -> None:
        """What was learnt of it before."""
        self.delay_s, self._delays = delay_s, _FEW

    @property
    def _news_s(self) -> float:
        """Seconds after its time in which an event must have come, from where the unit is."""
        return _TOLD_S + self._unit.delay_s

    @property
    def busy(self) -> bool:
        """Whether a key is held, or its motion not over yet."""
        return bool(self._held)

    def slewing(self, axis: int) -> bool:
        """Whether a key moves an axis."""
        return axis in self._held

    # A stage ---------------------------------------------------------------------------------------------------

    def begin(self, stage: Stage) -> float:
        """Choose its speed and press its first keys; return when the first one acts.

        Raises
        ------
        DriveRefused, DriveError, TransportError
            There is no dead-man process, or the unit does not obey.
        """
        self._beside.begin()
        self.unheard = None
        self.choose(stage.speed)
        first = self._unit.now() + self._unit.key_s
        self._due = [(first + at, axis, down) for at, axis, down in stage.commands]
        self._held = {axis: _Held(press) for axis, press in enumerate(stage.presses) if press}
        self.look(0.0)
        return first + self.delay_s

    def choose(self, speed: Speed) -> None:
        """Have a speed in force."""
        if self.speed != speed:
            self.speed = None
            self._unit.key(commands.SPEEDS[speed])
            self.speed = speed

    def look(self, soon_s: float = SOON_S) -> None:
        """Press, release and listen until nothing is due within `soon_s`.

        Raises
        ------
        DriveError, TransportError
            The unit does not obey or answer; all keys were released, as far as it listens.
        """
        if self._must_release:
            self.let_go()
        try:
            while (until := self._until(soon_s)) is not None:
                if self._due and self._due[0][0] <= until:
                    self._do(*self._due.pop(0))
                else:
                    self._listen(until, lambda event: isinstance(event, Moving))
                    self._overdue()
            self._beside.calm()
            self._listen(self._unit.now())
        except (DriveError, TransportError):
            if self._held:
                self.let_go()
            raise

    def _unheard(self, axis: int) -> None:
        """Neither an answer nor a motion was told of a key: it was not heard, unless an end of its motion is told."""
        held = self._held.pop(axis)
        self._due = [each for each in self._due if each[1] != axis]
        self.unheard = axis
        self._unit.release((axis,))
        self._rest()
        self._suspect = axis, self._unit.now() + held.press.key.climb_s + self._news_s

    def _until(self, soon_s: float) -> float | None:
        """Until when it must be listened now: the next command, or the latest that an event of ours may come."""
        soon = self._unit.now() + soon_s
        dues = [due for due, _, _ in self._due[:1] if due <= soon]
        for held in self._held.values():
            if held.began is None and not math.isnan(held.pressed):
                dues.append(held.pressed + self.delay_s + self._news_s)
            elif not math.isnan(held.released) and self._ends(held) <= soon:
                dues.append(self._ends(held) + self._told_s(held))
        return min(dues, default=None)

    def _overdue(self) -> None:
        """What was not told in time is lost."""
        now = self._unit.now()
        for axis, held in list(self._held.items()):
            if held.began is None and now >= held.pressed + self.delay_s + self._news_s:
                self._lost(axis, "began")
            elif now >= self._ends(held) + self._told_s(held):
                self._lost(axis, "ended")

    def _do(self, due: float, axis: int, down: bool) -> None:
        if not down:
            self._beside.hasten()
        self._listen(due - self._unit.key_s)
        held = self._held.get(axis)
        if held is None:
            return
        if down:
            self._press(axis, held)
        else:
            held.released = self._unit.release((axis,))
            self._rest()
        self._listen(self._unit.now())

    def _rest(self) -> None:
        """Where no key is to be released any more, nobody need stand beside."""
        if not any(not pressed for _, _, pressed in self._due):
            self._beside.rest()

    def _press(self, axis: int, held: _Held) -> None:
        body = commands.PRESSES[axis, held.press.sign]
        heard = self._unit.now() + self._unit.key_s
        try:
            heard = self._unit.key(body)
        except NoAnswer:
            if not any(isinstance(each.event, Moving) and each.event.axes[axis] for each in self._unit.peek()):
                self._unheard(axis)
                return
        held.pressed = heard
        self._axes[axis].pressed(held.press, heard + self.delay_s)

    def _told_s(self, held: _Held) -> float:
        return held.told_s + self._unit.delay_s + (_TRIAL_S if self.trials is not None else 0.0)

    def _ends(self, held: _Held) -> float:
        """When a motion is over that was released."""
        began = held.pressed + self.delay_s if held.began is None else held.began.time
        hold = held.released + self.delay_s - began
        return began + held.press.duration + max(0.0, hold - held.press.hold)

    # What is told ----------------------------------------------------------------------------------------------

    def _listen(self, until: float, enough: Callable[[Event], bool] = lambda _: False) -> None:
        self._unit.listen(until, enough)
        self.take(self._unit.events(Moving))

    def take(self, happened: list[Happened]) -> None:
        """Act on what the unit told of motion."""
        for each in happened:
            if isinstance(each.event, Moving):
                self._compare(each)
                for axis, moves in enumerate(each.event.axes):
                    self._told(axis, each, moves=moves)

    def _compare(self, each: Happened) -> None:
        """Each change is told by an event of its own: one that tells of two, or of none, shows that one was lost."""
        assert isinstance(each.event, Moving)  # noqa: S101 - as whoever calls has seen
        changed = [axis for axis in (0, 1) if each.event.axes[axis] != self.moving[axis]]
        suspected, until = self._suspect
        if len(changed) > 1 and self._held:
            self._lose(LOST.format(changed[0] + 1, "began" if each.event.axes[0] else "ended"))
        elif not changed and each.time < until:
            self._lose(LOST.format(suspected + 1, "began"))
        self.moving = each.event.axes

    def _told(self, axis: int, each: Happened, *, moves: bool) -> None:
        held = self._held.get(axis)
        if held is not None:
            each = self._when(axis, held.press, each, moves=moves)
        if held is None:
            if moves:
                self._foreign(axis)
        elif moves and held.began is None:
            held.began = each
            late = each.time - held.pressed - self.delay_s
            jitter = self.punctuality.jitter
            most = _SIGMAS * math.hypot(jitter.press_s, jitter.stamp_s) + _EARLY_S
            if not abs(late) <= (most if self._delays >= _FEW else _TOLD_S):
                self._lost(axis, "began")  # this event is another's, or damaged: no key was pressed
            else:
                self._delays += 1
                self.delay_s += max(_LEARNT, 1.0 / self._delays) * (each.time - held.pressed - self.delay_s)
                self._axes[axis].began(each.time)
        elif not moves and held.began is not None:
            duration, hold = each.time - held.began.time, held.released - held.pressed
            jitter, planned = self.punctuality.jitter, replace(held.press, hold=hold).duration
            if self.trials is not None:
                self.trials.append(Trial(duration, hold))
                self._axes[axis].ended(held.press.planned(jitter), each.time)
                del self._held[axis]
                return
            strange = _STRANGE_S + _SIGMAS * jitter.late_s(held.press.key, hold)
            if math.isnan(hold) or abs(duration - planned) > strange:
                self._lost(axis, "ended", ODD.format(axis + 1, duration, held.press.duration))
                return
            self.punctuality.heard(held.press, hold, duration)
            way = held.press.measured(jitter, duration, hold)
            doubt = abs(held.press.key.rate) * math.hypot(each.early_s, held.began.early_s) / 2.0
            self._axes[axis].ended(way._replace(sigma=math.hypot(way.sigma, doubt)), each.time)
            del self._held[axis]
        elif not moves and each.time > held.released + self.delay_s + _LATEST_S:
            self._lost(axis, "began")

    def _when(self, axis: int, press: Press, each: Happened, *, moves: bool) -> Happened:
        """An event that may have waited for the line, at the moment that a blip of its axis tells where there is one.

        A blip is where the motor turns round: after the drive's rate is braked as a motion begins, before it is taken
        up again as it ends.
        """
        if not each.early_s:
            return each
        since, turning = each.time - each.early_s, abs(self._axes[axis].rate) / press.key.acceleration
        for blip in self._unit.peek():
            mine = isinstance(blip.event, Backlash) and blip.event.axis == axis
            if mine and since - _INSTANT_S <= blip.time <= each.time:
                at = blip.time + (-turning if moves else turning)
                return Happened(each.event, min(max(at, since), each.time), blip.early_s)
        return each

    def _lost(self, axis: int, what: str, why: str = "") -> None:
        held = self._held.pop(axis)
        self._due = [each for each in self._due if each[1] != axis]
        self._unit.release((axis,))
        self._rest()
        now = self._unit.now()
        here = self._axes[axis].at(now)
        since = 0.0 if math.isnan(held.pressed) else now - held.pressed
        most = abs(held.press.key.rate) * (min(held.press.duration, since) + held.told_s)
        self._axes[axis].known(here.counts, now, here.uncertainty + most)
        self._lose(why or LOST.format(axis + 1, what))

    def _foreign(self, axis: int) -> None:
        """Something else moves an axis."""
        self._lose(FOREIGN.format(axis + 1))
        self._unit.release((axis,))

    # Letting go ------------------------------------------------------------------------------------------------

    def let_go(self) -> None:
        """Release all keys, whatever was planned, as far as the unit listens; what moved is lost track of."""
        self._due.clear()
        self._must_release = True
        for axis, held in list(self._held.items()):
            if math.isnan(held.pressed):
                del self._held[axis]
        heard = self._unit.release()
        self._must_release = False
        self._beside.rest()
        for held in self._held.values():
            held.released = heard if math.isnan(held.released) else held.released

    def halt(self) -> None:
        """Release all keys and wait until their motions have ended.

        Raises
        ------
        DriveError, TransportError
            The unit does not answer.
        """
        now = self._unit.now()
        self.let_go()
        for axis, held in self._held.items():
            began = now if held.began is None else held.began.time
            short = Press(held.press.key, max(0.0, now - began))
            held.press = short
            self._axes[axis].press = short
        self.look(math.inf)
