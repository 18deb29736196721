"""A target followed by the drives alone, with no key pressed."""

import math
from collections.abc import Sequence

from mounts.awr.parts import Parts
from mounts.awr.settings import AwrSettings
from mounts.drive import AxisPath
from mounts.errors import DriveRefused

FOLLOW_S = 2.0  # from one look at a path to the next
LEAST_FOLLOW_S = 0.5
_CLOSING = 2.0  # times sidereal, at which an axis is led back to its path at most


def require_slow(rates: Sequence[float], settings: AwrSettings) -> None:
    """Refuse what is too fast for a drive: what that does when the program is gone must leave time to come.

    Raises
    ------
    DriveRefused
        An axis would go faster.
    """
    for number, (rate, most) in enumerate(zip(rates, settings.fastest, strict=True), start=1):
        if abs(rate) > most:
            raise DriveRefused(
                f"axis {number} would have to go at {rate:+.0f} steps/s by its drive, which goes on when this "
                f"program is gone; at most {most:.0f} steps/s: choose a slower target"
            )


def follow(parts: Parts, path: AxisPath, time: float) -> float:
    """Set both drives to the rates that lead the axes back to a path by the next look; return seconds until that.

    Raises
    ------
    DriveRefused, TransportError
        The unit does not take the rate, or does not answer.
    """
    now = max(time, parts.unit.now())
    ahead = path.at(now + FOLLOW_S)[:2]
    if all(rate == 0.0 for _, rate in ahead) and parts.drives.resting:
        return FOLLOW_S
    require_slow([rate for _, rate in ahead], parts.settings)
    most = _CLOSING * parts.settings.sidereal_steps_per_s
    rates = []
    for axis, (there, rate) in zip(parts.axes, ahead, strict=True):
        slack = math.copysign(1.0, rate) * axis.play.slack(axis.side(now), rate) if rate else 0.0
        closing = (there - axis.at(now).counts + slack) / FOLLOW_S - rate
        rates.append(rate + min(max(closing, -most), most))
    parts.drives.go(rates)
    return FOLLOW_S - (parts.unit.now() - now)
