"""What a TC410 is told of a rate."""

from typing import Any

from mounts.tc410.registers import COUNTS_PER_SECOND
from pointing.plan import Axis, Unsaid


def velocity_register(counts_s: float) -> int:
    """The velocity register nearest to a rate."""
    return round(counts_s / COUNTS_PER_SECOND)


class Tc410Words(Unsaid):
    """Its velocity register."""

    def of_rate(self, axis: Axis, rate: float) -> dict[str, Any]:
        """Return the velocity register of a rate, radians per second."""
        return {"velocity_register": velocity_register(rate * axis.gearing.counts_per_radian)}
