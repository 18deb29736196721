"""By how much an axis may be elsewhere than reckoned, as commands may have been mutilated or mean something else.

Encoders tell where an axis is to two and a half counts whatever became of a command, as of their last look. Without
them a command that is not believed may have done all that one of its kind can; and a move may have gone to the other
axis, the other way, or twice as far, until a `sync` after it has shown that it did not.
"""

from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.commands import FIVE_ARCMIN
from mounts.avr_box.encoders import SEEN_COUNTS
from mounts.avr_box.guiding import GuideRates
from mounts.avr_box.trust import FLAGS, GUIDES, MOVES, STEPS, Trust

UNATTENDED = 3e-3
"""Of the way that is tracked: a divisor, or a PEC, that nobody set."""
_LOOK_S = 0.02  # by which the moment of what an encoder says is uncertain
_MOST_STEPS = 2 * 255  # of `<` and `>`: as many the other way
_PROVED = 0.05  # of the way that was sent, by which a `sync` may find the axes elsewhere
_CLEAR_STEPS = 30_000  # of a way that proves something, half a degree or one


def uncertainty(
    axis: BoxAxis, unproved: float, trust: Trust, rates: GuideRates, time: float, looked: float, *, flawed: bool
) -> float:
    """Microsteps by which an axis may be off at a time.

    Parameters
    ----------
    axis : BoxAxis
        The axis.
    unproved : float
        Microsteps that moves may have made otherwise than is taken for it.
    trust : Trust
        What of the commands is believed.
    rates : GuideRates
        To which axis 1 is trimmed.
    time, looked : float
        Now, and when its encoder was last seen to agree, POSIX seconds.
    flawed : bool
        Whether the line has shown a flaw since it was known where both are.
    """
    state = axis.at(time)
    ran = 2.0 * axis.law.fastest  # one may run this way that was sent the other way
    if axis.encoder is not None:
        if trust.complete and not flawed:
            return state.uncertainty
        since = max(looked, trust.since(MOVES))
        most = SEEN_COUNTS * axis.encoder.step
        loose = axis.encoder.bound_at < looked  # it may be off by what it agrees within
        seen = state.uncertainty + most if loose else most
        return seen + abs(state.rate) * _LOOK_S + ran * max(0.0, time - since)
    by_moves = ran * max(0.0, time - trust.since(MOVES)) + unproved
    flags = max(0.0, time - trust.since(FLAGS))
    if axis.index == 0:
        guided = max(0.0, time - trust.since(GUIDES)) * (rates.faster - rates.slower)
        return state.uncertainty + by_moves + guided + flags * rates.own * UNATTENDED
    stepped = _MOST_STEPS if trust.since(STEPS) < time else 0
    return state.uncertainty + by_moves + stepped + (2 * FIVE_ARCMIN[1] if flags else 0)  # `C` is a bit from `S`


def proves(sent: tuple[float, float], off: tuple[float, float]) -> bool:
    """Whether axes that were found so far off prove that moves of so many microsteps mean what is taken for it."""
    return all(way >= _CLEAR_STEPS and abs(by) <= _PROVED * way for way, by in zip(sent, off, strict=True))
