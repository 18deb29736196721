"""Whether a box was switched off and on: its encoders, and its PEC bin, then count from nothing."""

from collections.abc import Sequence

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.encoders import zeroed
from mounts.avr_box.tick_clock import TickClock

_FIRST_BINS = 3
_LATELY_S = 20.0  # within which the bin may have been told already, and taken for one that an index pulse moved
_AWAY_COUNTS = 5.0  # from nothing, to tell an encoder that began anew
_JUMP_COUNTS = 2  # from one look to the next, that are no rounding


class PowerSwitch:
    """Of one box.

    Parameters
    ----------
    box : Box
        Is asked for its PEC bin.
    axes : sequence of BoxAxis
        Their encoders count from nothing.
    ticks : TickClock
        Knows where the bin should be.
    since : float
        When it was known where the axes are, POSIX seconds.
    """

    def __init__(self, box: Box, axes: Sequence[BoxAxis], ticks: TickClock, since: float) -> None:
        self._box, self._axes, self._ticks = box, axes, ticks
        one, two = (0 if axis.encoder is None else axis.encoder.counts(axis.at(since).counts) for axis in axes)
        self._counted = one, two
        self.looked = since
        """When the encoders were last believed, POSIX seconds."""

    def believed(self, told: Told) -> None:
        """The encoders are right."""
        self._counted, self.looked = told.pair, told.middle

    def used(self, told: Told) -> bool:
        """Whether both count from nothing, and did not before, or the PEC bin does as well."""
        if not self.counts_from_nothing(told):
            return False
        return max(map(abs, self._counted)) > _AWAY_COUNTS or self._bin_began_anew(self._away(told))

    def used_nearby(self, told: Told) -> bool:
        """Whether it was used where that has the axes no farther off than they may be: the bin began anew as well."""
        jumped = any(
            abs(said - before) >= _JUMP_COUNTS for said, before in zip(told.pair, self._counted, strict=True)
        )
        return jumped and self.counts_from_nothing(told) and self._bin_began_anew(self._away(told))

    def counts_from_nothing(self, told: Told) -> bool:
        """Whether both encoders say what they would, had the box been switched on since they were last believed."""
        one = self._axes[0]
        return one.encoder is not None and zeroed(told.pair, abs(one.own_rate) * self._away(told) / one.encoder.step)

    def _away(self, told: Told) -> float:
        """Seconds since the encoders were last believed."""
        return max(0.0, told.middle - self.looked)

    def _bin_began_anew(self, away: float) -> bool:
        """Whether the PEC bin counts from nothing since some moment of the last seconds."""
        pec = self._box.ask(commands.ASK_PEC)
        fresh = pec.pair.one <= max(away, _LATELY_S) / self._ticks.tick_s + _FIRST_BINS
        moved = pec.middle - self._ticks.moved_at < _LATELY_S
        return fresh and (moved or self._ticks.is_elsewhere(pec.pair.one, pec.middle))
