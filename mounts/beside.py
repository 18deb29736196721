"""Who stands beside a motion that would go on without its host: a dead-man process, started before and let go after.

It is started and armed before what moves the axes is sent, and each exchange with the unit says that the host lives.
It is let go only when the unit has acknowledged that the motion was ended.
"""

from collections.abc import Callable
from typing import Protocol

from mounts.errors import DriveRefused


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

    def ease(self) -> None:
        """Let it act after a longer silence."""
        ...

    def beat(self) -> bool:
        """Say that the host lives; return whether it does."""
        ...

    def disarm(self) -> None:
        """Let it act no more."""
        ...

    def close(self) -> None:
        """End it; one that is armed makes the drive safe before."""
        ...


class Exchanging(Protocol):
    """A unit that calls before each exchange whoever watches its host."""

    before_each: Callable[[], object]


class Beside:
    """Who stands beside one motion.

    Parameters
    ----------
    unit : Exchanging
        Whose exchanges are the host's signs of life.
    guardian : Guardian, optional
        Without one nothing is begun.
    motion : str
        What it is, for a person who is told that it ended, or that it needs a guardian.
    """

    def __init__(self, unit: Exchanging, guardian: Guardian | None, motion: str) -> None:
        self._unit = unit
        self._guardian = guardian
        self._motion = motion
        self._started = False
        self.armed = False

    @property
    def fate(self) -> str:
        """Why the motion must not go on: what became of the guardian; empty when all is well."""
        return self._guardian.fate if self.armed and self._guardian is not None else ""

    def stand_by(self) -> None:
        """Have the guardian started, which takes a moment, and not armed yet; harmless when it is either.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._there()

    def begin(self) -> None:
        """Have the guardian armed; harmless when it is.

        Raises
        ------
        DriveRefused, DriveError
            There is none, it does not start, or it is gone since it was armed.
        """
        if self.armed:
            if fate := self.fate:
                raise DriveRefused(f"{self._motion} was ended: {fate}")
            return
        guardian, self._started = self._there(), False  # one that cannot be armed is started anew the next time
        guardian.arm()
        self._started = self.armed = True
        self._unit.before_each = guardian.beat

    def rest(self) -> None:
        """The motion was ended; the guardian stays, unarmed, for the next one."""
        if self.armed and self._guardian is not None:
            self.armed = False
            self._unit.before_each = _nobody
            self._guardian.disarm()

    def end(self) -> None:
        """The motion was ended; let the guardian go."""
        self.rest()
        self._let_go()

    def leave(self) -> None:
        """The unit did not acknowledge an end, so let the guardian go as it is: armed, it goes on trying."""
        self.armed = False
        self._unit.before_each = _nobody
        self._let_go()

    def _let_go(self) -> None:
        if self._started and self._guardian is not None:
            self._started = False
            self._guardian.close()

    def _there(self) -> Guardian:
        if self._guardian is None:
            raise DriveRefused(
                f"{self._motion} needs a dead-man process beside it, as it would go on when this program is gone; "
                "this driver was made without one, so give it a mounts.deadman.DeadMan"
            )
        if self._started and self._guardian.fate:
            self._started = False
        if not self._started:
            self._guardian.start()
            self._started = True
        return self._guardian


def _nobody() -> None:
    """Nobody needs a sign of life."""
