"""The TC410 simulated on the wire: requests in, answers out, motors turning between them.

The registers of the table are all there with their access; undefined addresses answer exception 2, impossible values
exception 3. Motion is computed by the unit's own ticks up to the time of each call; a command acts from the next
tick on, a position is as of the end of the request.
"""

import random
import struct
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from mounts.errors import DriveError
from mounts.tc410.axis import FRACTION_BITS, STEPS, SimulatedAxis
from mounts.tc410.registers import CENTRE, Kind, Register, RegisterError, at, by_name, of_axis
from mounts.tc410.simulator_memory import FACTORY, Memory
from mounts.tc410.simulator_senses import fans, measure, soft_limit_counts, states
from mounts.tc410.simulator_settings import PERFECT_HARDWARE, AxisHardware, SimulatorSettings
from mounts.tc410.simulator_sources import Sources, Surroundings
from transports.modbus_slave import IllegalAddress, IllegalValue, ModbusSlave

TICK_S = 0.002
_STEP_TOLERANCE = 1e-2  # of a 50 µs step: POSIX seconds resolve 0.24 µs
_RANDOM = "<625I"  # the words of the generator's state
_CONTROL = by_name("velocity_control")
_SLEW = _CONTROL.mask("slew_to_target")


class SimulatedTC410:
    """A TC410 with two motors; keeps `transports.memory.Device` and `transports.modbus_slave.RegisterBank`.

    Parameters
    ----------
    settings : SimulatorSettings
        How this unit differs from the ideal.
    t0 : float
        POSIX time at which it starts.
    hardware : tuple of AxisHardware
        Motors, gears, encoders and limit switches of the axes.
    configuration : mapping, optional
        Register values by name in its non-volatile memory, beyond the factory's and the hardware's gears.
    positions : tuple of int
        Counts at which the axes stand, and which the unit counts, at `t0`.
    """

    def __init__(
        self,
        settings: SimulatorSettings,
        t0: float,
        hardware: tuple[AxisHardware, AxisHardware] = PERFECT_HARDWARE,
        configuration: Mapping[str, float] | None = None,
        positions: tuple[int, int] = (CENTRE, CENTRE),
    ) -> None:
        self.settings = settings
        self.hardware = hardware
        self.surroundings = Surroundings()
        self.random = random.Random(settings.seed)  # noqa: S311
        self.axes = tuple(SimulatedAxis(counts << FRACTION_BITS) for counts in positions)
        self.coil = self.powered = settings.power_at_boot
        self.fans: tuple[bool, ...] = (False, False, False)
        bolted = {**_gears(hardware), **_encoder_zeros(settings, hardware)}
        self.memory = Memory(settings.position_format, {**bolted, **(configuration or {})})
        self._t0 = t0
        self._tick = 0  # the boundary at which the tick under way ends
        self._step = STEPS  # how many 50 µs steps of it have passed
        self._slave = ModbusSlave(self)
        self._apply()

    # Time ------------------------------------------------------------------------------------------------------

    @property
    def lines(self) -> "tuple[SimulatedTC410]":
        """The one line, at whose far end this unit is."""
        return (self,)

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers."""
        self.advance(t)
        return self._slave.receive(data)

    def advance(self, t: float) -> None:
        """Let the motors run until POSIX `t`; a time already passed changes nothing."""
        tick_s = TICK_S * (1.0 + self.settings.clock_drift_ppm * 1e-6)
        steps = int((t - self._t0) / tick_s * STEPS + _STEP_TOLERANCE)
        if t < self._t0 or steps <= (self._tick - 1) * STEPS + self._step:
            return
        ticks = steps // STEPS + 1 - self._tick
        self._tick, self._step = self._tick + ticks, steps % STEPS
        if self.powered:
            self._run(ticks)
        self.fans = fans(self)

    def _run(self, ticks: int) -> None:
        while ticks > 0:
            wanted = self._sources.velocities()
            if not self._slewing:
                for axis, velocity in zip(self.axes, wanted, strict=True):
                    axis.follow(velocity, ticks)
                return
            ticks -= self._slew(ticks, wanted if self.settings.slew_idle == "per-axis" else (0, 0))

    def _slew(self, ticks: int, meanwhile: tuple[int, int]) -> int:
        """Run until both axes have landed, for at most `ticks`; one that has landed goes on with `meanwhile`."""
        taken = [axis.slew(ticks) for axis in self.axes]
        used = ticks if self._slewing else max(1, *taken)
        for axis, slewed, velocity in zip(self.axes, taken, meanwhile, strict=True):
            axis.follow(velocity, used - slewed)
        if not self._slewing:
            self._slew_ended()
        return used

    # What moves the axes ---------------------------------------------------------------------------------------

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the sources that move the telescope, as the movement flags have them."""
        source = self._sources.active
        below = (source,) if source and self.powered else ()
        if not self._slewing:
            return below
        return ("slewing", *below) if self.settings.slew_idle == "per-axis" else ("slewing",)

    @property
    def _slewing(self) -> bool:
        return any(axis.slewing for axis in self.axes)

    @property
    def _sources(self) -> Sources:
        return Sources(self.settings, self.memory, self.surroundings)

    def _set_control(self, word: int) -> None:
        """Set the velocity control flags; a slew begins when its bit is set, and ends when it is cleared."""
        begins = word & _SLEW and not self.memory.raw(_CONTROL.name) & _SLEW
        self.memory.put(_CONTROL, (word,))
        for axis in self.axes:
            if begins and self.powered:
                axis.begin_slew()
            elif not word & _SLEW:
                axis.end_slew()

    def _slew_ended(self) -> None:
        if self.settings.slew_bit_clears:
            self.memory.put(_CONTROL, (self.memory.raw(_CONTROL.name) & ~_SLEW,))

    def _all_stop(self) -> None:
        self._set_control(self.memory.raw(_CONTROL.name) & ~_SLEW)
        for number in (1, 2):
            self.memory.put(of_axis(number, "target_velocity"), (0, 0))

    def _apply(self) -> None:
        """Let the axes follow their registers."""
        ramp = 0x100 * (1.0 + self.settings.acceleration_error)
        for number, (axis, hardware) in enumerate(zip(self.axes, self.hardware, strict=True), start=1):
            axis.acceleration = round(self.memory.raw(f"axis{number}_acceleration") * ramp)
            axis.deceleration = round(self.memory.raw(f"axis{number}_deceleration") * ramp)
            axis.top = self.memory.raw(f"axis{number}_max_speed") << self.settings.speed_shift
            axis.target = self.memory.counts(f"axis{number}_target_position") << FRACTION_BITS
            axis.landing_ticks = round(self.settings.landing_s / TICK_S)
            axis.landing_distance = self.settings.landing_counts << FRACTION_BITS
            axis.lower, axis.upper = (limit << FRACTION_BITS for limit in self.soft_limits(number))
            if hardware.negative_switch is not None:
                axis.lower = max(axis.lower, (hardware.negative_switch << FRACTION_BITS) - axis.offset)
            if hardware.positive_switch is not None:
                axis.upper = min(axis.upper, (hardware.positive_switch << FRACTION_BITS) - axis.offset)

    # Power -----------------------------------------------------------------------------------------------------

    def _switch_power(self) -> None:
        """Follow the power's switches; an axis without power may be turned by a few steps before it holds again."""
        around = self.surroundings
        on = (self.coil or around.manual_power) and "supply_shut_down" not in around.alarms
        if on == self.powered:
            return
        self.powered = on
        for axis, hardware in zip(self.axes, self.hardware, strict=True):
            if on:
                most = int(self.settings.standby_steps * hardware.counts_per_step)
                axis.offset += self.random.randint(-most, most) << FRACTION_BITS
            else:
                axis.halt(self._step)
                self._slew_ended()
        self._apply()

    def power_cycle(self) -> None:
        """Switch the unit off and on: positions go to the centre count, and what was not saved is lost."""
        for axis in self.axes:
            axis.halt(self._step)
            axis.synchronise(CENTRE << FRACTION_BITS, self._step)
        self.memory.put(_CONTROL, (0,))
        self.memory.forget_latches()
        self.memory.recall()
        if self.settings.volatile_targets:
            self.memory.forget_targets()
        self.coil = self.powered = self.settings.power_at_boot
        self._apply()

    # What people do --------------------------------------------------------------------------------------------

    def disturb(self, **changes: Any) -> None:  # noqa: ANN401 - the fields of Surroundings
        """Change the surroundings, as in ``disturb(alarms=("supply_shut_down",))``, from the next tick on."""
        self.surroundings = replace(self.surroundings, **changes)
        self._switch_power()
        self.fans = fans(self)

    def joystick(self, x: int, y: int) -> None:
        """Hold the joystick at these ADC values, 128 being the centre."""
        self.disturb(joystick=(x, y))

    def press_limit(self, axis: int, direction: int) -> None:
        """Close the limit switch of axis 1 or 2 right where the axis is; `direction` is +1 or −1."""
        here = round(self.true_position(axis))
        one, two = self.hardware
        bolted = self.hardware[axis - 1]
        bolted = replace(bolted, positive_switch=here) if direction > 0 else replace(bolted, negative_switch=here)
        self.hardware = (bolted, two) if axis == 1 else (one, bolted)
        self._apply()

    # What is true ----------------------------------------------------------------------------------------------

    def true_position(self, axis: int) -> float:
        """Where axis 1 or 2 really is: counts with all 24 bits of fraction, whatever the unit believes."""
        simulated = self.axes[axis - 1]
        return (simulated.position + simulated.offset - simulated.moved * (STEPS - self._step)) / (1 << FRACTION_BITS)

    def counted_position(self, axis: int) -> float:
        """Where the unit believes axis 1 or 2 to be: counts with all 24 bits of fraction."""
        return self.axes[axis - 1].at_step(self._step) / (1 << FRACTION_BITS)

    def soft_limits(self, axis: int) -> tuple[int, int]:
        """Soft limits of axis 1 or 2 in counts, as this unit takes its registers."""
        negative, positive = (
            soft_limit_counts(self.memory.raw(f"axis{axis}_{side}_limit"), self.settings.limit_shift)
            for side in ("negative", "positive")
        )
        return negative, positive

    # Registers on the wire -------------------------------------------------------------------------------------

    def read_coils(self, address: int, count: int) -> list[bool]:
        """Return the power coil."""
        _rows("coil", address, count)
        return [self.coil]

    def write_coils(self, address: int, values: list[bool]) -> None:
        """Power the motors, or send them to standby."""
        _rows("coil", address, len(values))
        self.coil = values[0]
        self._switch_power()

    def read_discrete_inputs(self, address: int, count: int) -> list[bool]:
        """Return the named states."""
        rows, now = _rows("discrete", address, count), states(self)
        return [now[register.name] for register in rows]

    def read_input_registers(self, address: int, count: int) -> list[int]:
        """Return measurements and flags."""
        rows = _rows("input", address, count)
        now = states(self) if any(register.flags for register in rows) else {}
        words = {register.address: measure(self, register, now) for register in dict.fromkeys(rows)}
        return [words[register.address][address + i - register.address] for i, register in enumerate(rows)]

    def read_holding_registers(self, address: int, count: int) -> list[int]:
        """Return configuration and control; the actions cannot be read."""
        if any(register.access == "write" for register in _rows("holding", address, count)):
            raise IllegalAddress(f"0x{address:02X}: an action cannot be read")
        for number in (1, 2):
            self.memory.put_counts(f"axis{number}_position", int(self.counted_position(number)))
        return [self.memory.word(address + index) for index in range(count)]

    def write_registers(self, address: int, values: list[int]) -> None:
        """Write in rising order; a request with an impossible value changes nothing before it."""
        rows = _rows("holding", address, len(values))
        for register, value in zip(rows, values, strict=True):
            if register.words == 1 and not register.accepts((value,)):
                raise IllegalValue(f"{register.name} does not take {value}")
        for index, (register, value) in enumerate(zip(rows, values, strict=True)):
            words = self.memory.complete(register, address + index, value)
            if words is not None:
                self._write(register, words)

    def _write(self, register: Register, words: tuple[int, ...]) -> None:
        match register.name:
            case "velocity_control":
                self._set_control(words[0])
            case "all_stop":
                self._all_stop()
            case "load_factory":
                self.memory.load(FACTORY)
            case "save_configuration":
                self.memory.save()
            case "load_configuration":
                self.memory.recall()
            case "axis1_position" | "axis2_position":
                counts = self.memory.counts_of(words)
                self.axes[register.axis - 1].synchronise(counts << FRACTION_BITS, self._step)
            case _:
                self.memory.put(register, words)
        self._apply()

    # Snapshots -------------------------------------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as JSON-able values; settings and hardware are not in it."""
        version, internal, gauss = self.random.getstate()
        return {
            "t0": self._t0,
            "tick": self._tick,
            "step": self._step,
            "coil": self.coil,
            "powered": self.powered,
            "fans": list(self.fans),
            "memory": self.memory.state(),
            "axes": [axis.state() for axis in self.axes],
            "surroundings": dict(vars(self.surroundings)),
            "random": [version, struct.pack(_RANDOM, *internal).hex(), gauss],
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot; the motors catch up with the time since at the next call.

        Raises
        ------
        DriveError
            This is no snapshot of such a unit; nothing has changed.
        """
        before = self.snapshot()
        try:
            self._restore(snapshot)
        except (LookupError, TypeError, ValueError, AttributeError, struct.error) as error:
            self._restore(before)
            raise DriveError(
                f"the stored state of the simulated TC410 cannot be read ({error!r}); delete it to start at park",
            ) from error

    def _restore(self, snapshot: Mapping[str, Any]) -> None:
        self._t0, self._tick, self._step = snapshot["t0"], snapshot["tick"], snapshot["step"]
        self.coil, self.powered, self.fans = snapshot["coil"], snapshot["powered"], tuple(snapshot["fans"])
        self.memory.restore(snapshot["memory"])
        one, two = snapshot["axes"]
        self.axes = (SimulatedAxis(**one), SimulatedAxis(**two))
        around: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in snapshot["surroundings"].items()
        }
        self.surroundings = Surroundings(**around)
        version, kept, gauss = snapshot["random"]  # a text, or the numbers themselves where an older program kept it
        internal = struct.unpack(_RANDOM, bytes.fromhex(kept)) if isinstance(kept, str) else tuple(kept)
        self.random.setstate((version, internal, gauss))
        self._apply()


def _rows(kind: Kind, address: int, count: int) -> list[Register]:
    try:
        return [at(kind, address + index) for index in range(count)]
    except RegisterError as error:
        raise IllegalAddress(str(error)) from error


def _gears(hardware: tuple[AxisHardware, AxisHardware]) -> dict[str, float]:
    values: dict[str, float] = {}
    for number, axis in enumerate(hardware, start=1):
        values[f"axis{number}_motor_steps"] = axis.motor_steps
        for gear, ratio in (("main", axis.main_gear), ("secondary", axis.secondary_gear)):
            values[f"axis{number}_{gear}_gear_multiplier"] = ratio.numerator
            values[f"axis{number}_{gear}_gear_divisor"] = ratio.denominator
    return values


def _encoder_zeros(
    settings: SimulatorSettings,
    hardware: tuple[AxisHardware, AxisHardware],
) -> dict[str, float]:
    """Encoder readings where the position is zero: at the centre count, or at count 0."""
    turned = 0 if settings.encoder_zero_at == "centre" else -CENTRE
    return {
        f"axis{number}_encoder_zero": round(
            axis.encoder_at_centre + (-turned if axis.encoder_reversed else turned) * axis.turns_per_count * 0x10000
        )
        % 0x10000
        for number, axis in enumerate(hardware, start=1)
        if axis.encoder_bits
    }
