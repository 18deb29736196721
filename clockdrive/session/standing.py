"""A telescope that stands: held where its drive cannot stop tracking, and what comes of it when nobody holds it."""

from clockdrive.resting import place
from clockdrive.safety import moved_by_others
from clockdrive.session.account import AT_REST, IDLE_PERIOD_S, LEFT_ALONE_S
from clockdrive.session.watching import HELD, MOVED_PERIOD_S, Watching
from mounts.drive import HoldsUnplaced, Reading
from transports.errors import TransportError

_TRACKING_PERIOD_S = 1.0
_HELD_AFTER_S = 10.0  # of being open, so that a look at what rests moves nothing, but where a limit is near


class Standing(Watching):
    """Holds what cannot be stopped."""

    def _held(self) -> float:
        """Hold a drive that tracks whatever it is told where it came to rest; return the seconds to the next look."""
        reading, what = self.reading, self.drive.capabilities
        if self.doing not in HELD or what.can_stop or reading is None or reading.unsynchronised:
            self._holding.end()
            self._hold_unplaced(reading)
            return self._usual_period
        self._hold_unplaced(None)
        if self.link_lost_since is not None:
            return self._usual_period
        if moved := self._holding.moved(reading, what):
            self.trouble = moved
            self.note("moved", moved)
        if self._holding.rest is None and self._only_looks:
            return self._usual_period
        rest = self._holding.at(reading, what)
        if rest is None:
            return MOVED_PERIOD_S
        try:
            return min(self._usual_period, self.drive.follow(rest, self.clock.now()))
        except TransportError as error:
            self._link_lost(error)
            return self._usual_period

    def _hold_unplaced(self, reading: Reading | None) -> None:
        """Hold what is parked where it stands though nobody knows where that is, if the drive can."""
        if not isinstance(self.drive, HoldsUnplaced):
            return
        if self.doing != "parked" or reading is None or not reading.unsynchronised:
            self.drive.leave_unplaced()
            self.held_unplaced = ""
            return
        if self.link_lost_since is not None or self._only_looks:
            return
        try:
            held = self.drive.hold_unplaced(self.clock.now())
        except TransportError as error:
            self._link_lost(error)
            return
        if held and not self.held_unplaced:
            self.note("held", held)
        self.held_unplaced = held

    def held_at(self, angles: tuple[float, float]) -> tuple[float, float]:
        """Axis angles, radians, near to these at which the drive can be held and is allowed to, once it is there."""
        what, (one, two) = self.drive.capabilities, self.planner.axes
        if what.can_stop:
            return angles
        wanted = one.gearing.counts(angles[0]), two.gearing.counts(angles[1])
        held = place(self.planner, wanted, what, self.clock.now())
        return angles if held == wanted else self.planner.angles(held)

    @property
    def _only_looks(self) -> bool:
        """Whether it may be closed again before what rests must be held."""
        due = self._opened + _HELD_AFTER_S
        left = self.left_alone
        near = left is not None and left.limit is not None and left.limit < due + LEFT_ALONE_S
        return self.clock.now() < due and not near

    @property
    def _usual_period(self) -> float:
        """Seconds from one look to the next, where no target asks for more."""
        if self.doing not in AT_REST:
            return _TRACKING_PERIOD_S
        moved = self.reading is not None and moved_by_others(self.reading)
        return MOVED_PERIOD_S if moved else IDLE_PERIOD_S
