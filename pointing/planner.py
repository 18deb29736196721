"""Where to send the axes so that the target is there when they arrive.

The arrival and the target are solved together: both axes must end where the target is when the *later* of them lands
(or each when it lands itself, for a drive whose axes resume tracking one by one). Of the ways to point there, two
postures and every winding within the axis limits, the one that arrives first by an allowed path is taken.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace

from pointing.errors import PointingError, TargetError, Unreachable
from pointing.geometry import Geometry
from pointing.instant import Instant
from pointing.led_plan import led_plan
from pointing.limits import Check
from pointing.mount import POSTURES, Posture
from pointing.pass_plan import planned_pass
from pointing.path import Leg, SlewPath
from pointing.plan import AxisPlan, Plan, Start, Timing
from pointing.remedy import OF_A_WAY, remedy
from pointing.short_moves import held, too_fast
from pointing.slew import Travel, arriving, travelled
from pointing.targets import Target
from pointing.trajectory import LED_ABOVE
from pointing.vectors import Vector
from pointing.visibility import passes
from pointing.way_round import only_the_sky_bars, way_round

_KEPT_S = 7200.0  # for which a way should keep its target
_KEPT_STEP_S = 900.0
_KEPT_STEP = math.radians(5.0)  # in which a fast target must be looked at again
_ALIKE_S = 2.0  # by which two ways may differ and keep their target equally long
_WAY_STEP = 600.0  # s; a way that is blocked costs more to look at, and comes free as slowly as the Sun moves
_SEARCH_SPAN = 86_400.0
_ROUNDS = 60  # the fixed point contracts by rate / speed, below 1e-2 a round unless the pole of axis 1 is near
_FLICKER = 6  # rounds after which a target that goes on changing by one count, tick by tick, stands
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


class Planner(Geometry):
    """Plans slews for one telescope; its parameters are those of `Geometry`."""

    def plan(
        self,
        target: Target,
        start: Start,
        timing: Timing,
        posture: Posture | None = None,
        *,
        search: bool = True,
    ) -> Plan:
        """Plan the earliest allowed arrival on a target, where it can be tracked for longest, in a posture or in any.

        Of ways that differ in how long they let the target be tracked, up to two hours, the longest is taken; of
        those that do not, the one that arrives first.

        Raises
        ------
        Unreachable
            Nothing allowed leads there now; says what forbids it, by how much, and, where that is searched for,
            when it will be reachable.
        """
        best, refused = self.straight(target, start, timing, posture)
        if best is None and refused is not None and _is_barred(refused):
            best = way_round(self, target, start, timing, refused, posture)
        if best is not None:
            return best
        begin = start.time + timing.latency
        postures = POSTURES if posture is None else (posture,)
        checks = self.no_placement(target, begin, postures) if refused is None else refused.checks
        reason = "; ".join(check.detail for check in checks if not check.ok)
        search &= not any(map(too_fast, checks))
        free = self._free_from(target, start, timing, posture) if search else None
        advice = remedy(checks, free, searched=search)
        raise Unreachable(f"{target.name}: {reason}; {advice}", free, checks)

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
        sun = self.sun(self.sky.at(Instant.from_posix(start.time + timing.latency)))
        way = _Way(self.mount.posture(angles[1]), angles, (0.0, 0.0), sun)
        targets = self._counts((way, way))
        travels = self._travel(targets, (0.0, 0.0), start, timing)
        arrival = Instant.from_posix(start.time + timing.latency + _longer(travels))
        way = replace(way, sun=self.sun(self.sky.at(arrival)))
        plan = self._assembled(name, way, sun, targets, travels, start, timing, ends_clear=False)
        refused = [check.detail for check in plan.checks if not check.ok]
        if refused:
            raise Unreachable(f"{name}: {'; '.join(refused)}; {OF_A_WAY}", checks=plan.checks)
        return plan

    def reachable(self, target: Target, after: float) -> float | None:
        """The first time within a day at which a target stands at an allowed place, to 0.1 s; None when never.

        A target that is allowed already has nothing to wait for: None as well.
        """
        if self.allowed(target, after):
            return None
        with suppress(TargetError):  # nobody knows the target's place any further, as after the end of a table
            found = next(passes(self, target, after, after + _SEARCH_SPAN), None)
            return None if found is None else found.rise.time
        return None

    def _free_from(self, target: Target, start: Start, timing: Timing, posture: Posture | None) -> float | None:
        """When a refused target stands at an allowed place; if it does already, when the way from here is free."""
        begin = start.time + timing.latency
        if posture is None and not self.allowed(target, begin):
            return self.reachable(target, begin)

        def goes(time: float) -> bool:
            then = Start(time, start.counts)  # whether there is any way; which is the best of them is dear to know
            ways = self._ways_to(target, then, timing, posture)
            return any(_is_free(self._solved(target, way, soonest, then, timing)) for soonest, way in ways)

        return self._first(goes, start.time)

    def _first(self, goes: Callable[[float], bool], after: float) -> float | None:
        """Return the first time within a day at which there is a way that there is not now, to 1 s."""
        with suppress(TargetError):  # as in `reachable`
            for k in range(1, int(_SEARCH_SPAN / _WAY_STEP) + 1):
                found = after + _WAY_STEP * k
                if goes(found):
                    early = found - _WAY_STEP
                    while found - early > 1.0:
                        middle = (early + found) / 2.0
                        early, found = (early, middle) if goes(middle) else (middle, found)
                    return found
        return None

    def straight(
        self, target: Target, start: Start, timing: Timing, posture: Posture | None = None
    ) -> tuple[Plan | None, Plan | None]:
        """Return the best plan in one leg, or none and the refused plan of what seemed the quickest way."""
        best = refused = None
        kept = 0.0
        ways = self._ways_to(target, start, timing, posture)
        for soonest, way in ways:
            if best is not None and kept >= _KEPT_S and soonest >= best.eta - timing.latency:
                break
            plan = self._solved(target, way, soonest, start, timing)
            if not _is_free(plan):
                refused = refused or plan
                continue
            keeps = self._kept(target, plan) if len(ways) > 1 else _KEPT_S
            if best is None or keeps > kept + _ALIKE_S or (keeps > kept - _ALIKE_S and plan.arrival < best.arrival):
                best, kept = plan, keeps
        return best, refused

    def _kept(self, target: Target, plan: Plan) -> float:
        """For how long a target can be tracked from the arrival on, seconds, up to two hours."""
        if plan.trajectory is not None:
            return min(planned_pass(plan.trajectory, plan.arrival, _angles(plan)).followed_s, _KEPT_S)
        near, seconds = _angles(plan), 0.0
        fastest = max(abs(axis.rate) for axis in plan.axes)
        step = min(_KEPT_STEP_S, _KEPT_STEP / fastest) if fastest else _KEPT_STEP_S
        with suppress(PointingError):  # it has no place any further, or one where the pointing origin does not come
            while seconds < _KEPT_S:
                state = self.track(target, plan.arrival + seconds + step, plan.posture, near)
                near = state[0][0], state[1][0]
                if not all(axis.minimum <= here <= axis.maximum for axis, here in zip(self.free, near, strict=True)):
                    break
                seconds += step
        return seconds

    def _ways_to(
        self, target: Target, start: Start, timing: Timing, posture: Posture | None
    ) -> list[tuple[float, _Way]]:
        """All ways to a target as it is when the motion begins; see `_ways`."""
        frame = self.sky.at(Instant.from_posix(start.time + timing.latency))
        postures = POSTURES if posture is None else (posture,)
        return self._ways(*target.observed_with_rate(frame), self.sun(frame), start, timing, postures)

    def _ways(
        self,
        observed: Vector,
        rate: Vector,
        sun: Vector,
        start: Start,
        timing: Timing,
        postures: tuple[Posture, ...],
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
        for posture in postures:
            (angle1, rate1), (angle2, rate2) = self.mount.axes_and_rates(observed, rate, posture)
            for angles in self.windings((angle1, angle2), (abs(rate1) * longest, abs(rate2) * longest)):
                way = _Way(posture, angles, (rate1, rate2), sun)
                # Were axes and target as fast as can be, and towards each other, from the first moment on:
                soonest = max(
                    abs(angles[0] - here[0]) / (speeds[0] + abs(rate1)),
                    abs(angles[1] - here[1]) / (speeds[1] + abs(rate2)),
                )
                found.append((soonest, way))
        return sorted(found, key=lambda each: (each[0], each[1].posture != present))

    def _speeds(self, start: Start, timing: Timing) -> tuple[float, float]:
        """Largest speed of each axis during the slew, radians per second."""
        (one, two), (rate1, rate2) = timing.slew, start.rates
        return (
            max(one.max_rate, abs(rate1)) / abs(self.axes[0].gearing.counts_per_radian),
            max(two.max_rate, abs(rate2)) / abs(self.axes[1].gearing.counts_per_radian),
        )

    def _solved(self, target: Target, way: _Way, soonest: float, start: Start, timing: Timing) -> Plan:
        """Meet the target at rest, or with its own velocity where it is fast and the drive can be led."""
        if timing.leading is None:
            return self._solve(target, way, soonest, start, timing)
        if max(map(abs, way.rates)) < LED_ABOVE:
            plan = self._solve(target, way, soonest, start, timing)
            if max(abs(axis.rate) for axis in plan.axes) < LED_ABOVE:
                return plan
        return led_plan(self, target, way.posture, way.angles, way.sun, start, timing.leading)

    def _solve(self, target: Target, way: _Way, soonest: float, start: Start, timing: Timing) -> Plan:
        """Solve arrival and target together: travel → where the target is then → travel, until the counts stand."""
        begin, sun = start.time + timing.latency, way.sun
        first = second = way.later(soonest)
        targets = self._counts((first, second))
        settled = False
        for turn in range(_ROUNDS):
            travels = self._travel(
                targets, (first.rates[0], second.rates[1]), start, timing, (first.known, second.known)
            )
            due1, due2 = travels[0].duration, travels[1].duration
            if timing.together:
                due1 = due2 = min(max(due1, due2), _SEARCH_SPAN)
            first = self._at(target, begin, due1, first)
            second = first if due1 == due2 else self._at(target, begin, due2, second)
            wanted = self._counts((first, second))
            settled = all(
                abs(one - other) <= (axis.flicker if turn > _FLICKER else axis.settled)
                for axis, one, other in zip(self.axes, wanted, targets, strict=True)
            )
            if settled:
                break
            targets = wanted
        later = first if due1 >= due2 else second
        landing = first.rates[0], second.rates[1]
        plan = self._assembled(target.name, later, sun, targets, travels, start, timing, landing=landing)
        if settled:
            return plan
        detail = f"the target runs away nearly as fast as the drive slews, no arrival was found in {_ROUNDS} rounds"
        return replace(plan, checks=(*plan.checks, Check("arrival", ok=False, detail=detail)))

    def _at(self, target: Target, begin: float, due: float, way: _Way) -> _Way:
        """Return the way `due` seconds after begin; over more than a moment the rates do not hold, the sky does."""
        if abs(due - way.tracked) <= min(axis.straight_s for axis in self.axes):
            return way.later(due)
        frame = self.sky.at(Instant.from_posix(begin + due))
        (a1, w1), (a2, w2) = self.state(target, frame, way.posture, way.angles)
        return _Way(way.posture, (a1, a2), (w1, w2), self.sun(frame), due, due)

    def _counts(self, ways: tuple[_Way, _Way]) -> tuple[float, float]:
        """Return the counts nearest to axis 1 of the first way and axis 2 of the second."""
        one, two = self.axes
        return one.nearest(ways[0].angles[0]), two.nearest(ways[1].angles[1])

    def _travel(
        self,
        targets: tuple[float, float],
        rates: tuple[float, float],
        start: Start,
        timing: Timing,
        dues: tuple[float, float] | None = None,
    ) -> tuple[Travel, Travel]:
        """Travel of both axes, to end with the target's `rates`, radians per second, where the drive can.

        `dues`: when it is at `targets`, seconds after the motion began, for a drive that meets what moves.
        """
        shift = timing.latency  # the axes go on at their present rates until the motion begins
        one, two = (
            travelled(model, here + before * shift, before, target, rate * axis.gearing.counts_per_radian, due)
            for model, here, before, target, rate, axis, due in zip(
                timing.slew, start.counts, start.rates, targets, rates, self.axes, dues or (None, None), strict=True
            )
        )
        return one, two

    def _together(
        self,
        targets: tuple[float, float],
        rates: tuple[float, float],
        travels: tuple[Travel, Travel],
        start: Start,
        timing: Timing,
    ) -> tuple[Travel, Travel]:
        """Travel of both axes that ends when the later one lands, of a drive that can begin one later."""
        due, shift = _longer(travels), timing.latency
        one, two = (
            arriving(model, here + before * shift, before, target, rate * axis.gearing.counts_per_radian, due)
            for model, here, before, target, rate, axis in zip(
                timing.slew, start.counts, start.rates, targets, rates, self.axes, strict=True
            )
        )
        return one, two

    def _assembled(
        self,
        name: str,
        way: _Way,
        sun: Vector,
        targets: tuple[float, float],
        travels: tuple[Travel, Travel],
        start: Start,
        timing: Timing,
        *,
        landing: tuple[float, float] | None = None,
        ends_clear: bool = True,
    ) -> Plan:
        """Put together the plan of a way as it is at arrival, with all its checks.

        `sun` is that of the beginning; `landing`, radians per second, the target's rates as each axis lands, where
        not both land at the arrival.
        """
        axes, legs = [], []
        landing = way.rates if landing is None else landing
        speeds = self._speeds(start, timing)
        if timing.together:
            travels = self._together(targets, way.rates, travels, start, timing)
        for i, axis in enumerate(self.axes):
            rate_counts = landing[i] * axis.gearing.counts_per_radian
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
                *self.axis_checks(way.angles),
                *self._speed_checks((axes[0], axes[1]), timing),
                *path.checks(self.limits, ends_clear=ends_clear),
            ),
        )

    def _speed_checks(self, axes: tuple[AxisPlan, AxisPlan], timing: Timing) -> Iterator[Check]:
        """Whether the drive can follow the target once it is there: near the pole of axis 1 it may not."""
        for axis, model, setup in zip(axes, timing.slew, self.axes, strict=True):
            degrees = setup.gearing.step_deg_float
            needed, most = abs(axis.rate_counts) * degrees, min(model.max_rate * degrees, math.degrees(setup.fastest))
            said = f"{axis.name} tracks at {needed:.5f}°/s, the drive reaches {most:.3f}°/s"
            yield Check(f"{axis.name} speed", ok=needed <= most, detail=said)
            if (check := held(setup, axis.rate)) is not None:
                yield check


def _is_free(plan: Plan) -> bool:
    return all(check.ok for check in plan.checks)


def _is_barred(plan: Plan) -> bool:
    """Whether another way may lead there, of a plan that can wait."""
    return plan.trajectory is None and only_the_sky_bars(plan.checks)


def _angles(plan: Plan) -> tuple[float, float]:
    return plan.axes[0].angle, plan.axes[1].angle


def _longer(travels: tuple[Travel, Travel]) -> float:
    return max(travels[0].duration, travels[1].duration)
