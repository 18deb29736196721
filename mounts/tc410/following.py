"""How a TC410 is kept on a path: by its own tracking, or led by direct speed control."""

from collections.abc import Sequence

from mounts.drive import AxisPath, Reading
from mounts.errors import DriveRefused
from mounts.tc410.leading import PERIOD_S, leading_of
from mounts.tc410.parts import AXES, REMOTE, SLEW, TRACK
from mounts.tc410.positioning import WRITE_CHARACTERS
from mounts.tc410.registers import COUNTS_PER_SECOND
from mounts.tc410.slewing import Slewing
from mounts.tc410.tracking import Pace, TrackedAxis
from pointing.plan import Leading

_TRACKING = Pace(period_s=1.0, beat_s=2.0, catch_up=200.0)  # 200 counts/s: 3′ a second in the manual's gearing
_LED_BEATS = 3.0  # periods over which an error is closed while led
_LED_CATCH_UP = 0.1  # of the top speed
_LED_PACE = 1.3  # periods are longer than a cycle of exchanges by this
_CYCLE_EXCHANGES = 5  # of a look and two velocities
_CYCLE_CHARACTERS = 3 * (17 + 27) + 2 * (27 + 17)
_WRITE_ANSWER_CHARACTERS = 17


class Following(Slewing):
    """Tracks, leads, and moves at speeds."""

    def follow(self, path: AxisPath, time: float) -> float:
        """Set the velocities that keep both axes on the path; return the seconds until they must be set again.

        A path that is led goes by direct speed control, which a dead-man process stands beside; any other by the
        drive's own tracking. Between the two the velocities stay as they are.

        Raises
        ------
        Unsynchronised, DriveRefused, DriveError
            As for `start`; there is no dead-man process for a path that is led.
        """
        if self._slew is not None:
            return _TRACKING.period_s
        if path.led:
            self._direct.begin()
            self._restore_speed()  # a move before this one may have lowered it
        reading = self._ready(self._last or self.read(time))
        tracked = self._tracked = self._tracked or self._tracked_as(reading)
        pace = self._led_pace() if path.led else _TRACKING
        source, register = (REMOTE, "target_velocity") if path.led else (TRACK, "tracking_velocity")
        if not self._control & source:
            self._change_source(source, register, tracked)
        for i, axis in enumerate(tracked):
            effective = time + self._unit.burst_s(i + 1, (i + 1) * WRITE_CHARACTERS + i * _WRITE_ANSWER_CHARACTERS)
            here, ahead = path.at(effective)[i][0], path.at(effective + pace.period_s)[i][0]
            velocity = axis.velocity_for(here, ahead, effective, pace)
            if velocity != axis.velocity or axis.doubtful:
                axis.attempt(velocity, effective)
                axis.command(velocity, self._unit.write(f"axis{i + 1}_{register}", velocity))
        return pace.period_s

    def _tracked_as(self, reading: Reading) -> tuple[TrackedAxis, TrackedAxis]:
        """The dead reckoning from a reading on."""
        one, two = (
            TrackedAxis(
                axis.counts,
                reading.time,
                round(axis.rate / COUNTS_PER_SECOND),
                model.law,
                axis.uncertainty_counts,
                axis.uncertainty_counts,
            )
            for axis, model in zip(reading.axes, self.slew_models, strict=True)
        )
        return one, two

    def _led_pace(self) -> Pace:
        """As often as the link carries a look and two velocities."""
        cycle = self._unit.burst_s(_CYCLE_EXCHANGES, _CYCLE_CHARACTERS)
        period = max(PERIOD_S, _LED_PACE * cycle)
        return Pace(period, _LED_BEATS * period, _LED_CATCH_UP * min(model.max_rate for model in self.slew_models))

    def _change_source(self, source: int, register: str, tracked: tuple[TrackedAxis, TrackedAxis]) -> None:
        """Let the drive take its velocities from `source`, where first those are written that the axes have now."""
        self._tracked = None  # unless the unit acknowledges it: it may move so, or not
        for i, axis in enumerate(tracked):
            self._unit.write(f"axis{i + 1}_{register}", axis.velocity)
        # The unit may have cleared its slew bit when the slew ended: to write it again would begin another.
        self._write_control(self._control & ~(SLEW | TRACK | REMOTE) | source)
        self._tracked = tracked
        if source == TRACK:
            self._direct.end()

    def stand_by(self, time: float) -> None:  # noqa: ARG002 - the contract gives the time to all
        """Have the dead-man process started, so that `follow` begins at once to lead.

        Raises
        ------
        DriveRefused, DriveError
            There is none, or it does not start.
        """
        self._direct.stand_by()

    @property
    def leading(self) -> Leading:
        """What `follow` can lead the axes along."""
        return leading_of(self.slew_models, self._led_pace().period_s)

    def move_at(self, rates: Sequence[float], time: float) -> None:
        """Direct speed control: both axes ramp to these rates at once, and go on at them.

        Raises
        ------
        Unsynchronised, DriveRefused, DriveError
            As for `start`; there is no dead-man process, or it is gone.
        RegisterError
            A rate is outside what the drive can hold; nothing was sent.
        """
        velocities = self._encoded("target_velocity", [rate / COUNTS_PER_SECOND for rate in rates])
        self._ready(self._last or self.read(time))
        if self._slew is not None:
            raise DriveRefused("a slew is under way; wait for it, or `stop` first")
        self._restore_speed()  # a move before this one may have lowered it
        self._direct.begin()
        self._landing = self._tracked = None
        if velocities != self._direct.velocities:
            self._direct.velocities = None  # until both are acknowledged
            for axis, words in zip(AXES, velocities, strict=True):
                self._unit.write_words(f"axis{axis}_target_velocity", words)
            self._direct.velocities = velocities
        if not self._control & REMOTE or self._control & TRACK:
            self._write_control(self._control & ~(SLEW | TRACK) | REMOTE)
