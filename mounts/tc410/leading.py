"""What a TC410 can be led along by direct speed control, with a reserve that closes errors."""

from collections.abc import Iterable

from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slew import TICK_S, Tc410SlewModel
from pointing.plan import Leading
from pointing.profile import Ramps

_RESERVE = 0.9  # of speed and acceleration
PERIOD_S = 0.1  # between two commands of an axis, where the link is quick enough
_DELAY_S = 0.6  # in which the way is planned and the first velocities are written


def leading_of(models: Iterable[Tc410SlewModel], period_s: float = PERIOD_S) -> Leading:
    """Speeds and accelerations of both axes, by all that is known of their slews; commanded every `period_s`."""
    one, two = (
        Ramps(
            _RESERVE * model.max_rate,
            _RESERVE * min(model.law.acceleration, model.law.deceleration) * COUNTS_PER_SECOND / TICK_S,
        )
        for model in models
    )
    return Leading((one, two), _DELAY_S, period_s)
