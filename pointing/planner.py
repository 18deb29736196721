"""Where to send the axes so that the target is there when they arrive.

The arrival and the target are solved together: both axes must end where the target is when the *later* of them lands
(or each when it lands itself, for a drive whose axes resume tracking one by one). Of the ways to point there, two
postures and every winding within the axis limits, the quickest whose whole path is allowed is taken.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.limits import Check, Limits
from pointing.mount import POSTURES, Mount, MountType, Posture
from pointing.path import SlewPath, horizon_check, sun_check
from pointing.plan import Axis, AxisPlan, AxisState, Plan, Start, Timing
from pointing.sky import Sky
from pointing.slew import Travel
from pointing.targets import Target
from pointing.vectors import Vector

_SEARCH_STEP = 240.0  # s; a target stays reachable or not for far longer
_SEARCH_SPAN = 86_400.0
_ROUNDS = 6  # the fixed point contracts by rate / speed, below 1e-2 a round for anything that can be tracked


@dataclass(frozen=True)
class _Way:
    """One way to point at a target: posture, wound axis angles and their rates, radians."""

    posture: Posture
    angles: tuple[float, float]
    rates: tuple[float, float]

    def later(self, seconds: float) -> "_Way":
        """Return the same way a moment later, at constant rates."""
        (a1, a2), (w1, w2) = self.angles, self.rates
        return _Way(self.posture, (a1 + w1 * seconds, a2 + w2 * seconds), self.rates)

    def counts(self, axes: tuple[Axis, Axis], seconds: tuple[float, float]) -> tuple[int, int]:
        """Return the counts nearest to where each axis must be so many seconds later."""
        (a1, a2), (w1, w2) = self.angles, self.rates
        return (
            round(axes[0].gearing.counts(a1 + w1 * seconds[0])),
            round(axes[1].gearing.counts(a2 + w2 * seconds[1])),
        )


def _rates(state: AxisState) -> tuple[float, float]:
    return state[0][1], state[1][1]


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
        self.past_meridian = past_meridian if mount.type is MountType.GERMAN else math.inf

    def plan(self, target: Target, start: Start, timing: Timing) -> Plan:
        """Plan the quickest allowed slew that ends on a target.

        Raises
        ------
        Unreachable
            Nothing allowed leads there now; says what forbids it, by how much, and when it will be reachable.
        """
        begin = start.time + timing.latency
        observed, rate = target.observed_with_rate(self.sky.at(Instant.from_posix(begin)))
        refused: list[Check] = []
        for way in self._ways(observed, rate, start, timing):
            plan = self._solve(target, way, start, timing)
            refused = [check for check in plan.checks if not check.ok]
            if not refused:
                return plan
        reason = "; ".join(check.detail for check in refused) or self._why_no_way(observed)
        raise Unreachable(f"{target.name}: {reason}", self.reachable(target, begin))

    def plan_axes(self, name: str, angles: tuple[float, float], start: Start, timing: Timing) -> Plan:
        """Plan a slew to fixed axis angles, radians, ending at rest: park, home and jog.

        Raises
        ------
        Unreachable
            An angle is outside its limits, or the path is forbidden.
        """
        way = _Way(self.mount.posture(angles[1]), angles, (0.0, 0.0))
        plan = self._assembled(name, way, way.counts(self.axes, (0.0, 0.0)), start, timing)
        refused = [check.detail for check in plan.checks if not check.ok]
        if refused:
            raise Unreachable(f"{name}: {'; '.join(refused)}")
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
        observed, rate = target.observed_with_rate(self.sky.at(Instant.from_posix(time)))
        (a1, w1), (a2, w2) = self.mount.axes_and_rates(observed, rate, posture)
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
        return any(True for _ in self._placements(observed))

    def reachable(self, target: Target, after: float) -> float | None:
        """The first time within a day at which a target stands at an allowed place, to 1 s; None when never.

        A target that is allowed already has nothing to wait for: None as well.
        """
        if self.allowed(target, after):
            return None
        steps = int(_SEARCH_SPAN / _SEARCH_STEP)
        for late in (after + _SEARCH_STEP * k for k in range(1, steps + 1)):
            if self.allowed(target, late):
                early, found = late - _SEARCH_STEP, late
                while found - early > 1.0:
                    middle = (early + found) / 2.0
                    early, found = (early, middle) if self.allowed(target, middle) else (middle, found)
                return found
        return None

    def _placements(self, observed: Vector) -> Iterator[tuple[Posture, tuple[float, float]]]:
        for posture in POSTURES:
            angle1, angle2 = self.mount.axes(observed, posture)
            for wound1 in self.axes[0].windings(angle1):
                if -self.past_meridian <= wound1 <= math.pi + self.past_meridian:
                    for wound2 in self.axes[1].windings(angle2):
                        yield posture, (wound1, wound2)

    def _ways(self, observed: Vector, rate: Vector, start: Start, timing: Timing) -> list["_Way"]:
        """All ways to point at a target, the quickest first; the present posture wins a tie."""
        here = self.angles(start.counts)
        present = self.mount.posture(here[1])

        def cost(way: _Way) -> tuple[float, bool]:
            return self._least_time(way, here, timing), way.posture != present

        return sorted(
            (
                _Way(posture, angles, _rates(self.mount.axes_and_rates(observed, rate, posture)))
                for posture, angles in self._placements(observed)
            ),
            key=cost,
        )

    def _least_time(self, way: "_Way", here: tuple[float, float], timing: Timing) -> float:
        """Return the seconds that the longer of both ways would take at full speed."""
        return max(
            abs((angle - now) * axis.gearing.counts_per_radian) / model.max_rate
            for angle, now, axis, model in zip(way.angles, here, self.axes, timing.slew, strict=True)
        )

    def _solve(self, target: Target, way: "_Way", start: Start, timing: Timing) -> Plan:
        """Solve arrival and target together: travel → where the target is then → travel, until the counts stand."""
        begin = start.time + timing.latency
        known = 0.0  # seconds after `begin` at which the angles and rates of `way` hold
        due = (self._least_time(way, self.angles(start.counts), timing),) * 2
        targets = (0, 0)
        for turn in range(_ROUNDS):
            if turn == 1:  # the arrival is known to milliseconds by now: from here the sky is exact
                known = max(due)
                (a1, w1), (a2, w2) = self.track(target, begin + known, way.posture, way.angles)
                way = _Way(way.posture, (a1, a2), (w1, w2))
            wanted = way.counts(self.axes, (due[0] - known, due[1] - known))
            if wanted == targets and turn > 1:
                break
            targets = wanted
            first, second = (travel.duration for travel in self._travel(targets, start, timing))
            due = (max(first, second),) * 2 if timing.together else (first, second)
        return self._assembled(target.name, way.later(max(due) - known), targets, start, timing)

    def _travel(self, targets: tuple[int, int], start: Start, timing: Timing) -> tuple[Travel, Travel]:
        (one, two), (from1, from2), (rate1, rate2) = timing.slew, start.counts, start.rates
        shift = timing.latency  # the axes go on at their present rates until the motion begins
        return (
            one.travel(from1 + rate1 * shift, targets[0], rate1, 0.0),
            two.travel(from2 + rate2 * shift, targets[1], rate2, 0.0),
        )

    def _assembled(self, name: str, way: "_Way", targets: tuple[int, int], start: Start, timing: Timing) -> Plan:
        """Put together the plan of a way whose angles and rates hold at arrival, with all its checks."""
        travels = self._travel(targets, start, timing)
        arrival = start.time + timing.latency + max(travels[0].duration, travels[1].duration)
        axes = tuple(
            AxisPlan(axis.name, angle, rate, counts, aim, rate * axis.gearing.counts_per_radian, travel)
            for axis, angle, rate, counts, aim, travel in zip(
                self.axes, way.angles, way.rates, start.counts, targets, travels, strict=True
            )
        )
        path = SlewPath(self.mount, (self.axes[0].gearing, self.axes[1].gearing), travels)
        sun = self.sky.at(Instant.from_posix(arrival)).sun()
        speeds = (timing.slew[0].max_rate, timing.slew[1].max_rate)
        return Plan(
            target=name,
            start=start.time,
            arrival=arrival,
            posture=way.posture,
            observed=self.mount.observed(*way.angles),
            axes=(axes[0], axes[1]),
            checks=(
                *self._axis_checks(way.angles),
                *self._speed_checks(axes, speeds),
                *path.checks(self.limits, sun, speeds),
            ),
        )

    def _speed_checks(self, axes: tuple[AxisPlan, ...], speeds: tuple[float, float]) -> Iterator[Check]:
        """Whether the drive can follow the target once it is there: near the pole of axis 1 it may not."""
        for axis, speed, setup in zip(axes, speeds, self.axes, strict=True):
            degrees = abs(setup.gearing.step_deg_float)
            needed, most = abs(axis.rate_counts) * degrees, speed * degrees
            ok = needed <= most
            said = f"{axis.name} tracks at {needed:.5f}°/s, the drive reaches {most:.3f}°/s"
            yield Check(f"{axis.name} speed", ok=ok, detail=said)

    def _axis_checks(self, angles: tuple[float, float]) -> tuple[Check, ...]:
        checks = tuple(
            _within(f"{axis.name} soft limit", axis.name, angle, axis.minimum, axis.maximum)
            for axis, angle in zip(self.axes, angles, strict=True)
        )
        if math.isinf(self.past_meridian):
            return checks
        low, high = -self.past_meridian, math.pi + self.past_meridian
        return *checks, _within("hour-angle window", "mechanical hour angle", angles[0], low, high)

    def _why_no_way(self, observed: Vector) -> str:
        """Of all ways to point at a place, the one that misses the axis limits by least, and by how much."""
        refusals: list[tuple[float, str]] = []
        for posture in POSTURES:
            angles = self.mount.axes(observed, posture)
            near = (
                _nearest(angles[0], (self.axes[0].minimum + self.axes[0].maximum) / 2.0),
                _nearest(angles[1], (self.axes[1].minimum + self.axes[1].maximum) / 2.0),
            )
            failed = [check for check in self._axis_checks(near) if not check.ok]
            excess = sum(
                max(axis.minimum - angle, angle - axis.maximum, 0.0)
                for axis, angle in zip(self.axes, near, strict=True)
            )
            refusals.append((excess, "; ".join(check.detail for check in failed)))
        return min(refusals)[1]


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
