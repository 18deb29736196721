"""Axes on the way to the stow that their controllers alone know: nobody has checked that way, so it is watched."""

from collections.abc import Iterable

from mounts.apo.axis import ControlledAxis, Sight

_STOW_DEG = 1.0  # from the park position, within which a stow must lie
_BEGUN_S = 2.0  # in which an axis must have begun to go there


class Stowing:
    """The axes that are going to their stow, and where they were parked."""

    def __init__(self) -> None:
        self._parked: dict[int, float] = {}  # degrees, by axis
        self._since = 0.0  # POSIX seconds

    def __bool__(self) -> bool:
        return bool(self._parked)

    def __contains__(self, i: int) -> bool:
        return i in self._parked

    def begin(self, axes: Iterable[ControlledAxis], time: float) -> None:
        """Let axes that stand at their park positions go, by `P`.

        Raises
        ------
        DriveRefused, TransportError
            A controller refuses it, or does not answer.
        """
        self._since = time
        for i, axis in enumerate(axes):
            self._parked[i] = axis.look().position
            axis.stow()

    def settle(self, time: float, *, stand: bool) -> None:
        """End it where the axes stand."""
        if stand and time > self._since + _BEGUN_S:
            self.end()

    def end(self) -> None:
        """They were halted, or go elsewhere."""
        self._parked = {}

    def trouble(self, i: int, axis: ControlledAxis, sight: Sight) -> str:
        """That an axis goes too far, in words; empty where it does not."""
        parked = self._parked.get(i, sight.position)
        if abs(sight.position - parked) <= _STOW_DEG:
            return ""
        return (
            f"{axis.name}: its stow lies more than {_STOW_DEG:g}° from {parked:.4f}°, where it was parked; "
            "set park_deg to the stow, or drive.stow = false"
        )
