"""Whether the axes are where they are reckoned to be: the encoders are asked, and what they say is acted on.

A byte that is lost on the way to the box can make any move of one that was bounded; nothing in its protocol forbids
it. So an axis that the encoder sees run where none was asked to is given a move of 5′, which ends the one before it
(A). An axis that stands elsewhere missed steps, or was moved by hand: the encoder says where it is, to a count.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import HALF_A_COMMAND, Box, Told
from mounts.avr_box.encoders import ROUNDED_COUNTS, TRUST_COUNTS, Encoder, zeroed
from mounts.avr_box.runaway import AGAIN_S, BOUND_COUNTS, RUNS_COUNTS, Runaway, end
from mounts.avr_box.tick_clock import TickClock

_UNPROVED_COUNTS = 1.3  # beyond what was asked, where a move may have been mutilated: two roundings and their times
_TIMING_S = 0.005
_CLEAR_COUNTS = 8.0  # of a move, to tell how far it went
_FIRST_BINS = 3
_LATELY_S = 20.0  # within which the bin may have been told already, and taken for one that an index pulse moved
_AWAY_COUNTS = 5.0  # from nothing, to tell an encoder that began anew
_BY_HAND_S = 3.0  # longer than a move of 5′ by the hand controller takes
_TRIES = 3
_DAMAGES = 3  # of the line since the last sync, from which on it mutilates moves as well
_OFTEN = 2  # times that the opposite is no chance
ABSENT_S = 60.0  # for which a box that no encoder watches may be left without a program
SWITCHED = "the box was switched off and on: its encoders began anew; `sync` on a known star"
ABSENT = (
    "no program watched, and without encoders nobody knows whether the box was switched off or the telescope turned "
    "meanwhile; `sync` on a known star"
)
BAD_LINE = (
    "the line lost or mutilated an answer soon after a command, which it may have mutilated too, and there are no "
    "encoders to tell; look at the telescope, switch the box off if it runs, mend cable or port, then `sync`"
)
STEPPED = (
    "the ticks of the box are not where they should be: it was switched off and on, or this computer's clock was set "
    "while axis 1 tracked; `sync` on a known star"
)
MAY_RUN = (
    "the box did not answer after a move, which may have been mutilated, and there are no encoders to see it: both "
    "axes were given moves of 5′ to end it; look at the telescope, switch the box off if it runs, then `sync`"
)
AGAINST = (
    "the encoder of axis {} says the opposite of what the axis was told: swap its A and B wires, or set `reversed` "
    "of that axis where it turns the wrong way, or `axis_bit` where it moves instead of the other one (`commission` "
    "tells which), then `sync`; where that happens once on a line that loses bytes, a command was mutilated"
)
COUNTS = (
    'by the encoders moves go {} as far as they should, again and again: set `move_count` to "{}", unless '
    "`commission` finds `encoder_counts_per_turn` or the gears wrong, then `sync`"
)
RAN = (
    "axis {} ran where it was not sent and was given a move of 5′ to end that: a mutilated command, or, if it is so "
    "at every move, `move_count`, `axis_bit` or `reversed` are not as configured"
)
RUNS_ON = "axis {} runs on, and a move of 5′ did not end it: switch the box off now, then on, and `sync`"


class _Astray(NamedTuple):
    """An axis that is not where it was reckoned to be, twice."""

    axis: BoxAxis
    encoder: Encoder
    told: Told  # the later look
    runs: float  # counts that it made between two looks beyond what was asked of it, signed with its own
    opposite: bool  # it went as far the other way
    past: bool  # it is ahead of the move that was asked of it and is under way, as one that was mutilated is
    short: bool  # it goes the way that was asked of it, and falls behind, or stands


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
    """

    def __init__(
        self, box: Box, axes: tuple[BoxAxis, BoxAxis], ticks: TickClock, unsynchronised: str, since: float
    ) -> None:
        self._box = box
        self._axes = axes
        self._ticks = ticks
        one, two = (0 if axis.encoder is None else axis.encoder.counts(axis.at(since).counts) for axis in axes)
        self._counted = one, two  # by the encoders when they were last believed
        self.unsynchronised = unsynchronised
        self.alarms: tuple[str, ...] = ()
        self.on_trial = False
        """A move is under way of which nobody knows yet where it leads."""
        self.moved_by: tuple[str, ...] = ()
        self._events: list[str] = []
        self._against = [0, 0]  # how often an encoder said the opposite, one time after the other
        self._halved = self._doubled = 0  # moves, one after the other, that went half as far, or farther
        self._looked = since
        self._runaways: list[Runaway] = []  # which no move of 5′ ended
        self._runs_since = self._runs_seen = -math.inf  # POSIX seconds, when one that nobody asked was seen to run
        self._unplaced: Told | None = None  # what the encoders said last while nobody knew where the axes are
        self._running_since = [math.inf, math.inf]  # POSIX seconds, likewise
        self._sound = 0  # flaws of the line when the position was last given

    @property
    def notes(self) -> tuple[str, ...]:
        """What was seen, the newest last."""
        return tuple(self._events[-5:])

    @property
    def flawed(self) -> bool:
        """Whether the line has shown a flaw since it was known where the axes are."""
        return self._box.trust.flaws > self._sound

    @property
    def looked(self) -> float:
        """When the encoders were last believed, POSIX seconds."""
        return self._looked

    def found(self) -> None:
        """Look for the first time: tie the encoders, or say where the axes went while nobody looked."""
        if self._axes[0].encoder is None:
            if not self.unsynchronised and self._box.now() - self._looked > ABSENT_S:
                self._lose(ABSENT)
            return
        told = self._box.ask(commands.ASK_ENCODERS)
        if self.unsynchronised:
            return
        self._tie(told)
        if any(self._beyond(axis, told) for axis in self._axes):
            if self._counts_from_nothing(told):  # far from where they would be, had the box not been switched off
                self._lose(SWITCHED)
            else:
                self._repair(self._astray(told))
        self._bound(told)
        self._looked = told.middle

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
        if self._runaways:
            self._end(self._runaways)
        if self.on_trial:
            return
        if self.unsynchronised:
            self._guard(told)
            return
        self._tie(told)
        self.moved_by = ()
        if not any(self._beyond(axis, told) for axis in self._axes):
            self._agreed(told)
            return
        told = self._surely_told(told)
        if any(self._beyond(axis, told) for axis in self._axes):
            self._act(told)
        else:
            self._box.trust.flawed()
            self._agreed(told)

    def look_blind(self) -> None:
        """See whether the line shows a flaw, or the box another time, and no encoder tells what came of it."""
        if self.unsynchronised or self.on_trial:
            return
        if self._ticks.stepped:
            self._lose(STEPPED)
        elif self.flawed and self._box.trust.complete:
            self._sound = self._box.trust.flaws
        elif self.flawed:
            self._lose(BAD_LINE)

    def _guard(self, told: Told) -> None:
        """End what runs for longer than a hand controller lets it, though nobody knows where the axes are."""
        before, self._unplaced = self._unplaced, told
        if before is None or told.middle - before.middle > _BY_HAND_S:
            self._running_since = [math.inf, math.inf]
            return
        running = []
        for axis in self._axes:
            encoder, i = axis.encoder, axis.index
            if encoder is None:
                return
            passed = told.middle - before.middle
            made = (told.pair[i] - before.pair[i]) * encoder.steps_per_count - axis.own_rate * passed
            runs = abs(made) > max(RUNS_COUNTS, RUNS_COUNTS * passed / AGAIN_S) * encoder.step
            self._running_since[i] = min(self._running_since[i], before.middle) if runs else math.inf
            if told.middle - self._running_since[i] > _BY_HAND_S:
                running.append(Runaway(axis, encoder, made > 0.0))
        if running:
            self._end(running)

    def in_doubt(self) -> bool:
        """Whether half a command may stand in the box, so that it must not be sent one byte until a `sync`."""
        if self._box.in_doubt and self.unsynchronised != HALF_A_COMMAND:
            self._lose(HALF_A_COMMAND)
        return self._box.in_doubt

    def suspect(self) -> None:
        """The box was silent after a move: see whether it runs."""
        if self._axes[0].encoder is None:
            self._lose(MAY_RUN)
            self._abandon()
            return
        self.look()

    def resumed(self) -> None:
        """Trials are over: the encoders say where they led."""
        if not self.on_trial:
            return
        self.on_trial = False
        told = self._box.ask(commands.ASK_ENCODERS)
        for axis, said in zip(self._axes, told.pair, strict=True):
            if axis.encoder is not None and axis.encoder.zero is not None:
                axis.halted(axis.encoder.steps(said), told.middle, BOUND_COUNTS * axis.encoder.step)

    def synchronised(self) -> None:
        """A person says where the axes are."""
        self._box.switched_on()
        self.unsynchronised, self.alarms, self._sound = "", (), self._box.trust.flaws
        self._box.trust.told()
        self._ticks.forget()
        self._runaways = []
        self._halved = self._doubled = 0
        encoders = [axis.encoder for axis in self._axes if axis.encoder is not None]
        for encoder in encoders:
            encoder.zero = None
        if encoders:
            self._tie(self._box.ask(commands.ASK_ENCODERS))

    def _tie(self, told: Told) -> None:
        for axis, said in zip(self._axes, told.pair, strict=True):
            if axis.encoder is not None and axis.encoder.zero is None:
                axis.encoder.tie(said, axis.at(told.middle).counts)

    def _beyond(self, axis: BoxAxis, told: Told) -> float:
        """By how many microsteps an axis is beyond where it is reckoned to be."""
        encoder = axis.encoder
        if encoder is None or encoder.zero is None:
            return 0.0
        state = axis.at(told.middle)
        timing = (told.latest - told.earliest) / 2.0 + _TIMING_S
        return encoder.off(told.pair[axis.index], state.counts, state.uncertainty + abs(state.rate) * timing)

    def _agreed(self, told: Told) -> None:
        self._bound(told)
        self._looked, self._counted = told.middle, told.pair
        for axis in self._axes:
            if axis.encoder is not None and told.earliest > axis.reckoning.ends:
                self._rests(axis, axis.encoder)
                axis.encoder.proved = axis.at(told.middle).counts
                self._against[axis.index] = 0

    def _bound(self, told: Told) -> None:
        """An encoder bounds what the reckoning may be off, where that is much, or commands may have been lost."""
        held = [axis for axis in self._axes if self._must_be_bound(axis, told)]
        if any(self._off_counts(axis, told) > 1.0 for axis in held):
            told = self._surely_told()
        for axis in held:
            state, encoder = axis.at(told.middle), axis.encoder
            if encoder is None or state.moving:
                continue
            here = encoder.steps(told.pair[axis.index])
            most = BOUND_COUNTS * encoder.step
            axis.known(min(max(state.counts, here - encoder.step), here + encoder.step), told.middle, most)
            encoder.bound_at = told.middle

    def _must_be_bound(self, axis: BoxAxis, told: Told) -> bool:
        encoder, state = axis.encoder, axis.at(told.middle)
        if encoder is None or encoder.zero is None or state.moving:
            return False
        crept = self._off_counts(axis, told) > TRUST_COUNTS  # no farther than it was uncertain
        return self.flawed or crept or state.uncertainty > BOUND_COUNTS * encoder.step

    def _off_counts(self, axis: BoxAxis, told: Told) -> float:
        """By how many counts an axis with an encoder is from what that says."""
        encoder = axis.encoder
        if encoder is None or encoder.zero is None:
            return 0.0
        return abs(axis.at(told.middle).counts - encoder.steps(told.pair[axis.index])) / encoder.step

    def _act(self, told: Told) -> None:
        """Two answers said so: a box that was switched on, a sense that is wrong, a runaway, a hand."""
        if self._began_anew(told):
            self._lose(SWITCHED)
            return
        astray = self._astray(told)
        if any(each.opposite for each in astray):  # an answer that came late says so once, a wrong wire again
            astray = self._astray(astray[0].told)
        unproved = self._any_unproved()
        most = _UNPROVED_COUNTS if unproved else RUNS_COUNTS
        running = [each for each in astray if each.past or (abs(each.runs) > most and not each.short)]
        if running and (unproved or self._runs_for(told.middle) > _BY_HAND_S):
            self._end([Runaway(each.axis, each.encoder, each.runs > 0.0) for each in running])
            for each in running:
                if each.opposite:
                    self._lose(AGAINST.format(each.axis.index + 1))
            self._count_past(running)
            return
        self.moved_by = ("hand controller",) if astray and not unproved else ()
        self._repair(astray)

    def _runs_for(self, time: float) -> float:
        """Seconds since an axis that runs now was first seen to."""
        if time - self._runs_seen > _BY_HAND_S:
            self._runs_since = time
        self._runs_seen = time
        return time - self._runs_since

    def _any_unproved(self) -> bool:
        return any(axis.unproved for axis in self._axes)

    def _surely_told(self, told: Told | None = None) -> Told:
        """Ask until two answers in a row, after one, can both be right: digits can be garbled and still be some."""
        told = told or self._box.ask(commands.ASK_ENCODERS)
        for _ in range(_TRIES + 1):
            before, told = told, self._box.ask(commands.ASK_ENCODERS)
            ways = [abs(one - other) for one, other in zip(told.pair, before.pair, strict=True)]
            fastest = [axis.law.fastest / axis.encoder.step for axis in self._axes if axis.encoder is not None]
            passed = told.latest - before.earliest
            if all(way <= most * passed + 1.0 for way, most in zip(ways, fastest, strict=True)):
                break
            self._box.trust.flawed()
        return told

    def _astray(self, told: Told) -> list[_Astray]:
        """Look again after a moment at each axis that is astray, whether it runs."""
        self._box.pause(told.latest + AGAIN_S)
        again = self._surely_told()
        found = []
        for axis in self._axes:
            encoder = axis.encoder
            if encoder is None or not self._beyond(axis, again):
                continue
            here = axis.at(again.middle)
            asked = here.counts - axis.at(told.middle).counts
            made = encoder.steps(again.pair[axis.index]) - encoder.steps(told.pair[axis.index])
            runs = (made - asked) / encoder.step
            opposite = abs(runs) > RUNS_COUNTS and encoder.against(asked, made)
            past = here.moving and axis.unproved and asked * self._beyond(axis, again) > 0.0 and asked * runs > 0.0
            back = -math.copysign(made, made * asked)  # microsteps that it went the other way
            short = asked * runs < 0.0 and back < encoder.step
            found.append(_Astray(axis, encoder, again, runs, opposite, past, short))
        return found

    def _repair(self, astray: Sequence[_Astray]) -> None:
        """The encoder is right, to a count; one that again and again says the opposite is not."""
        for axis, encoder, told, runs, *_ in astray:
            said, state = encoder.steps(told.pair[axis.index]), axis.at(told.middle)
            since = state.counts if encoder.proved is None else encoder.proved
            against = encoder.against(state.counts - since, said - since)
            self._against[axis.index] = self._against[axis.index] + 1 if against else 0
            if self._against[axis.index] >= _OFTEN:
                self._lose(AGAINST.format(axis.index + 1))
                return
            self._note(
                f"axis {axis.index + 1} is {abs(said - state.counts) / encoder.step:.1f} encoder counts from where "
                "its steps lead: it missed steps, or was moved by hand; the encoder says where it is, ± 1 count"
            )
            unsure = encoder.step * (BOUND_COUNTS + abs(runs)) + abs(state.rate) * _TIMING_S
            self._counted, self._looked = told.pair, told.middle
            axis.corrected += said - state.counts
            axis.known(said, told.middle, unsure)
            encoder.proved = said
            if told.earliest > axis.reckoning.ends:
                self._rests(axis, encoder)

    def _rests(self, axis: BoxAxis, encoder: Encoder) -> None:
        """It stands where it is reckoned to be: whether moves go half as far as they should, again and again."""
        if abs(axis.asked) > _CLEAR_COUNTS * encoder.step:
            halved = abs(axis.asked / 2.0 + axis.corrected) < ROUNDED_COUNTS * encoder.step + 0.05 * abs(axis.asked)
            self._halved = self._halved + 1 if halved else 0
            self._doubled = 0
        axis.agreed()
        if self._halved >= _OFTEN and self._line_is_sound:
            self._lose(COUNTS.format("half", "total"))

    @property
    def _line_is_sound(self) -> bool:
        """Whether moves that go wrong are no matter of the line."""
        return self._box.trust.flaws - self._sound < _DAMAGES

    def _count_past(self, running: Sequence[_Astray]) -> None:
        """Whether moves go farther than they should, again and again."""
        self._doubled += sum(each.past for each in running)
        if self._doubled >= _OFTEN and self._line_is_sound:
            self._lose(COUNTS.format("twice", "half"))

    def _end(self, running: Sequence[Runaway]) -> None:
        """End moves that nobody asked for; raise the alarm for what runs on."""
        self._abandon()
        for each in running:
            self._note(RAN.format(each.axis.index + 1))
        self._runaways = end(self._box, running)
        self.alarms = tuple(f"axis {each.axis.index + 1} runs away" for each in self._runaways)
        for each in self._runaways:
            self._lose(RUNS_ON.format(each.axis.index + 1))

    def _abandon(self) -> None:
        for axis in self._axes:
            axis.abandon()

    def _began_anew(self, told: Told) -> bool:
        """Whether both count from nothing, and did not before, or the PEC bin does as well."""
        if not self._counts_from_nothing(told):
            return False
        return max(map(abs, self._counted)) > _AWAY_COUNTS or self._bin_began_anew(self._away(told))

    def _away(self, told: Told) -> float:
        """Seconds since the encoders were last believed."""
        return max(0.0, told.middle - self._looked)

    def _counts_from_nothing(self, told: Told) -> bool:
        """Whether both encoders say what they would, had the box been switched on since they were last believed."""
        one = self._axes[0]
        return one.encoder is not None and zeroed(told.pair, abs(one.own_rate) * self._away(told) / one.encoder.step)

    def _bin_began_anew(self, away: float) -> bool:
        """Whether the PEC bin counts from nothing since some moment of the last seconds."""
        pec = self._box.ask(commands.ASK_PEC)
        fresh = pec.pair.one <= max(away, _LATELY_S) / self._ticks.tick_s + _FIRST_BINS
        moved = pec.middle - self._ticks.moved_at < _LATELY_S
        return fresh and (moved or self._ticks.is_elsewhere(pec.pair.one, pec.middle))

    def _lose(self, why: str) -> None:
        self._abandon()
        self.unsynchronised = why
        self._note(why)

    def _note(self, text: str) -> None:
        if not self._events or self._events[-1] != text:
            self._events.append(text)
