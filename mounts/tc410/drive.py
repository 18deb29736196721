"""The TC410 behind the Drive contract.

The unit's own registers govern how it moves, so acceleration, deceleration and top speed are read from it and planned
with; a configuration that differs is listed in `notes`. What only the host uses, gearing and soft limits, is the
configuration's; the soft limits are written to the unit and read back before anything moves.

Everything that a command would write is checked before the first of it is sent. What a write left in the unit is
noted only when the unit has acknowledged it, so that a command cut short can be given again.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mounts.beside import Guardian
from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveRefused, Unsynchronised
from mounts.tc410.calibration import Learnt
from mounts.tc410.carried import Carried, by_law, by_velocity
from mounts.tc410.direct import DirectSpeed
from mounts.tc410.encoders import Encoders
from mounts.tc410.hands import Hands
from mounts.tc410.landing import Landing
from mounts.tc410.leading import PERIOD_S, leading_of
from mounts.tc410.look import Look
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND, Register, by_name
from mounts.tc410.settings import TC410Settings
from mounts.tc410.slew import Tc410SlewModel
from mounts.tc410.slew_watch import TELLING_RATE, TIMEOUT_S, AxisWatch, SlewWatch
from mounts.tc410.startup import find_position_format, identify, read_models, write_soft_limits
from mounts.tc410.tracking import Pace, TrackedAxis
from mounts.tc410.trust import BY_HAND, DECIDED, REINTERPRETED, RELOADED, Trust
from mounts.tc410.unit import Unit
from mounts.tc410.upkeep import Upkeep
from pointing.plan import Leading
from transports.modbus_ascii import ModbusAscii

_AXES = (1, 2)
_SLEW, _REMOTE, _TRACK = (
    by_name("velocity_control").mask(name) for name in ("slew_to_target", "remote_control", "tracking")
)
_STANDBY_STEPS = 2.0  # full steps by which a motor may settle when its power comes back
_UNSEEN_S = 2.5  # without a look, in which the motors may have lost their power and have it back
_TRACKING = Pace(period_s=1.0, beat_s=2.0, catch_up=200.0)  # 200 counts/s: 3′ a second in the manual's gearing
_LED_BEATS = 3.0  # periods over which an error is closed while led
_LED_CATCH_UP = 0.1  # of the top speed
_LED_PACE = 1.3  # periods are longer than a cycle of exchanges by this
_WRITE_CHARACTERS = 27  # of the request that writes a pair
_CYCLE_EXCHANGES = 5  # of a look and two velocities
_CYCLE_CHARACTERS = 3 * (17 + 27) + 2 * (27 + 17)
_WRITE_ANSWER_CHARACTERS = 17
_ANSWER_CHARACTERS = 19  # of the answer that brings a pair
_START_EXCHANGES = 9  # of a start: three reads, two writes of words and four of pairs
_START_CHARACTERS = 3 * (17 + 27) + 2 * 17 + 17 + 4 * (27 + 17)  # up to the end of the last request


class TC410:
    """One TC410.

    Parameters
    ----------
    modbus : ModbusAscii
        The master on the unit's link.
    settings : TC410Settings
        What the configuration says.
    memory : Mapping
        What `memory` gave when this unit was last driven; empty for a unit never seen.
    remember : callable
        Keeps `memory`; called before a register that the next start must know of is written.
    guardian : Guardian, optional
        Makes the unit safe when this process is gone; without one there is no direct speed control.
    """

    def __init__(
        self,
        modbus: ModbusAscii,
        settings: TC410Settings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None] = lambda memory: None,  # noqa: ARG005 - a test need not
        guardian: Guardian | None = None,
    ) -> None:
        self._unit = Unit(modbus, settings.baud)
        self.upkeep = Upkeep(self._unit, self._about_to_write, self._written)
        """The registers, for a person."""
        self._direct = DirectSpeed(self._unit, guardian)
        barred = memory.get("hands")
        self._hands = Hands(self._unit, barred if isinstance(barred, int) else 0)
        self._settings = settings
        self._remember = remember
        self._trust = Trust(memory)
        if not self._trust.unsynchronised and memory.get("meaning", settings.meaning) != settings.meaning:
            self._trust.lose(REINTERPRETED)
        one, two = settings.axes
        self.encoders = Encoders(
            self._unit,
            (one.encoder, two.encoder),
            ((one.lowest_counts, one.highest_counts), (two.lowest_counts, two.highest_counts)),
            memory,
        )
        """The absolute encoders, and what is believed of them."""
        self._compare_encoders = True  # with the next position that can be trusted
        self._learnt = Learnt.from_json(memory.get("learnt"))
        lowered = memory.get("restore")
        self._lowered: dict[str, float] = dict(lowered) if isinstance(lowered, Mapping) else {}
        self._borrowed = False  # whether what is lowered was borrowed, and not for a slew that ends by itself
        self._notes: list[str] = []
        self._models: tuple[Tc410SlewModel, Tc410SlewModel] | None = None
        self._control = 0
        self._control_known = True  # else a write of it may have reached the unit, or not
        self._last: Reading | None = None
        self._counts: tuple[float, float] | None = None
        self._moved = (math.inf, math.inf)  # by how many counts, between the last two looks
        self._powered = True
        self._looked = math.inf  # POSIX seconds of the last look
        self._seen_at = (math.inf, math.inf)  # POSIX seconds of the positions then
        self._since_look = (0.0, 0.0)  # seconds between the last two positions
        self._slew: SlewWatch | None = None
        self._landing: Landing | None = None
        self._tracked: tuple[TrackedAxis, TrackedAxis] | None = None

    @property
    def capabilities(self) -> Capabilities:
        """It has a position and a stop, and tracks on when the host is gone."""
        return Capabilities(
            has_position=True,
            can_stop=True,
            rate_control=True,
            path_nodes=False,
            holds_rate_alone=True,
            units="counts",
        )

    @property
    def slew_models(self) -> tuple[Tc410SlewModel, Tc410SlewModel]:
        """The landing law of both axes with the unit's registers and all that has been learnt."""
        if self._models is None:
            raise DriveRefused("the drive is not connected; connect first")
        one, two = (
            replace(model, acceleration_scale=known.acceleration_scale, landing_s=known.landing_s)
            for model, known in zip(self._models, self._learnt.axes, strict=True)
        )
        return one, two

    @property
    def start_latency(self) -> float:
        """Seconds from `start` to the motion: as learnt, else at the pace of the exchanges seen so far."""
        known = self._learnt.start_latency_s
        return self._unit.burst_s(_START_EXCHANGES, _START_CHARACTERS) if known is None else known

    @property
    def axes_land_together(self) -> bool:
        """Whether tracking resumes when the whole slew ends: as found out, else as configured."""
        return (self._learnt.slew_idle or self._settings.slew_idle) == "both"

    @property
    def memory(self) -> Mapping[str, object]:
        """Position, boot cookie, registers to restore, and all that has been learnt."""
        return {
            **self._trust.as_json(),
            "learnt": self._learnt.as_json(),
            "meaning": self._settings.meaning,
            "restore": dict(self._lowered),
            "hands": self._hands.barred,
            "encoders": self.encoders.as_json(),
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences from the configuration, assumptions refuted."""
        notes = (*self._notes, *self.encoders.notes)
        found = self._learnt.slew_idle
        if found is None or found == self._settings.slew_idle:
            return notes
        said = (
            f'slew_idle: slews show "{found}", the configuration says "{self._settings.slew_idle}"; planned as seen'
        )
        return (*notes, said)

    # Registers -------------------------------------------------------------------------------------------------

    @property
    def unit(self) -> Unit:
        """The unit's registers, for what this driver has no word of; `borrow` changes one for a while."""
        return self._unit

    @property
    def learnt(self) -> Learnt:
        """All that this unit's slews have taught."""
        return self._learnt

    def borrow(self, changes: Mapping[str, float]) -> None:
        """Change registers until `give_back`, the next slew or the next connection, whichever comes first.

        What they hold is remembered first, so that the next process gives it back when this one cannot.
        """
        found = {name: self._unit.read(name)[name] for name in changes if name not in self._lowered}
        self._lowered, self._borrowed = {**self._lowered, **found}, True
        self._remember(self.memory)
        for name, value in changes.items():
            self._unit.write(name, value)

    def give_back(self) -> None:
        """Write back what was borrowed."""
        self._restore_speed()

    @property
    def lent(self) -> Mapping[str, float]:
        """What the registers that are changed for a while hold otherwise, by name."""
        return dict(self._lowered)

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Identify the unit, find its position format, judge its position, write its soft limits.

        Raises
        ------
        WrongProtocol, DriveRefused
            No TC410 answers; it contradicts the configuration, has no motor drives or does not keep its limits.
        """
        self._control = identify(self._unit)
        if make_safe:
            self.stop(time)
        elif self._control & (_SLEW | _REMOTE):
            self._write_control(self._control & ~(_SLEW | _REMOTE))
        self._unit.position_format = find_position_format(self._unit, self._settings.position_format)
        self._restore_speed()
        self._read_models()
        seen = self._look()
        self._leave_cookie(seen.counts)
        write_soft_limits(self._unit, self._settings)
        self._tracked = self._left_tracking(seen)
        return self.read(time)

    def _read_models(self) -> None:
        self._restore_speed()  # else a speed lowered for one move would be taken for the unit's own
        models, self._notes = read_models(self._unit, self._settings)
        self._models = models

    def _left_tracking(self, seen: Look) -> tuple[TrackedAxis, TrackedAxis] | None:
        """The dead reckoning of a drive that is tracking already."""
        if not self._control & _TRACK:
            return None
        velocities = [self._axis_register(axis, "tracking_velocity") for axis in _AXES]
        return self._tracked_from(seen, (int(velocities[0]), int(velocities[1])))

    def _tracked_from(self, seen: Look, velocities: tuple[int, int]) -> tuple[TrackedAxis, TrackedAxis]:
        one, two = (
            TrackedAxis(counts + 0.5, values.time, velocity, model.law)
            for counts, values, velocity, model in zip(
                seen.counts, seen.positions, velocities, self.slew_models, strict=True
            )
        )
        return one, two

    def _leave_cookie(self, counts: Sequence[float]) -> None:
        """Write target registers that power-up would not leave behind."""
        whole = [int(here) for here in counts]
        self._write_targets(self._encoded("target_position", [here ^ (here == CENTRE) for here in whole]))

    # Reading ---------------------------------------------------------------------------------------------------

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
            tracking=bool(self._control & _TRACK),
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

    def _read_control(self) -> None:
        self._control = int(self._unit.read("velocity_control")["velocity_control"])
        self._control_known = True

    def _look(self) -> Look:
        """Read the unit, and judge at once whether its position can be trusted."""
        one, two = (self._unit.read(f"axis{axis}_position", f"axis{axis}_target_position") for axis in _AXES)
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
        return "remote_control" if self._control & _REMOTE else "tracking"

    def _axis_register(self, axis: int, name: str) -> float:
        return self._unit.read(f"axis{axis}_{name}")[f"axis{axis}_{name}"]

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
        landing = Landing.of(slew, tracking=bool(self._control & _TRACK), together=self.axes_land_together)
        self._tracked = landing.tracked if slew.may_have_arrived(seen.counts, seen.positions, seen.state) else None
        self._landing = landing if undisturbed else None
        if set(slew.targets) == {CENTRE}:  # what power-up leaves behind as well: no cookie
            self._write_control(self._control & ~_SLEW)
            self._leave_cookie((CENTRE, CENTRE))

    def _learn(self) -> None:
        """Take in what the last landing taught."""
        if self._landing is not None and (found := self._landing.found()) is not None:
            self._learnt = self._learnt.landed(self._landing.watch.axes, found)
        self._landing = None

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Write targets and tracking velocities, then raise the slew bit: both axes start in the same tick.

        Raises
        ------
        Unsynchronised, DriveRefused
            The position may be wrong; there is no power, or an alarm stands.
        RegisterError
            A target or rate is outside what the drive can hold; nothing was sent.
        """
        targets = self._encoded("target_position", [slew.target for slew in axes])
        velocities = self._encoded("tracking_velocity", [slew.rate_after / COUNTS_PER_SECOND for slew in axes])
        lowered = self._speeds_to_lower(axes)
        self._learn()
        exchanges = self._unit.exchanges
        reading = self._ready(self.read(time))
        self._slew = self._landing = self._tracked = None
        self._write_control(self._control & ~_SLEW)  # an axis that is led goes on until the slew takes it over
        self._set_speeds(lowered)
        self._write_targets(targets)
        told = [
            self._unit.write_words(f"axis{axis}_tracking_velocity", words)
            for axis, words in zip(_AXES, velocities, strict=True)
        ]
        turned = told if "tracking" in reading.motion else [None, None]  # a drive that tracks obeys at once
        tracks = any(any(words) for words in velocities)
        began = self._write_control(self._control & ~(_TRACK | _REMOTE) | _SLEW | (_TRACK if tracks else 0))
        self._direct.end()
        if self._unit.exchanges - exchanges == _START_EXCHANGES:  # more when it came from motion, or to a lower speed
            self._learnt = self._learnt.started(began - time)
        one, two = (self._watch(i, reading, slew, lowered, began, turned[i]) for i, slew in enumerate(axes))
        self._slew = SlewWatch((one, two))
        return began

    def _encoded(self, name: str, values: Sequence[float]) -> list[tuple[int, ...]]:
        """The words of a register of both axes; what they cannot hold is refused here, before anything is sent."""
        return [self._unit.encoded(f"axis{axis}_{name}", value) for axis, value in zip(_AXES, values, strict=True)]

    def _ready(self, reading: Reading) -> Reading:
        if reading.unsynchronised:
            raise Unsynchronised(reading.unsynchronised)
        if reading.alarms:
            raise DriveRefused(f"power supply alarm: {', '.join(reading.alarms)}; find its cause before moving")
        if not reading.powered:
            raise DriveRefused("the motors have no power (standby); `drive power on`, then try again")
        return reading

    def _speeds_to_lower(self, axes: Sequence[AxisSlew]) -> dict[str, float]:
        """Top speeds for one move that must be slower, by register."""
        lowered = {}
        for axis, slew, model in zip(_AXES, axes, self.slew_models, strict=True):
            if slew.max_rate is not None and slew.max_rate < model.max_rate:
                name = f"axis{axis}_max_speed"
                speed = slew.max_rate / COUNTS_PER_SECOND
                lowered[name] = by_name(name).decode(self._unit.encoded(name, speed))
        return lowered

    def _set_speeds(self, lowered: Mapping[str, float]) -> None:
        """Lower top speeds, having the true ones remembered first; give back what an earlier move lowered."""
        self._restore_speed()
        if not lowered:
            return
        models = dict(zip((f"axis{axis}_max_speed" for axis in _AXES), self.slew_models, strict=True))
        self._lowered = {name: models[name].max_velocity for name in lowered}
        self._remember(self.memory)
        for name, speed in lowered.items():
            self._unit.write(name, speed)

    def _restore_speed(self) -> None:
        for name, value in self._lowered.items():
            self._unit.write(name, value)
        self._borrowed = False
        if self._lowered:
            self._lowered = {}
            self._remember(self.memory)

    def _write_targets(self, words: Sequence[tuple[int, ...]]) -> None:
        """Write both, and have them remembered first: a host that dies in between leaves either in the unit."""
        self._trust.will_hold(words)
        self._remember(self.memory)
        for axis, pair in zip(_AXES, words, strict=True):
            self._unit.write_words(f"axis{axis}_target_position", pair)
        self._trust.holds(words)

    def _watch(
        self,
        i: int,
        reading: Reading,
        slew: AxisSlew,
        lowered: Mapping[str, float],
        began: float,
        turned: float | None,
    ) -> AxisWatch:
        """Watch an axis that began to slew; `turned` when it took up its new tracking rate before that."""
        axis, target = reading.axes[i], round(slew.target)
        model = self.slew_models[i]
        model = replace(model, max_velocity=int(lowered.get(f"axis{i + 1}_max_speed", model.max_velocity)))
        start, rate = axis.counts + axis.rate * (began - reading.time), axis.rate
        if turned is not None:
            start += (slew.rate_after - rate) * (began - turned)
            rate = slew.rate_after
        travel = model.travel(start, target, rate, 0.0)
        return AxisWatch(model, start, rate, target, travel, slew.rate_after, began)

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
        source, register = (_REMOTE, "target_velocity") if path.led else (_TRACK, "tracking_velocity")
        if not self._control & source:
            self._change_source(source, register, tracked)
        for i, axis in enumerate(tracked):
            effective = time + self._unit.burst_s(i + 1, (i + 1) * _WRITE_CHARACTERS + i * _WRITE_ANSWER_CHARACTERS)
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
        self._write_control(self._control & ~(_SLEW | _TRACK | _REMOTE) | source)
        self._tracked = tracked
        if source == _TRACK:
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

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Write both positions and read them back; tracking goes on from there.

        An axis that moves is where `counts` say at `time`; what it moves until the unit is told is added.

        Raises
        ------
        DriveRefused
            A slew is under way, or a position reads back otherwise.
        RegisterError
            A position is outside what the drive can count; nothing was sent.
        """
        self._encoded("position", counts)
        if self._slew is not None:
            raise DriveRefused("a slew is under way; `stop`, then sync")
        self._read_control()
        self._read_models()
        self._set_position(counts, time)
        seen = self._look()
        write_soft_limits(self._unit, self._settings)
        self._tracked = self._left_tracking(seen)
        self.read(time)
        self._remember(self.memory)

    def _set_position(self, counts: Sequence[float], since: float) -> None:
        """Write both positions, those of the time `since`, read them back, and trust them."""
        lost = 0.0  # of a count, for the unit takes whole ones
        for axis, value in zip(_AXES, counts, strict=True):
            here = self._carried(axis, value, since)
            lost = max(lost, abs(here - round(here)))
            pair = self._unit.encoded(f"axis{axis}_position", here)
            written = self._unit.write_words(f"axis{axis}_position", pair)
            self._check_synchronised(axis, pair, written)
        self._leave_cookie(counts)
        self._trust.synchronised()
        self._trust.may_be_off(lost)
        self._powered = True  # motors without power may still settle after it: their loss counts anew
        self._landing = self._tracked = None
        self._compare_encoders = True

    def _carried(self, axis: int, counts: float, since: float) -> float:
        """Where an axis that was at `counts` at the time `since` will be when a write reaches the unit."""
        name = f"axis{axis}_velocity"
        seen = self._unit.read(name)
        reached = seen.time + self._unit.burst_s(1, _ANSWER_CHARACTERS + _WRITE_CHARACTERS)
        return counts + seen[name] * COUNTS_PER_SECOND * (reached - since)

    def _check_synchronised(self, axis: int, words: tuple[int, ...], written: float) -> None:
        wanted = by_name(f"axis{axis}_position").decode(words, self._unit.position_format)
        found = self._unit.read(f"axis{axis}_position", f"axis{axis}_target_position")
        position, rate = found[f"axis{axis}_position"], self._axis_register(axis, "velocity") * COUNTS_PER_SECOND
        expected = wanted + rate * (found.time - written)
        if abs(position - expected) > abs(rate) * (found.late_s + 0.1) + 2.0:
            raise DriveRefused(f"axis {axis} reads back {position:.0f} counts instead of {expected:.0f}; try again")

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
            self._write_control(self._control & ~(_SLEW | _REMOTE | _TRACK | self._hands.barred))
        self._learn()
        self._slew = self._tracked = None

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
            for axis, words in zip(_AXES, velocities, strict=True):
                self._unit.write_words(f"axis{axis}_target_velocity", words)
            self._direct.velocities = velocities
        if not self._control & _REMOTE or self._control & _TRACK:
            self._write_control(self._control & ~(_SLEW | _TRACK) | _REMOTE)

    def power(self, *, on: bool) -> None:
        """Power the motors, or send the drive to standby, in which nothing is left that would go on afterwards."""
        if not on:
            self.stop(0.0)
        self._unit.power(on=on)

    def registers(self) -> Mapping[str, str]:
        """Every readable register by name, as a person reads it."""
        return {shown.register.name: shown.text for shown in self.upkeep.show()}

    def _about_to_write(self, row: Register, words: tuple[int, ...]) -> None:
        """Have remembered what a person's writing will change, and saved nothing that was changed for a while."""
        if row.saved or row.name == "save_configuration":
            self._restore_speed()
        elif row.name.endswith("_target_position"):
            self._trust.will_hold(self._targets_with(row, words))
            self._remember(self.memory)

    def _targets_with(self, row: Register, words: tuple[int, ...]) -> list[tuple[int, ...]]:
        return [words if row.axis == axis else self._unit.words(f"axis{axis}_target_position") for axis in _AXES]

    def _written(self, row: Register, words: tuple[int, ...]) -> None:
        """Take in what a person has written."""
        if row.name == "velocity_control":
            self._control = words[0]
        elif row.name.endswith("_target_position"):
            self._trust.holds(self._targets_with(row, words))
        elif row.name in {"axis1_position", "axis2_position"}:
            self._trust.lose(BY_HAND)
        elif row.name in {"load_factory", "load_configuration"}:
            self._lowered = {}
            self._trust.lose(RELOADED)
            write_soft_limits(self._unit, self._settings)
        if row.saved or row.name.startswith("load_"):
            self._read_models()
        self._remember(self.memory)

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - the contract gives the time to all
        """End direct control, and tracking unless it is kept; give back the top speed."""
        try:
            self._learn()
            if keep_tracking and not self._control & _REMOTE:
                self._write_control(self._control & ~_SLEW)
            else:
                self._halt()
            try:
                self._direct.end()
            finally:  # the unit has ended its slew, whatever becomes of the process beside it
                self._restore_speed()
        finally:
            self._unit.close()

    def _write_control(self, bits: int) -> float:
        self._control_known = False
        written = self._unit.write("velocity_control", bits)
        self._control, self._control_known = bits, True
        return written
