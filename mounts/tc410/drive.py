"""The TC410 behind the Drive contract.

The unit's own registers govern how it moves, so acceleration, deceleration and top speed are read from it and planned
with; a configuration that differs is listed in `notes`. What only the host uses, gearing and soft limits, is the
configuration's; the soft limits are written to the unit and read back before anything moves.

A position may be wrong after a power-cycle. The unit's volatile target registers hold what was last written to them:
they are the boot cookie. When they changed, or the position is further from the last one than the top speed explains,
the position is unsynchronised until `sync`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from mounts.drive import AxisPath, AxisReading, AxisSlew, Capabilities, Reading
from mounts.errors import DriveRefused, Unsynchronised
from mounts.tc410.calibration import AxisWatch, Learnt, learn
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND, by_name, of_axis
from mounts.tc410.settings import TC410Settings
from mounts.tc410.slew import Tc410SlewModel
from mounts.tc410.startup import find_position_format, identify, read_models, write_soft_limits
from mounts.tc410.tracking import BEAT_S, TrackedAxis
from mounts.tc410.unit import Unit, Values
from transports.modbus_ascii import ModbusAscii

_AXES = (1, 2)
_SLEW, _REMOTE, _TRACK = (
    by_name("velocity_control").mask(name) for name in ("slew_to_target", "remote_control", "tracking")
)
_ALARMS = {"supply_shut_down", "supply_over_current", "supply_over_voltage", "supply_under_voltage"}
_LOST = (
    "the drive was power-cycled: its target registers no longer hold what was last written; `sync` on a known star"
)
_NEVER = "the position of this drive was never synchronised; `sync` on a known star"
_STANDBY_STEPS = 2.0  # full steps by which a motor may settle when its power comes back
_CATCH_UP = 200.0  # counts/s beyond the tracking rate while an error is closed: 3′ a second in the manual's gearing
_START_EXCHANGES = 6  # requests of a start, up to the one that sets both axes in motion
_GRACE_S = 0.5  # by which a slew that was never seen to run counts as over
_TIMEOUT_S = 5.0  # by which a slew that goes on has failed


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
    """

    def __init__(
        self,
        modbus: ModbusAscii,
        settings: TC410Settings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None] = lambda memory: None,  # noqa: ARG005 - a test need not
    ) -> None:
        self._unit = Unit(modbus, settings.baud)
        self._settings = settings
        self._memory = dict(memory)
        self._remember = remember
        stored = memory.get("learnt")
        self._learnt = Learnt.from_json(stored if isinstance(stored, Mapping) else {})
        self._unsynchronised = str(memory.get("unsynchronised", _NEVER))
        self._uncertainty = float(memory.get("uncertainty_counts", 0.0))  # type: ignore[arg-type]
        self._lowered: dict[str, float] = dict(memory.get("restore") or {})  # type: ignore[call-overload]
        self._notes: list[str] = []
        self._models: tuple[Tc410SlewModel, Tc410SlewModel] | None = None
        self._control = 0
        self._cookie: list[list[int]] | None = None
        self._tracked: tuple[TrackedAxis, TrackedAxis] | None = None
        self._watches: tuple[AxisWatch, AxisWatch] | None = None
        self._due = -math.inf  # when the slew under way ought to end
        self._seen_slewing = False
        self._exchange_s = 0.0
        self._last: Reading | None = None

    # What it is ------------------------------------------------------------------------------------------------

    @property
    def capabilities(self) -> Capabilities:
        """A position, a stop, rates on both axes; no path nodes; tracks on alone."""
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
        return self._models

    @property
    def start_latency(self) -> float:
        """Seconds from `start` to the motion: as learnt, else at the pace of the exchanges seen so far."""
        known = self._learnt.start_latency_s
        return _START_EXCHANGES * self._exchange_s if known is None else known

    @property
    def axes_land_together(self) -> bool:
        """Whether tracking resumes when the whole slew ends: as found out, else as configured."""
        return (self._learnt.slew_idle or self._settings.slew_idle) == "both"

    @property
    def memory(self) -> Mapping[str, object]:
        """Position, boot cookie, registers to restore, and all that has been learnt."""
        return self._memory | {
            "learnt": self._learnt.as_json(),
            "unsynchronised": self._unsynchronised,
            "uncertainty_counts": self._uncertainty,
            "restore": dict(self._lowered),
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences from the configuration, assumptions refuted."""
        found = self._learnt.slew_idle
        if found is None or found == self._settings.slew_idle:
            return tuple(self._notes)
        said = (
            f'slew_idle: slews show "{found}", the configuration says "{self._settings.slew_idle}"; planned as seen'
        )
        return (*self._notes, said)

    # Connecting ------------------------------------------------------------------------------------------------

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Identify the unit, find its position format, judge its position, write its soft limits."""
        self._control = identify(self._unit)
        if make_safe:
            self.stop(time)
        elif self._control & (_SLEW | _REMOTE):
            self._write_control(self._control & ~(_SLEW | _REMOTE))
        self._unit.position_format = find_position_format(self._unit, self._settings.position_format)
        self._restore_speed()
        self._models, self._notes = read_models(self._unit, self._settings, self._learnt)
        self._judge_position(time)
        self._leave_cookie()
        write_soft_limits(self._unit, self._settings)
        reading = self.read(time)
        self._exchange_s = (reading.time - time) / self._unit.exchanges
        if self._control & _TRACK:
            self._take_over_tracking(reading)
        return reading

    def _restore_speed(self) -> None:
        for name, value in self._lowered.items():
            self._unit.write(name, value)
        self._lowered = {}

    def _judge_position(self, time: float) -> None:
        """Compare the unit with what was last known of it."""
        last, cookies = self._memory.get("position"), self._memory.get("cookies")
        if self._unsynchronised or not isinstance(last, list) or not isinstance(cookies, list):
            return
        values = self._position(1), self._position(2)
        if not all(words in kept for words, kept in zip(_targets_in(values), cookies, strict=True)):
            self._lose(_LOST)
            return
        elapsed = max(0.0, time - float(self._memory["time"]))  # type: ignore[arg-type]
        for axis, value, before, model in zip(_AXES, values, last, self.slew_models, strict=True):
            moved = abs(value[f"axis{axis}_position"] - before)
            if moved > model.max_rate * elapsed + 2.0:
                self._lose(
                    f"axis {axis} stands {moved:.0f} counts from where it was {elapsed:.0f} s ago, "
                    "more than its top speed explains; `sync` on a known star"
                )

    def _leave_cookie(self) -> None:
        """Write target registers that power-up would not leave behind."""
        targets = [int(self._position(axis)[f"axis{axis}_position"]) for axis in _AXES]
        self._write_targets([target ^ 1 if target == CENTRE else target for target in targets])

    def _take_over_tracking(self, reading: Reading) -> None:
        """Go on from a drive that was left tracking."""
        velocities = [
            int(self._unit.read(f"axis{axis}_tracking_velocity")[f"axis{axis}_tracking_velocity"]) for axis in _AXES
        ]
        one, two = (
            TrackedAxis(axis.counts, reading.time, velocity, model.acceleration << 8)
            for axis, velocity, model in zip(reading.axes, velocities, self.slew_models, strict=True)
        )
        self._tracked = (one, two)

    # Reading ---------------------------------------------------------------------------------------------------

    def read(self, time: float) -> Reading:
        """Positions, flags and alarms; the position is lost when the boot cookie is.

        Raises
        ------
        DriveRefused
            A slew goes on long after it should have ended; it was stopped.
        """
        values = self._position(1), self._position(2)
        state = self._unit.read("slew_flags", "supply_flags")
        self._check_cookie(values)
        supply = set(by_name("supply_flags").asserted(int(state["supply_flags"])))
        powered = "motor_power_enabled" in supply
        if not powered:
            widest = max(axis.counts_per_step for axis in self._settings.axes)
            self._uncertainty = max(self._uncertainty, _STANDBY_STEPS * widest)
        running = set(by_name("slew_flags").asserted(int(state["slew_flags"])))
        slewing = ("axis1_slewing" in running, "axis2_slewing" in running)
        self._see_slew(values, slewing, state.time)
        reading = Reading(
            time=state.time,
            axes=tuple(
                self._axis_reading(i, values[i], state.time, slewing=self._watches is not None or slewing[i])
                for i in (0, 1)
            ),
            motion=by_name("movement_flags").asserted(int(state["movement_flags"])),
            limits=by_name("limit_flags").asserted(int(state["limit_flags"])),
            alarms=tuple(sorted(supply & _ALARMS)),
            powered=powered,
            tracking=bool(self._control & _TRACK),
            unsynchronised=self._unsynchronised,
        )
        self._last = reading
        counts = [values[i][f"axis{axis}_position"] for i, axis in enumerate(_AXES)]
        self._memory |= {"position": counts, "time": reading.time}
        if self._watches is not None and time > self._due + _TIMEOUT_S:
            self.stop(time)
            raise DriveRefused(
                f"the slew goes on {time - self._due:.1f} s after it should have ended; it was stopped. "
                "Check that nothing blocks the telescope, then go again"
            )
        return reading

    def _position(self, axis: int) -> Values:
        return self._unit.read(f"axis{axis}_position", f"axis{axis}_target_position")

    def _check_cookie(self, values: tuple[Values, Values]) -> None:
        if self._cookie is not None and _targets_in(values) != self._cookie and not self._unsynchronised:
            self._lose(_LOST)

    def _lose(self, why: str) -> None:
        self._unsynchronised = why
        self._tracked = None
        self._watches = None

    def _axis_reading(self, i: int, values: Values, time: float, *, slewing: bool) -> AxisReading:
        counts = values[f"axis{i + 1}_position"]
        if self._tracked is None:
            return AxisReading(counts + 0.5, self._uncertainty + 0.5, 0.0, slewing)
        tracked = self._tracked[i]
        tracked.observe(counts, values.time)
        rate = tracked.velocity * COUNTS_PER_SECOND
        return AxisReading(tracked.at(time), self._uncertainty + 0.5, rate, slewing)

    def _see_slew(self, values: tuple[Values, Values], slewing: tuple[bool, bool], time: float) -> None:
        """Follow a slew under way, and take up the dead reckoning where it has landed."""
        watches = self._watches
        if watches is None:
            return
        for i, watch in enumerate(watches):
            counts = values[i][f"axis{i + 1}_position"]
            watch.see(counts, time, slewing=slewing[i], other_slewing=slewing[1 - i])
        self._seen_slewing |= any(slewing)
        at_target = all(
            abs(values[i][f"axis{i + 1}_position"] - watch.target) <= 1.0 for i, watch in enumerate(watches)
        )
        if any(slewing) or not (self._seen_slewing or at_target or time > self._due + _GRACE_S):
            return
        self._watches = None
        if at_target or all(self._landed_near(i, watches[i], values[i], time) for i in (0, 1)):
            self._learnt = learn(self._learnt, watches)
            self._models = self._with_learnt()
        if self._control & _TRACK:
            landed = [watch.began + (watch.landed_after or watch.travel.duration) for watch in watches]
            if self.axes_land_together:
                landed = [max(landed)] * 2
            one, two = (self._tracked_from(i, watches[i], values[i], landed[i]) for i in (0, 1))
            self._tracked = (one, two)

    def _landed_near(self, i: int, watch: AxisWatch, values: Values, time: float) -> bool:
        """Whether an axis stands where an undisturbed slew would have left it."""
        gone = abs(watch.rate_after) * (time - watch.began)
        return abs(values[f"axis{i + 1}_position"] - watch.target) <= gone + 1.0

    def _tracked_from(self, i: int, watch: AxisWatch, values: Values, landed: float) -> TrackedAxis:
        velocity = round(watch.rate_after / COUNTS_PER_SECOND)
        tracked = TrackedAxis(watch.target, landed, 0, watch.model.acceleration << 8)
        tracked.command(velocity, landed)
        tracked.observe(values[f"axis{i + 1}_position"], values.time)
        return tracked

    def _with_learnt(self) -> tuple[Tc410SlewModel, Tc410SlewModel]:
        one, two = (
            replace(model, acceleration_scale=known.acceleration_scale, landing_s=known.landing_s)
            for model, known in zip(self.slew_models, self._learnt.axes, strict=True)
        )
        return one, two

    # Moving ----------------------------------------------------------------------------------------------------

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Write targets and tracking velocities, then raise the slew bit: both axes start in the same tick.

        Raises
        ------
        Unsynchronised, DriveRefused
            The position may be wrong; there is no power, or an alarm stands.
        """
        reading = self._ready(self._last or self.read(time))
        self._watches = None
        self._write_control(self._control & ~(_SLEW | _REMOTE))
        self._limit_speed(axes)
        self._write_targets([round(slew.target) for slew in axes])
        velocities = [round(slew.rate_after / COUNTS_PER_SECOND) for slew in axes]
        for axis, velocity in zip(_AXES, velocities, strict=True):
            self._unit.write(f"axis{axis}_tracking_velocity", velocity)
        began = self._write_control(self._control & ~_TRACK | _SLEW | (_TRACK if any(velocities) else 0))
        known = self._learnt.start_latency_s
        latency = began - time if known is None else known + 0.5 * (began - time - known)
        self._learnt = replace(self._learnt, start_latency_s=latency)
        one, two = (self._watch(i, reading, slew, began) for i, slew in enumerate(axes))
        self._watches, self._tracked, self._seen_slewing = (one, two), None, False
        self._due = began + max(one.travel.duration, two.travel.duration)
        return began

    def _ready(self, reading: Reading) -> Reading:
        if self._unsynchronised:
            raise Unsynchronised(self._unsynchronised)
        if not reading.powered:
            raise DriveRefused("the motors have no power (standby); `drive power on`, then try again")
        if reading.alarms:
            raise DriveRefused(f"power supply alarm: {', '.join(reading.alarms)}; find its cause before moving")
        return reading

    def _limit_speed(self, axes: Sequence[AxisSlew]) -> None:
        """Lower the top speed for one move, or give back what an earlier move lowered."""
        self._restore_speed()
        for axis, slew, model in zip(_AXES, axes, self.slew_models, strict=True):
            if slew.max_rate is not None and slew.max_rate < model.max_rate:
                name = f"axis{axis}_max_speed"
                self._lowered[name] = model.max_velocity
                self._remember(self.memory)
                self._unit.write(name, slew.max_rate / COUNTS_PER_SECOND)

    def _write_targets(self, targets: Sequence[int]) -> None:
        """Write both, and have them remembered first: a host that dies in between leaves either in the unit."""
        before = self._cookie or [[], []]
        self._cookie = [
            list(of_axis(axis, "target_position").encode(target, self._unit.position_format))
            for axis, target in zip(_AXES, targets, strict=True)
        ]
        self._memory["cookies"] = [list(pair) for pair in zip(before, self._cookie, strict=True)]
        self._remember(self.memory)
        for axis, target in zip(_AXES, targets, strict=True):
            self._unit.write(f"axis{axis}_target_position", target)

    def _watch(self, i: int, reading: Reading, slew: AxisSlew, began: float) -> AxisWatch:
        axis, model, target = reading.axes[i], self.slew_models[i], round(slew.target)
        if f"axis{i + 1}_max_speed" in self._lowered and slew.max_rate is not None:
            model = replace(model, max_velocity=int(slew.max_rate / COUNTS_PER_SECOND) & ~0xFF)
        start = axis.counts + axis.rate * (began - reading.time)
        travel = model.travel(start, target, axis.rate, 0.0)
        return AxisWatch(model, start, axis.rate, target, travel, slew.rate_after, began)

    def follow(self, path: AxisPath, time: float) -> None:
        """Set the tracking velocities that bring both axes onto the path within a beat."""
        if self._watches is not None:
            return
        reading = self._ready(self._last or self.read(time))
        if self._tracked is None:
            one, two = (
                TrackedAxis(axis.counts, reading.time, 0, model.acceleration << 8)
                for axis, model in zip(reading.axes, self.slew_models, strict=True)
            )
            self._tracked = (one, two)
        effective = time + self._exchange_s
        here, ahead = path.at(effective), path.at(effective + BEAT_S)
        for axis, tracked, (now, _), (then, _) in zip(_AXES, self._tracked, here, ahead, strict=True):
            velocity = tracked.velocity_for(then, (then - now) / BEAT_S, effective, _CATCH_UP)
            if velocity != tracked.velocity or not self._control & _TRACK:
                tracked.command(velocity, self._unit.write(f"axis{axis}_tracking_velocity", velocity))
        if not self._control & _TRACK:
            began = self._write_control(self._control | _TRACK)
            for tracked in self._tracked:
                tracked.time = began

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Write both positions and read them back; tracking goes on from there.

        Raises
        ------
        DriveRefused
            A position reads back otherwise.
        """
        for axis, value in zip(_AXES, counts, strict=True):
            wanted = round(value)
            self._unit.write(f"axis{axis}_position", wanted)
            found = self._position(axis)[f"axis{axis}_position"]
            if abs(found - wanted) > self.slew_models[axis - 1].max_rate * self._exchange_s + 2.0:
                raise DriveRefused(f"axis {axis} reads back {found:.0f} counts instead of {wanted}; try again")
        self._unsynchronised, self._uncertainty = "", 0.0
        self._tracked = None
        self._leave_cookie()
        write_soft_limits(self._unit, self._settings)
        reading = self.read(time)
        if self._control & _TRACK:
            self._take_over_tracking(reading)

    def stop(self, time: float) -> None:  # noqa: ARG002 - the contract gives the time to all
        """Stop everything: "all stop" leaves tracking running, so its bit is cleared too."""
        self._unit.write("all_stop", 1)
        self._write_control(self._control & ~(_SLEW | _REMOTE | _TRACK))
        self._watches = None
        self._tracked = None

    def power(self, *, on: bool) -> None:
        """Power the motors or send the drive to standby."""
        self._unit.power(on=on)

    def registers(self) -> Mapping[str, str]:
        """Every readable register by name, with its unit or its named flags."""
        return self._unit.all_readable()

    def close(self, time: float, *, keep_tracking: bool) -> None:
        """End direct control, and tracking unless it is kept; give back the top speed."""
        if keep_tracking:
            self._write_control(self._control & ~(_SLEW | _REMOTE))
        else:
            self.stop(time)
        self._restore_speed()
        self._unit.close()

    def _write_control(self, bits: int) -> float:
        self._control = bits
        return self._unit.write("velocity_control", bits)


def _targets_in(values: Sequence[Values]) -> list[list[int]]:
    """Return the raw target registers of both axes."""
    return [list(value.words[f"axis{axis}_target_position"]) for axis, value in zip(_AXES, values, strict=True)]
