"""The dead-man process beside a key that is held, which the unit would hold for ever when its host is gone.

It is started and armed before a key is pressed, and let go when the unit has confirmed the release. While a release
is near it allows its owner only a short silence, so that a key is never held much longer than it was to be.
"""

from typing import Protocol

from mounts.awr.unit import Unit
from mounts.errors import DriveRefused

_WATCHED_S = 0.025  # from one sign of life to the next while a release is near


class Guardian(Protocol):
    """What `mounts.deadman.DeadMan` is to a driver."""

    @property
    def fate(self) -> str:
        """What became of it; empty while it lives."""
        ...

    def start(self) -> None:
        """Start it, unarmed."""
        ...

    def arm(self) -> None:
        """Let it act from now on."""
        ...

    def hasten(self) -> None:
        """Let it act after a shorter silence."""
        ...

    def beat(self) -> bool:
        """Say that the host lives; return whether it does."""
        ...

    def disarm(self) -> None:
        """Let it act no more."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class Beside:
    """Who stands beside the keys.

    Parameters
    ----------
    unit : Unit
        Whose commands and waits are the host's signs of life.
    guardian : Guardian, optional
        Without one no key is pressed.
    """

    def __init__(self, unit: Unit, guardian: Guardian | None) -> None:
        self._unit = unit
        self._guardian = guardian
        self._started = False
        self.armed = False

    @property
    def fate(self) -> str:
        """Why no key may stay pressed: what became of the guardian; empty when all is well."""
        return self._guardian.fate if self.armed and self._guardian is not None else ""

    def stand_by(self) -> None:
        """Have the guardian started, which takes a moment; harmless when it is.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._there()

    def begin(self) -> None:
        """Have the guardian armed, with patience; harmless when it is.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        guardian = self._there()
        self._started = False  # one that cannot be armed is started anew the next time
        guardian.arm()
        self._started = self.armed = True
        self._unit.before_each, self._unit.slice_s = guardian.beat, float("inf")

    def hasten(self) -> None:
        """A release is near."""
        if self.armed and self._guardian is not None:
            self._unit.slice_s = _WATCHED_S
            self._guardian.hasten()

    def calm(self) -> None:
        """No release is near any more."""
        if self.armed and self._guardian is not None and self._unit.slice_s < float("inf"):
            self._unit.slice_s = float("inf")
            self._guardian.arm()

    def rest(self) -> None:
        """All keys are released; the guardian stays, unarmed, for the next one."""
        if self._guardian is not None and self.armed:
            self.armed = False
            self._unit.before_each, self._unit.slice_s = _nobody, float("inf")
            self._guardian.disarm()

    def end(self) -> None:
        """Let the guardian go."""
        self.rest()
        if self._started and self._guardian is not None:
            self._started = False
            self._guardian.close()

    def _there(self) -> Guardian:
        if self._guardian is None:
            raise DriveRefused(
                "a key that is pressed stays pressed when this program is gone, so a dead-man process must stand "
                "beside it, and this driver was made without one"
            )
        if self._started and self._guardian.fate:
            self._started = False
        if not self._started:
            self._guardian.start()
            self._started = True
        return self._guardian


def _nobody() -> None:
    """Nobody needs a sign of life."""
