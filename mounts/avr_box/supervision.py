"""Whether the axes are where they are reckoned to be: the encoders are asked, and what they say is acted on.

A byte that is lost on the way to the box can make any move of one that was bounded; nothing in its protocol forbids
it. So an axis that the encoder sees run where none was asked to is given a move of 5′, which ends the one before it
(A). An axis that stands elsewhere missed steps, or was moved by hand: the encoder says where it is, to a count.
"""

from collections.abc import Sequence

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import HALF_A_COMMAND, Box, Told
from mounts.avr_box.encoders import Encoder
from mounts.avr_box.evidence import DAMAGES, Evidence
from mounts.avr_box.power_switch import PowerSwitch
from mounts.avr_box.reasons import ABSENT, AGAINST, BAD_LINE, MAY_RUN, STEPPED, STILL, SWITCHED
from mounts.avr_box.runaway import BOUND_COUNTS, RUNS_COUNTS, Runaway
from mounts.avr_box.runaways import BY_HAND_S, Runaways
from mounts.avr_box.sight import TIMING_S, Astray, Sight
from mounts.avr_box.standing import Standing
from mounts.avr_box.tick_clock import TickClock
from mounts.avr_box.unseen import Unseen

_UNPROVED_COUNTS = 1.3  # beyond what was asked, where a move may have been mutilated: two roundings and their times
ABSENT_S = 60.0
"""For which a box that no encoder watches may be left without a program."""


class Supervision:
    """Watches both axes of one box.

    Parameters
    ----------
    box : Box
        Is asked.
    axes : tuple of BoxAxis
        Are repaired.
    ticks : TickClock
        Tells whether the box was switched on meanwhile.
    unsynchronised : str
        Why nobody knows where they are; empty where that is known.
    since : float
        When that was so, POSIX seconds.
    endable : bool
        Whether a move ends the one under way (A).
    """

    def __init__(
        self,
        box: Box,
        axes: tuple[BoxAxis, BoxAxis],
        ticks: TickClock,
        unsynchronised: str,
        since: float,
        *,
        endable: bool = True,
    ) -> None:
        self._box, self._axes, self._ticks, self._endable = box, axes, ticks, endable
        self.standing = Standing(axes, unsynchronised)
        """Whether the position is known, and what was seen."""
        self._sight = Sight(box, axes)
        self._switch = PowerSwitch(box, axes, ticks, since)
        self._runaways = Runaways(box, axes, self.standing, endable=endable)
        self._evidence = Evidence()
        self._unseen = (Unseen(), Unseen())
        self.on_trial = False
        """A move is under way of which nobody knows yet where it leads."""
        self.moved_by: tuple[str, ...] = ()
        self._sound = 0  # flaws of the line when the position was last given

    @property
    def unsynchronised(self) -> str:
        """Why nobody knows where the axes are; empty where that is known."""
        return self.standing.unsynchronised

    @property
    def flawed(self) -> bool:
        """Whether the line has shown a flaw since it was known where the axes are."""
        return self._damages > 0

    @property
    def _damages(self) -> int:
        return self._box.trust.flaws - self._sound

    @property
    def looked(self) -> float:
        """When the encoders were last believed, POSIX seconds."""
        return self._switch.looked

    def unseen(self, axis: BoxAxis) -> float:
        """Microsteps that an axis was led while its encoder stood, and which it may have gone."""
        return self._unseen[axis.index].steps

    def found(self) -> None:
        """Look for the first time: tie the encoders, or say where the axes went while nobody looked."""
        if self._axes[0].encoder is None:
            if not self.unsynchronised and self._box.now() - self.looked > ABSENT_S:
                self.standing.lose(ABSENT)
            return
        told = self._box.ask(commands.ASK_ENCODERS)
        if self.unsynchronised:
            return
        for axis, unseen in zip(self._axes, self._unseen, strict=True):
            if axis.encoder is not None and axis.encoder.zero is not None:
                here = axis.at(self.looked).counts
                unseen.look(axis, axis.encoder.counts(here), self.looked)
        self._see(told)
        self._sight.tie(told)
        if self._sight.any_beyond(told):
            if self._switch.counts_from_nothing(told):  # far from where they would be, had it not been switched off
                self._was_switched_off(told)
            else:
                for axis in self._axes:
                    if axis.encoder is not None:
                        axis.encoder.proved = None  # nobody saw whether it was turned by hand meanwhile
                self._repair(self._sight.astray(told))
        self._sight.bound(told, flawed=self.flawed)
        self._switch.looked = told.middle

    def look(self) -> None:
        """Ask the encoders, and act on what they say.

        Raises
        ------
        TransportError
            They do not answer.
        """
        told = self._box.ask(commands.ASK_ENCODERS)
        if self._ticks.stepped:
            self._ticks.stepped = False
            self._box.trust.flawed()
        self._runaways.end_again()
        if self.on_trial:
            return
        if self.unsynchronised:
            self._runaways.end_unplaced(told)
            return
        self._sight.tie(told)
        self.moved_by = ()
        self._see(told)
        if self.unsynchronised:
            return
        if not self._sight.any_beyond(told):
            if self._switch.used_nearby(told):
                self._was_switched_off(told)
            else:
                self._agreed(told)
            return
        first, told = told, self._sight.surely_told()
        if self._sight.any_beyond(told):
            self._act(told)
            return
        if not self._sight.agree(first, told):  # else it was beyond by the rounding of one of them
            self._box.trust.flawed()
        self._agreed(told)

    def look_blind(self) -> None:
        """See whether the line shows a flaw, or the box another time, and no encoder tells what came of it."""
        if self.unsynchronised or self.on_trial:
            return
        if self._ticks.stepped:
            self.standing.lose(STEPPED)
        elif self.flawed and self._box.trust.complete:
            self._sound = self._box.trust.flaws
        elif self.flawed:
            self.standing.lose(BAD_LINE)

    def in_doubt(self) -> bool:
        """Whether half a command may stand in the box, so that it must not be sent one byte until a `sync`."""
        if self._box.in_doubt and self.unsynchronised != HALF_A_COMMAND:
            self.standing.lose(HALF_A_COMMAND)
        return self._box.in_doubt

    def suspect(self) -> None:
        """The box was silent after a move: see whether it runs.

        Where no move ends another, what stands in the box must not be completed.
        """
        if not self._endable:
            self._box.in_doubt = True
            self.in_doubt()
            return
        if self._axes[0].encoder is None:
            self.standing.lose(MAY_RUN)
            return
        self.look()

    def resumed(self) -> None:
        """Trials are over: the encoders say where they led."""
        if not self.on_trial:
            return
        self.on_trial = False
        told = self._box.ask(commands.ASK_ENCODERS)
        for axis, said in zip(self._axes, told.pair, strict=True):
            axis.agreed()
            if axis.encoder is not None and axis.encoder.zero is not None:
                axis.halted(axis.encoder.steps(said), told.middle, BOUND_COUNTS * axis.encoder.step)

    def synchronised(self) -> None:
        """A person says where the axes are."""
        self._box.switched_on()
        self.standing.given()
        self._sound = self._box.trust.flaws
        self._box.trust.told()
        self._ticks.forget()
        self._runaways.forget()
        self._evidence.forget()
        for unseen in self._unseen:
            unseen.forget()
        encoders = [axis.encoder for axis in self._axes if axis.encoder is not None]
        for encoder in encoders:
            encoder.zero = None
        if encoders:
            self._sight.tie(self._box.ask(commands.ASK_ENCODERS))

    def _see(self, told: Told) -> None:
        """See whether the encoders see anything; one that does not is no longer believed, nor its axis moved."""
        for axis, unseen in zip(self._axes, self._unseen, strict=True):
            unseen.look(axis, told.pair[axis.index], told.middle)
            if unseen.is_blind(bad_line=self._damages >= DAMAGES):
                self.standing.lose(STILL.format(axis.index + 1))
                self.standing.blind.add(axis.index)
                self._runaways.break_off(axis)

    def _agreed(self, told: Told) -> None:
        self._sight.bound(told, flawed=self.flawed)
        self._switch.believed(told)
        for axis in self._axes:
            if said := self._evidence.creeps(axis):
                self.standing.note(said)
            if axis.encoder is not None and told.earliest > axis.reckoning.ends:
                self._rests(axis, axis.encoder)
                axis.encoder.proved = axis.at(told.middle).counts
                self._evidence.agrees(axis)

    def _act(self, told: Told) -> None:
        """Two answers said so: a box that was switched on, a sense that is wrong, a runaway, a hand."""
        if self._switch.used(told):
            self._was_switched_off(told)
            return
        astray = self._sight.astray(told)
        if any(each.opposite for each in astray):  # an answer that came late says so once, a wrong wire again
            astray = self._sight.astray(astray[0].told)
        unproved = any(axis.unproved for axis in self._axes)
        most = _UNPROVED_COUNTS if unproved else RUNS_COUNTS
        running = [each for each in astray if each.past or (abs(each.runs) > most and not each.short)]
        if running and (unproved or self._runaways.lasted(told.middle) > BY_HAND_S):
            self._end(running)
            return
        self.moved_by = ("hand controller",) if astray and not unproved else ()
        self._repair(astray)

    def _was_switched_off(self, told: Told) -> None:
        """No move is under way any more, and nobody knows where the last one has led."""
        for axis in self._axes:
            state = axis.at(told.middle)
            axis.halted(state.counts, told.middle, state.uncertainty)
        self.standing.lose(SWITCHED)

    def _end(self, running: Sequence[Astray]) -> None:
        self._runaways.end([Runaway(each.axis, each.encoder, each.runs > 0.0) for each in running])
        for each in running:
            if each.opposite:
                self.standing.lose(AGAINST.format(each.axis.index + 1))
        if why := self._evidence.ran(running, self._damages):
            self.standing.lose(why)

    def _repair(self, astray: Sequence[Astray]) -> None:
        """The encoder is right, to a count; one that again and again says the opposite is not."""
        for axis, encoder, told, runs, *_ in astray:
            said, state = encoder.steps(told.pair[axis.index]), axis.at(told.middle)
            against = self._evidence.opposes(axis, encoder, said, state.counts)
            if why := against or self._evidence.falls_short(axis, encoder, said, state.counts, self._damages):
                self.standing.lose(why)
                return
            self.standing.note(
                f"axis {axis.index + 1} is {abs(said - state.counts) / encoder.step:.1f} encoder counts from where "
                "its steps lead: it missed steps, or was moved by hand; the encoder says where it is, ± 1 count"
            )
            unsure = encoder.step * (BOUND_COUNTS + abs(runs)) + abs(state.rate) * TIMING_S
            self._switch.believed(told)
            axis.corrected += said - state.counts
            axis.known(said, told.middle, unsure)
            encoder.proved, axis.trimmed = said, 0.0
            if told.earliest > axis.reckoning.ends:
                self._rests(axis, encoder)

    def _rests(self, axis: BoxAxis, encoder: Encoder) -> None:
        if why := self._evidence.rests(axis, encoder, self._damages):
            self.standing.lose(why)
