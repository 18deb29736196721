"""Ending all motion: every axis is told, whatever becomes of another, and watched until it stands."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Protocol

from mounts.apo.axis_group import AxisGroup
from mounts.apo.settings import ApoSettings
from mounts.errors import DriveError
from transports.errors import TransportError

_STOPS_IN_S = 2.0  # beyond what the deceleration takes


class Undertaking(Protocol):
    """Something that was begun with the axes, and ends when they are halted."""

    def end(self) -> None:
        """Give it up."""


class Halting:
    """Halts the axes of a telescope.

    Parameters
    ----------
    group : AxisGroup
        The axes.
    settings : ApoSettings
        How fast they move and brake.
    undertakings : sequence of Undertaking
        What ends with the motion.
    """

    def __init__(self, group: AxisGroup, settings: ApoSettings, undertakings: Sequence[Undertaking]) -> None:
        self._group = group
        self._undertakings = undertakings
        self._braking_s = max(axis.max_speed_deg_s / axis.acceleration_deg_s2 for axis in settings.axes)
        self._since: float | None = None  # POSIX seconds, while the axes may still move after a MOVE
        self._stood = False  # when looked at last

    @property
    def brakes(self) -> bool:
        """Whether the axes were halted and may move still."""
        return self._since is not None

    def over(self) -> None:
        """The axes are sent on."""
        self._since = None

    def settle(self, time: float, *, stand: bool) -> None:
        """See the motion end; what does not stand in its time is stopped abruptly.

        One that swings back after a stop stands for a moment where it turns, so it must be seen to stand twice.

        Raises
        ------
        DriveError, TransportError
            As for `all`.
        """
        if self._since is None:
            return
        stood, self._stood = self._stood, stand
        if stand:
            self._since = None if stood else self._since
        elif time > self._since + self._braking_s + _STOPS_IN_S:
            self.all(time, abruptly=True)

    def all(self, time: float, *, abruptly: bool = False) -> None:
        """Tell every axis, and raise the first error only then.

        Raises
        ------
        DriveError, TransportError
            An axis could not be told.
        """
        for each in self._undertakings:
            each.end()
        self._since, self._stood = time, False
        self._group.halt(abruptly=abruptly)

    def what_answers(self, time: float) -> None:
        """Tell every axis, and pass over those that do not answer."""
        with suppress(DriveError, TransportError):
            self.all(time)

    @contextmanager
    def on_failure(self, time: float) -> Iterator[None]:
        """Halt what answers where something fails."""
        try:
            yield
        except BaseException:
            self.what_answers(time)
            raise
