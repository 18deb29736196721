"""Asking the box for its PEC bin, which tells when its clock ticks, and how fast its crystal is."""

import math
from collections.abc import Sequence

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.tick_clock import NEAR_TICKS, TickClock

_PHASE_S = 0.02  # to which the moment of a tick is worth knowing
_STALE = 3.0  # times that, before it is found out anew
_LOOK_S = 1.2  # in which a tick must have been seen
_PULSE_S = 60.0  # after what looked like an index pulse, in which a tick that comes otherwise says that it was none


class TickWatch:
    """Keeps the tick clock of one box right.

    Parameters
    ----------
    box : Box
        Is asked.
    ticks : TickClock
        Takes in what it answers.
    axes : sequence of BoxAxis
        Go by the crystal.
    """

    def __init__(self, box: Box, ticks: TickClock, axes: Sequence[BoxAxis]) -> None:
        self._box, self._ticks, self._axes = box, ticks, axes
        self.asked = -math.inf
        """When the bin was told last, POSIX seconds."""

    def ask(self, tries: int | None = None) -> Told:
        """Ask for bin and zero, and take in what they tell of the clock.

        Raises
        ------
        DriveRefused, TransportError, WrongProtocol
            As `Box.ask`.
        """
        if self._axes[0].reckoning.ends > self.asked:
            self._ticks.worm_turned()
        told = self._box.ask(commands.ASK_PEC) if tries is None else self._box.ask(commands.ASK_PEC, tries)
        if self._unexplained(told) > NEAR_TICKS:
            told = self._box.ask(commands.ASK_PEC)  # digits can be garbled and still be some
            if self._unexplained(told) > NEAR_TICKS:
                self._ticks.stepped = True
            else:
                self._box.trust.flawed()
        before, slipped = self._ticks.crystal, self._ticks.slipped_s - self._unexplained(told) * self._ticks.tick_s
        self._ticks.heard(told.pair.one, told.earliest, told.latest, told.pair.two)
        if (late := self._ticks.slipped_s - slipped) > 0.0:  # it tracked for longer or shorter than was reckoned
            self._axes[0].widened(late * abs(self._axes[0].own_rate), told.latest)
        if late > 0.0 and told.latest - self._ticks.moved_at < _PULSE_S:
            self._ticks.stepped = True
        self.asked = told.latest
        if self._ticks.crystal != before:
            for axis in self._axes:
                axis.crystal_measured(told.latest)
        return told

    def _unexplained(self, told: Told) -> float:
        return self._ticks.unexplained(told.pair.one, told.pair.two, told.earliest, told.latest)

    def see_a_tick(self) -> None:
        """Ask until the bin changes, which is the tick."""
        due = self.ask().latest + _LOOK_S
        while self._ticks.uncertainty_s > _PHASE_S and self._box.now() < due:
            self.ask()

    def freshen(self) -> None:
        """See a tick where its moment is not known well enough to time a command by it."""
        if self._ticks.uncertainty_s > _STALE * _PHASE_S:
            self.see_a_tick()
