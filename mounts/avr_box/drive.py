"""The stepper box behind the Drive contract.

It says nothing of its motors and has no stop. Where the axes are is reckoned from all that was sent, by the exact law
of its slews; encoders, where there are some, prove it to a count and repair it. A long way goes in pieces, the next
one sent by `read` at its time; `stop` sends no further one. After each move the box is asked for its PEC bin: one
that is silent then may have taken the question for the rest of the move.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from mounts.avr_box import commands, following, guiding
from mounts.avr_box.axis import BoxAxis, Waiting
from mounts.avr_box.box import Box, Told
from mounts.avr_box.guiding import GuideRates
from mounts.avr_box.memory import Kept
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.slew_model import AvrSlewModel
from mounts.avr_box.slew_table import laws
from mounts.avr_box.supervision import Supervision
from mounts.avr_box.tick_clock import CRYSTAL_UNCERTAINTY, TickClock
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveRefused, Unsynchronised
from pointing.plan import Leading
from transports.errors import TransportError

_COMMAND_BYTES = 6  # of a move
_SOON_S = 0.5  # within which `read` waits for the time of a piece
_SHORT_S = 5.0  # that a move of `follow` takes at most, for a slew to wait for it
_TICKS_EVERY_S = 10.0  # the phase of TIMER1 is asked for
_PHASE_S = 0.02  # to which it must be known before guiding
_LOOK_S = 1.2  # in which the first tick must have been seen
_RECHECK_S = 0.5
_FOLLOW_S = 5.0  # at most until a path is looked at again
_UNATTENDED = 3e-3  # of the way that it tracked while nobody looked: the divisor, or a PEC that was switched on
_GUIDED_S = 118.0  # for which guiding goes on at most when its host is gone
_CORRECTED = 2000  # microsteps by which the last piece of a slew makes up for what the others were off
_EXCHANGE_S = 0.05  # of a question and its answer
_ROUNDS = 4  # of solving where both land, each later than the one before by less
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
        self._remember = remember
        kept = Kept.of(memory, settings.meaning)
        doubt = kept.crystal_uncertainty
        self._ticks = TickClock(kept.crystal, CRYSTAL_UNCERTAINTY if doubt is None else doubt)
        self._seen = kept.time
        one, two = (
            BoxAxis(i, settings, law, self._ticks, kept.axes[i], kept.time if math.isfinite(kept.time) else box.now())
            for i, law in enumerate(laws(settings.slew_table))
        )
        self.axes = (one, two)
        self.supervision = Supervision(box, self.axes, kept.unsynchronised, kept.time)
        self._resting = kept.resting
        self._sending = False
        self._sent = False  # a move, after which nothing was asked
        self._asked_ticks = -math.inf
        self._own_notes: tuple[str, ...] = ()

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
        return self._line_s + max(0.0, self._free_at - self._box.now())

    @property
    def _line_s(self) -> float:
        return _COMMAND_BYTES * self._box.byte_s + self._box.delay_s

    @property
    def _free_at(self) -> float:
        return max(*(axis.free_at for axis in self.axes), self.axes[1].guided_until)

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
        return Kept(
            self.supervision.unsynchronised,
            begun,
            (one, two),
            self._ticks.crystal,
            self._ticks.crystal_uncertainty,
            self._resting,
            self._sending,
            self._settings.meaning,
        ).as_json()

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know."""
        return (*self._own_notes, *self.supervision.notes)

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Find the box, set its flags, see its clock tick, and say where it is, as well as that can be known.

        Raises
        ------
        TransportError, WrongProtocol
            Nothing answers, or nothing that is a stepper box.
        """
        self._see_a_tick(self._box.ask(commands.ASK_PEC))
        names = ("ra_guiding", "dec_guiding", *(("pec",) if self._settings.pec else ()))
        self._box.send(commands.flags(*names))
        said = f"its flags cannot be read back: guiding on, PEC {'on' if self._settings.pec else 'off'} were written"
        self._own_notes = (said,)
        self._resting |= make_safe
        self._unattended(time)
        self.supervision.found()
        return self._reading()

    def _see_a_tick(self, first: Told) -> None:
        """Ask for the bin until it changes, which is the tick."""
        self._heard(first)
        due = first.latest + _LOOK_S
        while self._ticks.uncertainty_s > _PHASE_S and self._box.now() < due:
            told = self._box.ask(commands.ASK_PEC)
            self._heard(told)

    def _heard(self, told: Told) -> None:
        before = self._ticks.crystal
        self._ticks.heard(told.pair.one, told.earliest, told.latest)
        self._asked_ticks = told.latest
        if self._ticks.crystal != before:
            for axis in self.axes:
                axis.crystal_measured(told.latest)

    def _unattended(self, time: float) -> None:
        """While nobody looked it tracked on: how far, and how surely."""
        away = time - self._seen
        if not math.isfinite(away) or self.supervision.unsynchronised:
            return
        axis = self.axes[0]
        rates = GuideRates.of(self._settings.own_rate, self._settings.guide_counts, self._ticks.crystal)
        doubt = away * rates.own * _UNATTENDED + min(away, _GUIDED_S) * (rates.faster - rates.own)
        here = axis.at(time)
        axis.known(here.counts, time, here.uncertainty + max(0.0, doubt))
        degrees = away * rates.own / self._settings.steps_per_turn[0] * 360.0
        if degrees > 0.1:
            arcmin = doubt / self._settings.steps_per_turn[0] * 21600.0
            told = f"axis 1 tracked on for {away:.0f} s while no program looked, {degrees:.2f}° ± {arcmin:.1f}′"
            self._own_notes = (*self._own_notes, told)

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:  # noqa: ARG002 - its link knows the time to the piece
        """Send what is due, ask what can be asked, and reckon where the axes are.

        Raises
        ------
        TransportError, DriveRefused
            The box does not answer, or must not be asked.
        """
        self._send_due()
        if self._settings.encoder_counts_per_turn:
            self.supervision.look()
        if self._box.now() - self._asked_ticks > _TICKS_EVERY_S or not self._settings.encoder_counts_per_turn:
            self._heard(self._box.ask(commands.ASK_PEC))
        return self._reading()

    def _reading(self) -> Reading:
        now = self._box.now()
        axes = []
        for axis in self.axes:
            state = axis.at(now)
            rate = state.rate if axis.slewing(now) else axis.rate_until_free(now)
            axes.append(AxisReading(state.counts, state.uncertainty + axis.grain, rate, axis.slewing(now)))
        return Reading(
            now,
            tuple(axes),
            motion=("tracking", *self.supervision.moved_by),
            alarms=self.supervision.alarms,
            tracking=not self._resting,
            unsynchronised=self.supervision.unsynchronised,
        )

    # Slewing ---------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Send the first piece of each axis; the others are sent by `read`.

        Raises
        ------
        Unsynchronised, DriveRefused
            Nobody knows where it is, or it still moves.
        """
        if self.supervision.unsynchronised:
            raise Unsynchronised(self.supervision.unsynchronised)
        self._settle(time)
        began = self._box.now() + self._line_s
        aims = self._aims(axes, began)
        self._resting = not any(slew.rate_after for slew in axes)
        for axis, aim, slew in zip(self.axes, aims, axes, strict=False):
            self._plan(axis, aim, slew, began)
        self._send_due()
        return began

    def _settle(self, time: float) -> None:
        """Wait for a short move that is under way; nothing else may be."""
        busy = self._free_at - time
        if busy > _SHORT_S:
            raise DriveRefused(f"the axes still move for {busy:.1f} s, and no command ends that: wait for it")
        self._box.pause(self._free_at)

    def _aims(self, axes: Sequence[AxisSlew], began: float) -> list[float]:
        """Where each axis is to land, so that both are right when the later one does: each then goes its own rate."""
        aims = [slew.target for slew in axes[:2]]
        for _ in range(_ROUNDS):
            durations = [
                self._model(axis, slew).travel(axis.at(began).counts, aim, 0.0, 0.0).duration
                for axis, aim, slew in zip(self.axes, aims, axes, strict=False)
            ]
            planned = [slew.arrival for slew in axes[:2]]
            apart = [max(durations) - own for own in durations]
            # A target was given for its planned landing, at the rate with which the path goes on from there.
            late = [0.0 if due is None else began + own - due for due, own in zip(planned, durations, strict=True)]
            aims = [
                slew.target + slew.rate_after * (gap + behind) - axis.own_rate * gap
                for axis, slew, gap, behind in zip(self.axes, axes, apart, late, strict=False)
            ]
        return aims

    def _model(self, axis: BoxAxis, slew: AxisSlew) -> AvrSlewModel:
        return axis.model if slew.max_rate is None else axis.model.limited(slew.max_rate)

    def _plan(self, axis: BoxAxis, aim: float, slew: AxisSlew, begin: float) -> None:
        travel = self._model(axis, slew).travel(axis.at(begin).counts, aim, 0.0, 0.0)
        axis.abandon()
        axis.aim = aim
        axis.slew_ends = begin + travel.duration
        axis.waiting = [Waiting(piece, begin + piece.begin) for piece in travel.pieces]

    def _send_due(self) -> None:
        """Send the pieces whose time comes before the next look, each at its time."""
        while due := sorted((axis.waiting[0].begin, axis.index) for axis in self.axes if axis.waiting):
            begin, index = due[0]
            if begin > self._box.now() + _SOON_S:
                break
            if self._sent and begin > self._box.now() + _EXCHANGE_S:
                self._prove()
            self._send_piece(self.axes[index])
        if self._sent:
            self._prove()

    def _send_piece(self, axis: BoxAxis) -> None:
        """Send the next piece at its time; the last one for where the axis is by then."""
        waiting = axis.waiting[0]
        steps, begin = waiting.piece.steps, max(waiting.begin, axis.free_at)
        if len(axis.waiting) == 1 and axis.aim is not None:
            steps, begin = self._last(axis, axis.aim, waiting)
        self._box.pause(begin - self._line_s)
        axis.waiting.pop(0)
        if steps:
            self._move(axis, abs(steps) // 2, 1 if steps > 0 else -1, slew=True)

    def _last(self, axis: BoxAxis, aim: float, planned: Waiting) -> tuple[int, float]:
        """Microsteps that lead to the aim from where the axis is when it begins; as planned where they cannot."""
        begin, per_half = max(planned.begin, axis.free_at), self._settings.wire_per_half
        half = round((aim - axis.starts_from(begin)) / 2.0)
        wire, alike = abs(half) * per_half, abs(2 * half - planned.piece.steps) < _CORRECTED
        good = alike and abs(half) <= axis.model.longest_half and commands.harmless_below(wire, per_half) == wire
        return (2 * half if good else planned.piece.steps), begin

    def _move(self, axis: BoxAxis, half: int, sign: int, *, slew: bool = False) -> None:
        """Send a move; it is remembered before, and the box asked after."""
        command = commands.move(
            axis.index, half * self._settings.wire_per_half, decreasing=sign < 0, axis_bit=self._settings.axis_bit
        )
        self._sending = True
        self._remember(self.memory)
        begin = self._box.send(command)
        axis.moved(half, sign, begin, slew=slew)
        self._sending = False
        self._remember(self.memory)
        self._sent = True

    def _prove(self) -> None:
        """Ask after what was sent: a box that took the question for the rest of a move is silent."""
        self._sent = False
        with suppress(TransportError):
            self._heard(self._box.ask(commands.ASK_PEC, tries=1))
            return
        self.supervision.suspect()

    # Following -------------------------------------------------------------------------------------------------

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep both axes on a path by `+`, `-`, `<`, `>` and short moves; on one at rest, hold them short of it."""
        self._resting = all(rate == 0.0 for _, rate in path.at(time)[:2])
        idle = bool(self.supervision.unsynchronised) or self.supervision.on_trial
        if idle or any(axis.slewing(time) for axis in self.axes):
            return _RECHECK_S
        return min(self._follow_one(path), self._follow_two(path), _FOLLOW_S)

    def _follow_one(self, path: AxisPath) -> float:
        axis, now = self.axes[0], self._box.now()
        ahead, wanted = self._ahead(axis, path, now)
        rates = GuideRates.of(self._settings.own_rate, self._settings.guide_counts, self._ticks.crystal)
        band = following.band_of(wanted, rates)
        if now < axis.free_at:
            return axis.free_at - now
        drift = axis.at(now).rate * axis.sign - wanted
        if not band.low <= ahead <= band.high:
            half = following.move_back(ahead, wanted, band, axis.duration)
            self._short_move(axis, half * axis.sign)
            return axis.free_at - self._box.now()
        if wanted and now >= axis.guided_until:
            self._guide(path, rates)
            now = self._box.now()
            ahead, wanted = self._ahead(axis, path, now)
            drift = axis.at(now).rate * axis.sign - wanted
            due = axis.guided_until - now if now < axis.guided_until else guiding.EVERY_S / 2.0
        else:
            due = axis.guided_until - now if now < axis.guided_until else math.inf
        return max(0.05, min(due, following.leaves_in(ahead, drift, band)))

    def _ahead(self, axis: BoxAxis, path: AxisPath, time: float) -> tuple[float, float]:
        """By how many microsteps an axis is ahead of its path, and the path's rate, both with the axis's angle."""
        counts, rate = path.at(time)[axis.index]
        return axis.sign * (axis.at(time).counts - counts), axis.sign * rate

    def _guide(self, path: AxisPath, rates: GuideRates) -> None:
        """Send `+` or `-` in the middle of a tick, where that is due."""
        axis, tick = self.axes[0], self._ticks.tick_s
        if self._guided_last + guiding.EVERY_S > self._box.now() and rates.reach(
            self._ahead(axis, path, self._box.now())[1]
        ):
            return
        if self._ticks.uncertainty_s > _PHASE_S * 3.0:
            self._see_a_tick(self._box.ask(commands.ASK_PEC))
        lead = 2 * self._box.byte_s + self._box.delay_s
        self._box.pause(self._box.now() + guiding.sent_after(self._ticks.since_tick(self._box.now() + lead), tick))
        begin = self._box.now() + lead
        ahead, wanted = self._ahead(axis, path, begin)
        pulse = guiding.pulse(ahead, wanted, rates, self._ticks.since_tick(begin), tick)
        self._guided_last = begin
        if pulse is None:
            return
        command = commands.faster(pulse.ticks) if pulse.sign > 0 else commands.slower(pulse.ticks)
        begin = self._box.send(command)
        ends = pulse.ticks * tick - self._ticks.since_tick(begin)
        axis.guided(axis.sign * (rates.faster if pulse.sign > 0 else rates.slower), begin, ends)

    _guided_last = -math.inf

    def _follow_two(self, path: AxisPath) -> float:
        axis, now = self.axes[1], self._box.now()
        busy = max(axis.free_at, axis.guided_until) - now
        if busy > 0.0:
            return busy
        ahead, wanted = self._ahead(axis, path, now)
        if steps := following.single_steps(ahead):
            command = commands.north(steps) if steps > 0 else commands.south(-steps)
            axis.stepped(steps * axis.sign, self._box.send(command))
        elif abs(ahead) >= 1.0:
            half = round(-ahead / 2.0)
            self._short_move(axis, half * axis.sign)
        return _RECHECK_S if wanted == 0.0 else min(_FOLLOW_S, max(_RECHECK_S, 1.0 / abs(wanted)))

    def _short_move(self, axis: BoxAxis, half: int) -> None:
        most = axis.model.longest_half
        steps = commands.harmless_below(
            min(abs(half), most) * self._settings.wire_per_half, self._settings.wire_per_half
        )
        if steps:
            self._move(axis, steps // self._settings.wire_per_half, 1 if half > 0 else -1)
            self._prove()

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
        raise DriveRefused("the box only makes counted moves, none at a speed: `jog` makes one of a length")

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
        for axis, here in zip(self.axes, counts, strict=False):
            ahead = axis.at(now).rate * (now - time)
            axis.known(here + ahead, now, 0.5)
        self.supervision.synchronised()

    def stop(self, time: float) -> None:
        """Send no further piece, and hold axis 1 from then on where `follow` says.

        Raises
        ------
        DriveRefused
            A piece is under way; says when it ends.
        """
        for axis in self.axes:
            axis.abandon()
        self._resting = True
        left = {axis.index + 1: axis.slew_ends - time for axis in self.axes if axis.slew_ends > time}
        if left:
            ends = " and ".join(f"axis {number} ends its move" for number in left)
            raise DriveRefused(_NO_STOP.format(ends, max(left.values())))

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
        pec = self._box.ask(commands.ASK_PEC)
        self._heard(pec)
        shown = {"pec_bin": str(pec.pair.one), "pec_zero": str(pec.pair.two)}
        if self._settings.encoder_counts_per_turn:
            said = self._box.ask(commands.ASK_ENCODERS).pair
            shown |= {"encoder_1": str(said.one), "encoder_2": str(said.two)}
        doubt = self._ticks.crystal_uncertainty * 1e6
        return shown | {"crystal": f"{(self._ticks.crystal - 1.0) * 1e6:+.1f} ± {doubt:.1f} ppm"}

    def set_pec(self, name: str, number: int) -> None:
        """Set the PEC bin, or the bin at which the index pulse finds the worm.

        Raises
        ------
        AvrBoxError
            There is no such bin.
        """
        self._box.send(commands.set_bin(number) if name == "pec_bin" else commands.set_zero(number))

    def asked_encoders(self) -> Told:
        """What both encoders say."""
        return self._box.ask(commands.ASK_ENCODERS)

    def send_trial(self, index: int, half: int, *, falling: bool) -> int:
        """Send a move that finds out what a move is, with nobody watching but who asked for it; return its count."""
        self.supervision.on_trial = True
        wire = half * self._settings.wire_per_half
        self._box.send(commands.move(index, wire, decreasing=falling, axis_bit=self._settings.axis_bit))
        return wire

    def give_back(self) -> None:
        """Trials are over: from here on the axes are where their encoders say."""
        self.supervision.resumed()

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002
        """Leave it; it ends its move and tracks on, whatever was asked."""
        for axis in self.axes:
            axis.abandon()
        self._resting = not keep_tracking
        self._box.close()
