"""Direct speed control, which the TC410 goes on with when its host is gone: never without a dead-man process."""

from mounts.beside import Beside, Guardian
from mounts.tc410.unit import Unit


class DirectSpeed(Beside):
    """Whether the axes move at speeds that the host gave, and who stands beside.

    Parameters
    ----------
    unit : Unit
        Whose requests are the host's signs of life.
    guardian : Guardian, optional
        Without one there is no direct speed control.
    """

    def __init__(self, unit: Unit, guardian: Guardian | None) -> None:
        super().__init__(unit, guardian, "direct speed control")
        self.velocities: list[tuple[int, ...]] | None = None
        """What the unit was last told and acknowledged; None when that is not known."""

    def end(self) -> None:
        """Let the guardian go; the axes have been stopped."""
        self.velocities = None
        super().end()
