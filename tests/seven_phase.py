"""The least time of an axis with limited velocity, acceleration and jerk, told from its peak velocity alone.

Between two velocities without acceleration at either, an axis takes dv/a + a/j, or 2√(dv/j) where its acceleration
stays below the limit, at the mean of the two velocities. With acceleration nought at both ends of a slew the quickest
way changes to one peak velocity, may stay there if that is the limit, and changes to the last velocity: seven phases
at most. What is left is one number, found by scanning and bisection.
"""

import math
from itertools import pairwise

_SCAN = 160
_HALVINGS = 64


def change_s(dv, acceleration, jerk):
    """Seconds that a change of velocity takes."""
    dv = abs(dv)
    if dv >= acceleration**2 / jerk:
        return dv / acceleration + acceleration / jerk
    return 2.0 * math.sqrt(dv / jerk)


def by_peak(peak, first, last, acceleration, jerk):
    """Seconds and distance of the way over a peak velocity, without staying there."""
    up, down = change_s(peak - first, acceleration, jerk), change_s(last - peak, acceleration, jerk)
    return up + down, up * (first + peak) / 2.0 + down * (peak + last) / 2.0


def least_s(distance, first, last, speeds, acceleration, jerk):
    """Seconds of the quickest way over a distance; `speeds` are the lowest and the highest velocity allowed."""

    def missed(peak):
        return by_peak(peak, first, last, acceleration, jerk)[1] - distance

    found = []
    for begin, end in ((max(first, last), speeds[1]), (min(first, last), speeds[0])):
        seconds, way = by_peak(end, first, last, acceleration, jerk)
        if (distance - way) / end >= 0.0:
            found.append(seconds + (distance - way) / end)
        peaks = [begin + (end - begin) * (k / _SCAN) ** 3 for k in range(_SCAN + 1)]  # finest where time is steepest
        for one, two in brackets(missed, peaks):
            found.append(by_peak(bisected(missed, one, two), first, last, acceleration, jerk)[0])
    return min(found)


def stops_first_s(distance, first, last, speed, acceleration, jerk):
    """Seconds of a planner that stops, slews at rest, and then takes up the last velocity where that leads to."""
    stop, go = change_s(first, acceleration, jerk), change_s(last, acceleration, jerk)
    rest = distance - stop * first / 2.0 - go * last / 2.0
    return stop + least_s(rest, 0.0, 0.0, (-speed, speed), acceleration, jerk) + go


def brackets(missed, peaks):
    """Pairs of peaks between which nothing is missed, those included where the misses only touch nought."""
    misses = [missed(peak) for peak in peaks]
    for (one, two), (m, n) in zip(pairwise(peaks), pairwise(misses), strict=True):
        if (m > 0.0) != (n > 0.0):
            yield one, two
    for i in range(1, len(peaks) - 1):
        if abs(misses[i]) < min(abs(misses[i - 1]), abs(misses[i + 1])):
            turn = turning(missed, peaks[i - 1], peaks[i + 1], math.copysign(1.0, misses[i]))
            if (missed(turn) > 0.0) != (misses[i] > 0.0):
                yield peaks[i], turn
                yield turn, peaks[i + 1]


def bisected(missed, one, two):
    """The peak between two at which nothing is missed."""
    above = missed(one) > 0.0
    for _ in range(_HALVINGS):
        middle = (one + two) / 2.0
        if (missed(middle) > 0.0) == above:
            one = middle
        else:
            two = middle
    return (one + two) / 2.0


def turning(missed, one, two, sign):
    """The peak between two at which least is missed, by thirds."""
    for _ in range(_HALVINGS):
        left, right = one + (two - one) / 3.0, two - (two - one) / 3.0
        if missed(left) * sign < missed(right) * sign:
            two = right
        else:
            one = left
    return (one + two) / 2.0
