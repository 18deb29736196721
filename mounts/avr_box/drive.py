"""The stepper box behind the Drive contract.

It says nothing of its motors and has no stop. Where the axes are is reckoned from all that was sent, by the exact law
of its slews; encoders, where there are some, prove it to a count and repair it. A long way goes in pieces, the next
one sent by `read` at its time; `stop` sends no further one. After each move the box is asked for its PEC bin: one
that is silent then may have taken the question for the rest of the move.
"""

import math
from collections.abc import Callable, Mapping, Sequence

from mounts.avr_box import absence, commands, following
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box
from mounts.avr_box.closing import Closing
from mounts.avr_box.doubt import Doubt
from mounts.avr_box.encoders import EncoderSeen
from mounts.avr_box.host_time import SeenSooner, sooner
from mounts.avr_box.memory import Kept
from mounts.avr_box.moves import Moves
from mounts.avr_box.panel import Panel
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.slew_model import AvrSlewModel
from mounts.avr_box.slew_table import laws
from mounts.avr_box.slewing import Slews
from mounts.avr_box.supervision import Supervision
from mounts.avr_box.tick_clock import CRYSTAL_UNCERTAINTY, TickClock
from mounts.avr_box.tick_watch import TickWatch
from mounts.avr_box.tracking import RECHECK_S, Tracker
from mounts.avr_box.trials import Trials
from mounts.avr_box.unplaced_hold import UnplacedHold
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveRefused, StillMoving, Unsynchronised
from pointing.plan import Leading

_TICKS_EVERY_S = 10.0  # the phase of TIMER1 is asked for
_ASKED_BLIND = 8  # questions a reading, while a command without encoders is not believed
_NO_STOP = "the box has no stop: {} in {:.1f} s, and no further move is sent; its power switch stops it at once"


class AvrBoxDrive:
    """A telescope with a stepper box.

    Parameters
    ----------
    box : Box
        The box at its link.
    settings : AvrSettings
        What the configuration says.
    memory : Mapping
        What `memory` gave when it was last driven; empty for one never seen.
    remember : callable
        Keeps `memory`; called before a move is sent.
    """

    def __init__(
        self,
        box: Box,
        settings: AvrSettings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None],
    ) -> None:
        self._box = box
        self._settings = settings
        kept = Kept.of(memory, settings.meaning)
        doubt = kept.crystal_uncertainty
        self._ticks = TickClock(kept.crystal, CRYSTAL_UNCERTAINTY if doubt is None else doubt)
        self._seen = kept.time
        box.in_doubt = kept.sending
        one, two = (
            BoxAxis(i, settings, law, self._ticks, kept.axes[i], kept.time if math.isfinite(kept.time) else box.now())
            for i, law in enumerate(laws(settings.slew_table))
        )
        self.axes = (one, two)
        self.supervision = Supervision(
            box, self.axes, self._ticks, kept.unsynchronised, kept.time, endable=settings.busy == "restart"
        )
        self._watch = TickWatch(box, self._ticks, self.axes)
        self._closing = Closing(box, settings, self.axes)
        self._moves = Moves(
            box, settings, self.supervision, self._closing, self._watch, lambda: remember(self.memory)
        )
        self._slews = Slews(box, self.axes, self._moves)
        self._tracker = Tracker(box, settings, self.axes, self._moves, self._ticks, self._watch)
        self._doubt = Doubt(self.axes, box.trust, self.supervision, self._tracker, proved=kept.proved)
        self._panel = Panel(box, self.axes, self._ticks, self._watch)
        self.trials = Trials(box, settings, self.axes, self._moves, self._tracker, self.supervision)
        """Moves that find out what a move is."""
        self._unplaced = UnplacedHold(box, self.axes[0], self._moves, self._may_not_be_held)
        self._resting = kept.resting
        if kept.doubted is not None:
            box.trust.sent("M", kept.doubted)
        self._own_notes: tuple[str, ...] = ()

    def _may_not_be_held(self) -> bool:
        watch = self.supervision
        standing = watch.standing
        return watch.in_doubt() or watch.on_trial or bool(standing.runaways) or self.axes[0].index in standing.blind

    # What it is ------------------------------------------------------------------------------------------------

    @property
    def capabilities(self) -> Capabilities:
        """It tracks at a rate of its own, which nothing switches off, and makes counted moves."""
        return Capabilities(
            has_position=bool(self._settings.encoder_counts_per_turn),
            can_stop=False,
            rate_control=False,
            path_nodes=False,
            holds_rate_alone=True,
            units="microsteps",
            goes_on_at=self.axes[0].own_rate,
            rests_within=1.5 * following.HELD_EVERY_S * abs(self.axes[0].own_rate),
        )

    @property
    def slew_models(self) -> tuple[AvrSlewModel, AvrSlewModel]:
        """The laws of both axes, with the crystal as it was measured."""
        return self.axes[0].model, self.axes[1].model

    @property
    def start_latency(self) -> float:
        """The line time of a move, and what is left of a short one that is under way."""
        return self._moves.line_s + max(0.0, self._slews.free_at - self._box.now())

    @property
    def axes_land_together(self) -> bool:
        """Axis 1 tracks on as soon as it has landed."""
        return False

    @property
    def leading(self) -> Leading | None:
        """It cannot be led."""
        return None

    @property
    def memory(self) -> Mapping[str, object]:
        """Position, moves under way, ties of the encoders, crystal."""
        time = self._box.now()
        begun = min([time, *(begin for axis in self.axes for begin in axis.begun(time))])
        one, two = (axis.kept(begun) for axis in self.axes)
        kept = Kept(
            self.supervision.unsynchronised,
            begun,
            (one, two),
            self._ticks.crystal,
            self._ticks.crystal_uncertainty,
            self._resting,
            self._moves.sending or self._box.in_doubt,
            None if self._box.trust.complete else self._box.trust.since(),
            self._doubt.proved,
            self._settings.meaning,
        )
        return kept.later(self._box.behind).as_json()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        return (*self._own_notes, *self._doubt.untried, *self.supervision.standing.notes)

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Find the box, set its flags, see its clock tick, and say where it is, as well as that can be known.

        Raises
        ------
        TransportError, WrongProtocol
            Nothing answers, or nothing that is a stepper box.
        """
        self._resting |= make_safe
        if self.supervision.in_doubt():
            return self._reading()
        self._watch.see_a_tick()
        self._box.send(commands.guiding_flags(pec=self._settings.pec))
        said = f"its flags cannot be read back: guiding on, PEC {'on' if self._settings.pec else 'off'} were written"
        self._own_notes = (said,)
        if not self.supervision.unsynchronised:
            now = time - self._box.behind
            self._own_notes += absence.tracked_on(self.axes[0], self._settings, self._tracker.rates, self._seen, now)
        self.supervision.found()
        return self._reading()

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:  # noqa: ARG002 - its link knows the time to the piece
        """Send what is due, ask what can be asked, and reckon where the axes are.

        Raises
        ------
        TransportError
            The box does not answer.
        """
        if self.supervision.in_doubt():
            return self._reading()
        self._slews.send_due()
        if self._settings.encoder_counts_per_turn:
            self.supervision.look()
            if self._box.now() - self._watch.asked > _TICKS_EVERY_S:
                self._watch.ask()
        else:
            for _ in range(1 if self._box.trust.complete else _ASKED_BLIND):
                self._closing.due()
                self._watch.ask()
            self.supervision.look_blind()
        return self._reading()

    def _reading(self) -> Reading:
        now = self._box.now()
        axes = []
        for axis in self.axes:
            state = axis.at(now)
            rate = state.rate if axis.slewing(now) else axis.rate_until_free(now)
            axes.append(AxisReading(state.counts, self._doubt.of(axis, now) + axis.grain, rate, axis.slewing(now)))
        return Reading(
            now + self._box.behind,
            tuple(axes),
            motion=("tracking", *self.supervision.moved_by),
            alarms=self.supervision.standing.alarms,
            tracking=not self._resting,
            unsynchronised=self.supervision.unsynchronised,
        )

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Begin a slew; the pieces that come later are sent by `read`.

        Raises
        ------
        Unsynchronised, DriveRefused
            Nobody knows where it is, or it still moves.
        """
        if self.supervision.unsynchronised:
            raise Unsynchronised(self.supervision.unsynchronised)
        self._resting = not any(slew.rate_after for slew in axes)
        behind = self._box.behind
        return self._slews.begin(sooner(axes, behind), time - behind) + behind

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep both axes on a path by `+`, `-`, `<`, `>` and short moves; on one at rest, hold them short of it."""
        self._resting = all(rate == 0.0 for _, rate in path.at(time)[:2])
        behind = self._box.behind
        idle = bool(self.supervision.unsynchronised) or self.supervision.on_trial or self._closing.pending
        if idle or any(axis.slewing(time - behind) for axis in self.axes):
            return RECHECK_S
        return self._tracker.follow(SeenSooner(path, behind))

    def hold_unplaced(self, time: float) -> str:  # noqa: ARG002 - its link knows the time to the piece
        """Hold axis 1 by its encoder while nobody knows where it is; return how, or nothing where it cannot be.

        Raises
        ------
        TransportError
            The box does not answer.
        """
        return self._unplaced.hold()

    def leave_unplaced(self) -> None:
        """Hold it so no more."""
        self._unplaced.end()

    # All else --------------------------------------------------------------------------------------------------

    def stand_by(self, time: float) -> None:
        """Nothing needs to be made ready."""

    def move_at(self, rates: Sequence[float], time: float) -> None:  # noqa: ARG002
        """Refuse: it only makes counted moves.

        Raises
        ------
        DriveRefused
            Always.
        """
        raise DriveRefused("the box only makes counted moves, none at a speed: `jog` moves one axis by a way")

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Reckon from here on.

        Raises
        ------
        DriveRefused
            It slews.
        """
        now = self._box.now()
        if any(now < axis.reckoning.ends for axis in self.axes):
            raise DriveRefused("the axes move: `sync` when they have ended it, the box has no stop")
        since = now - (time - self._box.behind)
        found = [here + axis.at(now).rate * since for axis, here in zip(self.axes, counts, strict=False)]
        self._doubt.tried(found, now)
        for axis, here in zip(self.axes, found, strict=True):
            axis.known(here, now, 0.5)
        self.supervision.synchronised()
        self._box.send(commands.guiding_flags(pec=self._settings.pec))

    def stop(self, time: float) -> None:
        """Send no further piece, and hold axis 1 from then on where `follow` says.

        Raises
        ------
        StillMoving
            A piece is under way; says when it ends.
        """
        for axis in self.axes:
            axis.abandon()
        self._resting = True
        now = time - self._box.behind
        left = {axis.index + 1: axis.slew_ends - now for axis in self.axes if axis.slew_ends > now}
        if left:
            ends = " and ".join(f"axis {number} ends its move" for number in left)
            raise StillMoving(_NO_STOP.format(ends, max(left.values())))

    def power(self, *, on: bool) -> None:
        """Refuse: no command switches its motors.

        Raises
        ------
        DriveRefused
            Always.
        """
        raise DriveRefused(
            f"no command switches the motors of the box {'on' if on else 'off'}: its power switch does"
        )

    def registers(self) -> Mapping[str, str]:
        """All that it can be asked, and what is known of its clock."""
        return self._panel.registers()

    def set_pec(self, name: str, number: int) -> None:
        """Set the PEC bin, or the bin at which the index pulse finds the worm.

        Raises
        ------
        AvrBoxError
            There is no such bin, or its bytes could be taken for a command.
        """
        self._panel.set_pec(name, number)

    def encoders_seen(self) -> tuple[EncoderSeen, ...]:
        """What both encoders say, and where that is; nothing where none are fitted.

        Raises
        ------
        TransportError
            They do not answer.
        """
        return self._panel.encoders(synchronised=not self.supervision.unsynchronised)

    def give_back(self) -> None:
        """Trials are over: from here on the axes are where their encoders say."""
        self.trials.end()

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002
        """Leave it; it ends its move and tracks on, whatever was asked."""
        for axis in self.axes:
            axis.abandon()
        self._resting = not keep_tracking
        self._box.close()
