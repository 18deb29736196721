"""Moves that find out what a move is, with nobody watching but who asked for them.

They are remembered as what they are configured to be. Which axis one moves is what is asked, so that neither may be
under way when it is sent.
"""

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.moves import Moves
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.supervision import Supervision
from mounts.avr_box.tracking import Tracker
from mounts.errors import DriveRefused


class Trials:
    """Of one box.

    Parameters
    ----------
    box : Box
        Is asked and told.
    settings : AvrSettings
        What is taken for the meaning of a move.
    axes : tuple of BoxAxis
        Make them.
    moves, tracker : Moves, Tracker
        Send them, and guiding.
    supervision : Supervision
        Leaves the axes alone meanwhile.
    """

    def __init__(
        self,
        box: Box,
        settings: AvrSettings,
        axes: tuple[BoxAxis, BoxAxis],
        moves: Moves,
        tracker: Tracker,
        supervision: Supervision,
    ) -> None:
        self._box, self._settings, self._axes = box, settings, axes
        self._moves, self._tracker, self._supervision = moves, tracker, supervision

    def begin(self) -> None:
        """Leave both axes to themselves, PEC off."""
        self._supervision.on_trial = True
        self._box.send(commands.guiding_flags(pec=False))

    def encoders(self) -> Told:
        """What both encoders say."""
        return self._box.ask(commands.ASK_ENCODERS)

    def guide(self, ticks: int) -> float:
        """Send `+`, and return for how many seconds it makes axis 1 faster."""
        return self._tracker.guide_for(ticks)

    def move(self, index: int, half: int, *, falling: bool) -> int:
        """Send a move of twice `half` microsteps; return what it counts.

        Raises
        ------
        DriveRefused
            An axis may still move.
        """
        self._require_free()
        wire = half * self._settings.wire_per_half
        command = commands.move(index, wire, decreasing=falling, axis_bit=self._settings.axis_bit)
        self._moves.send_trial(self._axes[index], command, -half if falling else half)
        return wire

    def north(self) -> float:
        """Send `N`, likewise; return how many seconds it takes."""
        self._require_free()
        axis, half = self._axes[1], commands.FIVE_ARCMIN[1]
        self._moves.send_trial(axis, b"N", half * axis.sign * (-1 if axis.north_falls else 1))
        return axis.duration(half)

    def _require_free(self) -> None:
        self._supervision.on_trial = True
        left = max(axis.free_at for axis in self._axes) - self._box.now()
        if left > 0.0:
            raise DriveRefused(f"an axis may move for another {left:.1f} s, and no command ends that: wait for it")

    def end(self) -> None:
        """From here on the axes are where their encoders say."""
        if self._supervision.on_trial:
            self._box.send(commands.guiding_flags(pec=self._settings.pec))
        self._supervision.resumed()
