"""Where a telescope under control is to point: plans by what its drive has learnt, with all corrections."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from clockdrive.corrections import DISPLACEMENTS, OF_A_TARGET, OFFSETS, displacement
from clockdrive.pursuit import Pursuit
from clockdrive.session.account import Account
from clockdrive.state import Correction
from pointing.mount import Posture
from pointing.offset import OffsetTarget
from pointing.plan import Plan, Start, Timing
from pointing.rotator import Hold
from pointing.rotator_plan import rotator_path, with_rotator
from pointing.targets import Target

_ARCSEC = math.pi / 648_000.0
_STALE_PLAN_S = 0.05  # a plan that took longer to make is made again
_STALE_LED_S = 0.3  # one whose motion begins later by itself may take longer


class Aiming(Account):
    """Plans from where the telescope is, to where the corrections put its targets."""

    def timing(self) -> Timing:
        """How the drive moves, with all that has been learnt of it."""
        one, two, *others = self.drive.slew_models
        rotator = others[0] if others else None
        return Timing(
            (one, two), self.drive.start_latency, self.drive.axes_land_together, self.drive.leading, rotator
        )

    def start(self) -> Start:
        """Where the axes are now."""
        reading = self.synchronised()
        now = self.clock.now()
        ahead = now - reading.time
        one, two, *others = reading.axes
        turned = ((other.counts + other.rate * ahead, other.rate) for other in others)
        counts = one.counts + one.rate * ahead, two.counts + two.rate * ahead
        return Start(now, counts, (one.rate, two.rate), next(turned, None))

    def uncertainty_counts(self) -> tuple[float, float]:
        """By how much the position may be off in each axis, counts.

        Raises
        ------
        Refused
            The position is not synchronised.
        """
        one, two = self.synchronised().axes[:2]
        return one.uncertainty_counts, two.uncertainty_counts

    def plan(self, target: Target, posture: Posture | None = None) -> Plan:
        """Plan a slew from here and now, in a posture or in the best.

        Raises
        ------
        Refused
            The position is not synchronised.
        Unreachable
            Nothing allowed leads there.
        """
        self.start()
        plan = self._planned(target, posture)
        stale = _STALE_PLAN_S if plan.trajectory is None else _STALE_LED_S
        if self.clock.now() - plan.start > stale:  # the first plan of a process builds its tables
            plan = self._planned(target, plan.posture)
        return plan

    def _planned(self, target: Target, posture: Posture | None) -> Plan:
        """Plan without the search for when it will be reachable: the control thread has a telescope to look after."""
        wanted, start, timing = self.corrected(target), self.start(), self.timing()
        plan = self.planner.plan(wanted, start, timing, posture, search=False)
        return with_rotator(self.planner, plan, wanted, start, timing, self.hold)

    def whence(self, target: Target, time: float | None) -> tuple[Target, Start, Timing]:
        """What a plan is made of: from where the axes are now, or at another time from there, at rest.

        Raises
        ------
        Refused
            The position is not synchronised.
        """
        start = self.start()
        still = None if start.rotator is None else (start.rotator[0], 0.0)
        begin = start if time is None else Start(time, start.counts, rotator=still)
        return self.displaced(target), begin, self.timing()

    def displaced(self, target: Target) -> Target:
        """The target with the person's offsets."""
        return self._displaced(target, OFFSETS)

    def corrected(self, target: Target) -> Target:
        """The target with the person's offsets and, if it is the one pursued, what guides and centres it."""
        return self._displaced(target, DISPLACEMENTS if target is self.wanted else OFFSETS)

    def _displaced(self, target: Target, names: tuple[str, ...]) -> Target:
        east, north = displacement(self.store.corrections(), names)
        return OffsetTarget(target, east * _ARCSEC, north * _ARCSEC) if east or north else target

    def corrections(self) -> tuple[Correction, ...]:
        """What a person has corrected and is in force: guide and centre while their target is pursued."""
        idle = OF_A_TARGET if self.pursuit is None else ()
        return tuple(each for each in self.store.corrections() if each.name not in idle)

    @contextmanager
    def holding(self, hold: Hold | None) -> Iterator[None]:
        """Let the rotator hold something from now on; as before, where the block fails."""
        before, self.hold = self.hold, hold
        try:
            yield
        except BaseException:
            self.hold = before
            raise

    def forget_target(self) -> None:
        """Begin anew: what guided and centred the last target is cleared, and said so."""
        cleared = [name for name in OF_A_TARGET if self.store.clear_correction(name)]
        if cleared and self.wanted is not None:
            self.note("corrections", f"{', '.join(cleared)} of {self.wanted.name} cleared by a new goto")
        self.wanted = None

    def pursue(self, target: Target, plan: Plan) -> Pursuit:
        """Follow a target from the end of a slew on."""
        angles = plan.axes[0].angle, plan.axes[1].angle
        if target is not self.wanted:
            self.wanted, self.wanted_since = target, self.clock.now()
        followed = self.corrected(target) if plan.trajectory is None else plan.trajectory.target
        rotator = rotator_path(self.planner, plan, followed)
        leading, planned = self.drive.leading, plan.trajectory
        self.pursuit = Pursuit(self.planner, followed, plan.posture, angles, leading, planned, rotator)
        return self.pursuit
