"""One axis of the box as its driver knows it: reckoned, with the moves that were sent and those that wait.

A slew takes the timer from tracking, and the microstep of tracking that it interrupts is never made; after it
tracking begins a whole step. So axis 1 is at a whole step when a move begins, counted from where the last one ended.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mounts.avr_box.encoders import Encoder
from mounts.avr_box.memory import KeptAxis, KeptMove
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.slew_model import AvrSlewModel, Piece, cycles_in, seconds_of
from mounts.avr_box.slew_table import SlewLaw
from mounts.avr_box.tick_clock import TickClock
from mounts.avr_box.timers import CRYSTAL_HZ, fine_cycles
from mounts.reckoning import Motion, Reckoned, Reckoning

if TYPE_CHECKING:
    from mounts.avr_box.landing import Aim

AFTER_S = 0.1  # between the computed end of a move and the next command to the axis
FINE_STEP_S = fine_cycles() / CRYSTAL_HZ
"""Of a microstep of `<` and `>`."""
_ROUNDING = 1e-6
_INTERRUPTED = 0.5  # microsteps by which a move may begin elsewhere than reckoned


@dataclass(frozen=True)
class Waiting:
    """A piece that has not been sent, and the POSIX time at which it is to begin."""

    piece: Piece
    begin: float


class BoxAxis:
    """One axis.

    Parameters
    ----------
    index : int
        0 or 1.
    settings : AvrSettings
        What the configuration says.
    law : SlewLaw
        How it slews.
    ticks : TickClock
        Knows the crystal.
    kept : KeptAxis
        What was remembered of it.
    time : float
        When that was so, POSIX seconds.
    """

    def __init__(
        self, index: int, settings: AvrSettings, law: SlewLaw, ticks: TickClock, kept: KeptAxis, time: float
    ) -> None:
        self.index = index
        self.sign = settings.signs[index]
        self.north_falls = index == 1 and settings.north_reversed
        """Whether the commands to the north turn it to smaller angles."""
        self.law = law
        self._settings = settings
        self._ticks = ticks
        self.encoder: Encoder | None = None
        if settings.encoder_counts_per_turn:
            step = self.sign * settings.steps_per_turn[index] / settings.encoder_counts_per_turn
            self.encoder = Encoder(step, kept.encoder_zero, kept.counts)
        self.reckoning = Reckoning(kept.counts, time, kept.uncertainty, self.own_rate, self._rate_uncertainty)
        self._whole = kept.counts  # a place at which it was on a whole step
        self._moves: list[KeptMove] = []
        self.waiting: list[Waiting] = []
        self.aim: Aim | None = None
        """Where the slew under way is to end, and when."""
        self.slew_ends = -math.inf
        """When the slew under way ends, or ended."""
        self.guided_until = -math.inf
        """When the rate is its own again, or the last microstep of `<` or `>` is made."""
        self.led_back = False
        """Whether letters moved it to and fro since its last piece was planned."""
        self.unproved = False
        """Whether a move was sent since the encoder last agreed."""
        self.asked = 0
        """Microsteps, signed, of the moves since its encoder last agreed at rest."""
        self._jumped = 0.0
        self.unproved_steps = kept.unproved_steps
        """Microsteps of all moves since a `sync` that nothing has shown to go as far, and that way."""
        self.trimmed = 0.0
        """Microsteps that guiding and single steps may have made otherwise, but for what the encoder took back."""
        self.corrected = 0.0
        """Microsteps by which its encoder had it farther on since then."""
        for move in kept.moves:
            self.moved(move.half, move.sign, move.begin, slew=True)
        self.unproved_steps = kept.unproved_steps

    @property
    def own_rate(self) -> float:
        """Counts per second that it makes when nothing is asked of it."""
        return self.sign * self._settings.own_rate * self._ticks.crystal if self.index == 0 else 0.0

    @property
    def steps_per_turn(self) -> float:
        """Microsteps of its motor for a turn of it."""
        return self._settings.steps_per_turn[self.index]

    @property
    def grain(self) -> float:
        """Microsteps by which an axis that tracks is off a way without steps."""
        return 1.0 if self.index == 0 else 0.0

    @property
    def _rate_uncertainty(self) -> float:
        return self._ticks.crystal_uncertainty + self._settings.rate_uncertainty

    @property
    def model(self) -> AvrSlewModel:
        """How it slews."""
        return self._settings.slew_model(self.index, self.law, self._ticks.crystal)

    @property
    def free_at(self) -> float:
        """POSIX seconds from which on a move may be sent to it."""
        return self.reckoning.ends + AFTER_S

    def slewing(self, time: float) -> bool:
        """Whether the slew that was asked of it is not over."""
        return bool(self.waiting) or time < self.slew_ends

    def at(self, time: float) -> Reckoned:
        """Where it is reckoned to be."""
        return self.reckoning.at(time)

    def led(self, time: float) -> float:
        """Where it would be by what it was told alone, whatever was found since: counts from anywhere."""
        return self.at(time).counts - self._jumped

    def rate_until_free(self, time: float) -> float:
        """Counts per second, of a short move the mean until the axis takes another: it cannot be led off it."""
        state = self.at(time)
        left = self.free_at - time
        return (self.at(self.free_at).counts - state.counts) / left if left > 0.0 else state.rate

    def starts_from(self, time: float) -> float:
        """Where a move that begins then begins, counts."""
        if self.index != 0:
            return self.at(time).counts
        return self._whole + self.sign * math.floor(self._tracked(time))

    def part_made(self, time: float) -> float:
        """What part of a microstep of tracking is under way then."""
        return self._tracked(time) % 1.0

    def tracks(self, begin: float, end: float) -> float:
        """Counts that tracking makes from one time to another, guided where it is; below 0 where `end` is before.

        `+` and `-` that are under way when a slew begins go on for up to two minutes, and change the rate after it.
        """
        return self.reckoning.way(begin, end)

    def _tracked(self, time: float) -> float:
        return self.sign * (self.at(time).counts - self._whole) + _ROUNDING

    def duration(self, half: int) -> float:
        """Seconds of a move of twice `half` microsteps."""
        return seconds_of(self.law.cycles(half), self._ticks.crystal)

    def moved(self, half: int, sign: int, begin: float, *, slew: bool = False, again_s: float = 0.0) -> None:
        """A move has begun; it began anew for so many seconds, in which it came nowhere."""
        self._settle(begin)
        start, crystal = self.starts_from(begin), self._ticks.crystal
        now = self.at(begin)
        self.reckoning.known(start, begin, now.uncertainty)
        course = self._course(half, sign, crystal, again_s)
        motion = Motion(
            begin, again_s + self.duration(half), course, uncertainty=_INTERRUPTED if self.index == 0 else 0.0
        )
        self.reckoning.moves(motion)
        self._whole = start + 2 * half * sign
        self._moves.append(KeptMove(half, sign, begin))
        self.unproved = True
        self.asked += 2 * half * sign
        self.unproved_steps += 2.0 * half
        if slew:
            self.slew_ends = max(self.slew_ends, motion.end)

    def _course(self, half: int, sign: int, crystal: float, again_s: float) -> Callable[[float], float]:
        return lambda seconds: sign * self.law.made(half, cycles_in(seconds - again_s, crystal))

    def guided(self, rate: float, begin: float, duration: float) -> None:
        """The rate of axis 1 is another for a time: by how much is the manual's, and may be wrong by all of it.

        Its timer has what it counted of the microstep under way, so that all of that has the other rate.
        """
        self._trims(abs(rate - self.own_rate) * max(0.0, duration), begin)
        self.reckoning.goes_on(rate, begin - self.part_made(begin) / abs(self.own_rate))
        self.reckoning.goes_on(self.own_rate, begin + duration)
        self.guided_until = begin + duration

    def stepped(self, steps: int, begin: float) -> None:
        """Axis 2 makes single microsteps, signed: which way they go is the manual's, and may be the other one."""
        self._trims(2.0 * abs(steps), begin)
        sign, duration = (1 if steps > 0 else -1), abs(steps) * FINE_STEP_S
        self.reckoning.moves(
            Motion(begin, duration, lambda seconds: sign * math.floor(seconds / FINE_STEP_S), suspends=False)
        )
        self.guided_until = begin + duration

    def known(self, counts: float, time: float, uncertainty: float) -> None:
        """It is known where it is; what is under way goes on from there."""
        self._jumped += counts - self.at(time).counts
        self.reckoning.known(counts, time, uncertainty)
        self._whole = counts

    def widened(self, counts: float, time: float) -> None:
        """It may be off by so much more."""
        state = self.at(time)
        self.reckoning.known(state.counts, time, state.uncertainty + counts)

    def _trims(self, counts: float, time: float) -> None:
        self.widened(counts, time)
        self.trimmed += counts

    def agreed(self) -> None:
        """Its encoder says, at rest, what is reckoned."""
        self.unproved, self.asked, self.corrected = False, 0, 0.0

    def halted(self, counts: float, time: float, uncertainty: float) -> None:
        """Whatever was under way is over, and it is known where it stands."""
        self.abandon()
        self._moves.clear()
        self.slew_ends = self.guided_until = -math.inf
        self._jumped += counts - self.at(time).counts
        self.reckoning.halted(counts, time, uncertainty)
        if self.index == 0:
            self.reckoning.goes_on(self.own_rate, time)
        self._whole = counts

    def crystal_measured(self, time: float) -> None:
        """The crystal is known better: from now on it goes on by that, unless it is guided just now."""
        if time >= self.guided_until and self.index == 0:
            self.reckoning.goes_on(self.own_rate, time)
        self.reckoning.rate_uncertainty = self._rate_uncertainty

    def abandon(self) -> None:
        """Send no further piece."""
        self.waiting.clear()
        self.slew_ends = min(self.slew_ends, self.reckoning.ends)  # of a slew: a short move of holding is none
        self.aim = None

    def begun(self, time: float) -> list[float]:
        """When the moves began that are not over, POSIX seconds."""
        self._settle(time)
        return [move.begin for move in self._moves]

    def kept(self, time: float) -> KeptAxis:
        """What must be remembered of it: where it was at a time, and the moves since.

        Single microsteps are none: they end by themselves, and axis 2 stands but for them.
        """
        stepped = self.index == 1 and not self._moves
        state = self.at(max(time, self.guided_until) if stepped else time)
        zero = None if self.encoder is None else self.encoder.zero
        return KeptAxis(state.counts, state.uncertainty, tuple(self._moves), zero, self.unproved_steps)

    def _settle(self, time: float) -> None:
        """Forget moves that are over."""
        if self._moves and time >= self.reckoning.ends:
            self._moves.clear()
