"""Where both axes must be while they are led to a moving target and along with it.

An axis follows the target wherever it can. Where the target is too fast for it, near the pole of axis 1 (the
keyhole), it leaves the target's way when it must and joins it again as soon as it can: a *bridge*. The way to a
target that is met with its own velocity is the first bridge. Nothing is quicker than to leave as late as possible: an
axis that goes ahead earlier is off the target for longer.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass

from pointing.errors import PointingError
from pointing.geometry import Geometry
from pointing.mount import Posture
from pointing.plan import AxisState, Leading, Start
from pointing.profile import Motion
from pointing.targets import Target

LED_ABOVE = math.radians(0.05)  # rad/s of an axis; slower targets are met at rest and tracked by the drive alone
LED_UNTIL = math.radians(0.03)  # what is led stays so until it is slower than this

_STEP_S = 0.1  # between two looks ahead, and by how much too early the target may be left
_INSTANT_S = 0.02  # in which no change of velocity tells
_ANCHOR_S = 5.0
_LONGEST_BRIDGE_S = 600.0
_ROUNDS = 30  # the fixed point contracts by the target's change of velocity over the speed of the axis
_SETTLED_S = 1e-4


@dataclass(frozen=True)
class Bridge:
    """One axis off the target: from `begin`, POSIX seconds, on its `motion`, counts, until it joins it again."""

    axis: int
    begin: float
    motion: Motion

    @property
    def end(self) -> float:
        """POSIX seconds at which it has joined the target."""
        return self.begin + self.motion.duration


class Trajectory:
    """The way of both axes along a target, in one posture.

    Parameters
    ----------
    geometry : Geometry
        Sky, mount and axes.
    target : Target
        What is followed.
    posture : Posture
        The posture to keep.
    near : tuple of float
        Axis angles, radians, whose windings are the nearest at first; later those of where the axes are.
    leading : Leading, optional
        What the axes can do; without it they are supposed to follow any target.
    start : Start, optional
        Where the axes are when they set out to join the target; without it they are on it.
    """

    def __init__(
        self,
        geometry: Geometry,
        target: Target,
        posture: Posture,
        near: tuple[float, float],
        leading: Leading | None = None,
        start: Start | None = None,
    ) -> None:
        self.geometry = geometry
        self.target = target
        self.posture = posture
        self.leading = leading
        self.bridges: list[Bridge] = []
        """In the order of their beginnings, as far as the way is known."""
        self.unmet = False
        """Whether an axis cannot join the target within ten minutes."""
        self._near = self._first_near = near
        self._seen: tuple[float, AxisState] | None = None  # the last look ahead
        self._anchors: list[tuple[float, tuple[float, float]]] = []  # axis angles at times that were looked at
        self._set_out = start
        if start is not None:
            for axis in (0, 1):
                self._bridge(axis, start.time, start.counts[axis], start.rates[axis], near[axis], 0.0)

    def anew(self) -> "Trajectory":
        """The same way from its beginning, for whoever looks far ahead while the axes are led along this one."""
        return Trajectory(self.geometry, self.target, self.posture, self._first_near, self.leading, self._set_out)

    def angles(self, time: float) -> AxisState:
        """(angle, rate) of each axis at POSIX `time`, radians and radians per second.

        Raises
        ------
        TargetError
            The target has no place then.
        """
        if self.leading is not None:
            self.extend(time)
            self._near = self._anchored(time)
        state = self.geometry.track(self.target, time, self.posture, self._near)
        for bridge in self.bridges:
            if bridge.begin <= time < bridge.end:
                state = self._replaced(state, bridge.axis, bridge.motion.at(time - bridge.begin))
        if self._set_out is not None and time < self._set_out.time:
            ahead = time - self._set_out.time
            for axis, (counts, rate) in enumerate(zip(self._set_out.counts, self._set_out.rates, strict=True)):
                state = self._replaced(state, axis, (counts + rate * ahead, rate))
        self._near = state[0][0], state[1][0]
        return state

    def at(self, time: float) -> AxisState:
        """(counts, counts per second) of each axis at POSIX `time`."""
        one, two = (
            (axis.gearing.counts(angle), rate * axis.gearing.counts_per_radian)
            for axis, (angle, rate) in zip(self.geometry.axes, self.angles(time), strict=True)
        )
        return one, two

    def is_joined(self, time: float) -> bool:
        """Whether both axes are on the target at a time."""
        waiting = self._set_out is not None and time < self._set_out.time
        return not waiting and not any(bridge.begin <= time < bridge.end for bridge in self.bridges)

    def rejoined(self, time: float) -> float:
        """When both axes are on the target again, POSIX seconds; the time itself where they are.

        A bridge that an axis begins while the other one is on its own belongs to the same gap.
        """
        self.extend(time)
        while ends := [each.end for each in self.bridges if each.begin <= time < each.end]:
            time = max(ends)
            self.extend(time)
        return time

    def left(self, time: float) -> float | None:
        """When the gap began in which a time is, POSIX seconds; None where both axes are on the target then."""
        begun = None
        while begins := [each.begin for each in self.bridges if each.begin < time <= each.end]:
            begun = time = min(begins)
        return begun

    @property
    def joined(self) -> float:
        """POSIX seconds at which both axes have joined the target for the first time."""
        first = [next((each.end for each in self.bridges if each.axis == axis), -math.inf) for axis in (0, 1)]
        return max(first)

    @property
    def extremes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The least and the largest angle of each axis on its bridges, radians; those of now where it has none."""
        found: list[list[float]] = [[self._near[0]], [self._near[1]]]
        for bridge in self.bridges:
            found[bridge.axis] += map(self.geometry.axes[bridge.axis].gearing.angle, bridge.motion.extremes)
        return (min(found[0]), max(found[0])), (min(found[1]), max(found[1]))

    def gaps(self, until: float) -> tuple[tuple[float, float], ...]:
        """When an axis is on a bridge, after both had joined the target and before `until`: (begin, end) each."""
        self.extend(until)
        gaps: list[tuple[float, float]] = []
        for bridge in sorted(self.bridges, key=lambda each: each.begin):
            begin, end = max(bridge.begin, self.joined), min(bridge.end, until)
            if begin >= end:
                continue
            if gaps and begin <= gaps[-1][1]:
                gaps[-1] = gaps[-1][0], max(gaps[-1][1], end)
            else:
                gaps.append((begin, end))
        return tuple(gaps)

    def extend(self, until: float) -> None:
        """Look ahead to `until`, and bridge what the axes cannot follow."""
        if self.leading is None or self.unmet:
            return
        if self._seen is None:
            begin = until if self._set_out is None else self._set_out.time
            state = self.geometry.track(self.target, begin, self.posture, self._near)
            self._seen = begin, state
            self._anchors.append((begin, self._reached(begin, state)))
        while self._seen[0] < until:
            before, was = self._seen
            time = before + _STEP_S
            try:
                state = self.geometry.track(self.target, time, self.posture, self._reached(before, was))
            except PointingError:
                return  # it has no place then: whoever asks for that time is told
            bridged = [axis for axis in (0, 1) if self._must_leave(axis, before, was[axis], time, state[axis])]
            if bridged:
                state = self.geometry.track(self.target, time, self.posture, self._reached(time, state))
            self._seen = time, state
            if time >= self._anchors[-1][0] + _ANCHOR_S or bridged:
                self._anchors.append((time, self._reached(time, state)))

    def _anchored(self, time: float) -> tuple[float, float]:
        """Axis angles shortly before a time, to which its windings are the nearest, in whatever order one asks."""
        i = bisect_right(self._anchors, time, key=lambda anchor: anchor[0])
        return self._anchors[i - 1][1] if i else self._near

    def _reached(self, time: float, state: AxisState) -> tuple[float, float]:
        """Angles to which windings are the nearest: where a bridge leads, else where the axes are on the target."""
        near = [state[0][0], state[1][0]]
        for bridge in self.bridges:
            if bridge.begin <= time < bridge.end + _STEP_S:
                near[bridge.axis] = self.geometry.axes[bridge.axis].gearing.angle(bridge.motion.landed)
        return near[0], near[1]

    def _must_leave(
        self, axis: int, before: float, was: tuple[float, float], time: float, state: tuple[float, float]
    ) -> bool:
        """Bridge what an axis, on the target at `before` or since, cannot follow until `time`; say whether so."""
        gearing = self.geometry.axes[axis].gearing
        last = next((bridge for bridge in reversed(self.bridges) if bridge.axis == axis), None)
        if last is not None and last.begin <= before and time < last.end:
            return False  # it is on its way
        if last is not None and before < last.end <= time:  # it has just joined the target, as fast as that is then
            before = last.end
            counts, speed = last.motion.at(last.motion.duration)
            was = gearing.angle(counts), speed / gearing.counts_per_radian
        if self._can_follow(axis, was, state, time - before):
            return False
        self._bridge(axis, before, gearing.counts(was[0]), was[1] * gearing.counts_per_radian, was[0], _STEP_S)
        return True

    def _can_follow(self, axis: int, was: tuple[float, float], state: tuple[float, float], seconds: float) -> bool:
        assert self.leading is not None  # noqa: S101 - nothing is bridged without it
        ramps, scale = self.leading.ramps[axis], abs(self.geometry.axes[axis].gearing.counts_per_radian)
        seconds = max(seconds, _INSTANT_S)
        fastest = max(abs(state[1]), abs(state[0] - was[0]) / seconds) * scale
        return fastest < ramps.max_rate and abs(state[1] - was[1]) * scale <= ramps.acceleration * seconds

    def _bridge(self, axis: int, begin: float, counts: float, rate: float, near: float, least: float) -> None:
        """Bridge what an axis cannot follow; it is on the target at `begin`, and not to be again within `least`."""
        motion = self._quickest(axis, begin, counts, rate, near, least)
        if motion is None:
            self.unmet = True
        elif motion.duration > 0.0:
            self.bridges.append(Bridge(axis, begin, motion))

    def _quickest(
        self, axis: int, begin: float, counts: float, rate: float, near: float, least: float
    ) -> Motion | None:
        """The motion that joins the target first: solved with the place where the target is then."""
        seconds = least
        for _ in range(_ROUNDS):
            motion = self._joining(axis, begin, counts, rate, near, seconds)
            if motion is None or not least <= motion.duration <= _LONGEST_BRIDGE_S:
                break
            if abs(motion.duration - seconds) < _SETTLED_S:
                return motion
            seconds = motion.duration
        return self._searched(axis, begin, counts, rate, near, least)

    def _searched(
        self, axis: int, begin: float, counts: float, rate: float, near: float, least: float
    ) -> Motion | None:
        """As `_quickest`, where the target's velocity changes too much for that: step by step, then by halving."""
        early, late = least, least + _STEP_S
        while not self._in_time(axis, begin, counts, rate, near, late):
            early, late = late, late + max(_STEP_S, 0.02 * late)
            if late > _LONGEST_BRIDGE_S:
                return None
        while late - early > _SETTLED_S:
            middle = (early + late) / 2.0
            if self._in_time(axis, begin, counts, rate, near, middle):
                late = middle
            else:
                early = middle
        motion = self._joining(axis, begin, counts, rate, near, late)
        # Where the target leaps, round the pole, the axis is there before it and waits for it.
        return motion if motion is None or motion.duration > late - _STEP_S else motion.ridden(late)

    def _in_time(self, axis: int, begin: float, counts: float, rate: float, near: float, seconds: float) -> bool:
        motion = self._joining(axis, begin, counts, rate, near, seconds)
        return motion is not None and motion.duration <= seconds

    def _joining(
        self, axis: int, begin: float, counts: float, rate: float, near: float, seconds: float
    ) -> Motion | None:
        """The quickest motion to a place that moves as the target does `seconds` after `begin`."""
        assert self.leading is not None  # noqa: S101 - nothing is bridged without it
        setup = self.geometry.axes[axis]
        try:
            angle, speed = self.geometry.track(self.target, begin + seconds, self.posture, (near, near))[axis]
        except PointingError:
            return None  # it has no place then
        within = min(self.geometry.free[axis].windings(angle), key=lambda wound: abs(wound - near), default=angle)
        place, speed = setup.gearing.counts(within), speed * setup.gearing.counts_per_radian
        return self.leading.ramps[axis].meet(counts, rate, place - speed * seconds, speed)

    def _replaced(self, state: AxisState, axis: int, counts: tuple[float, float]) -> AxisState:
        gearing = self.geometry.axes[axis].gearing
        own = gearing.angle(counts[0]), counts[1] / gearing.counts_per_radian
        return (own, state[1]) if axis == 0 else (state[0], own)


@dataclass(frozen=True)
class LedTravel:
    """One axis along a trajectory, from the moment it sets out; keeps `pointing.slew.Travel`."""

    trajectory: Trajectory
    axis: int
    begin: float
    duration: float

    @property
    def landed(self) -> float:
        """The position in counts at which it joins the target."""
        return self.position(self.duration)

    def position(self, elapsed: float) -> float:
        """The position in counts `elapsed` seconds after the start; on the target from `duration` on."""
        return self.trajectory.at(self.begin + elapsed)[self.axis][0]
