"""Stages of a goto carried out: keys pressed and released at their times, and what their events tell.

Between two looks a key may be held; within half a second of its release the look lasts until that. A motion whose
beginning or end is not told in time makes the position unknown, and an axis that moves with no key of ours pressed is
released at once.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import NamedTuple

from mounts.awr import commands
from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Attended
from mounts.awr.cascade import Press, Stage
from mounts.awr.commands import Speed
from mounts.awr.held import TOLD_S, Held
from mounts.awr.messages import Backlash, Event, Moving
from mounts.awr.punctuality import Punctuality
from mounts.awr.uncertainty import Jitter
from mounts.awr.unit import Happened, Heard, Unit
from mounts.errors import DriveError
from transports.errors import NoAnswer, TransportError

SOON_S = 0.6  # before a release from which on a look lasts until it
_BEGUN_S = 0.1  # in which the beginning of a motion must be told, once the delay of keys is known
_AGAIN_S = 0.06, 0.12  # after a release at which it is sent again, as it may have been damaged
_APART = 6.0  # standard deviations by which both are told apart by when the motion ends
_SELDOM = 3.0  # standard deviations after which a motion should have ended
_EVERY_S = 0.1  # from then on, until it is told that the axis stands
_ROOM_S = 0.02  # on the line for a release and its answer
_LATE_S = 0.01  # by which a key is pressed or released late, as its answer or another's was lost
_TRIAL_S = 5.0  # longer that the end of a motion is waited for whose ramps are to be found out
_INSTANT_S = 5e-4  # within which the stamps of two events are alike that follow one another on the line
_LEARNT = 0.2  # weight of a new delay among the old ones
_USUAL_S = 0.02  # from hearing a key to its acting
_FEW = 4  # keys of which that must be known before an event that comes otherwise is another's
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
        unit.at_rest = lambda: not self._held
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
        self._held: dict[int, Held] = {}
        self._due: list[tuple[float, int, bool]] = []
        self._must_release = False  # the unit has not confirmed that all keys are released, though it was told to
        self._repeated = False  # a release was sent again since both keys were known to be released
        self._listened = -math.inf  # POSIX seconds until which it is listened whether a release has become a press
        self._suspect = (
            0,
            -math.inf,
            0.0,
        )  # an axis whose key was perhaps heard, until when, its way
        self.unheard: int | None = None
        """The axis of a key of this stage that was not heard."""
        self.moving = (False, False)
        """What the unit told last."""
        self._told_at = -math.inf  # POSIX seconds
        self.unproven = False
        """An axis is reckoned by its key alone, and nobody has seen that the unit had power meanwhile."""

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
        return TOLD_S + self._unit.delay_s

    @property
    def _begun_s(self) -> float:
        """Seconds after its time in which a motion must be told to begin, or else a key is released again."""
        return self._news_s if self._delays < _FEW else _BEGUN_S + self._unit.delay_s

    @property
    def busy(self) -> bool:
        """Whether a key is held, or its motion not over yet."""
        return bool(self._held)

    def doubt(self, axis: int) -> float:
        """Steps within which an axis is of where its key should have brought it by now, in 95 of 100 cases."""
        held, (suspected, until, way) = self._held.get(axis), self._suspect
        if axis == suspected and self._unit.now() < until:
            return way
        if held is None or not held.is_pressed:
            return 0.0
        unsure = TOLD_S if held.began is None and self._delays < _FEW else 0.0
        return held.doubt(self.punctuality.jitter) + abs(held.press.key.rate) * unsure

    def stood(self) -> None:
        """The unit stopped everything at once, and tells no end of what moved."""
        self.moving = (False, False)

    def free_for(self, seconds: float) -> bool:
        """Whether no key is to be pressed or released so soon, and no event of theirs is awaited."""
        return self._until(seconds) is None

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
        self._held = {axis: Held(press) for axis, press in enumerate(stage.presses) if press}
        self.look(0.0)
        return first + self.delay_s

    def choose_anew(self) -> None:
        """The next stage begins a motion: whatever was chosen before, a hand box may have chosen another since."""
        self.speed = None

    def choose(self, speed: Speed) -> None:
        """Have a speed in force, whatever damaged commands made of it: nothing tells which one is."""
        times = 1 if self.speed == speed else 2
        self.speed = None
        for _ in range(times):
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
                    self._do(*self._due[0])
                else:
                    self._listen(until, lambda event: isinstance(event, Moving))
                    self._overdue()
            if not self._near(SOON_S):
                self._beside.calm()
            self._listen(self._unit.now())
        except (DriveError, TransportError):
            if self._held:
                self.let_go()
            raise

    def _unheard(self, axis: int, since: float) -> None:
        """Neither an answer nor a motion was told of a key: it was not heard, unless an end of its motion is told."""
        held = self._held.pop(axis)
        self._due = [each for each in self._due if each[1] != axis]
        self.unheard = axis
        with self._promised(axis):
            self._unit.release((axis, axis))
        self._rest()
        now = self._unit.now()
        way = abs(held.press.key.way(now - since))
        self._suspect = axis, now + held.press.key.climb_s + self._news_s, way

    def _until(self, soon_s: float) -> float | None:
        """Until when it must be listened now: the next command, or the latest that an event of ours may come."""
        soon = self._unit.now() + soon_s
        dues = [due for due, _, _ in self._due[:1] if due <= soon]
        if self._unit.now() < self._listened:
            dues.append(self._listened)
        for held in self._held.values():
            if held.is_released:
                dues.append(self._over(held))
            elif held.is_pressed and not held.is_seen:
                dues.append(held.pressed.last + self.delay_s + self._begun_s)
        return min(dues, default=None)

    def _overdue(self) -> None:
        """What was not told in time is lost: a motion that was seen is known by its key, another by nothing."""
        now = self._unit.now()
        for axis, held in list(self._held.items()):
            if held.is_released:
                if now >= self._over(held):
                    self._unended(axis, held)
            elif not held.is_seen and now >= held.pressed.last + self.delay_s + self._begun_s:
                self._cut_short(axis, held)

    def _over(self, held: Held) -> float:
        """When its key is released again, or the end of a motion must have been told for good."""
        return min(self._again_at(held), self._told_by(held))

    def _told_by(self, held: Held) -> float:
        """When the end of a motion must have been told, be it its second release that was heard."""
        ends = held.ends(self.delay_s)
        if held.is_again:
            ends = max(ends, held.again.last + self.delay_s + held.press.key.climb_s)
        return ends + self._told_s(held)

    def _again_at(self, held: Held) -> float:
        """When a key is released again: a release may have become another command, and that is answered as well.

        Not while its end is expected, which shows that it was heard, nor while another key is due.
        """
        jitter = self.punctuality.jitter
        late_s = jitter.late_s(held.press.key, held.hold)
        if held.is_again:
            last = held.repeated
            at = last + _EVERY_S
        else:
            least, most = _AGAIN_S
            last = held.released.first
            at = last + min(max(least, _APART * late_s), most)
        end = held.ends(self.delay_s)
        taken = [(due - _ROOM_S, due + _ROOM_S) for due, _, _ in self._due]
        taken.append((end - 2.0 * _ROOM_S, end + min(_EVERY_S, _ROOM_S + _SELDOM * late_s + self._unit.delay_s)))
        for other in self._held.values():
            if other is not held and other.is_released:
                end = other.ends(self.delay_s)
                taken.append((end - 2.0 * _ROOM_S, end + _ROOM_S))
        for begin, end in sorted(taken):
            if begin < at < end:
                at = begin if begin > last + 2.0 * _ROOM_S else end
        return at

    def _unended(self, axis: int, held: Held) -> None:
        """Nothing tells yet that an axis stands whose key was released."""
        if self._unit.now() < self._told_by(held):
            self._let_up(axis)
            held.again = held.again if held.is_again else self._unit.heard
            held.later = (*held.later, self._unit.now())
        elif not held.is_seen:
            self._lost(axis, "began")
        elif self.moving[axis] and self._told_at > held.ends(self.delay_s) + held.strange_s(self.punctuality.jitter):
            self._lost(axis, "ended")
        else:
            self._by_its_key(axis, held)

    def _cut_short(self, axis: int, held: Held) -> None:
        """Nothing tells that a key moves its axis: release it, and whatever else was pressed in its place."""
        other = self._held.get(1 - axis)
        if other is None:
            self._unit.release((1 - axis,))
        elif other.is_pressed and not other.is_released:
            self._shortened(1 - axis, other)
        self._shortened(axis, held)

    def _shortened(self, axis: int, held: Held) -> None:
        """Release a key before its time."""
        self._due = [each for each in self._due if each[1] != axis]
        self._release(axis, held)

    def _release(self, axis: int, held: Held) -> None:
        self._let_up(axis)
        held.released = self._unit.heard
        if abs(held.hold - held.press.hold) > _LATE_S:
            held.press = replace(held.press, hold=held.hold)
            self._axes[axis].shortened(held.press)
        self._rest()

    def _let_up(self, axis: int) -> None:
        """Release a key, and press that of the other axis anew which a damaged release may have turned round."""
        other = 1 - axis
        with self._promised(axis):
            self._unit.release((axis,))
        heard, held = self._unit.heard, self._held.get(other)
        room_s = 2.0 * (_ROOM_S + self._unit.silence_s)  # a press that waits for silence would hold up the release
        if held is not None and held.is_seen and self._is_down(other) and self._due_in(other) > room_s:
            with self._promised(other, pressed=True), suppress(NoAnswer):
                self._unit.key(commands.PRESSES[other, held.press.sign])
        self._unit.heard = heard

    @contextmanager
    def _promised(self, axis: int, *, pressed: bool = False) -> Iterator[None]:
        """Have the other's key released in time, be the answer to one of this axis awaited then.

        While a release awaits its answer one that is not to be held is released as well, as a damaged release may
        have become its press. The answer to a press is not mixed with others.
        """
        other = 1 - axis
        due_s = self._due_in(other) if self._is_down(other) else math.inf if pressed else self._unit.again_s
        self._unit.promise({other: self._unit.now() + due_s}, None if pressed else axis)
        try:
            yield
        finally:
            self._unit.withdraw()

    def _near(self, seconds: float) -> bool:
        """Whether a key is to be released so soon."""
        return any(not down and due - self._unit.now() < seconds for due, _, down in self._due)

    def _due_in(self, axis: int) -> float:
        """Seconds until the release of a key that is held is to be sent."""
        dues = [due for due, each, down in self._due if each == axis and not down]
        return min(dues, default=math.inf) - self._unit.key_s - self._unit.now()

    def _is_down(self, axis: int) -> bool:
        """Whether a key of ours is held."""
        held = self._held.get(axis)
        return held is not None and held.is_pressed and not held.is_released

    def _do(self, due: float, axis: int, down: bool) -> None:
        if not down or self._near(SOON_S):
            self._beside.hasten()
        self._listen(due - self._unit.key_s)
        if (due, axis, down) not in self._due:  # what was heard meanwhile has taken it back
            return
        self._due.remove((due, axis, down))
        held = self._held.get(axis)
        if held is None:
            return
        if down:
            self._press(axis, held, due)
        else:
            self._release(axis, held)
        self._listen(self._unit.now())

    def _rest(self) -> None:
        """Where no key is to be released any more, nobody need stand beside."""
        if not any(not pressed for _, _, pressed in self._due):
            self._beside.rest()

    def _press(self, axis: int, held: Held, due: float) -> None:
        body = commands.PRESSES[axis, held.press.sign]
        heard = self._unit.now() + self._unit.key_s
        try:
            with self._promised(axis, pressed=True):
                heard = self._unit.key(body)
        except NoAnswer:
            if not any(isinstance(each.event, Moving) and each.event.axes[axis] for each in self._unit.peek()):
                self._unheard(axis, heard)
                return
            held.pressed = Heard(heard, self._unit.now())
        else:
            held.pressed = self._unit.heard
        self._axes[axis].pressed(held.press, heard + self.delay_s)
        if (late := heard - due) > _LATE_S:  # it is held as long all the same
            self._due = sorted((at + late * (other == axis), other, down) for at, other, down in self._due)

    def _told_s(self, held: Held) -> float:
        return held.told_s + self._unit.delay_s + (_TRIAL_S if self.trials is not None else 0.0)

    # What is told ----------------------------------------------------------------------------------------------

    def _listen(self, until: float, enough: Callable[[Event], bool] = lambda _: False) -> None:
        self._unit.listen(until, enough)
        self.take(self._unit.events(Moving))

    def take(self, happened: list[Happened]) -> None:
        """Act on what the unit told of motion."""
        for each in happened:
            if isinstance(each.event, Moving):
                changed, held = self._changed(each.event, each.time), set(self._held)
                for axis, moves in enumerate(each.event.axes):
                    self._told(axis, each, moves=moves, alone=not changed - {axis})
                    if changed == {axis} and axis not in held and not moves:
                        self._lose(LOST.format(axis + 1, "ended"))  # it went on until now

    def _changed(self, event: Moving, time: float) -> set[int]:
        """The axes of which an event tells otherwise than the one before; each change has an event of its own."""
        changed = {axis for axis in (0, 1) if event.axes[axis] != self.moving[axis]}
        suspected, until, _ = self._suspect
        if not changed and time < until:
            self._lose(LOST.format(suspected + 1, "began"))
        self.moving, self._told_at = event.axes, time
        return changed

    def _told(self, axis: int, each: Happened, *, moves: bool, alone: bool) -> None:
        """An event tells of an axis, of which alone it tells something new or not."""
        held = self._held.get(axis)
        if held is None:
            if moves:
                self._foreign(axis)
            return
        each = self._when(axis, held.press, each, moves=moves)
        if moves:
            if not held.is_seen:
                self._moves(axis, held, each, alone=alone)
        elif held.began is not None:
            self._stands(axis, held, each, alone=alone)
        elif held.is_released and (held.moves or alone):
            fits = held.fits_end(each.time, self.punctuality.jitter, self.delay_s)
            if fits or (held.moves and each.time > held.ends(self.delay_s)):
                self._by_its_key(axis, held)

    def _moves(self, axis: int, held: Held, each: Happened, *, alone: bool) -> None:
        """It is told that an axis moves whose key was pressed or is going to be."""
        unsure, other = self._delays < _FEW, self._held.get(1 - axis)
        off = held.begins(each.time, self.punctuality.jitter, self.delay_s, unsure=unsure)
        if not held.is_pressed or off < 0.0:
            self._lost(axis, "began")  # another's key moves it
        elif off > 0.0 or not (alone or other is None or held.pressed.first > other.pressed.first):
            held.moves = True  # its own event was lost, and this is of the other axis
        else:
            held.began, late = each, each.time - held.pressed.first - self.delay_s
            held.early_s = max(0.0, late) if unsure else 0.0
            if held.pressed.last == held.pressed.first:
                self._delays += 1
                self.delay_s += max(_LEARNT, 1.0 / self._delays) * late
            self._axes[axis].began(each.time)

    def _stands(self, axis: int, held: Held, each: Happened, *, alone: bool) -> None:
        """It is told that an axis stands again whose motion began."""
        assert held.began is not None  # noqa: S101 - as whoever calls has seen
        duration, jitter = each.time - held.began.time, self.punctuality.jitter
        if self.trials is not None:
            self.trials.append(Trial(duration, held.hold))
            self._axes[axis].ended(held.press.planned(jitter), each.time)
            del self._held[axis]
            return
        off = held.lasts_otherwise(duration, jitter, alone=alone)
        most = held.hold if alone else held.most(duration, jitter)
        if not alone and (off > 0.0 or most > held.hold):
            self._by_its_key(axis, held, most)  # the event of its own end or of the other's was lost
        elif off != 0.0:
            self._lost(axis, "ended", ODD.format(axis + 1, duration, held.press.duration))
        else:
            self.punctuality.heard(held.press, held.hold, duration)
            way = held.measured(duration, jitter)
            doubt = abs(held.press.key.rate) * math.hypot(each.early_s, held.began.early_s) / 2.0
            self._axes[axis].ended(way._replace(sigma=math.hypot(way.sigma, doubt)), each.time)
            self._over_with(axis, held)

    def _by_its_key(self, axis: int, held: Held, most: float = 0.0) -> None:
        """A motion is over of which an event was lost: it went as far as its key was held, `most` seconds at most."""
        self._axes[axis].ended(held.planned(self.punctuality.jitter, most), self._unit.now())
        self.unproven = True
        self._over_with(axis, held)

    def _over_with(self, axis: int, held: Held) -> None:
        """Its motion is over; a release that was sent again may have become a press, of which nothing need tell."""
        del self._held[axis]
        self._repeated = self._repeated or held.is_again
        if self._repeated and not self._held:  # the end of another motion is not to wait for the line
            self._repeated = False
            self._let_be(1 - axis, axis)

    def _let_be(self, *axes: int) -> None:
        """Release keys of which none is to be held, and hear whether one moves all the same."""
        with self._promised(axes[-1]):
            self._unit.release(axes)
        self._listened = self._unit.now() + _EVERY_S + self._unit.delay_s

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
        held, self.speed = self._held.pop(axis), None  # which one is in force is no surer than what moved
        self._due = [each for each in self._due if each[1] != axis]
        self._let_be(axis, axis)
        self._rest()
        now = self._unit.now()
        here = self._axes[axis].at(now)
        since = now - held.pressed.first if held.is_pressed else 0.0
        most = abs(held.press.key.rate) * (min(held.press.duration, since) + held.told_s)
        self._axes[axis].known(here.counts, now, here.uncertainty + most)
        self._lose(why or LOST.format(axis + 1, what))

    def _foreign(self, axis: int) -> None:
        """Something else moves an axis."""
        self.speed = None
        self._lose(FOREIGN.format(axis + 1))
        self._let_be(axis, axis)

    # Letting go ------------------------------------------------------------------------------------------------

    def let_go(self) -> None:
        """Release all keys, whatever was planned, as far as the unit listens; what moved is lost track of."""
        self._due.clear()
        self._must_release = True
        for axis, held in list(self._held.items()):
            if not held.is_pressed:
                del self._held[axis]
        self._unit.release()
        heard = self._unit.heard
        self._unit.release()
        self._must_release = False
        self._beside.rest()
        for held in self._held.values():
            held.released = held.released if held.is_released else heard

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
