"""Axis controllers behind the Drive contract: the 3.5 m telescope's and the SDSS's.

An axis is moved by nodes alone, each a place, a velocity and a time; the controller joins them by cubics. A slew
begins with DRIFT, whose answer says on what line the axis goes on, and ends on the path of the target with its
velocity. From then on `follow` keeps the buffer filled. What cannot be followed, or answered for, ends with MOVE on
all axes: they decelerate and stand.

Positions are the controllers' degrees; they keep them without the host. What was there last is remembered, so that a
position that jumped while nobody looked is called unsynchronised.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress

from mounts.apo import supervision
from mounts.apo.axis import ControlledAxis, Sight
from mounts.apo.by_hand import BY_HAND, SETS_POSITION, Given, give
from mounts.apo.connecting import Setting, identified, settings_notes, settings_of, told
from mounts.apo.following import Follower
from mounts.apo.meeting import Meeting, Where, excursion, meet, ramp
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import ApoSettings
from mounts.apo.slew_model import ApoSlewModel
from mounts.apo.trust import Trust
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from pointing.plan import Leading
from transports.errors import TransportError

LEAD_S = 1.0  # by which the first node must be sent ahead
_MARGIN_S = 0.1  # for the solving
_SLEW_NODES = 9  # of a slew at most, with the one that holds it
_START_EXCHANGES = _SLEW_NODES + 4  # with two looks, a DRIFT, and one more
_HOLD_S = 5.0  # an axis that landed at rest is held by a node until MOVE lets it stand
_LANDED_S = 0.1
_SILENT_S = 4.0  # after which an axis that does not answer halts all others
_ATTEMPTS = 3
_STOPS_IN_S = 2.0  # beyond what the deceleration takes
_MOVES = 1e-4  # deg/s
_ANYWHERE_DEG = 360.0
_STANDS = 1e-6  # deg/s; the last node lies on the grid of times, up to 0.5 µs before the end
_ABRUPT = 10.0  # times the configured acceleration, with which a stop button or a limit switch may halt an axis
_SLOW_DEG_S = 0.1  # of an axis that may be synchronised while it tracks
_BRAKING = 1000  # looks, each as long as an exchange, in which an axis must have come to rest
_READ_BACK_DEG = 2e-5


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
        Keeps `memory`; called before a position is set.
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
        self._models = tuple(
            ApoSlewModel(axis.max_speed_deg_s, axis.acceleration_deg_s2, axis.jerk_deg_s3) for axis in settings.axes
        )
        self._follower = Follower(axes, settings, self._meet, self._ramp)
        self._notes: list[str] = []
        self._arrivals: list[float | None] = [None] * len(axes)  # POSIX seconds, of the slew under way
        self._holding = [False] * len(axes)  # at the end of a slew that ended at rest
        self._halted: float | None = None  # POSIX seconds, while the axes may still move after a MOVE
        self._heard = [-math.inf] * len(axes)
        self._silent: dict[int, TransportError] = {}  # axes that did not answer when looked at last, and why
        self._planned: dict[int, Callable[[PathNode, float], Meeting]] = {}  # the way of each axis, from any drift

    @property
    def axes(self) -> tuple[ControlledAxis, ...]:
        """The axes, for what this driver has no word of."""
        return self._axes

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
        return self._models

    @property
    def start_latency(self) -> float:
        """Seconds from `start` to the motion: the lead of the first node, and the line time of all that is sent."""
        return LEAD_S + _MARGIN_S + sum(_START_EXCHANGES * axis.exchange_s for axis in self._axes)

    @property
    def axes_land_together(self) -> bool:
        """As configured; else each as soon as it can."""
        return self._settings.together

    @property
    def memory(self) -> Mapping[str, object]:
        """Where the axes were, when, and whether that could be trusted."""
        return self._trust.as_json()

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences from the configuration, warnings of the controllers, clocks that are off."""
        clocks = (
            f"{axis.name}: the controller's clock is {axis.offset.value:+.4f} s off; node times are corrected for it"
            for axis in self._axes
            if axis.offset.value
        )
        warned = (f"{text} since the last INIT" for text in supervision.warnings(self._axes))
        lost = (
            f"{self._axes[i].name}: its position is not known; turn it to where that is, then "
            f"`drive raw {self._axes[i].name} SET.POSITION DEGREES`"
            for i in sorted(self._trust.lost_axes)
            if i > 1
        )
        return (*self._notes, *clocks, *warned, *lost)

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
            No controller answers on a line, or one refuses to be initialised.
        """
        for axis in self._axes:
            identified(axis)
        if make_safe:
            self._halt_all(time)
        self._notes = []
        for i, axis in enumerate(self._axes):
            if axis.look().word.restarted:
                self._notes.append(f"{axis.name}: the controller had restarted; it was initialised")
            self._free(i)
            self._notes += settings_notes(axis)
        return self.read(time)

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:
        """Ask STATUS of each axis and carry all to one time; act on what it says.

        Raises
        ------
        TransportError
            An axis does not answer; after 4 s all that do were halted.
        DriveRefused
            A controller has restarted, an axis is off its path, a clock is wrong; all were halted.
        """
        sights = self._look_at_all()
        with self._halted_on_failure(time):
            self._settle(sights)
            if trouble := self._trouble(sights):
                raise DriveRefused(f"{trouble}; all axes were halted")
        self._require_answers(time)
        reading = self._reading(list(sights.values()))
        if reading.alarms and any(axis.queue.last for axis in self._axes):
            self._halt_what_answers(time)
        return reading

    def _look_at_all(self) -> dict[int, Sight]:
        """Look at every axis; what answers is to be judged, whatever is silent."""
        sights: dict[int, Sight] = {}
        self._silent, before = {}, self._silent
        for i in sorted(range(len(self._axes)), key=lambda i: i in before):
            try:
                sights[i] = self._axes[i].look()
                self._heard[i] = sights[i].time
            except TransportError as error:
                self._silent[i] = error
        return dict(sorted(sights.items()))

    def _require_answers(self, time: float) -> None:
        """Raise what a silent axis raised; halt all others first where it has been silent for long."""
        if not self._silent:
            return
        first = self._silent[min(self._silent)]
        lost = max(time - self._heard[i] for i in self._silent)
        if lost > _SILENT_S and any(axis.queue.last for axis in self._axes):
            names = " and ".join(self._axes[i].name for i in sorted(self._silent))
            self._halt_what_answers(time)
            raise DriveRefused(f"{names}: no answer for {lost:.1f} s; MOVE halted all axes that answer: {first}")
        raise first

    def _settle(self, sights: Mapping[int, Sight]) -> None:
        """End what has come to its end: slews that landed, stops that came to rest."""
        for i, sight in sights.items():
            axis = self._axes[i]
            self._feed(i, sight.time)
            due = self._arrivals[i]
            if due is not None and sight.time >= due:
                self._arrivals[i] = None
            if self._holding[i] and self._arrivals[i] is None and sight.time >= axis.queue.ends - _HOLD_S + _LANDED_S:
                axis.halt()
                self._holding[i] = False
        if self._halted is None or not sights:
            return
        latest = max(sight.time for sight in sights.values())
        if not self._silent and all(abs(sight.velocity) < _MOVES for sight in sights.values()):
            self._halted = None
        elif latest > self._halted + self._stopping_s + _STOPS_IN_S:
            self._halt_all(latest, abruptly=True)

    def _feed(self, i: int, time: float) -> None:
        """Give an axis the nodes that wait for room; where one is in doubt its way is planned anew."""
        try:
            self._axes[i].feed(time, self._settings.max_nodes)
        except (DriveRefused, TransportError):
            self._led_by(i, self._planned[i])

    @property
    def _stopping_s(self) -> float:
        return max(axis.max_speed_deg_s / axis.acceleration_deg_s2 for axis in self._settings.axes)

    def _trouble(self, sights: Mapping[int, Sight]) -> str:
        for i, sight in sights.items():
            axis = self._axes[i]
            if axis.word.restarted:
                self._free(i)
                return f"{axis.name}: the controller has restarted and was initialised; `goto` again"
            if axis.jumped_deg:
                jumped, axis.jumped_deg = axis.jumped_deg, 0.0
                self._trust.lose_axis(
                    i, f"{axis.name}: its position has jumped by {jumped:.4f}°, lost or set by somebody; `sync`"
                )
                return self._trust.unsynchronised
            if text := supervision.off_its_path(axis, sight):
                return text
            if axis.queue.is_path and sight.time > axis.queue.ends + 0.5:
                return f"{axis.name}: its path ended {sight.time - axis.queue.ends:.1f} s ago; `goto` again"
        return ""

    def _reading(self, sights: Sequence[Sight]) -> Reading:
        now = max(sight.time for sight in sights)
        axes = []
        for i, (axis, sight) in enumerate(zip(self._axes, sights, strict=True)):
            late = now - sight.time
            here = axis.queue.at(now)
            carried = sight.position + sight.velocity * late
            unsure = sight.uncertainty + self._unseen(i, sight.velocity, late)
            unsure += abs(here[0] - carried) if here else 0.0
            unsure += _ANYWHERE_DEG if i in self._trust.lost_axes else 0.0
            axes.append(AxisReading(carried, unsure, sight.velocity, self._arrivals[i] is not None))
        self._trust.seen(now, [axis.counts for axis in axes], [axis.rate for axis in axes])
        clocks = filter(None, (axis.clock_trouble() for axis in self._axes))
        slewing, tracking = any(axis.slewing for axis in axes), self._follower.active
        moving = self._halted is None and any(abs(axis.rate) > _MOVES for axis in axes)
        told = (
            "slewing" if slewing else "tracking" if tracking else "another host" if moving and not self._led else ""
        )
        return Reading(
            time=now,
            axes=tuple(axes),
            motion=(told,) if told else (),
            limits=supervision.limits(self._axes),
            alarms=(*supervision.alarms(self._axes), *clocks),
            tracking=tracking and not slewing,
            unsynchronised=self._trust.unsynchronised,
        )

    @property
    def _led(self) -> bool:
        """Whether any axis has something of ours to do."""
        return any(axis.queue.last for axis in self._axes)

    def _unseen(self, i: int, velocity: float, late: float) -> float:
        """By how far an axis may be off the line on which it was seen, degrees: it may have been stopped since.

        One that was halted may be on its way back already.
        """
        braking = 0.5 * _ABRUPT * self._settings.axes[i].acceleration_deg_s2 * late**2
        return braking if self._halted is not None else min(abs(velocity) * late, braking)

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Begin a slew of all axes: DRIFT, then nodes from there to where the target is at the arrival.

        Raises
        ------
        Unsynchronised, DriveRefused
            The position may be wrong; an alarm stands; a controller takes no nodes; the way leaves the travel.
        TransportError
            An axis does not answer. All were halted, as with every error after the first DRIFT.
        """
        self._require_ready()
        self._follower.end()
        self._halted = None
        began = math.inf
        with self._halted_on_failure(time):
            for i, slew in enumerate(axes):
                nodes = self._meet(i, _line_of(slew, time), slew.arrival, slew.max_rate)
                began = min(began, nodes[0].time)
                self._arrivals[i] = nodes[-1].time
                self._holding[i] = slew.rate_after == 0.0
        return began

    def _meet(
        self, i: int, where: Where, arrival: float | None = None, max_rate: float | None = None
    ) -> tuple[PathNode, ...]:
        """Bring an axis onto a path by nodes that its controller has taken.

        A node whose answer was lost, or that came too late, leaves the buffer in doubt: DRIFT flushes it, and the way
        is planned anew.
        """
        model = self._models[i]
        model = model if max_rate is None or max_rate >= model.max_rate else model.limited(max_rate)

        def planned(line: PathNode, earliest: float) -> Meeting:
            return meet(self._settings.axes[i], line, earliest, where, arrival, model.meeting)

        return self._led_by(i, planned)

    def _ramp(self, i: int, rate: float, seconds: float) -> tuple[PathNode, ...]:
        """Bring an axis to a velocity, from wherever it is, and after so many seconds to rest, if any; as `_meet`."""
        settings, profile = self._settings.axes[i], self._models[i].profile

        def planned(line: PathNode, earliest: float) -> Meeting:
            if seconds:
                return excursion(settings, line, earliest, rate, seconds, profile)
            return ramp(settings, line, earliest, rate, profile)

        return self._led_by(i, planned)

    def _led_by(self, i: int, planned: Callable[[PathNode, float], Meeting]) -> tuple[PathNode, ...]:
        """Let an axis drift, plan from there, and give its nodes; anew where one of them is in doubt."""
        axis = self._axes[i]
        self._planned[i] = planned
        line_time = _SLEW_NODES * axis.exchange_s
        for attempt in range(_ATTEMPTS):
            line = axis.drift()
            earliest = line.time + (LEAD_S + line_time) * (1.0 + 0.5 * attempt) + _MARGIN_S / 2.0
            meeting = planned(line, earliest)
            last, nodes = meeting.nodes[-1], meeting.nodes
            if abs(last.velocity) < _STANDS:
                nodes = (*nodes, PathNode(last.time + _HOLD_S, last.position, 0.0))
            try:
                axis.send_path(nodes, self._settings.max_nodes)
            except (DriveRefused, TransportError) as error:
                if attempt == _ATTEMPTS - 1:
                    raise
                if isinstance(error, DriveRefused) and line.velocity == 0.0:  # something may have halted it unseen
                    axis.look()
                    axis.must_init = True
                    self._free(i)
            else:
                if self._arrivals[i] is not None:  # a slew that had to be planned anew
                    self._arrivals[i] = meeting.arrival
                return meeting.nodes
        raise AssertionError("unreachable: the last attempt returns or raises")

    def follow(self, path: AxisPath, time: float) -> float:
        """Keep the buffers filled along a path; an axis that is not on it is brought there first.

        Raises
        ------
        Unsynchronised, DriveRefused
            As for `start`; the path leaves an axis's travel or is too fast for it.
        TransportError
            An axis does not answer; what its buffer holds it still follows.
        """
        if self._trust.unsynchronised:
            raise Unsynchronised(self._trust.unsynchronised)
        self._halted = None
        try:
            return self._follower.follow(path, time)
        except DriveRefused:
            self._halt_what_answers(time)
            raise
        finally:
            self._holding = [False] * len(self._axes)

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
        self._halted = None
        try:
            self._follower.keep_moving(rates, time)
        except DriveRefused:
            self._halt_what_answers(time)
            raise

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Set the position of each axis: where it was at `time` is `counts`. Tracking axes are halted for it.

        Raises
        ------
        DriveRefused
            An axis slews, or does not come to rest.
        """
        if any(due is not None for due in self._arrivals):
            raise DriveRefused("a slew is under way; `stop`, then sync")
        before = [axis.queue.at(time) or _carried(axis.look(), time) for axis in self._axes]
        if max(abs(rate) for _, rate in before) > _SLOW_DEG_S:
            fastest = max(abs(rate) for _, rate in before)
            raise DriveRefused(
                f"an axis moves at {fastest:.3f}°/s, at most {_SLOW_DEG_S}°/s is halted for a sync; `stop`"
            )
        self._halt_all(time)
        for axis, wanted, (was, _) in zip(self._axes, counts, before, strict=False):
            self._trust.lose("a sync was cut short; `sync` again")
            self._remember(self.memory)
            self._declare(axis, wanted - was)
        self._trust.synchronised(len(counts))
        self._remember(self.memory)
        self.read(time)

    @staticmethod
    def _declare(axis: ControlledAxis, moved: float) -> None:
        """Add to the position of an axis as soon as its controller takes it: it may still swing back from a stop."""
        for _ in range(_BRAKING):
            target = axis.look().position + moved
            try:
                axis.set_position(target)
            except DriveRefused as error:
                refused = error
                continue
            if abs(axis.look().position - target) > _READ_BACK_DEG:
                raise DriveRefused(f"{axis.name} does not read back {target:.5f}°; `sync` again")
            return
        raise refused

    def stop(self, time: float) -> None:
        """End all motion: MOVE on every axis, and an error only after all were told."""
        self._halt_all(time)

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
        axis = next((axis for axis in self._axes if axis.name == name), None)
        if axis is None:
            raise DriveRefused(f"no axis {name!r}; there is {', '.join(axis.name for axis in self._axes)}")
        given = give(axis, text)
        if given.command.name in SETS_POSITION:
            if (i := self._axes.index(axis)) > 1:  # a rotator, of which the sky tells nothing
                self._trust.lost_axes.discard(i)
            else:
                self._trust.lose(BY_HAND.format(name))
            self._remember(self.memory)
        return given

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - see `capabilities`
        """Halt all axes, as none holds its rate alone; close the lines."""
        try:
            self._halt_all(time)
        finally:
            for axis in self._axes:
                axis.controller.close()

    # Halting ---------------------------------------------------------------------------------------------------

    def _halt_all(self, time: float, *, abruptly: bool = False) -> None:
        """Tell every axis, silent ones last as each costs its time-outs, and raise the first error only then."""
        self._follower.end()
        errors: list[DriveError | TransportError] = []
        for i in sorted(range(len(self._axes)), key=lambda i: i in self._silent):
            axis = self._axes[i]
            self._arrivals[i], self._holding[i] = None, False
            try:
                axis.halt(abruptly=abruptly)
            except (DriveError, TransportError) as error:
                axis.let_expire()
                errors.append(error)
        self._halted = time
        if errors:
            raise errors[0]

    def _halt_what_answers(self, time: float) -> None:
        with suppress(DriveError, TransportError):
            self._halt_all(time)

    @contextmanager
    def _halted_on_failure(self, time: float) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._halt_what_answers(time)
            raise

    def _free(self, i: int) -> None:
        """Initialise a controller that has halted; the position of one that has restarted is judged first."""
        axis = self._axes[i]
        if axis.sight is not None and axis.word.restarted:
            self._trust.restarted(i, axis.sight)
            axis.offset.forget()
        if axis.must_init:
            axis.initialise()
            axis.look()

    def _require_ready(self) -> None:
        if self._trust.unsynchronised:
            raise Unsynchronised(self._trust.unsynchronised)
        for i, axis in enumerate(self._axes):
            axis.look()
            self._free(i)
            axis.require_clock()
        if self._trust.unsynchronised:
            raise Unsynchronised(self._trust.unsynchronised)
        if standing := supervision.alarms(self._axes):
            raise DriveRefused(f"{', '.join(standing)}, after INIT too; find the cause before moving")


def _line_of(slew: AxisSlew, time: float) -> Where:
    """The path of a slew's target: where it is at the planned arrival, going on at its rate."""
    due = time if slew.arrival is None else slew.arrival
    return lambda when: (slew.target + slew.rate_after * (when - due), slew.rate_after)


def _carried(sight: Sight, time: float) -> tuple[float, float]:
    return sight.position + sight.velocity * (time - sight.time), sight.velocity
