"""The play of the gears between a motor and its axis, and where in it the motor stands.

An axis follows its motor once the motor has crossed the gap. The unit may take up some of it by a blip where the
motor turns round; what it leaves, or takes up too much, stays between what is reckoned of the motor, blips not
counted, and its axis. The *side* tells where in that the motor stands: at 1 it pushes the axis to larger counts, at
-1 to smaller ones, between it moves nothing. The axis lags it by side times half the play. Where the play is not
surely known the motor counts as between its sides for longer.
"""

import math
from dataclasses import dataclass, replace

from mounts.awr.ramps import Key

_SURELY = 3.0  # standard deviations, so much farther that the motor goes until it surely pushes its axis
SOON_S = 20.0  # in which a drive takes up the play by itself, so that no press need do so


@dataclass(frozen=True)
class Play:
    """That of one axis.

    Parameters
    ----------
    steps : float
        Motor steps of it that the unit does not take up; below 0 where its blips are longer than the play.
    sigma : float
        Standard deviation of that, steps.
    blip : float
        Steps of it that the unit takes up.
    """

    steps: float = 0.0
    sigma: float = 0.0
    blip: float = 0.0

    @property
    def unblipped(self) -> "Play":
        """The same where nobody knows whether its blips were made: its motor may have farther to go."""
        return replace(self, sigma=self.sigma + self.blip / _SURELY)

    def pushed(self, side: float, way: float) -> float:
        """The side after a way of the motor that began at a side, signed steps, on which it does not turn round."""
        span = self.steps + _SURELY * self.sigma
        if span > 0.0:
            return min(max(side + 2.0 * way / span, -1.0), 1.0)
        return math.copysign(1.0, way) if way else side

    def pressed(self, side: float, way: float, key: Key, drive: float) -> float:
        """The same after a press of a key on top of a drive, which together made a way."""
        against = key.rate * drive < 0.0 and abs(key.rate) > abs(drive)
        turned = drive * abs(drive) / (2.0 * key.acceleration) if against else 0.0  # as the drive is taken up again
        return self.pushed(self.pushed(side, way - turned), turned)

    def lag(self, side: float) -> float:
        """Steps by which the axis is behind its motor, against the middle of the play."""
        return side * self.steps / 2.0

    def slack(self, side: float, sense: float) -> float:
        """Steps that the motor goes to larger counts, or for a negative sense to smaller, before the axis follows."""
        return (1.0 - math.copysign(1.0, sense) * side) * self.steps / 2.0

    def doubt(self, side: float, since: float) -> float:
        """Standard deviation, steps, of an axis that was known at one side of the play and may be at another now."""
        return 0.0 if side == since else self.sigma

    def settles(self, drive: float) -> bool:
        """Whether a drive, steps a second, takes up the play by itself before long."""
        return drive != 0.0 and self.steps <= SOON_S * abs(drive)
