"""One axis at a speed for a time."""

import math
from dataclasses import replace

from clockdrive.control import Steps
from clockdrive.errors import ArgumentError, Refused
from clockdrive.slewing.one_slew import OneSlew, Report
from mounts.drive import ROTATOR
from pointing.plan import Axis, Plan, Timing
from pointing.planner import Planner
from pointing.rotator_plan import turned_to
from pointing.slew import SlewModel

_LONGEST_JOG_S = 3600.0


class Jogging(OneSlew):
    """A slew of one axis that goes no further than it was told."""

    def jog(self, axis: int, rate: float, seconds: float, report: Report) -> Steps[Plan]:
        """Move one axis, by number from 0, at `rate` radians a second for a time: a slew that goes no further.

        Raises
        ------
        Refused, Unreachable
            The speed is impossible, or as for `goto`.
        """
        session = self._session
        session.require_free()
        if not 0.0 < seconds <= _LONGEST_JOG_S:
            raise ArgumentError(
                f"a jog for {seconds:g} s: above 0 up to {_LONGEST_JOG_S:g} s; use `goto` for longer ways"
            )
        session.poll()
        moved, model = _moved(session.planner, session.timing(), axis)
        per_radian = abs(moved.gearing.counts_per_radian)
        speed, most = abs(rate) * per_radian, model.max_rate
        if not 0.0 < speed <= most:
            highest = math.degrees(most / per_radian)
            raise Refused(
                f"a jog at {math.degrees(rate):g}°/s: {moved.name} goes at up to ±{highest:.3f}°/s, and not at 0"
            )
        least = 2.0 * abs(session.drive.capabilities.goes_on_at) if axis == 0 else 0.0
        if speed < least:
            raise Refused(
                f"a jog at {math.degrees(rate):g}°/s: {moved.name} tracks by itself at half of "
                f"{math.degrees(least / per_radian):.5f}°/s, so it goes at no less than that"
            )
        plan = self._jogged(moved.name, axis, rate * seconds, _limited(session.timing(), axis, speed))
        yield from self._slew(plan, "jogging", report, {axis: speed})
        self._require_landed(plan)
        session.now_doing("idle")
        return plan

    def _jogged(self, name: str, axis: int, by: float, timing: Timing) -> Plan:
        """A plan of one axis by an angle, radians, from where it is."""
        planner, start = self._session.planner, self._session.start()
        angles = list(planner.angles(start.counts))
        if axis < len(angles):
            angles[axis] += by
        plan = planner.plan_axes(f"jog of {name}", (angles[0], angles[1]), start, timing)
        if axis < len(angles) or planner.rotator is None or start.rotator is None:
            return plan
        angle = planner.rotator.axis.gearing.angle(start.rotator[0]) + by
        return turned_to(planner, plan, angle, start, timing)


def _moved(planner: Planner, timing: Timing, axis: int) -> tuple[Axis, SlewModel]:
    """An axis by its number from 0, and its law of motion."""
    if axis < len(planner.axes):
        return planner.axes[axis], timing.slew[axis]
    if planner.rotator is None or timing.rotator is None:
        raise Refused("this telescope has no rotator: a table [rotator] in its configuration says that there is one")
    return planner.rotator.axis, timing.rotator


def _limited(timing: Timing, axis: int, rate: float) -> Timing:
    """The same laws, one axis no faster than `rate` counts per second."""
    one, two, turns = *timing.slew, timing.rotator
    if axis == ROTATOR and turns is not None:
        return replace(timing, rotator=turns.limited(rate))
    return replace(timing, slew=(one.limited(rate), two) if axis == 0 else (one, two.limited(rate)))
