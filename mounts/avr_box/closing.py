"""Letters that end what a move may have become, where no encoder sees it.

`M` with one byte lost, doubled or a bit otherwise is a move of any length, of either axis (`commands.misread` has all
of them), and no count is such that it could not be: a flipped bit of its last byte is 2^31 microsteps. So each move
is ended by `W` or `N`, four times a millisecond apart, whether it ran away or not: a new move begins anew (A). A bit
makes `W` only `S`, and `N` only `n`, neither of which takes arguments, so that nothing begins another move of any
length after them. Before them go bytes that are no command, which complete whatever waits for its rest.

In a slew they are a part of the way. Elsewhere the axis is led back after them, by one `E` or `S`.
"""

import math
from collections import deque
from collections.abc import Sequence

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box
from mounts.avr_box.settings import AvrSettings
from mounts.avr_box.slew_model import seconds_of

TIMES = 4
"""A letter is sent, should some be lost."""
_SPARE_S = 2.0  # before what ran away would be beyond its bound, for what is asked meanwhile
_GAP_S = 0.2  # before and after a move of 5′
_SOONER_S = 1.0  # for axis 1 to make up for what it did not track while it was moved
_MOVES_THAT_END = 2  # of an axis, one after the other, of which one is heard


class Closing:
    """Ends the moves of one box.

    Parameters
    ----------
    box : Box
        Gets the letters.
    settings : AvrSettings
        Says whether they are needed, and the bound of a move.
    axes : sequence of BoxAxis
        Are ended.
    """

    def __init__(self, box: Box, settings: AvrSettings, axes: Sequence[BoxAxis]) -> None:
        self._box, self._settings = box, settings
        self._axes = axes if settings.blind else ()
        self._most = [2 * half for half in settings.longest_half]
        self._within = [seconds_of(axis.law.climb_cycles(most)) for axis, most in zip(axes, self._most, strict=True)]
        self._open = [deque[float](maxlen=_MOVES_THAT_END) for _ in axes]  # POSIX seconds, of moves that may run on
        self._soon = False
        self._owed = [False for _ in axes]
        self._ahead = [0.0 for _ in axes]  # microsteps of its way, by letters, since they last were a part of it
        for axis in self._axes:
            self._open[axis.index] += axis.begun(box.now())

    @property
    def pending(self) -> bool:
        """Whether an axis is yet to be ended, or led back."""
        return any(self._owed) or (self._soon and any(self._open))

    @property
    def lag(self) -> float:
        """Microsteps of its way that axis 1 does not track while it is ended and led back after a move."""
        if not self._axes:
            return 0.0
        one = self._axes[0]
        return 2.0 * abs(one.own_rate) * one.duration(commands.FIVE_ARCMIN[0])

    def sent(self, command: bytes, begin: float, *, soon: bool) -> None:
        """`M` was sent; it is ended as soon as it is over, or when that must be, where others will follow it.

        Raises
        ------
        LinkError
            The link was lost.
        """
        if not self._axes:
            return
        self._box.fill(command)
        self._soon = soon
        per_count = 2 // self._settings.wire_per_half
        for bit, count in set(commands.misread(command)):
            index = int(bit == self._settings.axis_bit)
            if count * per_count > self._most[index] and begin not in self._open[index]:
                self._open[index].append(begin)

    def begin_way(self) -> None:
        """A slew begins: it goes from where the axes are, and none is led back."""
        self._owed, self._ahead = [False for _ in self._owed], [0.0 for _ in self._ahead]

    def due(self) -> None:
        """End what must be ended, and lead back what was.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        for axis in self._axes:
            now = self._box.now()
            if self._owed[axis.index] and now >= axis.free_at:
                self._lead_back(axis)
            elif now >= self._due_at(axis):
                ahead = self._ahead[axis.index] + _made(axis)
                self.close(axis, _sense(axis))
                self._owed[axis.index], self._ahead[axis.index] = True, ahead

    def _due_at(self, axis: BoxAxis) -> float:
        """POSIX seconds; there must be time to go to and fro before the next piece of a slew."""
        opened, there = self._open[axis.index], axis.duration(commands.FIVE_ARCMIN[axis.index]) + 2.0 * _GAP_S
        again = axis.waiting[0].begin - _SOONER_S - 2.0 * there if axis.waiting else math.inf
        if not opened or self._box.now() > again:
            return math.inf
        within = 0.0 if self._soon else self._within[axis.index] - _SPARE_S
        return max(axis.free_at, opened[0] + within)

    def _lead_back(self, axis: BoxAxis) -> None:
        """Lead it back, unless it tracked so little while it was moved that it is no more ahead of its way."""
        axis.led_back, self._owed[axis.index] = True, False
        if self._ahead[axis.index] > commands.FIVE_ARCMIN[axis.index]:
            self._ahead[axis.index] += _made(axis) - 4 * commands.FIVE_ARCMIN[axis.index]
            self.once(axis)

    def once(self, axis: BoxAxis) -> None:
        """Move an axis 5′ by one `E` or `S`, and what makes it harmless where it is taken for `M`.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        letter = commands.LETTERS[axis.index][0]
        begin = self._box.send(letter)
        axis.moved(commands.FIVE_ARCMIN[axis.index], -_sense(axis), begin)
        self._box.fill(letter)

    def close(self, axis: BoxAxis, sign: int) -> None:
        """End whatever an axis makes by 5′, with its counts or against them.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        letter = commands.LETTERS[axis.index][sign == _sense(axis)]
        self._box.fill(letter)
        first, last = self._box.repeat(letter, TIMES)
        axis.moved(commands.FIVE_ARCMIN[axis.index], sign, first, again_s=last - first)
        self._open[axis.index].clear()
        self._owed[axis.index], self._ahead[axis.index] = False, 0.0

    def end_all(self) -> None:
        """End whatever both axes make, now, where no encoder tells what that is.

        Raises
        ------
        DriveRefused, LinkError
            As `Box.send`.
        """
        for axis in self._axes:
            self.close(axis, _sense(axis))


def _sense(axis: BoxAxis) -> int:
    """In which sense `W` or `N` changes its counts."""
    return -axis.sign if axis.north_falls else axis.sign


def _made(axis: BoxAxis) -> float:
    """Microsteps that `W` or `N` has it ahead of where it would have tracked meanwhile."""
    half = commands.FIVE_ARCMIN[axis.index]
    return 2.0 * half - abs(axis.own_rate) * axis.duration(half)
