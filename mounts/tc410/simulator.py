"""The TC410 simulated on the wire: requests in, answers out, motors turning between them.

The registers of the table are all there with their access; undefined addresses answer exception 2, impossible values
exception 3. Motion is computed by the unit's own ticks up to the time of each call; a command acts from the next
tick on, a position is as of the end of the request. Which source moves the axes follows Table 15 of the manual.
"""

import random
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from mounts.tc410.axis import FRACTION_BITS, STEPS, SimulatedAxis
from mounts.tc410.registers import (
    CENTRE,
    DRIVE_TYPES,
    REGISTERS,
    Flag,
    Kind,
    Register,
    RegisterError,
    at,
    binary_to_gray,
    by_name,
    gray_to_binary,
    of_axis,
)
from mounts.tc410.simulator_settings import PERFECT_HARDWARE, AxisHardware, SimulatorSettings
from transports.modbus_slave import IllegalAddress, IllegalValue, ModbusSlave

TICK_S = 0.002
_STEP_TOLERANCE = 1e-2  # of a 50 µs step: POSIX seconds resolve 0.24 µs
ARCSEC_PER_TURN = 1296000.0
_LOGARITHMIC = 0x80
_LOGARITHMIC_DECADES = 4.2  # 42 dB
_CONTROL = by_name("velocity_control")
_TARGETS = ("target_position", "target_velocity")

FACTORY: Mapping[str, float] = {
    "joystick_mode": 8,
    "autoguider_mode": 14,
    "fan_start_temperature": 45.0,
    "fan_stop_temperature": 40.0,
    **{
        f"axis{axis}_{name}": value
        for axis in (1, 2)
        for name, value in (
            ("positive_limit", 0xFFFF00),
            ("acceleration", 26),
            ("deceleration", 26),
            ("max_speed", 0xFFFF00),
            ("motor_current", 1.0),
            ("motor_steps", 200),
            ("main_gear_multiplier", 1),
            ("main_gear_divisor", 1),
            ("secondary_gear_multiplier", 1),
            ("secondary_gear_divisor", 1),
            ("park", CENTRE),
        )
    },
}


@dataclass(frozen=True)
class Surroundings:
    """What people and weather do to the unit.

    Attributes
    ----------
    joystick, autoguider : tuple of int, optional
        ADC values of both axes, 0 to 255; None when not plugged in.
    directions : tuple of str
        Digital autoguider inputs asserted: "north", "south", "east", "west".
    manual_power : bool
        The switch on the unit that powers the motors whatever the coil says.
    alarms : tuple of str
        Supply alarms standing: "supply_shut_down" (which cuts the motors), "supply_over_current", ….
    temperatures_c : tuple of float
        Inside the drive, motor controllers of axis 1 and 2.
    """

    joystick: tuple[int, int] | None = None
    autoguider: tuple[int, int] | None = None
    directions: tuple[str, ...] = ()
    manual_power: bool = False
    alarms: tuple[str, ...] = ()
    temperatures_c: tuple[float, float, float] = (25.0, 25.0, 25.0)


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
        self._t0 = t0
        self._tick = 0  # the tick under way ends at this boundary; 0 before the first
        self._step = STEPS  # 50 µs steps of it that have passed
        self._rng = random.Random(settings.seed)  # noqa: S311
        self._slave = ModbusSlave(self)
        self._coil = settings.power_at_boot
        self._powered = settings.power_at_boot
        self._fans = [False, False, False]
        self._latch: dict[int, int] = {}
        self._words = {
            register.address + word: 0
            for register in REGISTERS
            if register.kind == "holding"
            for word in range(register.words)
        }
        self._axes = tuple(SimulatedAxis(counts << FRACTION_BITS) for counts in positions)
        self._reset_targets()
        self._load({**FACTORY, **_gears(hardware), **_encoder_zeros(settings, hardware), **(configuration or {})})
        self._saved = self._configuration()

    # Time ------------------------------------------------------------------------------------------------------

    def receive(self, data: bytes, t: float) -> bytes:
        """Take bytes that arrived at POSIX `t`; return the answers."""
        self.advance(t)
        return self._slave.receive(data)

    def advance(self, t: float) -> None:
        """Let the motors run until POSIX `t`; a time already passed changes nothing."""
        tick_s = TICK_S * (1.0 + self.settings.clock_drift_ppm * 1e-6)
        steps = int((t - self._t0) / tick_s * STEPS + _STEP_TOLERANCE)
        tick = steps // STEPS + 1
        if tick < self._tick or (tick == self._tick and steps % STEPS < self._step):
            return
        ticks = tick - self._tick
        self._tick, self._step = tick, steps % STEPS
        if self._powered:
            self._run(ticks)
        self._switch_fans()

    def _run(self, ticks: int) -> None:
        while ticks > 0:
            used = ticks
            wanted = self._wanted()
            if self._slewing:
                used_by_axis = [axis.slew(ticks) for axis in self._axes]
                used = ticks if self._slewing else max(1, *used_by_axis)
                if self.settings.slew_idle == "both":
                    wanted = (0, 0)
                for axis, taken, velocity in zip(self._axes, used_by_axis, wanted, strict=True):
                    axis.follow(velocity, used - taken)
                if not self._slewing:
                    self._slew_ended()
            else:
                for axis, velocity in zip(self._axes, wanted, strict=True):
                    axis.follow(velocity, ticks)
            ticks -= used

    # What moves the axes ---------------------------------------------------------------------------------------

    @property
    def _slewing(self) -> bool:
        return any(axis.slewing for axis in self._axes)

    @property
    def _control(self) -> tuple[str, ...]:
        return _CONTROL.asserted(self._words[_CONTROL.address])

    def _source(self) -> str:
        """The active source of highest priority below the slew, by the name of its movement flag."""
        allowed = self._control
        deflected = {
            "joystick": any(self._analogue("joystick")),
            "analogue_autoguider": any(self._analogue("autoguider")),
            "digital_autoguider": bool(self.surroundings.directions),
        }
        for source in ("remote_control", *deflected, "tracking"):
            if source in allowed and deflected.get(source, True):
                return source
        return ""

    def _wanted(self) -> tuple[int, int]:
        """Velocities of both axes when not slewing."""
        match self._source():
            case "remote_control":
                return self._pair("target_velocity")
            case "joystick":
                return self._analogue("joystick")
            case "analogue_autoguider":
                return self._analogue("autoguider")
            case "digital_autoguider":
                pushed = {name: name in self.surroundings.directions for name in ("north", "south", "east", "west")}
                guide = self.settings.guide_velocity
                return (
                    guide * (pushed["west"] - pushed["east"]),
                    guide * (pushed["north"] - pushed["south"]),
                )
            case "tracking":
                return self._pair("tracking_velocity")
            case _:
                return (0, 0)

    def _pair(self, name: str) -> tuple[int, int]:
        return int(self._value(of_axis(1, name))), int(self._value(of_axis(2, name)))

    def _analogue(self, device: str) -> tuple[int, int]:
        """Velocities that the joystick or the analogue autoguider asks for; zero in the dead zone."""
        adc = self.surroundings.joystick if device == "joystick" else self.surroundings.autoguider
        if adc is None:
            return (0, 0)
        mode = int(self._value(by_name(f"{device}_mode")))
        centres = [self._value(of_axis(axis, "joystick_centre")) if device == "joystick" else 0 for axis in (1, 2)]
        one, two = (
            self._deflection(int(value - (centre or 128)), mode) for value, centre in zip(adc, centres, strict=True)
        )
        return one, two

    def _deflection(self, deflection: int, mode: int) -> int:
        size = min(abs(deflection), 127)
        if size <= self.settings.dead_zone:
            return 0
        if mode & _LOGARITHMIC:
            velocity = int(0xFFFFFF * 10 ** (-_LOGARITHMIC_DECADES * (1 - size / 127)))
        else:
            velocity = (size << 17) >> (mode & 0x3F)
        return velocity if deflection > 0 else -velocity

    def _slew_ended(self) -> None:
        if self.settings.slew_bit_clears:
            self._words[_CONTROL.address] &= ~_CONTROL.mask("slew_to_target")

    def _set_control(self, word: int) -> None:
        slew = _CONTROL.mask("slew_to_target")
        before = self._words[_CONTROL.address]
        self._words[_CONTROL.address] = word
        if word & slew and not before & slew and self._powered:
            for axis in self._axes:
                axis.begin_slew()
        elif not word & slew:
            for axis in self._axes:
                axis.end_slew()

    def _all_stop(self) -> None:
        self._set_control(self._words[_CONTROL.address] & ~_CONTROL.mask("slew_to_target"))
        for number in (1, 2):
            self._put(of_axis(number, "target_velocity"), (0, 0))

    # Power -----------------------------------------------------------------------------------------------------

    def _switch_power(self) -> None:
        """Follow the power's switches; an unpowered axis may be turned by a few steps before it holds again."""
        on = (self._coil or self.surroundings.manual_power) and "supply_shut_down" not in self.surroundings.alarms
        if on == self._powered:
            return
        self._powered = on
        for axis, hardware in zip(self._axes, self.hardware, strict=True):
            if not on:
                axis.halt()
                self._slew_ended()
                continue
            most = int(self.settings.standby_steps * hardware.counts_per_step)
            axis.offset += self._rng.randint(-most, most) << FRACTION_BITS

    def power_cycle(self) -> None:
        """Switch the unit off and on: positions go to the centre count, and what was not saved is lost."""
        for axis in self._axes:
            axis.halt()
            axis.synchronise(CENTRE << FRACTION_BITS, self._step)
        self._latch.clear()
        self._words[_CONTROL.address] = 0
        if self.settings.volatile_targets:
            self._reset_targets()
        self._restore_configuration()
        self._coil = self._powered = self.settings.power_at_boot

    def _switch_fans(self) -> None:
        start, stop = (self._value(by_name(f"fan_{edge}_temperature")) for edge in ("start", "stop"))
        for fan, temperature in enumerate(self.surroundings.temperatures_c):
            self._fans[fan] = temperature >= start or (self._fans[fan] and temperature > stop)

    # What people do --------------------------------------------------------------------------------------------

    def disturb(self, **changes: Any) -> None:  # noqa: ANN401 - the fields of Surroundings
        """Change the surroundings, as in ``disturb(alarms=("supply_shut_down",))``, from the present tick on."""
        self.surroundings = replace(self.surroundings, **changes)
        self._switch_power()
        self._switch_fans()

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

    @property
    def powered(self) -> bool:
        """Whether the motors have power."""
        return self._powered

    def true_position(self, axis: int) -> float:
        """Where axis 1 or 2 really is: counts with all 24 bits of fraction, whatever the unit believes."""
        simulated = self._axes[axis - 1]
        return (simulated.position + simulated.offset - simulated.moved * (STEPS - self._step)) / (1 << FRACTION_BITS)

    def counted_position(self, axis: int) -> float:
        """Where the unit believes axis 1 or 2 to be: counts with all 24 bits of fraction."""
        return self._axes[axis - 1].at_step(self._step) / (1 << FRACTION_BITS)

    # Configuration ---------------------------------------------------------------------------------------------

    def _configuration(self) -> dict[int, int]:
        return {
            register.address + word: self._words[register.address + word]
            for register in REGISTERS
            if register.saved
            for word in range(register.words)
        }

    def _restore_configuration(self) -> None:
        self._words.update(self._saved)
        self._apply()

    def _load(self, values: Mapping[str, float]) -> None:
        for register in REGISTERS:
            if register.saved:
                self._put(register, register.encode(values.get(register.name, 0.0)), apply=False)
        self._apply()

    def _reset_targets(self) -> None:
        for number in (1, 2):
            self._put(of_axis(number, "target_position"), self._position_words(CENTRE), apply=False)
            self._put(of_axis(number, "target_velocity"), (0, 0), apply=False)

    def _apply(self) -> None:
        """Let the axes follow their registers."""
        ramp = 0x100 * (1.0 + self.settings.acceleration_error)
        for number, (axis, hardware) in enumerate(zip(self._axes, self.hardware, strict=True), start=1):
            axis.acceleration = round(self._raw(number, "acceleration") * ramp)
            axis.deceleration = round(self._raw(number, "deceleration") * ramp)
            axis.top = self._raw(number, "max_speed") << self.settings.speed_shift
            soft = [self._soft_limit(number, side) for side in ("negative", "positive")]
            axis.lower, axis.upper = (limit << FRACTION_BITS for limit in soft)
            if hardware.negative_switch is not None:
                axis.lower = max(axis.lower, (hardware.negative_switch << FRACTION_BITS) - axis.offset)
            if hardware.positive_switch is not None:
                axis.upper = min(axis.upper, (hardware.positive_switch << FRACTION_BITS) - axis.offset)
            axis.target = self._target(number) << FRACTION_BITS
            axis.landing_ticks = round(self.settings.landing_s / TICK_S)
            axis.landing_distance = self.settings.landing_counts << FRACTION_BITS

    def _soft_limit(self, number: int, side: str) -> int:
        return self._raw(number, f"{side}_limit") << self.settings.limit_shift & 0xFFFFFF

    def _raw(self, number: int, name: str) -> int:
        return self._words[of_axis(number, name).address]

    def _target(self, number: int) -> int:
        return self._position_counts(self._read(of_axis(number, "target_position")))

    def _position_counts(self, words: tuple[int, ...]) -> int:
        raw = words[0] << 16 | words[1]
        return raw >> 8 if self.settings.position_format == "left" else raw & 0xFFFFFF

    def _position_words(self, counts: int) -> tuple[int, ...]:
        raw = counts << 8 if self.settings.position_format == "left" else counts
        return raw >> 16, raw & 0xFFFF

    def _read(self, register: Register) -> tuple[int, ...]:
        return tuple(self._words[register.address + word] for word in range(register.words))

    def _value(self, register: Register) -> float:
        return register.decode(self._read(register))

    # Registers on the wire -------------------------------------------------------------------------------------

    def read_coils(self, address: int, count: int) -> list[bool]:
        """Return the power coil."""
        _rows("coil", address, count)
        return [self._coil]

    def write_coils(self, address: int, values: list[bool]) -> None:
        """Power the motors, or send them to standby."""
        _rows("coil", address, len(values))
        self._coil = values[0]
        self._switch_power()

    def read_discrete_inputs(self, address: int, count: int) -> list[bool]:
        """Return the named states."""
        states = self._states()
        return [states[register.name] for register in _rows("discrete", address, count)]

    def read_input_registers(self, address: int, count: int) -> list[int]:
        """Return measurements and flags."""
        rows = _rows("input", address, count)
        words = {register.name: self._measured(register) for register in set(rows)}
        return [words[register.name][address + index - register.address] for index, register in enumerate(rows)]

    def read_holding_registers(self, address: int, count: int) -> list[int]:
        """Return configuration and control; the actions cannot be read."""
        rows = _rows("holding", address, count)
        if any(register.access == "write" for register in rows):
            raise IllegalAddress(f"0x{address:02X}: an action cannot be read")
        for number, axis in enumerate(self._axes, start=1):
            counts = axis.at_step(self._step) >> FRACTION_BITS
            register = of_axis(number, "position")
            self._words.update(enumerate(self._position_words(counts), start=register.address))
        return [self._words[address + index] for index in range(count)]

    def write_registers(self, address: int, values: list[int]) -> None:
        """Write in rising order; the first word of a pair waits for the second."""
        rows = _rows("holding", address, len(values))
        for index, register in enumerate(rows):
            if register.words == 1 and not register.accepts((values[index],)):
                raise IllegalValue(f"{register.name} does not take {values[index]}")
        for index, register in enumerate(rows):
            where = address + index
            if register.words == 1:
                self._put(register, (values[index],))
            elif where == register.address:
                self._latch[where] = values[index]
            else:
                high = self._latch.pop(register.address, self._words[register.address])
                if not register.accepts((high, values[index])):
                    raise IllegalValue(f"{register.name} does not take 0x{high:04X}{values[index]:04X}")
                self._put(register, (high, values[index]))

    def _put(self, register: Register, words: tuple[int, ...], *, apply: bool = True) -> None:
        match register.name:
            case "velocity_control":
                self._set_control(words[0])
            case "all_stop":
                self._all_stop()
            case "load_factory":
                self._load({**FACTORY})
            case "save_configuration":
                self._saved = self._configuration()
            case "load_configuration":
                self._restore_configuration()
            case "axis1_position" | "axis2_position":
                counts = self._position_counts(words)
                self._axes[register.axis - 1].synchronise(counts << FRACTION_BITS, self._step)
                self._apply()
            case _:
                self._words.update(enumerate(words, start=register.address))
                if apply:
                    self._apply()

    def _measured(self, register: Register) -> tuple[int, ...]:
        """Words of an input register now."""
        if register.flags:
            states = self._states()
            return (sum(1 << flag.bit for flag in register.flags if states[flag.name] != flag.active_low),)
        name = register.name
        if register.axis and not name.endswith("temperature"):
            return self._axis_measured(register, self._axes[register.axis - 1], self.hardware[register.axis - 1])
        inside, one, two = self.surroundings.temperatures_c
        joystick, guider = self.surroundings.joystick or (0, 0), self.surroundings.autoguider or (0, 0)
        values = {
            "system_temperature": inside,
            "axis1_controller_temperature": one,
            "axis2_controller_temperature": two,
            "supply_current": 2000 if self._powered else 100,
            "supply_voltage": 24000 if self._powered else 0,
            "joystick_adc_axis1": joystick[0],
            "joystick_adc_axis2": joystick[1],
            "autoguider_adc_axis1": guider[0],
            "autoguider_adc_axis2": guider[1],
        }
        return register.encode(values[name])

    def _axis_measured(self, register: Register, axis: SimulatedAxis, hardware: AxisHardware) -> tuple[int, ...]:
        match register.name.partition("_")[2]:
            case "drive_type":
                return (next(key for key, name in DRIVE_TYPES.items() if name.lower() == hardware.drive_type),)
            case "velocity":
                return register.encode(axis.moved)
            case "encoder_raw":
                return (self._encoder(register.axis),)
            case _:
                return (gray_to_binary(self._encoder(register.axis)),)

    def _encoder(self, number: int) -> int:
        """Gray reading of the absolute encoder, which sees the true axis."""
        hardware = self.hardware[number - 1]
        if not hardware.encoder_bits:
            return 0
        turns = (self.true_position(number) - CENTRE) * float(hardware.turns_per_count)
        turns += self._rng.gauss(0.0, self.settings.encoder_noise_arcsec) / ARCSEC_PER_TURN
        if hardware.encoder_reversed:
            turns = -turns
        reading = round(hardware.encoder_at_centre + turns * 0x10000) & 0xFFFF
        unused = 16 - hardware.encoder_bits
        return binary_to_gray(reading >> unused) << unused

    def _states(self) -> dict[str, bool]:
        """Every discrete input and flag by name."""
        around = self.surroundings
        moving = {"slewing"} if self._slewing else set[str]()
        if self._powered and (not moving or self.settings.slew_idle == "per-axis"):
            moving.add(self._source())
        states = dict.fromkeys((flag.name for flag in _ALL_FLAGS), False)
        states |= {register.name: False for register in REGISTERS if register.kind == "discrete"}
        states |= dict.fromkeys(around.alarms, True) | dict.fromkeys(moving - {""}, True)
        states |= {
            "manual_power_on": around.manual_power,
            "remote_power_on": self._coil,
            "motor_power_enabled": self._powered,
            "system_fan_running": self._fans[0],
            "axis1_fan_running": self._fans[1],
            "axis2_fan_running": self._fans[2],
            "joystick_detected": around.joystick is not None,
            "joystick_present": around.joystick is not None,
            "autoguider_detected": around.autoguider is not None,
            "autoguider_present": around.autoguider is not None,
        }
        states |= {f"autoguider_{direction}": True for direction in around.directions}
        for number in (1, 2):
            states |= self._axis_states(number)
        return states

    def _axis_states(self, number: int) -> dict[str, bool]:
        axis, hardware = self._axes[number - 1], self.hardware[number - 1]
        counts, true = axis.at_step(self._step) >> FRACTION_BITS, self.true_position(number)
        negative, positive = hardware.negative_switch, hardware.positive_switch
        states = {
            "encoder_detected": bool(hardware.encoder_bits),
            "slewing": axis.slewing,
            "decelerating": axis.slewing and axis.decelerating,
            "slew_negative": axis.slewing and axis.target < axis.position,
            "hard_positive_limit": positive is not None and true >= positive,
            "hard_negative_limit": negative is not None and true <= negative,
            "soft_positive_limit": counts >= self._soft_limit(number, "positive"),
            "soft_negative_limit": counts <= self._soft_limit(number, "negative"),
        }
        return {f"axis{number}_{name}": state for name, state in states.items()}

    # Snapshots -------------------------------------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """Return the whole state as JSON-able values; settings and hardware are not in it."""
        version, internal, gauss = self._rng.getstate()
        return {
            "t0": self._t0,
            "tick": self._tick,
            "step": self._step,
            "coil": self._coil,
            "powered": self._powered,
            "fans": list(self._fans),
            "words": {str(address): word for address, word in self._words.items()},
            "saved": {str(address): word for address, word in self._saved.items()},
            "latch": {str(address): word for address, word in self._latch.items()},
            "axes": [axis.state() for axis in self._axes],
            "surroundings": asdict(self.surroundings),
            "random": [version, list(internal), gauss],
        }

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from a snapshot, JSON's lists for tuples being as good."""
        self._t0, self._tick, self._step = snapshot["t0"], snapshot["tick"], snapshot["step"]
        self._coil, self._powered, self._fans = snapshot["coil"], snapshot["powered"], list(snapshot["fans"])
        self._words, self._saved, self._latch = (
            {int(address): word for address, word in snapshot[name].items()} for name in ("words", "saved", "latch")
        )
        self._axes = tuple(SimulatedAxis(**state) for state in snapshot["axes"])
        around: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in snapshot["surroundings"].items()
        }
        self.surroundings = Surroundings(**around)
        version, internal, gauss = snapshot["random"]
        self._rng.setstate((version, tuple(internal), gauss))


_ALL_FLAGS: tuple[Flag, ...] = tuple(
    flag for register in REGISTERS if register.kind == "input" for flag in register.flags
)


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
    counts = 0 if settings.encoder_zero_at == "centre" else -CENTRE
    return {
        f"axis{number}_encoder_zero": round(axis.encoder_at_centre + counts * axis.turns_per_count * 0x10000)
        % 0x10000
        for number, axis in enumerate(hardware, start=1)
        if axis.encoder_bits
    }
