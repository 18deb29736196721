"""The AWR Microstep behind the Drive contract.

It has keys, speeds and events, no position: a goto is a cascade of timed presses, at ever slower speeds, and where
the axes are is reckoned from how long each motion lasted. Below the keys both axes go on at the rates of their drive
registers, which are soft-written for the target, so that for the keys it stands still; tracking is nothing else. No
word is written into the non-volatile memory unless a person asks for it.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, cast

from mounts.awr.at_speed import Keys, held_at, keys_of
from mounts.awr.axis import AwrAxis
from mounts.awr.beside import Beside, Guardian
from mounts.awr.by_hand import ByHand
from mounts.awr.cascade import Cascade, Errors, Stage
from mounts.awr.drive_rates import DriveRates
from mounts.awr.holding import Holding, Trial
from mounts.awr.ladder import Ladder
from mounts.awr.memory import Kept, KeptAxis
from mounts.awr.messages import Backlash, Error, IndexPulse, Lines, Moving, Override
from mounts.awr.pace import Pace
from mounts.awr.proof import Proof
from mounts.awr.registers import BY_NAME, by_name, shown
from mounts.awr.settings import AwrSettings
from mounts.awr.slew_model import AwrSlewModel
from mounts.awr.supervision import COMMITTED, RECALIBRATED, SWITCHED, TURNED_BACK, UNTOLD, Supervision
from mounts.awr.unit import Happened, Unit
from mounts.awr.words import Words
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from pointing.plan import Leading
from transports.errors import TransportError

if TYPE_CHECKING:
    from mounts.awr.commands import Speed

_FOLLOW_S = 2.0  # from one look at a path to the next
_LEAST_FOLLOW_S = 0.5
_CLOSING = 2.0  # times sidereal, at which an axis is led back to its path at most
_COOKIE_EVERY_S = 10.0
_STAGES = 40  # of one goto; more means that the keys do not do what they should
STEPPED = (
    "the clock of the computer was set by {:+.1f} s while keys were held, which were released; check the time "
    "service, then `sync` on a known star"
)
_OTHERS = (Error, Override, IndexPulse, Lines, Backlash)


class AwrDrive:
    """A telescope with an AWR Microstep.

    Parameters
    ----------
    unit : Unit
        The unit at its link.
    settings : AwrSettings
        What the configuration says.
    memory : Mapping
        What `memory` gave when it was last driven; empty for one never seen.
    remember : callable
        Keeps `memory`; called before a key is pressed.
    guardian : Guardian, optional
        The dead-man process; without one no key is pressed.
    """

    def __init__(
        self,
        unit: Unit,
        settings: AwrSettings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None] = lambda memory: None,  # noqa: ARG005 - a test need not
        guardian: Guardian | None = None,
    ) -> None:
        self.unit = unit
        self._settings = settings
        self._remember = remember
        kept = Kept.of(memory, settings.meaning)
        seen = kept.time if math.isfinite(kept.time) else unit.now()
        one, two = (AwrAxis(i, axis.counts, seen, axis.uncertainty, axis.turned) for i, axis in enumerate(kept.axes))
        self.axes = (one, two)
        for axis, was in zip(self.axes, kept.axes, strict=True):
            axis.drives_at(was.rate, seen)
        self.words = Words(unit, settings)
        self.words.ram = dict(kept.ram)
        self.supervision = Supervision(
            kept.unsynchronised, lambda time: one.at(time).counts, lambda: self.words.last_rate, kept.index
        )
        self._beside = Beside(unit, guardian)
        self.keys = Holding(unit, self._beside, self.axes, settings.jitter, self._lose)
        if kept.delay_s is not None:
            self.keys.remember_delay(kept.delay_s)
        self._pace = Pace(unit, self.words, settings)
        self._drives = DriveRates(unit, self.words, self.axes)
        self.hand = ByHand(unit, self.words, self.keys, self._drives)
        self.hand.recall(kept.written)
        self.proof = Proof(settings, kept)
        for axis in self.axes:
            axis.led = partial(self.proof.led, axis.index)
        self._kept = kept
        self._cookie: int | None = kept.cookie
        self._cookie_asked = -math.inf
        self._aims: tuple[AxisSlew, AxisSlew] | None = None
        self._aimed = 0.0  # POSIX seconds at which the aims hold
        self._cascade: Cascade | None = None
        self._stages = 0
        self._course: list[Stage] = []
        self._jog: Keys | None = None  # the keys that are held until told otherwise
        self._resting = False
        self._own_notes: tuple[str, ...] = ()

    # What it is ------------------------------------------------------------------------------------------------

    @property
    def capabilities(self) -> Capabilities:
        """It goes at rates of its own, stops, and does not say where it is."""
        return Capabilities(
            has_position=False,
            can_stop=True,
            rate_control=True,
            path_nodes=False,
            holds_rate_alone=True,
            bounds_itself=False,
            units="steps",
            rests_within=max(self.ladder.guide_steps) if self.words.lasting else 0.0,
        )

    @property
    def ladder(self) -> Ladder:
        """The speeds as steps from slew to a target that is tracked, with a slew as fast as its jitter allows."""
        return self._pace.ladder

    @property
    def slew_models(self) -> tuple[AwrSlewModel, AwrSlewModel]:
        """How long a goto takes, at most."""
        one, two = (
            AwrSlewModel(self.ladder, i, self._pace.resting_ladder, rate)
            for i, rate in enumerate(self.words.usual.drives)
        )
        return one, two

    @property
    def start_latency(self) -> float:
        """Speed and key, the drive rates, and the moment until the key acts."""
        return 2.0 * self._pace.exchange_s + self.keys.delay_s

    @property
    def axes_land_together(self) -> bool:
        """Each axis goes along with its target once it has landed, by its drive."""
        return False

    @property
    def leading(self) -> Leading | None:
        """It cannot be led."""
        return None

    @property
    def memory(self) -> Mapping[str, object]:
        """Position, rates, cookie, delays."""
        now = self.unit.now()
        one, two = (
            KeptAxis(state.counts, state.uncertainty, axis.rate, axis.turned)
            for axis, state in ((axis, axis.at(now)) for axis in self.axes)
        )
        return Kept(
            self.supervision.unsynchronised,
            now,
            (one, two),
            moving=self._aims is not None or self._jog is not None or self.keys.busy,
            cookie=self._cookie,
            directions=self.words.lasting.get(0x00, self._kept.directions),
            calibration=self._kept.calibration if self.words.calibration is None else self.words.calibration,
            delay_s=self.keys.known_delay_s,
            index=self.supervision.index,
            meaning=self._settings.meaning,
            ram=self.words.changed,
            written=self.hand.written,
            shown=self.proof.shown,
        ).as_json()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        late = self.keys.punctuality.note
        return (*self._own_notes, *self.supervision.notes, *((late,) if late else ()))

    def told(self) -> tuple[str, ...]:
        """What the unit told since this was asked last, for the event log."""
        return self.supervision.told()

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Release all keys, find the unit, read its words, and say where it is, as well as that can be known.

        Raises
        ------
        TransportError, WrongProtocol, AwrError
            Nothing answers, or nothing that is an AWR Microstep of a firmware that is known.
        """
        self.unit.release()
        note = self.unit.identify()
        self._own_notes = (f"firmware {self.unit.version}", *((note,) if note else ()))
        self.words.read()
        self._check_past(time)
        self.words.insist()
        self.hand.recall(self.hand.written)
        self._drives.as_the_words_say(time)
        if make_safe:
            self._rest()
        self._ask_status(time)
        self._take_events()
        self._pace.forget()
        self._pace.as_usual()
        self._cookie = self.words.bake()
        self._cookie_asked = self.unit.now()
        self._warn_of_words()
        return self._reading()

    def _ask_status(self, time: float) -> None:
        """Relays and override, of a firmware that tells them."""
        status = self.unit.status()
        if status is None:
            return
        self.supervision.relays = status.relays
        if status.override != self.supervision.stopped:
            self.supervision.take([Happened(Override(stopped=status.override), time)])
            self._drives.held(time, stopped=self.supervision.stopped)

    def _check_past(self, time: float) -> None:
        """Whether the unit is as it was left."""
        kept, lost = self._kept, self.supervision.unsynchronised
        directions = self.words.lasting.get(0x00)
        if {kept.directions, directions} - {None, directions} or kept.calibration not in {
            None,
            self.words.calibration,
        }:
            self.proof.void()
        if not lost and kept.directions is not None and directions != kept.directions:
            self._lose(
                "the direction senses of the unit (00) were changed since the last sync; `sync` on a known star"
            )
        if not lost and kept.calibration not in {None, self.words.calibration}:
            self._lose(RECALIBRATED)
        if not lost and kept.cookie is not None and not self.words.tells_ram:
            self._lose(UNTOLD)
        elif not lost and kept.cookie is not None and not self.words.is_there(kept.cookie):
            self._lose(SWITCHED)
        away = time - kept.time
        if away < 0.0:
            self._lose(TURNED_BACK.format(-away))
        if math.isfinite(away) and away > 0.0 and not self.supervision.unsynchronised and self.axes[0].rate:
            told = f"the drives went on for {away:.0f} s while no program looked"
            self._own_notes = (*self._own_notes, told)

    def _warn_of_words(self) -> None:
        plays = [name for name in ("ra_backlash", "dec_backlash") if self.words.lasting.get(BY_NAME[name].address)]
        if plays:
            self._own_notes = (*self._own_notes, f"it takes up backlash by itself: {', '.join(plays)}")
        if wrong := self.words.usual.contradiction():
            self._own_notes = (*self._own_notes, wrong)
        if not self.words.tells_ram:
            said = "it does not tell what its RAM holds, so soft writes are taken to be as they were written"
            self._own_notes = (*self._own_notes, said)

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:  # noqa: ARG002 - its link knows the time to the key
        """Press and release what is due, take events, go on with the next stage, and reckon where the axes are.

        Raises
        ------
        TransportError, DriveError
            The unit does not answer or obey; its keys were released, as far as it listens.
        """
        self.keys.require_hearing()
        self.keys.look()
        self._take_events()
        if self.supervision.was_reset:
            self._began_anew()
        self._check_clock()
        if (self.supervision.unsynchronised or self.supervision.stopped) and (
            self._aims is not None or self._jog is not None or self.keys.busy
        ):
            self._give_up()
        if self._drives.in_doubt and not self.keys.busy:
            self._drives.resolve()
        self._follow_clock()
        self._go_on()
        if not self.keys.busy and self.unit.now() - self._cookie_asked > _COOKIE_EVERY_S:
            self._ask_cookie()
            self._ask_status(self.unit.now())
        return self._reading()

    def _take_events(self) -> None:
        self.unit.listen(self.unit.now())
        self.keys.take(self.unit.events(Moving))
        told = self.unit.events(*_OTHERS)
        self.supervision.take(told)
        for each in told:
            if isinstance(each.event, Override):
                self._drives.held(each.time, stopped=each.event.stopped)

    def _check_clock(self) -> None:
        """Keys are not held on while the computer's clock is set: their target was another."""
        step = self.unit.clock_step
        if step and (self._aims is not None or self._jog is not None or self.keys.busy):
            self._lose(STEPPED.format(step))

    def _follow_clock(self) -> None:
        """At rest go by the computer's clock as it is set now; the axes are where they were."""
        if self._aims is not None or self._jog is not None or self.keys.busy or self._drives.in_doubt:
            return
        before = self.unit.now()
        here = [axis.at(before) for axis in self.axes]
        off = self.unit.follow_clock()
        if off:
            for axis, was in zip(self.axes, here, strict=True):
                axis.known(was.counts, before + off, was.uncertainty)
                axis.drives_at(axis.rate, before + off)
            self._cookie_asked += off

    def _began_anew(self) -> None:
        """After a reset its words are the non-volatile ones, by which axis 1 tracks, and no key is pressed."""
        self._resting = self._resting or not any(axis.rate for axis in self.axes)
        self._give_up()
        self.words.ram = dict(self.words.lasting)
        self.hand.forget()
        self.keys.speed = None
        now = self.unit.now()
        for axis in self.axes:
            here = axis.at(now)
            axis.known(here.counts, now, here.uncertainty)
        self._drives.as_the_words_say(now)
        self._pace.forget()
        if self._resting:
            self._rest()
        self._cookie = self.words.bake()
        self.supervision.was_reset = False

    def _ask_cookie(self) -> None:
        """See that the unit was not reset unheard."""
        self._cookie_asked = self.unit.now()
        if self.words.was_committed():
            self.supervision.note(COMMITTED)
        if self._cookie is not None and not self.words.is_there(self._cookie):
            self._lose(SWITCHED)
            self.supervision.was_reset = True
            self._began_anew()

    def _reading(self) -> Reading:
        now = self.unit.now()
        slewing = self._aims is not None or self._jog is not None
        axes = []
        for axis in self.axes:
            state = axis.at(now)
            moved = slewing or self.keys.slewing(axis.index)
            axes.append(AxisReading(state.counts, state.uncertainty, state.rate, moved))
        rates = [axis.rate for axis in self.axes]
        return Reading(
            now,
            tuple(axes),
            motion=(*(("keys",) if self.keys.busy else ()), *(("tracking",) if any(rates) else ())),
            limits=("override",) if self.supervision.stopped else (),
            alarms=self.supervision.alarms,
            tracking=any(rates),
            unsynchronised=self.supervision.unsynchronised,
        )

    # Slewing ---------------------------------------------------------------------------------------------------

    def _require_ready(self) -> None:
        if self.supervision.unsynchronised:
            raise Unsynchronised(self.supervision.unsynchronised)
        self.supervision.require_free()
        if wrong := self.words.usual.contradiction():
            raise DriveRefused(wrong)

    def _require_slow(self, rates: Sequence[float]) -> None:
        """Nobody stands beside a drive: what it does when the program is gone must leave time to come."""
        for number, (rate, most) in enumerate(zip(rates, self._settings.fastest, strict=True), start=1):
            if abs(rate) > most:
                raise DriveRefused(
                    f"axis {number} would have to go at {rate:+.0f} steps/s by its drive, which goes on when this "
                    f"program is gone; at most {most:.0f} steps/s: choose a slower target"
                )

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Set the drives to the rates of the target, and press the first keys.

        Raises
        ------
        Unsynchronised, DriveRefused, AwrError, TransportError
            Nobody knows where it is; there is no dead-man process, or the unit does not obey; no key leads there.
        """
        self._require_ready()
        one, two = axes[:2]
        self._require_slow((one.rate_after, two.rate_after))
        now = self.unit.now()
        self.proof.require(
            [aim.target - axis.at(now).counts for axis, aim in zip(self.axes, (one, two), strict=True)]
        )
        if self.keys.busy:
            self.keys.halt()
        self._jog = self._aims = None
        self._follow_clock()
        self._beside.stand_by()
        for axis, slew in zip(self.axes, (one, two), strict=True):
            self._drives.drive_at(axis.index, slew.rate_after)
        self._resting = not (one.rate_after or two.rate_after)
        ladder = self._pace.no_faster((one.max_rate, two.max_rate))
        self._cascade = Cascade(ladder)
        self._aims, self._stages = (one, two), 0
        self._aimed = time
        self._remember(self.memory)
        began = self.unit.now() + self._pace.exchange_s + self.keys.delay_s
        try:
            self._go_on()
        except (DriveError, TransportError):
            self._aims = None
            raise
        return began

    def _errors(self, time: float) -> Errors:
        """What both axes have to go, and by how much that grows."""
        assert self._aims is not None  # noqa: S101 - only asked then
        steps, drifts = [], []
        for axis, aim in zip(self.axes, self._aims, strict=True):
            due = self._aimed if aim.arrival is None else aim.arrival
            steps.append(aim.target + aim.rate_after * (time - due) - axis.at(time).counts)
            drifts.append(aim.rate_after - axis.rate)
        return Errors((steps[0], steps[1]), (drifts[0], drifts[1]))

    def _go_on(self) -> None:
        """Begin the next stage, as long as a stage ends within this look."""
        while self._aims is not None and not self.keys.busy and not self.supervision.unsynchronised:
            stage = None
            if self._cascade is not None and self._stages < _STAGES:
                turned = self.axes[0].turned, self.axes[1].turned
                now = self.unit.now() + self.keys.delay_s
                stage = self._cascade.next(self._errors(now), self.keys.speed, turned)
            if stage is None:
                self._arrived()
                return
            self._stages += 1
            self._course = [*self._course[: self._stages - 1], stage]
            self.keys.begin(stage)
            self.keys.look()

    def _arrived(self) -> None:
        self._aims = None
        self._beside.rest()
        if self._stages >= _STAGES:
            self.supervision.note(
                f"the target was not reached within {_STAGES} presses; see `drive show` for its rates"
            )
        self._remember(self.memory)

    def _give_up(self) -> None:
        self._aims = None
        self._jog = None
        with suppress(TransportError):
            self.keys.halt()

    # Following -------------------------------------------------------------------------------------------------

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep both axes on a path by their drive registers: at the rate that leads each back to it by the next look.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not take the rate, or does not answer.
        """
        if self._aims is not None or self.keys.busy or self._jog is not None or self.supervision.unsynchronised:
            return _LEAST_FOLLOW_S
        now = max(time, self.unit.now())
        ahead = path.at(now + _FOLLOW_S)
        if all(rate == 0.0 for _, rate in ahead[:2]) and self._resting:
            return _FOLLOW_S
        self._require_slow([rate for _, rate in ahead[:2]])
        self._resting = False
        most = _CLOSING * self._settings.sidereal_steps_per_s
        for axis, (there, rate) in zip(self.axes, ahead, strict=False):
            closing = (there - axis.at(now).counts) / _FOLLOW_S - rate
            self._drives.drive_at(axis.index, rate + min(max(closing, -most), most))
        return _FOLLOW_S - (self.unit.now() - now)

    def _rest(self) -> None:
        """Switch both drives off."""
        self._resting = True
        self._drives.rest()

    # At a speed ------------------------------------------------------------------------------------------------

    def stand_by(self, time: float) -> None:  # noqa: ARG002 - the contract gives the time to all
        """Have the dead-man process started.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._beside.stand_by()

    def move_at(self, rates: Sequence[float], time: float) -> None:  # noqa: ARG002
        """Hold the keys of the speed that comes nearest to the faster axis; called again, say that the host lives.

        Raises
        ------
        Unsynchronised, DriveRefused, AwrError, TransportError
            As for `start`.
        """
        self._check_clock()
        self._require_ready()
        self.keys.require_hearing()
        stage = held_at(self._pace.present, rates)
        wanted = keys_of(stage)
        if wanted == self._jog:
            self.keys.look()
            self._take_events()
            return
        self.keys.halt()
        self._jog = wanted
        if stage is not None:
            self._remember(self.memory)
            self.keys.begin(stage)

    # All else --------------------------------------------------------------------------------------------------

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Reckon from here on.

        Raises
        ------
        DriveRefused
            Keys move it; the override holds it, and nobody knows when it will go on.
        """
        self.supervision.require_free()
        if self.keys.busy:
            raise DriveRefused("keys move the axes: `sync` when they have come to rest")
        now, known = self.unit.now(), not self.supervision.unsynchronised
        moved = [here - axis.at(time).counts for axis, here in zip(self.axes, counts, strict=False)]
        if doubt := self.proof.synchronised(moved if known else None):
            self.supervision.note(doubt)
        for axis, here in zip(self.axes, counts, strict=False):
            axis.known(here + axis.rate * (now - time), now, 0.5)
        self.supervision.synchronised()
        self._remember(self.memory)

    def stop(self, time: float) -> None:  # noqa: ARG002 - as fast as it goes
        """Release all keys and switch both drives off.

        Raises
        ------
        DriveError, TransportError
            The unit does not confirm it.
        """
        self._aims = self._jog = None
        try:
            self.keys.halt()
        finally:
            self._take_events()
            self._rest()
        self._remember(self.memory)

    def power(self, *, on: bool) -> None:
        """Refuse: no command switches its motors.

        Raises
        ------
        DriveRefused
            Always.
        """
        raise DriveRefused(
            f"no command switches the motors of the unit {'on' if on else 'off'}: its power switch does; `stop` ends "
            "its tracking"
        )

    def registers(self) -> Mapping[str, str]:
        """All words, relays, override, lines, and what was measured."""
        self.words.read()
        rows = dict(self.words.shown())
        status = self.unit.status()
        if status is not None:
            for number in (1, 2, 3):
                rows[f"relay_{number}"] = "on" if status.relays >> number - 1 & 1 else "off"
            rows["override"] = "stopped" if status.override else "clear"
        if self.supervision.lines is not None:
            rows["lines_high"] = self.supervision.lines.high or "none"
        if self.supervision.index is not None:
            when, where = self.supervision.index
            rows["index"] = f"{self.unit.now() - when:.1f} s ago at {where:.1f} steps"
        speeds = self.words.speeds
        for number, rate in enumerate(speeds.drives, start=1):
            apart = speeds.apart(speeds.drive_words(number - 1))
            rows[f"drive_rate_{number}"] = f"{rate:.4f} steps/s, the next one {apart:.2g} away"
        if self._course:
            rows["last_goto"] = "; ".join(map(str, self._course))
        rows["line"] = f"{self.unit.damaged} packets lost or damaged" + "".join(
            f"; {why}" for why in self.unit.strange
        )
        if self.unit.debug:
            rows["debug_text"] = " | ".join(self.unit.debug)
        rows["key_delay_ms"] = f"{self.keys.delay_s * 1e3:.1f}"
        rows["guide_step"] = " and ".join(f"{step:.2f} steps" for step in self.ladder.guide_steps)
        return rows

    # In a person's hands ---------------------------------------------------------------------------------------

    def soft_write(self, name: str, value: int) -> str:
        """Write a word in RAM; return what it was, as a person reads it.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            There is no such register, or it is never written so; the unit does not hold it.
        """
        register = by_name(name)
        before = shown(register, self.words.ram.get(register.address, 0))
        self.hand.set_word(register, value)
        if register.kind == "bits":
            self.proof.void()
        self._words_changed()
        self._remember(self.memory)
        return before

    def commit(self) -> tuple[str, ...]:
        """Have what a person wrote kept for good; return the names of the words.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            Nothing was written; the unit does not do it.
        """
        try:
            return self.hand.commit()
        finally:
            self._pace.forget()
            self._remember(self.memory)

    def discard(self) -> None:
        """Have soft writes forgotten: the drives go as the non-volatile words say, and are stopped at once.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not do it.
        """
        rested = self._resting or not any(axis.rate for axis in self.axes)
        self.hand.discard()
        self._words_changed()
        if rested:
            self._rest()
        self.supervision.rates_are_sound()
        self._cookie = self.words.bake()
        self._remember(self.memory)

    def switch_relay(self, number: int, *, on: bool) -> None:
        """Switch a relay.

        Raises
        ------
        AwrError, DriveRefused, TransportError
            There is none; the unit does not do it.
        """
        self.hand.relay(number, on=on)
        bit = 1 << number - 1
        self.supervision.relays = self.supervision.relays | bit if on else self.supervision.relays & ~bit

    def way_of(self, name: str, speed: str, seconds: float) -> tuple[float, float]:
        """By how many steps a key for a time moves either axis, its drive's way apart.

        Raises
        ------
        AwrError
            As for `press`.
        """
        axis, press = self.hand.press_of(name, cast("Speed", speed), seconds, self._pace.present)
        steps = press.made(press.duration)
        return (steps, 0.0) if axis == 0 else (0.0, steps)

    def press(self, name: str, speed: str, seconds: float) -> None:
        """Hold a key for a time.

        Raises
        ------
        AwrError, DriveError, TransportError
            There is no such key or speed; there is no dead-man process, or the unit does not obey.
        """
        ladder = self._pace.present
        self.hand.press(name, cast("Speed", speed), seconds, ladder, lambda: self._remember(self.memory))

    def trial(self, name: str, speed: str, seconds: float, *, tracking: bool = False) -> tuple[Trial, float]:
        """Hold a key to find out what it does, at rest or while axis 1 tracks; return it, and how long it tracked.

        Raises
        ------
        AwrError, DriveError, TransportError
            As for `press`; no motion was told.
        """
        began = self.unit.now()
        if tracking:
            self._drives.drive_at(0, math.copysign(self._settings.sidereal_steps_per_s, self.words.tracks))
            began = self.unit.now()
        try:
            ladder = self._pace.on_trial()
            trial = self.hand.trial(name, cast("Speed", speed), seconds, ladder, lambda: self._remember(self.memory))
        finally:
            self._rest()
        return trial, self.unit.now() - began if tracking else 0.0

    def refuted(self, why: str) -> None:
        """What the position rests on is not so."""
        self._lose(why)

    def commissioned(self, confirmed: Collection[str]) -> None:
        """A commissioning has confirmed these keys of the configuration."""
        self.proof.confirmed(confirmed)
        self._remember(self.memory)

    def differing(self) -> dict[str, tuple[int, int]]:
        """Words that RAM holds otherwise than the non-volatile memory: this and that.

        Raises
        ------
        TransportError
            The unit does not answer.
        """
        self.words.read()
        return self.words.differing()

    def _words_changed(self) -> None:
        self._pace.forget()
        self._drives.as_the_words_say()

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - as fast as it goes
        """Release all keys; the drives go on at their rates where that is wanted, and stop else."""
        self._aims = self._jog = None
        with suppress(TransportError, DriveError):
            self.keys.halt()
            if not keep_tracking:
                self._rest()
        self._beside.end()
        self.unit.close()

    def _lose(self, why: str) -> None:
        self.supervision.lose(why)
