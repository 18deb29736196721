"""All axes that run where nobody sent them: which they are, and that no move of 5′ ended them.

What a hand controller moves is left alone for a while; what runs on is ended, known or not where it is.
"""

import math
from collections.abc import Sequence

from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box, Told
from mounts.avr_box.reasons import RUNS_ON, RUNS_UNENDED
from mounts.avr_box.runaway import AGAIN_S, RUNS_COUNTS, Runaway, break_off, end, running_on
from mounts.avr_box.standing import Standing

BY_HAND_S = 3.0
"""Longer than a move of 5′ by the hand controller takes."""
_WHY = (
    ": a mutilated command, or, if it is so at every move, `move_count`, `axis_bit`, `reversed` or `slew_table` are "
    "otherwise"
)
RAN = "axis {} ran where it was not sent and was given a move of 5′ to end that" + _WHY
RAN_UNENDED = "axis {} ran where it was not sent" + _WHY


class Runaways:
    """Of one box.

    Parameters
    ----------
    box : Box
        Is told to end them.
    axes : sequence of BoxAxis
        May run.
    standing : Standing
        Is told of them.
    endable : bool
        Whether a move ends the one under way (A).
    """

    def __init__(self, box: Box, axes: Sequence[BoxAxis], standing: Standing, *, endable: bool) -> None:
        self._box, self._axes, self._standing, self._endable = box, axes, standing, endable
        self._left: list[Runaway] = []  # which no move of 5′ ended
        self._since = self._seen = -math.inf  # POSIX seconds, when one that nobody asked was seen to run
        self._before: Told | None = None  # what the encoders said last while nobody knew where the axes are
        self._unplaced_since = [math.inf, math.inf]  # POSIX seconds, likewise

    def forget(self) -> None:
        """A person says where the axes are."""
        self._left = []

    def end_again(self) -> None:
        """End what ran on."""
        if self._left:
            self.end(self._left)

    def end(self, running: Sequence[Runaway]) -> None:
        """End moves that nobody asked for; raise the alarm for what runs on."""
        self._standing.abandon()
        for each in running:
            self._standing.note((RAN if self._endable else RAN_UNENDED).format(each.axis.index + 1))
        self._left = end(self._box, running) if self._endable else running_on(self._box, running)
        self._standing.runaways = tuple(f"axis {each.axis.index + 1} runs away" for each in self._left)
        for each in self._left:
            self._standing.lose((RUNS_ON if self._endable else RUNS_UNENDED).format(each.axis.index + 1))

    def break_off(self, axis: BoxAxis) -> None:
        """End the move under way of an axis that its encoder does not see."""
        if self._endable and axis.encoder is not None:
            break_off(self._box, axis, axis.encoder)

    def lasted(self, time: float) -> float:
        """Seconds since an axis that runs now was first seen to."""
        if time - self._seen > BY_HAND_S:
            self._since = time
        self._seen = time
        return time - self._since

    def end_unplaced(self, told: Told) -> None:
        """End what runs for longer than a hand controller lets it, though nobody knows where the axes are."""
        before, self._before = self._before, told
        if before is None or told.middle - before.middle > BY_HAND_S:
            self._unplaced_since = [math.inf, math.inf]
            return
        running = []
        for axis in self._axes:
            encoder, i = axis.encoder, axis.index
            if encoder is None:
                return
            passed = told.middle - before.middle
            made = (told.pair[i] - before.pair[i]) * encoder.steps_per_count - axis.own_rate * passed
            runs = abs(made) > max(RUNS_COUNTS, RUNS_COUNTS * passed / AGAIN_S) * encoder.step
            self._unplaced_since[i] = min(self._unplaced_since[i], before.middle) if runs else math.inf
            if told.middle - self._unplaced_since[i] > BY_HAND_S:
                running.append(Runaway(axis, encoder, made > 0.0))
        if running:
            self.end(running)
