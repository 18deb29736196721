"""Axis controllers behind the Drive contract: the 3.5 m telescope's and the SDSS's.

An axis is moved by nodes alone, each a place, a velocity and a time; the controller joins them by cubics. A slew
begins with DRIFT, whose answer says on what line the axis goes on, and ends on the path of the target with its
velocity. From then on `follow` keeps the buffer filled. What cannot be followed, or answered for, ends with MOVE on
all axes: they decelerate and stand.

Positions are the controllers' degrees; they keep them without the host. What was there last is remembered, so that a
position that jumped while nobody looked is called unsynchronised.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from mounts.apo import supervision
from mounts.apo.axis import STANDS_DEG_S, ControlledAxis, Sight
from mounts.apo.axis_group import AxisGroup
from mounts.apo.by_hand import SETS_POSITION, Given, give
from mounts.apo.clock_setting import ClockSet, require_settable, set_clock
from mounts.apo.commands import Kind, decode
from mounts.apo.connecting import Setting, identified, settings_notes, settings_of, told
from mounts.apo.declaring import at_slow_speed, declare
from mounts.apo.exchanged import exchanged
from mounts.apo.following import Follower
from mounts.apo.halting import Halting
from mounts.apo.settings import ApoSettings
from mounts.apo.slew_model import ApoSlewModel
from mounts.apo.stowing import Stowing
from mounts.apo.trust import Trust, numbers
from mounts.apo.watch import Watch
from mounts.apo.ways import Ways
from mounts.drive import AxisPath, AxisSlew, Capabilities, Reading
from mounts.errors import DriveRefused, Unsynchronised, WrongProtocol
from pointing.plan import Leading
from transports.errors import TransportError

_SILENT_S = 4.0  # after which an axis that does not answer halts all others


class ApoDrive:
    """Two or three axis controllers.

    Parameters
    ----------
    axes : tuple of ControlledAxis
        Azimuth, altitude and perhaps a rotator.
    settings : ApoSettings
        What the configuration says.
    memory : Mapping
        What `memory` gave when these controllers were last driven; empty for ones never seen.
    remember : callable
        Keeps `memory`; called before a position is set, and when one was lost.
    """

    def __init__(
        self,
        axes: tuple[ControlledAxis, ...],
        settings: ApoSettings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None] = lambda memory: None,  # noqa: ARG005 - a test need not
    ) -> None:
        self._axes = axes
        self._settings = settings
        self._remember = remember
        self._trust = Trust(memory, settings)
        for axis, gain in zip(axes, numbers(memory.get("gains"), len(axes)) or (), strict=False):
            axis.offset.assumed_gain = gain
        self._group = AxisGroup(axes, self._trust)
        self._ways = Ways(self._group, settings)
        self._follower = Follower(axes, settings, self._ways.meet, self._ways.ramp)
        self._stowing = Stowing()
        self._watch = Watch(self._group, self._ways, self._stowing, self._trust, settings)
        self._notes: list[str] = []
        self._halting = Halting(self._group, settings, (self._follower, self._stowing, self._ways))

    @property
    def axes(self) -> tuple[ControlledAxis, ...]:
        """The axes, for what this driver has no word of."""
        return self._axes

    @property
    def kind(self) -> Kind:
        """Whose controllers they are."""
        return self._settings.kind

    @property
    def capabilities(self) -> Capabilities:
        """It has a position and a stop, and takes nodes. Alone it drifts in a line, off any star in a minute."""
        return Capabilities(
            has_position=True,
            can_stop=True,
            rate_control=True,
            path_nodes=True,
            holds_rate_alone=False,
            units="degrees",
        )

    @property
    def slew_models(self) -> tuple[ApoSlewModel, ...]:
        """The quickest jerk-limited way of each axis."""
        return self._ways.models

    @property
    def start_latency(self) -> float:
        """Seconds from `start` to the motion: the lead of the first node, and the line time of all that is sent."""
        return self._ways.latency_s

    @property
    def axes_land_together(self) -> bool:
        """As configured; else each as soon as it can."""
        return self._settings.together

    @property
    def memory(self) -> Mapping[str, object]:
        """Where the axes were, when, and whether that could be trusted; what their clocks gain."""
        gains = [axis.offset.line.gain or axis.offset.assumed_gain for axis in self._axes]
        return {**self._trust.as_json(), "gains": gains}

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences from the configuration, warnings of the controllers, clocks that are off."""
        return (*self._notes, *supervision.notes(self._axes, self._trust.lost_axes))

    @property
    def leading(self) -> Leading | None:
        """None: every target is met with its own velocity."""
        return None

    def stand_by(self, time: float) -> None:
        """Nothing to get ready."""

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Identify each controller, initialise what has halted, compare limits, measure the clocks.

        Raises
        ------
        WrongProtocol, DriveRefused, TransportError
            No controller answers on a line, or that of another axis; or one refuses to be initialised.
        """
        identities = [identified(axis) for axis in self._axes]
        found = [settings_of(axis) for axis in self._axes]
        if text := exchanged(self._settings.axes, identities, found):
            raise WrongProtocol(text)
        if make_safe:
            self._halting.all(time)
        self._notes = []
        for i, (axis, told_of) in enumerate(zip(self._axes, found, strict=True)):
            if axis.look().word.restarted:
                self._notes.append(f"{axis.name}: the controller had restarted; it was initialised")
            self._group.free(i)
            self._group.found(i)
            self._notes += settings_notes(axis, told_of)
        return self.read(time)

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:
        """Ask STATUS of each axis and carry all to one time; act on what it says.

        Raises
        ------
        TransportError
            An axis does not answer; after 4 s all that do were halted.
        Unsynchronised, DriveRefused
            A position was lost; a controller has restarted, an axis is off its path, a clock is wrong; all were
            halted.
        """
        sights, doubted = self._group.look(), self._trust.unsynchronised
        with self._halting.on_failure(time):
            self._settle(sights)
            if self._group.silent:
                with suppress(TransportError):
                    self._follower.go_on(sights)
            if trouble := self._watch.trouble(sights):
                lost = self._trust.unsynchronised != doubted
                if lost:  # a controller may never say so again
                    self._remember(self.memory)
                raise (Unsynchronised if lost else DriveRefused)(f"{trouble}; all axes were halted")
        self._require_answers(time)
        reading = self._watch.reading(
            list(sights.values()), follows=self._follower.active, braking=self._halting.brakes
        )
        if reading.alarms and self._watch.leads:
            self._halting.what_answers(time)
        return reading

    def _require_answers(self, time: float) -> None:
        """Raise what a silent axis raised; halt all others first where it has been silent for long."""
        silent = self._group.silent
        if not silent:
            return
        first, lost = silent[min(silent)], self._group.silence_s(time)
        if lost > _SILENT_S and self._watch.leads:
            names = self._group.silent_names
            self._halting.what_answers(time)
            raise DriveRefused(f"{names}: no answer for {lost:.1f} s; MOVE halted all axes that answer: {first}")
        raise first

    def _settle(self, sights: Mapping[int, Sight]) -> None:
        """Go on with what was begun: slews, and stops that come to rest."""
        for i, sight in sights.items():
            self._ways.settle(i, sight)
            self._group.halt_late(i, sight)
        if not sights:
            return
        latest = max(sight.time for sight in sights.values())
        stand = not self._group.silent and all(abs(sight.velocity) < STANDS_DEG_S for sight in sights.values())
        self._stowing.settle(latest, stand=stand)
        self._halting.settle(latest, stand=stand)

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Begin a slew of all axes: DRIFT, then nodes from there to where the target is at the arrival.

        An axis that is given no target, a rotator, is halted: what it followed is followed no more.

        Raises
        ------
        Unsynchronised, DriveRefused
            The position may be wrong; an alarm stands; a controller takes no nodes; the way leaves the travel.
        TransportError
            An axis does not answer. All were halted, as with every error after the first DRIFT.
        """
        self._require_ready()
        self._follower.end()
        self._halting.over()
        with self._halting.on_failure(time):
            for axis in self._axes[len(axes) :]:
                axis.halt()
            return min(self._ways.slew(i, slew, time) for i, slew in enumerate(axes))

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep the buffers filled along a path; an axis that is not on it is brought there first.

        Raises
        ------
        Unsynchronised, DriveRefused
            As for `start`; the path leaves an axis's travel or is too fast for it.
        TransportError
            An axis does not answer; what its buffer holds it still follows.
        """
        self._group.require_synchronised()
        self._halting.over()
        try:
            return self._follower.follow(path, time)
        except DriveRefused:
            self._halting.what_answers(time)
            raise
        finally:
            self._ways.go_on()

    def move_at(self, rates: Sequence[float], time: float) -> None:
        """Move at these rates by nodes on straight lines; zero rates are a stop.

        Raises
        ------
        Unsynchronised, DriveRefused, TransportError
            As for `start`.
        """
        if not any(rates):
            self.stop(time)
            return
        if not self._follower.active:
            self._require_ready()
        self._halting.over()
        try:
            self._follower.keep_moving(rates, time)
        except DriveRefused:
            self._halting.what_answers(time)
            raise

    def stow(self, time: float) -> bool:
        """Let parked axes go to the stow that their controllers know, by `P`, where that is configured.

        One that goes farther than a degree is halted with all others, by `read`.

        Returns
        -------
        bool
            Whether they do.

        Raises
        ------
        Unsynchronised, DriveRefused, TransportError
            As for `start`.
        """
        if not self._settings.stows:
            return False
        self._require_ready()
        self._follower.end()
        self._halting.over()
        with self._halting.on_failure(time):
            self._stowing.begin(self._axes, time)
        return True

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Set the position of each axis: where it was at `time` is `counts`. Tracking axes are halted for it.

        Raises
        ------
        DriveRefused
            An axis slews, or does not come to rest.
        """
        if any(due is not None for due in self._ways.arrivals):
            raise DriveRefused("a slew is under way; `stop`, then sync")
        before = [at_slow_speed(axis, time) for axis in self._axes]
        self._halting.all(time)
        for axis, wanted, was in zip(self._axes, counts, before, strict=False):
            self._trust.lose("a sync was cut short; `sync` again")
            self._remember(self.memory)
            declare(axis, wanted - was)
        self._trust.synchronised(len(counts))
        self._remember(self.memory)
        self.read(time)

    def declare(self, number: int, counts: float, time: float) -> None:
        """Set the position of one axis alone, by its number from 0; raises as `sync`. All axes are halted for it."""
        if any(due is not None for due in self._ways.arrivals):
            raise DriveRefused("a slew is under way; `stop`, then sync")
        axis = self._axes[number]
        was = at_slow_speed(axis, time)
        self._halting.all(time)
        self._trust.lose_axis(number, f"{axis.name}: a sync was cut short; `sync` again")
        self._remember(self.memory)
        declare(axis, counts - was)
        self._trust.declared(number)
        self._remember(self.memory)
        self.read(time)

    def stop(self, time: float) -> None:
        """End all motion: MOVE on every axis, and an error only after all were told."""
        self._halting.all(time)

    def power(self, *, on: bool) -> None:
        """Refuse: the controllers have no command for it.

        Raises
        ------
        DriveRefused
            Always.
        """
        word = "on" if on else "off"
        raise DriveRefused(f"these controllers cannot switch their motors {word}; the amplifiers have a switch")

    def registers(self) -> Mapping[str, str]:
        """What each controller tells of itself, by axis and name."""
        return {f"{axis.name} {name}": text for axis in self._axes for name, text in told(axis).items()}

    def differences(self) -> Sequence[Setting]:
        """What each controller holds otherwise than it is configured."""
        return [each for axis in self._axes for each in settings_of(axis) if each.differs]

    def by_hand(self, name: str, text: str) -> Given:
        """Give a command to the axis of this name.

        Raises
        ------
        ImpossibleCommand, DriveRefused, TransportError
            There is no such command, or axis; the controller refuses it, or does not answer.
        """
        i = self._group.named(name)
        axis = self._axes[i]
        if decode(text).name not in SETS_POSITION:
            return give(axis, text)
        before, given = axis.look().position, give(axis, text)
        self._trust.set_by_hand(i)
        self._remember(self.memory)
        return replace(given, moved_deg=axis.look().position - before)

    def set_clocks(self, time: float) -> Sequence[ClockSet]:
        """Have the clocks of all controllers set, and say how far they were and are off; everything halts for it.

        Raises
        ------
        DriveRefused, TransportError
            These controllers have no command for it; a clock is not right afterwards; an axis does not answer.
        """
        require_settable(self._settings.kind)
        self._halting.all(time)
        return [set_clock(axis) for axis in self._axes]

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - see `capabilities`
        """Halt all axes, as none holds its rate alone; close the lines."""
        try:
            self._halting.all(time)
        finally:
            for axis in self._axes:
                axis.controller.close()

    def _require_ready(self) -> None:
        self._stowing.end()
        self._group.require_ready()
