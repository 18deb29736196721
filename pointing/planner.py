"""Where to send the axes so that the target is there when they arrive.

The arrival and the target are solved together: both axes must end where the target is when the *later* of them lands
(or each when it lands itself, for a drive whose axes resume tracking one by one). Of the ways to point there, two
postures and every winding within the axis limits, the one that arrives first by an allowed path is taken.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from pointing.errors import PointingError, Unreachable
from pointing.instant import Instant
from pointing.limits import Check, Limits
from pointing.mount import POSTURES, Mount, MountType, Posture
from pointing.path import Leg, SlewPath, horizon_check, sun_check
from pointing.plan import Axis, AxisPlan, AxisState, Plan, Start, Timing
from pointing.sky import Sky, SkyFrame
from pointing.slew import Travel
from pointing.targets import Target
from pointing.vectors import Vector

_SEARCH_STEP = 120.0  # s; what is allowed for less is of no use
_WAY_STEP = 600.0  # s; a way that is blocked costs more to look at, and comes free as slowly as the Sun moves
_SEARCH_SPAN = 86_400.0
_ROUNDS = 60  # the fixed point contracts by rate / speed, below 1e-2 a round unless the pole of axis 1 is near
_FLICKER = 6  # rounds after which a target that goes on changing by one count, tick by tick, stands
_STRAIGHT = 0.05  # s; for so long a target's rates may be taken as constant
_UNHURRIED = 60.0  # s; what starting and landing may add to a slew at full speed


@dataclass(frozen=True)
class _Way:
    """One way to point at a target: posture, wound axis angles and their rates, radians, `known` s after begin.

    `sun` is the Sun's direction then.
    """

    posture: Posture
    angles: tuple[float, float]
    rates: tuple[float, float]
    sun: Vector
    known: float = 0.0
    tracked: float = 0.0  # when the sky was last asked

    def later(self, due: float) -> "_Way":
        """Return the same way `due` seconds after begin, at constant rates."""
        (a1, a2), (w1, w2) = self.angles, self.rates
        seconds = due - self.known
        return _Way(self.posture, (a1 + w1 * seconds, a2 + w2 * seconds), self.rates, self.sun, due, self.tracked)


class Planner:
    """Plans slews and gives tracking paths for one telescope.

    Parameters
    ----------
    sky : Sky
        The sky over the site.
    mount : Mount
        The mount and its misalignment.
    axes : tuple of Axis
        Gearing and limits.
    limits : Limits
        Horizon and Sun.
    past_meridian : float
        German mounts: how far past the meridian the mechanical hour angle may go, radians.
    """

    def __init__(
        self, sky: Sky, mount: Mount, axes: tuple[Axis, Axis], limits: Limits, past_meridian: float = math.inf
    ) -> None:
        self.sky = sky
        self.mount = mount
        self.axes = axes
        self.limits = limits
        if math.isnan(past_meridian):
            raise PointingError("a German window of nan past the meridian: give an angle, or infinity for none")
        self.past_meridian = past_meridian if mount.type is MountType.GERMAN else math.inf
        low, high = -self.past_meridian, math.pi + self.past_meridian
        first = replace(axes[0], minimum=max(axes[0].minimum, low), maximum=min(axes[0].maximum, high))
        self._free = (first, axes[1])

    def plan(self, target: Target, start: Start, timing: Timing) -> Plan:
        """Plan the earliest allowed arrival on a target.

        Raises
        ------
        Unreachable
            Nothing allowed leads there now; says what forbids it, by how much, and when it will be reachable.
        """
        best, refused = self._best(target, start, timing)
        if best is not None:
            return best
        begin = start.time + timing.latency
        checks = self._no_placement(target, begin) if refused is None else refused.checks
        reason = "; ".join(check.detail for check in checks if not check.ok)
        raise Unreachable(f"{target.name}: {reason}", self._free_from(target, start, timing), checks)

    def plan_axes(self, name: str, angles: tuple[float, float], start: Start, timing: Timing) -> Plan:
        """Plan a slew to fixed axis angles, radians, ending at rest: park, home and jog.

        Raises
        ------
        PointingError
            An angle or a time is no number.
        Unreachable
            An angle is outside its limits, or the path is forbidden; one that begins in a forbidden zone may end in
            it, less deep.
        """
        if not all(map(math.isfinite, angles)):
            raise PointingError(f"{name}: axis angles of {angles} rad: give finite numbers")
        sun = self._sun(self.sky.at(Instant.from_posix(start.time + timing.latency)))
        way = _Way(self.mount.posture(angles[1]), angles, (0.0, 0.0), sun)
        targets = self._counts((way, way))
        travels = self._travel(targets, start, timing)
        arrival = Instant.from_posix(start.time + timing.latency + _longer(travels))
        way = replace(way, sun=self._sun(self.sky.at(arrival)))
        plan = self._assembled(name, way, sun, targets, travels, start, timing, ends_clear=False)
        refused = [check.detail for check in plan.checks if not check.ok]
        if refused:
            raise Unreachable(f"{name}: {'; '.join(refused)}", checks=plan.checks)
        return plan

    def track(self, target: Target, time: float, posture: Posture, near: tuple[float, float]) -> AxisState:
        """Where the axes must be for a target, and how fast they move.

        Parameters
        ----------
        target : Target
            What is tracked.
        time : float
            POSIX seconds.
        posture : Posture
            The posture to keep.
        near : tuple of float
            Axis angles, radians, to which the windings are the nearest.

        Returns
        -------
        tuple
            ((angle, rate) of axis 1, (angle, rate) of axis 2), radians and radians per second.
        """
        return self._state(target, self.sky.at(Instant.from_posix(time)), posture, near)

    def _state(self, target: Target, frame: SkyFrame, posture: Posture, near: tuple[float, float]) -> AxisState:
        (a1, w1), (a2, w2) = self.mount.axes_and_rates(*target.observed_with_rate(frame), posture)
        return (_nearest(a1, near[0]), w1), (_nearest(a2, near[1]), w2)

    def observed(self, counts: tuple[float, float]) -> Vector:
        """The observed direction at which the axes point, horizon frame."""
        return self.mount.observed(self.axes[0].gearing.angle(counts[0]), self.axes[1].gearing.angle(counts[1]))

    def angles(self, counts: tuple[float, float]) -> tuple[float, float]:
        """Axis angles at counts, radians."""
        return self.axes[0].gearing.angle(counts[0]), self.axes[1].gearing.angle(counts[1])

    def standing(self, angles: tuple[float, float], time: float) -> tuple[Check, ...]:
        """Every check at fixed axis angles and a time: what the session asks each cycle."""
        observed = self.mount.observed(*angles)
        frame = self.sky.at(Instant.from_posix(time))
        return (
            *self._axis_checks(angles),
            horizon_check(self.limits, observed, "now"),
            sun_check(self.limits, frame.sun(), observed, "now"),
        )

    def allowed(self, target: Target, time: float) -> bool:
        """Whether a target stands at an allowed place at a time, whatever the way there."""
        frame = self.sky.at(Instant.from_posix(time))
        observed, _ = target.observed_with_rate(frame)
        if self.limits.horizon.margin(observed) < 0 or self.limits.sun_margin(observed, frame.sun()) < 0:
            return False
        return any(
            True for posture in POSTURES for _ in self._windings(self.mount.axes(observed, posture), (0.0, 0.0))
        )

    def reachable(self, target: Target, after: float) -> float | None:
        """The first time within a day at which a target stands at an allowed place, to 1 s; None when never.

        A target that is allowed already has nothing to wait for: None as well.
        """
        return (
            None
            if self.allowed(target, after)
            else self._first(lambda t: self.allowed(target, t), after, _SEARCH_STEP)
        )

    def _free_from(self, target: Target, start: Start, timing: Timing) -> float | None:
        """When a refused target stands at an allowed place; if it does already, when the way from here is free."""
        begin = start.time + timing.latency
        if not self.allowed(target, begin):
            return self.reachable(target, begin)

        def goes(time: float) -> bool:
            return self._best(target, Start(time, start.counts), timing)[0] is not None

        return self._first(goes, start.time, _WAY_STEP)

    def _first(self, allowed: Callable[[float], bool], after: float, step: float) -> float | None:
        """Return the first time within a day at which something is allowed that is not now, to 1 s."""
        for k in range(1, int(_SEARCH_SPAN / step) + 1):
            found = after + step * k
            if allowed(found):
                early = found - step
                while found - early > 1.0:
                    middle = (early + found) / 2.0
                    early, found = (early, middle) if allowed(middle) else (middle, found)
                return found
        return None

    def _best(self, target: Target, start: Start, timing: Timing) -> tuple[Plan | None, Plan | None]:
        """Return the plan that arrives first, or none and the refused plan of what seemed the quickest way."""
        frame = self.sky.at(Instant.from_posix(start.time + timing.latency))
        best = refused = None
        for soonest, way in self._ways(*target.observed_with_rate(frame), self._sun(frame), start, timing):
            if best is not None and soonest >= best.eta - timing.latency:
                break
            plan = self._solve(target, way, soonest, start, timing)
            if not all(check.ok for check in plan.checks):
                refused = refused or plan
            elif best is None or plan.arrival < best.arrival:
                best = plan
        return best, refused

    def _ways(
        self, observed: Vector, rate: Vector, sun: Vector, start: Start, timing: Timing
    ) -> list[tuple[float, _Way]]:
        """All ways to point at a target with the least seconds each takes, the quickest first.

        The present posture wins a tie. A way may begin a little outside the limits, if the target is about to enter.
        """
        here = self.angles(start.counts)
        present = self.mount.posture(here[1])
        speeds = self._speeds(start, timing)
        longest = _UNHURRIED + max(
            (axis.maximum - axis.minimum) / speed for axis, speed in zip(self.axes, speeds, strict=True)
        )
        found = []
        for posture in POSTURES:
            (angle1, rate1), (angle2, rate2) = self.mount.axes_and_rates(observed, rate, posture)
            for angles in self._windings((angle1, angle2), (abs(rate1) * longest, abs(rate2) * longest)):
                way = _Way(posture, angles, (rate1, rate2), sun)
                # Were axes and target as fast as can be, and towards each other, from the first moment on:
                soonest = max(
                    abs(angles[0] - here[0]) / (speeds[0] + abs(rate1)),
                    abs(angles[1] - here[1]) / (speeds[1] + abs(rate2)),
                )
                found.append((soonest, way))
        return sorted(found, key=lambda each: (each[0], each[1].posture != present))

    def _windings(self, angles: tuple[float, float], slack: tuple[float, float]) -> Iterator[tuple[float, float]]:
        for wound1 in self._free[0].windings(angles[0], slack[0]):
            for wound2 in self._free[1].windings(angles[1], slack[1]):
                yield wound1, wound2

    def _speeds(self, start: Start, timing: Timing) -> tuple[float, float]:
        """Largest speed of each axis during the slew, radians per second."""
        (one, two), (rate1, rate2) = timing.slew, start.rates
        return (
            max(one.max_rate, abs(rate1)) / abs(self.axes[0].gearing.counts_per_radian),
            max(two.max_rate, abs(rate2)) / abs(self.axes[1].gearing.counts_per_radian),
        )

    def _solve(self, target: Target, way: _Way, soonest: float, start: Start, timing: Timing) -> Plan:
        """Solve arrival and target together: travel → where the target is then → travel, until the counts stand."""
        begin, sun = start.time + timing.latency, way.sun
        first = second = way.later(soonest)
        targets = self._counts((first, second))
        settled = False
        for turn in range(_ROUNDS):
            travels = self._travel(targets, start, timing)
            due1, due2 = travels[0].duration, travels[1].duration
            if timing.together:
                due1 = due2 = min(max(due1, due2), _SEARCH_SPAN)
            first = self._at(target, begin, due1, first)
            second = first if due1 == due2 else self._at(target, begin, due2, second)
            wanted = self._counts((first, second))
            change = max(abs(wanted[0] - targets[0]), abs(wanted[1] - targets[1]))
            settled = change <= (turn > _FLICKER)
            if settled:
                break
            targets = wanted
        later = first if due1 >= due2 else second
        plan = self._assembled(target.name, later, sun, targets, travels, start, timing)
        if settled:
            return plan
        detail = f"the target runs away nearly as fast as the drive slews, no arrival was found in {_ROUNDS} rounds"
        return replace(plan, checks=(*plan.checks, Check("arrival", ok=False, detail=detail)))

    def _at(self, target: Target, begin: float, due: float, way: _Way) -> _Way:
        """Return the way `due` seconds after begin; over more than a moment the rates do not hold, the sky does."""
        if abs(due - way.tracked) <= _STRAIGHT:
            return way.later(due)
        frame = self.sky.at(Instant.from_posix(begin + due))
        (a1, w1), (a2, w2) = self._state(target, frame, way.posture, way.angles)
        return _Way(way.posture, (a1, a2), (w1, w2), self._sun(frame), due, due)

    def _counts(self, ways: tuple[_Way, _Way]) -> tuple[int, int]:
        """Return the counts nearest to axis 1 of the first way and axis 2 of the second."""
        one, two = self.axes
        return round(one.gearing.counts(ways[0].angles[0])), round(two.gearing.counts(ways[1].angles[1]))

    def _sun(self, frame: SkyFrame) -> Vector:
        """Direction of the Sun where it matters, else the zenith."""
        return frame.sun() if self.limits.sun_avoidance else (0.0, 0.0, 1.0)

    def _travel(self, targets: tuple[int, int], start: Start, timing: Timing) -> tuple[Travel, Travel]:
        (one, two), (from1, from2), (rate1, rate2) = timing.slew, start.counts, start.rates
        shift = timing.latency  # the axes go on at their present rates until the motion begins
        return (
            one.travel(from1 + rate1 * shift, targets[0], rate1, 0.0),
            two.travel(from2 + rate2 * shift, targets[1], rate2, 0.0),
        )

    def _assembled(
        self,
        name: str,
        way: _Way,
        sun: Vector,
        targets: tuple[int, int],
        travels: tuple[Travel, Travel],
        start: Start,
        timing: Timing,
        *,
        ends_clear: bool = True,
    ) -> Plan:
        """Put together the plan of a way as it is at arrival, with all its checks; `sun` is that of the beginning."""
        axes, legs = [], []
        speeds = self._speeds(start, timing)
        for i, axis in enumerate(self.axes):
            rate_counts = way.rates[i] * axis.gearing.counts_per_radian
            axes.append(
                AxisPlan(axis.name, way.angles[i], way.rates[i], start.counts[i], targets[i], rate_counts, travels[i])
            )
            start_rate = start.rates[i] / axis.gearing.counts_per_radian
            resumed = 0.0 if timing.together else way.rates[i]
            legs.append(Leg(axis.gearing, travels[i], speeds[i], start_rate, resumed))
        path = SlewPath(self.mount, (legs[0], legs[1]), (sun, way.sun))
        return Plan(
            target=name,
            start=start.time,
            arrival=start.time + timing.latency + path.duration,
            posture=way.posture,
            observed=self.mount.observed(*way.angles),
            axes=(axes[0], axes[1]),
            checks=(
                *self._axis_checks(way.angles),
                *self._speed_checks((axes[0], axes[1]), timing),
                *path.checks(self.limits, ends_clear=ends_clear),
            ),
        )

    def _speed_checks(self, axes: tuple[AxisPlan, AxisPlan], timing: Timing) -> Iterator[Check]:
        """Whether the drive can follow the target once it is there: near the pole of axis 1 it may not."""
        for axis, model, setup in zip(axes, timing.slew, self.axes, strict=True):
            degrees = setup.gearing.step_deg_float
            needed, most = abs(axis.rate_counts) * degrees, model.max_rate * degrees
            said = f"{axis.name} tracks at {needed:.5f}°/s, the drive reaches {most:.3f}°/s"
            yield Check(f"{axis.name} speed", ok=needed <= most, detail=said)

    def _axis_checks(self, angles: tuple[float, float]) -> tuple[Check, ...]:
        checks = tuple(
            _within(f"{axis.name} soft limit", axis.name, angle, axis.minimum, axis.maximum)
            for axis, angle in zip(self.axes, angles, strict=True)
        )
        if math.isinf(self.past_meridian):
            return checks
        low, high = -self.past_meridian, math.pi + self.past_meridian
        return *checks, _within("hour-angle window", "mechanical hour angle", angles[0], low, high)

    def _no_placement(self, target: Target, time: float) -> tuple[Check, ...]:
        """What forbids a place that no posture and winding reaches: the sky, and the limits missed by least."""
        frame = self.sky.at(Instant.from_posix(time))
        observed = target.observed(frame)
        misses = []
        for posture in POSTURES:
            angle1, angle2 = (
                _nearest(angle, (axis.minimum + axis.maximum) / 2.0)
                for angle, axis in zip(self.mount.axes(observed, posture), self._free, strict=True)
            )
            excess = sum(
                max(axis.minimum - angle, angle - axis.maximum, 0.0)
                for axis, angle in zip(self._free, (angle1, angle2), strict=True)
            )
            misses.append((excess, (angle1, angle2)))
        return (
            horizon_check(self.limits, observed, "now"),
            sun_check(self.limits, self._sun(frame), observed, "now"),
            *self._axis_checks(min(misses)[1]),
        )


def _longer(travels: tuple[Travel, Travel]) -> float:
    return max(travels[0].duration, travels[1].duration)


def _within(name: str, what: str, angle: float, low: float, high: float) -> Check:
    degrees, lowest, highest = math.degrees(angle), math.degrees(low), math.degrees(high)
    allowed = f"{lowest:.2f}° to {highest:.2f}°"
    if low <= angle <= high:
        return Check(name, ok=True, detail=f"{what} at {degrees:.3f}°, allowed {allowed}")
    beyond = max(lowest - degrees, degrees - highest)
    return Check(name, ok=False, detail=f"{what} at {degrees:.3f}° is {beyond:.3f}° outside {allowed}")


def _nearest(angle: float, near: float) -> float:
    """The winding of `angle` nearest to `near`."""
    return angle + math.tau * round((near - angle) / math.tau)
