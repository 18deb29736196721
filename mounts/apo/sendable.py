"""The quickest way all of whose phases can be sent.

A phase that is too short cannot: its jerk would be made of the last digits of two positions. So short phases of the
quickest way are stretched, and the others give way; for that to stay within the limits, the way that is stretched
keeps slightly lower ones. Where nothing near the quickest way is found, all of it is slowed down.
"""

from collections.abc import Iterator

from mounts.apo.errors import ApoError
from mounts.apo.slew_profile import MARGIN, SHORTEST_S, Limits, Slew, SlewProfile, profile, quickest
from mounts.apo.stretching import End, Phase, stretched

_LOWER = (1.0, 0.999, 0.99, 0.97, 0.93, 0.85, 0.7, 0.5)  # of acceleration and jerk, in looking for a way
_SLOWER = 0.7  # of all times, from try to try, where that finds none
_TRIES = 60
_ROUNDING = 1.0 + 1e-12


def sendable(slew: Slew, limits: Limits) -> SlewProfile:
    """The quickest way found that can be sent.

    Raises
    ------
    ApoError
        There is none; whatever `quickest` raises.
    """
    found = quickest(slew, limits)
    if found.can_be_sent:
        return found
    near = min(_near(slew, limits), key=lambda each: each.duration, default=None)
    return near or _slow(slew, limits)


def _near(slew: Slew, limits: Limits) -> Iterator[SlewProfile]:
    """Ways near the quickest, within the limits."""
    for lower in _LOWER:
        found = quickest(slew, Limits(limits.velocity, limits.acceleration * lower, limits.jerk * lower))
        if found.can_be_sent:
            yield found
            continue
        line, end_rate = slew.onto, slew.end_rate
        ways = stretched(
            [Phase(phase.duration, phase.jerk) for phase in found.phases],
            slew.start_rate - line.rate,
            End(line.position - slew.start, end_rate),
            SHORTEST_S,
            limits.jerk * MARGIN,
        )
        made = (profile(slew, phases) for phases in ways)
        yield from (each for each in made if _keeps(each, slew, limits))


def _keeps(way: SlewProfile, slew: Slew, limits: Limits) -> bool:
    """Whether a way keeps the limits times 0.999; an axis that is too fast as it begins need only become slower."""
    speed = max(limits.velocity * MARGIN, abs(slew.start_rate)) * _ROUNDING
    return all(
        found.speed <= speed and found.acceleration <= limits.acceleration * MARGIN * _ROUNDING
        for found in (phase.extremes for phase in way.phases)
    )


def _slow(slew: Slew, limits: Limits) -> SlewProfile:
    """All of the way slower, until its shortest phase is long enough."""
    for turn in range(1, _TRIES + 1):
        scale = _SLOWER**turn
        found = quickest(slew, Limits(limits.velocity, limits.acceleration * scale**2, limits.jerk * scale**3))
        if found.can_be_sent:
            return found
    raise ApoError(
        f"no way of phases of at least {SHORTEST_S:g} s was found from {slew.start:.6f}° at {slew.start_rate:.6g}°/s "
        f"to {slew.onto.position:.6f}° at {slew.last_rate:.6g}°/s; `stop`, then go from rest"
    )
