"""Tracking one axis to a fraction of a count through a drive that reports whole counts.

The velocity register is exact, so between two commands the 48-bit position is known by dead reckoning. A reported
count c only says that the position lies in [c, c + 1): the estimate is moved no further than to the edge of that
interval, so single counts are never fed back. The velocity chosen each time brings the estimate onto the path; its
rounding error stays in the estimate, which dithers neighbouring register values by itself.
"""

from mounts.tc410.registers import COUNTS_PER_SECOND, MAX_VELOCITY
from mounts.tc410.slew import TICK_S

_JITTER_S = 0.004  # one tick, and what the link's timing may be off
BEAT_S = 2.0  # an error on the path is closed over this time


class TrackedAxis:
    """The dead reckoning of one axis while tracking.

    Parameters
    ----------
    position : float
        Counts, with their fraction.
    time : float
        POSIX seconds at which the axis is there.
    velocity : int
        The tracking velocity in force, register units.
    ramp : int
        Velocity units gained every tick while the drive changes its velocity.
    """

    def __init__(self, position: float, time: float, velocity: int, ramp: int) -> None:
        self.position = position
        self.time = time
        self.velocity = velocity
        self._ramp = ramp

    def at(self, time: float) -> float:
        """Position in counts at a time, if nothing is commanded."""
        return self.position + self.velocity * COUNTS_PER_SECOND * (time - self.time)

    def observe(self, counts: float, time: float) -> float:
        """Take a reported count; return by how many counts it contradicts the dead reckoning."""
        expected = self.at(time)
        slack = abs(self.velocity) * COUNTS_PER_SECOND * _JITTER_S
        corrected = min(max(expected, counts - slack), counts + 1.0 + slack)
        self.position, self.time = corrected, time
        return corrected - expected

    def command(self, velocity: int, time: float) -> None:
        """Note that the drive ramps to another velocity from `time` on."""
        self.position, self.time = self.at(time), time
        change = velocity - self.velocity
        ticks = abs(change) / self._ramp
        if ticks > 1.0:  # a ramp of n ticks is (n − 1)/2 ticks of the change behind a step
            self.position -= change * COUNTS_PER_SECOND * TICK_S * (ticks - 1.0) / 2.0
        self.velocity = velocity

    def velocity_for(self, counts: float, rate: float, time: float, largest_catch_up: float) -> int:
        """Velocity register that meets the path.

        Parameters
        ----------
        counts, rate : float
            Where the path is one beat after `time`, and its mean rate over that beat, counts per second.
        time : float
            When the velocity will take effect.
        largest_catch_up : float
            How much faster or slower than `rate` the axis may go to close an error, counts per second.
        """
        wanted = (counts - self.at(time)) / BEAT_S
        wanted = min(max(wanted, rate - largest_catch_up), rate + largest_catch_up)
        return min(max(round(wanted / COUNTS_PER_SECOND), -MAX_VELOCITY), MAX_VELOCITY)
