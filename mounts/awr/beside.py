"""The dead-man process beside keys that are held and drives that go, both of which the unit keeps up for ever.

Its owner may be silent for a moment while a key is held, for a shorter one while a release is near, so that a key is
never held much longer than it was to be, and for a longer one while only the drives go, which are slow.
"""

from typing import Literal

from mounts.awr.unit import Unit
from mounts.beside import Beside, Guardian

_SIGN_S, _HASTY_SIGN_S = 0.25, 0.025  # from one sign of life to the next at most; while a release is near

Silence = Literal["arm", "hasten", "ease"]
"""What the guardian was told of how long its owner may be silent."""


class Attended(Beside):
    """Who stands beside the keys and drives of one unit.

    Parameters
    ----------
    unit : Unit
        Whose commands and waits are the host's signs of life.
    guardian : Guardian, optional
        Without one no key is pressed, and no drive made to go.
    """

    def __init__(self, unit: Unit, guardian: Guardian | None) -> None:
        super().__init__(unit, guardian, "what moves the axes, a key that is held or a drive")
        self._waiting = unit
        self._keys = self._drives = False
        self._silence: Silence = "arm"

    @property
    def drives(self) -> bool:
        """Whether it stands beside drives that go."""
        return self.armed and self._drives

    # Keys ------------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """Have the guardian armed, with patience: a key will be held.

        Raises
        ------
        DriveRefused, DriveError
            There is none, it does not start, or it is gone since it was armed.
        """
        super().begin()
        self._keys = True
        self._settle()

    def hasten(self) -> None:
        """A release is near."""
        if self.armed:
            self._allow("hasten")

    def calm(self) -> None:
        """No release is near any more."""
        self._settle()

    def rest(self) -> None:
        """All keys are released."""
        self._keys = False
        self._settle()

    # Drives ----------------------------------------------------------------------------------------------------

    def drives_go(self) -> None:
        """Have the guardian armed: a drive will go.

        Raises
        ------
        DriveRefused, DriveError
            As for `begin`.
        """
        super().begin()
        self._drives = True
        self._settle()

    def drives_rest(self) -> None:
        """Both drives are off."""
        self._drives = False
        self._settle()

    def end(self) -> None:
        """Nothing moves, or what moves is left to itself; let the guardian go."""
        self._drives = False
        super().end()

    def leave(self) -> None:
        """The unit did not acknowledge an end: let the guardian, armed, go on trying."""
        self._keys = self._drives = False
        super().leave()

    # Both ------------------------------------------------------------------------------------------------------

    def _settle(self) -> None:
        if self._keys:
            self._allow("arm")
        elif self._drives:
            self._allow("ease")
        else:
            super().rest()
            self._hear("arm")

    def _allow(self, silence: Silence) -> None:
        if self.armed and self._guardian is not None and self._silence != silence:
            self._hear(silence)
            getattr(self._guardian, silence)()

    def _hear(self, silence: Silence) -> None:
        self._silence = silence
        self._waiting.slice_s = _HASTY_SIGN_S if silence == "hasten" else _SIGN_S
