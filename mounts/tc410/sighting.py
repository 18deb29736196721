"""What a look at a TC410 tells: positions, motion, whether they can be trusted, and what a slew teaches."""

import math

from mounts.drive import AxisReading, Reading
from mounts.errors import DriveRefused
from mounts.tc410.carried import Carried, by_law, by_velocity
from mounts.tc410.landing import Landing
from mounts.tc410.look import Look
from mounts.tc410.parts import AXES, REMOTE, SLEW, TRACK
from mounts.tc410.positioning import Positioning
from mounts.tc410.registers import CENTRE
from mounts.tc410.slew_watch import TELLING_RATE, TIMEOUT_S, SlewWatch
from mounts.tc410.tracking import TrackedAxis
from mounts.tc410.trust import DECIDED

_STANDBY_STEPS = 2.0  # full steps by which a motor may settle when its power comes back
_UNSEEN_S = 2.5  # without a look, in which the motors may have lost their power and have it back


class Sighting(Positioning):
    """Looks, learns from what it sees, and stops what must not go on."""

    def read(self, time: float) -> Reading:
        """Positions, flags and alarms, all as of one moment; the position is lost when the boot cookie is.

        Raises
        ------
        DriveRefused
            A slew goes on long after it should have ended; it was stopped.
        """
        if self._direct.fate:
            fate = self._direct.fate
            self.stop(time)
            raise DriveRefused(f"direct speed control was ended: {fate}")
        if not self._control_known:
            self._read_control()
        if self._hands.barred and self._hands.let_go():
            self._write_control(self._control | self._hands.barred)
            self._hands.given_back()
        seen = self._seen_with_encoders(self._look())
        self._see_slew(seen)
        if self._slew is None and not self._borrowed and seen.stands:  # else what moves would go faster at once
            self._restore_speed()
        reading = Reading(
            time=seen.state.time,
            axes=tuple(self._axis_reading(i, seen) for i in (0, 1)),
            motion=seen.motion,
            limits=seen.limits,
            alarms=seen.alarms,
            powered=seen.powered,
            tracking=bool(self._control & TRACK),
            unsynchronised=self._trust.unsynchronised,
        )
        self._last = reading
        if self._slew is not None and time > self._slew.due + TIMEOUT_S:
            late = time - self._slew.due
            self.stop(time)
            raise DriveRefused(
                f"the slew goes on {late:.1f} s after it should have ended; it was stopped. "
                "Check that nothing blocks the telescope, then go again"
            )
        return reading

    def _look(self) -> Look:
        """Read the unit, and judge at once whether its position can be trusted."""
        one, two = (self._unit.read(f"axis{axis}_position", f"axis{axis}_target_position") for axis in AXES)
        seen = Look((one, two), self._unit.read("slew_flags", "supply_flags"))
        before = self._counts or (-math.inf, -math.inf)
        self._moved = abs(seen.counts[0] - before[0]), abs(seen.counts[1] - before[1])
        times = seen.positions[0].time, seen.positions[1].time
        self._since_look = times[0] - self._seen_at[0], times[1] - self._seen_at[1]
        self._seen_at = times
        self._counts = seen.counts
        if self._trust.judge(seen.positions, [model.max_rate for model in self.slew_models]):
            self._slew = self._landing = self._tracked = None
            self._control_known = False
            self._hands.given_back()  # it begins with bits of its own
        unseen = _STANDBY_STEPS * max(axis.counts_per_step for axis in self._settings.axes)
        if self._powered and not seen.powered:
            self._trust.moved_unseen(unseen)
        elif seen.state.time - self._looked > _UNSEEN_S and not self._went_on(seen):
            self._trust.may_have_moved_unseen(unseen)
        self._powered, self._looked = seen.powered, seen.state.time
        return seen

    def _went_on(self, seen: Look) -> bool:
        """Whether the axes have moved as they should while nobody looked, so that they had power all the time."""
        if self._slew is not None:
            return self._slew.is_as_planned(seen.counts, seen.positions)
        if self._tracked is None or seen.disturbed(self._source):
            return False
        return (
            all(
                axis.expects(counts, values.time)
                for axis, counts, values in zip(self._tracked, seen.counts, seen.positions, strict=True)
            )
            and max(abs(axis.rate) for axis in self._tracked) > TELLING_RATE
        )

    def _seen_with_encoders(self, seen: Look) -> Look:
        """Compare the encoders with a position that can be trusted; preset one that was lost before, at rest."""
        if self.encoders.configured == (None, None) or self._slew is not None or any(self._moved):
            return seen
        if not self._trust.unsynchronised:
            if self._compare_encoders and not seen.motion:
                self._compare_encoders = False
                self.encoders.compare(seen.counts, self._trust.uncertainty_counts)
        elif self._trust.unsynchronised not in DECIDED and not seen.motion and seen.powered:
            position, uncertainty, why = self.encoders.position()
            self.encoders.notes = (why,) if why else ()
            if position is not None:
                self._set_position(position, seen.state.time)
                self._trust.may_be_off(uncertainty)
                told = max(each.uncertainty_arcsec for each in self.encoders.configured if each is not None)
                self.encoders.notes = (f"the position was lost and preset from the encoders, to ±{told:.0f}″",)
                self._look()  # sees them jump, as if they had moved
                return self._look()
        return seen

    def _axis_reading(self, i: int, seen: Look) -> AxisReading:
        """One axis, carried from its own moment to that of the flags by what is known best of its motion."""
        counts, at, time = seen.counts[i], seen.positions[i], seen.state.time
        slewing = self._slew is not None or seen.slewing[i]
        tracked = self._tracked[i] if self._tracked is not None and self._slew is None else None
        if tracked is not None:
            tracked.observe(counts, at.time, at.late_s)
        if tracked is not None and self._source in seen.motion and not seen.disturbed(self._source):
            here = Carried(tracked.at(time), tracked.margin_at(time), tracked.rate)
        elif self._slew is not None and seen.slewing[i] and not seen.disturbed(self._source):
            here = by_law(self._slew.axes[i], counts, at, seen.state)
        elif seen.motion or self._moved[i]:
            velocity = self._unit.read(f"axis{i + 1}_velocity")
            here = by_velocity(self.slew_models[i], seen, velocity, i + 1, (self._moved[i], self._since_look[i]))
        else:
            here = Carried(counts + 0.5, 0.5, 0.0)
        return AxisReading(here.counts, self._trust.uncertainty_counts + here.uncertainty, here.rate, slewing)

    @property
    def _source(self) -> str:
        """By which source, as the movement flags call it, the host moves the axes between slews."""
        return "remote_control" if self._control & REMOTE else "tracking"

    def _see_slew(self, seen: Look) -> None:
        """Follow a slew under way, take up the dead reckoning where it has landed, and learn from it."""
        if self._slew is not None:
            self._slew.see(seen.counts, seen.positions, seen.state, seen.slewing)
            self._slew.disturbed |= seen.disturbed(self._source)
            if self._slew.is_over(seen.counts, seen.state.time, seen.slewing):
                self._land(self._slew, seen)
        elif self._landing is not None:
            if seen.disturbed(self._source):
                self._landing = None
            elif self._landing.is_settled(seen.state.time):
                self._learn()

    def _land(self, slew: SlewWatch, seen: Look) -> None:
        self._slew = None
        self._compare_encoders = True
        undisturbed = slew.is_undisturbed(seen.counts, seen.positions)
        if undisturbed:
            self._learnt = self._learnt.idled(slew.axes)
        landing = Landing.of(slew, tracking=bool(self._control & TRACK), together=self.axes_land_together)
        self._tracked = landing.tracked if slew.may_have_arrived(seen.counts, seen.positions, seen.state) else None
        self._landing = landing if undisturbed else None
        if set(slew.targets) == {CENTRE}:  # what power-up leaves behind as well: no cookie
            self._write_control(self._control & ~SLEW)
            self._leave_cookie((CENTRE, CENTRE))

    def _learn(self) -> None:
        """Take in what the last landing taught."""
        if self._landing is not None and (found := self._landing.found()) is not None:
            self._learnt = self._learnt.landed(self._landing.watch.axes, found)
        self._landing = None

    def _left_tracking(self, seen: Look) -> tuple[TrackedAxis, TrackedAxis] | None:
        """The dead reckoning of a drive that is tracking already."""
        if not self._control & TRACK:
            return None
        velocities = [self._axis_register(axis, "tracking_velocity") for axis in AXES]
        return self._tracked_from(seen, (int(velocities[0]), int(velocities[1])))

    def _tracked_from(self, seen: Look, velocities: tuple[int, int]) -> tuple[TrackedAxis, TrackedAxis]:
        one, two = (
            TrackedAxis(counts + 0.5, values.time, velocity, model.law)
            for counts, values, velocity, model in zip(
                seen.counts, seen.positions, velocities, self.slew_models, strict=True
            )
        )
        return one, two

    def stop(self, time: float) -> None:  # noqa: ARG002 - the contract gives the time to all
        """Stop everything: "all stop" leaves tracking and hands moving the axes, so their bits are cleared too."""
        if self._last is not None and self._hands.bar(self._last.motion, self._control):
            self._remember(self.memory)
        self._halt()
        self._direct.end()

    def _halt(self) -> None:
        try:
            self._unit.write("all_stop", 1)
        finally:  # either alone ends a slew, so a request that is lost must not keep back the other
            self._write_control(self._control & ~(SLEW | REMOTE | TRACK | self._hands.barred))
        self._learn()
        self._slew = self._tracked = None
