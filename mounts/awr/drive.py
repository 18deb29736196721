"""The AWR Microstep behind the Drive contract.

It has keys, speeds and events, no position: a goto is a cascade of timed presses, at ever slower speeds, and where
the axes are is reckoned from how long each motion lasted. Below the keys both axes go on at the rates of their drive
registers, which are soft-written for the target, so that for the keys it stands still; tracking is nothing else. No
word is written into the non-volatile memory unless a person asks for it.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence

from mounts.awr.by_hand import ByHand
from mounts.awr.following import LEAST_FOLLOW_S, follow
from mounts.awr.ladder import Ladder
from mounts.awr.listing import listed
from mounts.awr.memory import Kept, KeptAxis
from mounts.awr.messages import Backlash, Error, IndexPulse, Lines, Moving, Override
from mounts.awr.parts import Parts
from mounts.awr.presence import Presence
from mounts.awr.settings import AwrSettings
from mounts.awr.slew_model import AwrSlewModel
from mounts.awr.slewing import Slewing
from mounts.awr.supervision import DESERTED, STEPPED
from mounts.awr.unit import Unit
from mounts.beside import Guardian
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveError, DriveRefused
from pointing.plan import Leading
from transports.errors import TransportError

_BESIDE_S = 1.5  # in which a unit is looked at, be it asked three times, before a key is to be released
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
        self._parts = parts = Parts.of(unit, settings, memory, lambda: remember(self.memory), guardian)
        self.unit, self.axes, self.words, self.keys = parts.unit, parts.axes, parts.words, parts.keys
        self.supervision, self.proof = parts.supervision, parts.proof
        self._presence = Presence(parts)
        self._slewing = Slewing(parts)
        self.hand = ByHand(parts, self._presence)
        self.hand.recall(parts.kept.written)

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
        return self._parts.pace.ladder

    @property
    def slew_models(self) -> tuple[AwrSlewModel, AwrSlewModel]:
        """How long a goto takes, at most."""
        one, two = (
            AwrSlewModel(self.ladder, i, self._parts.pace.resting_ladder, rate, self.axes[i].play.steps)
            for i, rate in enumerate(self.words.usual.drives)
        )
        return one, two

    @property
    def start_latency(self) -> float:
        """Speed and key, the drive rates, and the moment until the key acts."""
        return 2.0 * self._parts.pace.exchange_s + self.keys.delay_s

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
        now, kept = self.unit.now(), self._parts.kept
        one, two = (
            KeptAxis(state.counts, state.uncertainty, axis.rate, axis.side(now))
            for axis, state in ((axis, axis.at(now)) for axis in self.axes)
        )
        return Kept(
            self.supervision.unsynchronised,
            now,
            (one, two),
            moving=self._slewing.under_way,
            cookie=self._presence.cookie,
            directions=kept.directions if self.words.directions is None else self.words.directions,
            calibration=kept.calibration if self.words.calibration is None else self.words.calibration,
            delay_s=self.keys.known_delay_s,
            index=self.supervision.index,
            meaning=self._parts.settings.meaning,
            ram=self.words.changed,
            written=self.hand.written,
            shown=self.proof.shown,
        ).as_json()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        unsure = (self.keys.punctuality.note, self._parts.drives.note, self.proof.note)
        return (*self._presence.notes, *self.supervision.notes, *filter(None, unsure))

    def told(self) -> tuple[str, ...]:
        """What the unit told since this was asked last, for the event log."""
        return self.supervision.told()

    def registers(self) -> Mapping[str, str]:
        """All words, relays, override, lines, and what was measured."""
        return listed(self._parts, self._slewing.course)

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Release all keys, find the unit, read its words, and say where it is, as well as that can be known.

        Raises
        ------
        TransportError, WrongProtocol, AwrError
            Nothing answers, or nothing that is an AWR Microstep of a firmware that is known.
        """
        parts = self._parts
        self.unit.release()
        self._presence.connected(self.unit.identify())
        self.words.read()
        self._presence.check_past(time)
        self.words.insist()
        self._presence.doubt_drives(time)
        self.hand.recall(self.hand.written)
        parts.drives.as_the_words_say(time)
        if make_safe:
            parts.drives.rest()
        self._presence.ask_status(time)
        self._take_events()
        parts.pace.forget()
        parts.pace.as_usual()
        self._presence.bake()
        self._presence.warn_of_words()
        return self._reading()

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - as fast as it goes
        """Release all keys; the drives go on at their rates where that is wanted, and stop else.

        Raises
        ------
        DriveError, TransportError
            The unit does not confirm it; a dead-man process that stood beside goes on trying.
        """
        self._slewing.forget()
        try:
            self.keys.halt()
            if not keep_tracking:
                self._parts.drives.rest()
        except (TransportError, DriveError):
            self._parts.beside.leave()
            raise
        else:
            self._parts.beside.end()
        finally:
            self.unit.close()

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:  # noqa: ARG002 - its link knows the time to the key
        """Press and release what is due, take events, go on with the next stage, and reckon where the axes are.

        Raises
        ------
        TransportError, DriveError
            The unit does not answer or obey; its keys were released, as far as it listens.
        """
        drives = self._parts.drives
        self._require_guarded()
        self.keys.look()
        self._take_events()
        if self.supervision.was_reset:
            self._began_anew()
        self._check_clock()
        if (self.supervision.unsynchronised or self.supervision.stopped) and self._slewing.under_way:
            self._slewing.give_up()
        if drives.in_doubt and not self.keys.busy:
            drives.resolve()
        self._follow_clock()
        self._slewing.is_proven()
        self._slewing.go_on()
        if self._presence.is_due and self.keys.free_for(_BESIDE_S):
            if self._presence.is_lost():
                self._began_anew()
            self._presence.ask_status(self.unit.now())
        self._take_events()  # those that came meanwhile as well
        return self._reading()

    def _require_guarded(self) -> None:
        """See that whoever is to stand beside what moves is there; else end it: it may have ended it before."""
        fate, beside = self._parts.beside.fate, self._parts.beside
        if not fate:
            return
        if beside.drives:
            self.supervision.lose(DESERTED.format(fate))
        self._slewing.forget()
        self.keys.let_go()
        self._parts.drives.rest()
        raise DriveRefused(f"keys and drives were stopped: {fate}")

    def _take_events(self) -> None:
        self.unit.listen(self.unit.now())
        self.keys.take(self.unit.events(Moving))
        told = self.unit.events(*_OTHERS)
        self.supervision.take(told)
        for each in told:
            if isinstance(each.event, Override):
                self.keys.stood()
                self._parts.drives.held(each.time, stopped=each.event.stopped)

    def _check_clock(self) -> None:
        """Keys are not held on while the computer's clock is set: their target was another."""
        step = self.unit.clock_step
        if step and self._slewing.under_way:
            self.supervision.lose(STEPPED.format(step))

    def _follow_clock(self) -> None:
        if not self._slewing.under_way and not self._parts.drives.in_doubt:
            self._presence.follow_clock()

    def _began_anew(self) -> None:
        self._slewing.give_up()
        self.keys.stood()
        self.hand.forget()
        self._presence.began_anew()

    def _reading(self) -> Reading:
        now = self.unit.now()
        axes = []
        for axis in self.axes:
            state = axis.at(now)
            moved = self._slewing.wanted or self.keys.slewing(axis.index)
            doubt = math.hypot(state.uncertainty, self.keys.doubt(axis.index))
            doubt += self.proof.doubt(axis.index, state.counts, axis.leads(now))
            axes.append(AxisReading(state.counts, doubt, state.rate, moved))
        tracking = any(axis.rate for axis in self.axes)
        return Reading(
            now,
            tuple(axes),
            motion=(*(("keys",) if self.keys.busy else ()), *(("tracking",) if tracking else ())),
            limits=("override",) if self.supervision.stopped else (),
            alarms=self.supervision.alarms,
            tracking=tracking,
            unsynchronised=self.supervision.unsynchronised,
        )

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Set the drives to the rates of the target, and press the first keys.

        Raises
        ------
        Unsynchronised, DriveRefused, AwrError, TransportError
            Nobody knows where it is; there is no dead-man process, or the unit does not obey; no key leads there.
        """
        one, two = axes[:2]
        self._slewing.prepare((one, two))
        self._follow_clock()
        return self._slewing.start((one, two), time)

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep both axes on a path by their drive registers: at the rate that leads each back to it by the next look.

        Raises
        ------
        DriveRefused, TransportError
            The unit does not take the rate, or does not answer.
        """
        if self._slewing.under_way or self.supervision.unsynchronised:
            return LEAST_FOLLOW_S
        return follow(self._parts, path, time)

    def stand_by(self, time: float) -> None:  # noqa: ARG002 - the contract gives the time to all
        """Have the dead-man process started.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._parts.beside.stand_by()

    def move_at(self, rates: Sequence[float], time: float) -> None:  # noqa: ARG002
        """Hold the keys of the speed that comes nearest to the faster axis; called again, say that the host lives.

        Raises
        ------
        Unsynchronised, DriveRefused, AwrError, TransportError
            As for `start`.
        """
        self._check_clock()
        self._slewing.require_ready()
        self._require_guarded()
        if self._slewing.at(rates):
            self._take_events()

    def stop(self, time: float) -> None:  # noqa: ARG002 - as fast as it goes
        """Release all keys and switch both drives off.

        Raises
        ------
        DriveError, TransportError
            The unit does not confirm it.
        """
        self._slewing.forget()
        try:
            self.keys.halt()
        finally:
            self._take_events()
            self._parts.drives.rest()
        self._parts.remember()

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

    # Where it is -----------------------------------------------------------------------------------------------

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
        stated = [axis.at(now).uncertainty for axis in self.axes]
        for axis, count in zip(self.axes, counts, strict=False):
            axis.known(count + axis.rate * (now - time), now, 0.5)
        if said := self.proof.synchronised(
            [axis.at(now).counts for axis in self.axes], moved if known else None, stated
        ):
            self.supervision.note(said)
        self.supervision.synchronised()
        self._parts.remember()

    def refuted(self, why: str) -> None:
        """What the position rests on is not so."""
        self.supervision.lose(why)

    def commissioned(self, confirmed: Collection[str]) -> None:
        """A commissioning has confirmed these keys of the configuration."""
        self.proof.confirmed(confirmed)
        self._parts.remember()
