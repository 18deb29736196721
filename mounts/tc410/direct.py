"""Direct speed control, which the TC410 goes on with when its host is gone: never without a dead-man process.

The process is started and armed before the bit that lets the axes move is set, and each request to the unit says that
the host lives. It is let go only when the unit has acknowledged that the axes were stopped.
"""

from typing import Protocol

from mounts.errors import DriveRefused
from mounts.tc410.unit import Unit


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

    def beat(self) -> bool:
        """Say that the host lives; return whether it does."""
        ...

    def disarm(self) -> None:
        """Let it act no more."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class DirectSpeed:
    """Whether the axes move at speeds that the host gave, and who stands beside.

    Parameters
    ----------
    unit : Unit
        Whose requests are the host's signs of life.
    guardian : Guardian, optional
        Without one there is no direct speed control.
    """

    def __init__(self, unit: Unit, guardian: Guardian | None) -> None:
        self._unit = unit
        self._guardian = guardian
        self._started = False
        self.armed = False
        self.velocities: list[tuple[int, ...]] | None = None
        """What the unit was last told and acknowledged; None when that is not known."""

    @property
    def fate(self) -> str:
        """Why the axes must not go on: what became of the guardian; empty when all is well."""
        return self._guardian.fate if self.armed and self._guardian is not None else ""

    def stand_by(self) -> None:
        """Have the guardian started, which takes a moment, and not armed yet; harmless when it is either.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._beside()

    def begin(self) -> None:
        """Have the guardian armed; harmless when it is.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        if self.armed:
            return
        guardian, self._started = self._beside(), False  # one that cannot be armed is started anew the next time
        guardian.arm()
        self._started = self.armed = True
        self._unit.before_each = guardian.beat

    def end(self) -> None:
        """Let the guardian go; the axes have been stopped."""
        self.velocities = None
        if not self._started or self._guardian is None:
            return
        self._started = self.armed = False
        self._unit.before_each = _nobody
        self._guardian.disarm()
        self._guardian.close()

    def _beside(self) -> Guardian:
        if self._guardian is None:
            raise DriveRefused(
                "direct speed control needs a dead-man process beside it, and this driver was made without one; "
                "use `jog` or `goto`, which the drive ends by itself"
            )
        if not self._started:
            self._guardian.start()
            self._started = True
        return self._guardian


def _nobody() -> None:
    """Nobody needs a sign of life."""
