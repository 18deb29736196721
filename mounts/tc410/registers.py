"""Every register of the TC410, once.

The rows are Tables 17–31 of the drive's manual, with its misprints settled. Codec, driver, simulator, status
display and documentation all read this table; an address that is not in it is never touched.

A register has a *raw* value, the unsigned integer of its 16 or 32 bits, most significant word first, and a
*value* in the unit stated: counts are whole microsteps of the reported 24-bit position, velocities are in units of
20000/2²⁴ counts per second, temperatures in °C, motor currents in amperes, coordinates in milliarcseconds.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from mounts.errors import DriveError

Kind = Literal["coil", "discrete", "input", "holding"]
Access = Literal["read", "read-write", "write"]
PositionFormat = Literal["right", "left"]

CENTRE = 0x800000  # counts: the nominal centre of travel, and the position after power-up
POSITION_BITS = 24
MAX_VELOCITY = 0xFFFFFF
COUNTS_PER_SECOND = 20000.0 / 2**24  # one unit of velocity, in counts per second
MOUNT_TYPES: Mapping[int, str] = MappingProxyType(
    {0: "unknown", 1: "equatorial fork", 2: "altazimuth fork", 3: "German"},
)
MICROSTEPS: Mapping[int, int] = MappingProxyType({1: 10, 2: 16})  # counts a full step, by drive type
DRIVE_TYPES: Mapping[int, str] = MappingProxyType({0: "none", 1: "Gecko", 2: "IMS"})


class RegisterError(DriveError):
    """A value or an address that the TC410's register table does not allow."""


def gray_to_binary(gray: int) -> int:
    """Binary value of a 16-bit Gray code: each bit is the parity of the bits from it upwards."""
    for shift in (8, 4, 2, 1):
        gray ^= gray >> shift
    return gray


def binary_to_gray(binary: int) -> int:
    """Gray code of a 16-bit binary value; inverse of `gray_to_binary`."""
    return binary ^ (binary >> 1)


@dataclass(frozen=True)
class Conversion:
    """How raw and value correspond: value = raw · multiple / divisor, within the bounds given for the raw value."""

    unit: str
    lowest: int
    highest: int
    multiple: int = 1
    divisor: int = 1
    rounding: Callable[[float], int] = round

    def value(self, raw: int) -> float:
        """The value that `raw` (signed where the bounds are) stands for."""
        return raw * self.multiple if self.divisor == 1 else raw * self.multiple / self.divisor

    def raw(self, value: float) -> int:
        """The raw number of `value`, rounded as this quantity must be; not yet checked against the bounds."""
        return self.rounding(value * self.divisor / self.multiple)


WORD = Conversion("", 0, 0xFFFF)
BIT = Conversion("", 0, 1)
BYTE = Conversion("", 0, 0xFF)
GRAY = Conversion("1/65536 turn, Gray", 0, 0xFFFF)
TURN = Conversion("1/65536 turn", 0, 0xFFFF)
MILLIAMPERE = Conversion("mA", 0, 0xFFFF)
MILLIVOLT = Conversion("mV", 0, 0xFFFF)
CELSIUS = Conversion("°C", -0x8000, 0x7FFF, divisor=10)
AMPERE = Conversion("A", 10, 50, divisor=10)
COUNTS = Conversion("counts", 0, 0xFFFFFF)
VELOCITY = Conversion("20000/2²⁴ counts/s", -MAX_VELOCITY, MAX_VELOCITY)
MAX_SPEED = Conversion("20000/2²⁴ counts/s", 1, 0xFFFF, multiple=0x100, rounding=math.floor)
LIMIT_FROM_BELOW = Conversion("counts", 0, 0xFFFF, multiple=0x100, rounding=math.ceil)
LIMIT_FROM_ABOVE = Conversion("counts", 0, 0xFFFF, multiple=0x100, rounding=math.floor)
PARK = Conversion("counts", 0, 0xFFFF, multiple=0x100)
RAMP = Conversion("2⁸ velocity units per 2 ms", 1, 0xFF)
GEAR = Conversion("", 1, 0xFFFF)
MILLIARCSECOND = Conversion("mas", -(2**31), 2**31 - 1)
ACTION = Conversion("", 1, 1)


@dataclass(frozen=True)
class Flag:
    """One named bit of a register; `active_low` bits are asserted when they read 0."""

    bit: int
    name: str
    active_low: bool = False


@dataclass(frozen=True)
class Register:
    """One row of the table.

    `address` is that of the most significant word; `words` is 2 for 32-bit pairs (coils and discrete inputs count as
    one word holding 0 or 1). `axis` is 0 for what concerns both. `saved` registers are the configuration that the
    drive keeps in its non-volatile memory when told to.
    """

    kind: Kind
    address: int
    name: str
    meaning: str
    conversion: Conversion = WORD
    access: Access = "read"
    words: int = 1
    flags: tuple[Flag, ...] = ()
    axis: int = 0
    saved: bool = False

    @property
    def unit(self) -> str:
        """The unit of the value; empty for flags and pure numbers."""
        return self.conversion.unit

    def decode(self, words: Sequence[int], position_format: PositionFormat = "right") -> float:
        """Value of the register's words as read, most significant first.

        Raises
        ------
        RegisterError
            Wrong number of words, or a position pair that does not fit `position_format`.
        """
        if len(words) != self.words:
            raise RegisterError(f"{self.name} has {self.words} word(s), not {len(words)}; read it in one request")
        raw = 0
        for word in words:
            raw = raw << 16 | word
        if self.conversion is COUNTS:
            return _position_from_pair(self.name, raw, position_format)
        if self.conversion is GRAY:
            return gray_to_binary(raw)
        bits = 16 * self.words
        if self.conversion.lowest < 0 and raw >> (bits - 1):
            raw -= 1 << bits
        return self.conversion.value(raw)

    def encode(self, value: float, position_format: PositionFormat = "right") -> tuple[int, ...]:
        """Words to write for `value`, most significant first; soft limits are rounded inward.

        Raises
        ------
        RegisterError
            The value lies outside what the register holds.
        """
        low, high = self.conversion.lowest, self.conversion.highest
        raw = self.conversion.raw(value) if math.isfinite(value) else high + 1
        if not low <= raw <= high:
            bounds = f"{self.conversion.value(low):g} to {self.conversion.value(high):g} {self.unit}".strip()
            raise RegisterError(f"{self.name}: {value:g} is outside {bounds}; choose a value within")
        if self.conversion is GRAY:
            raw = binary_to_gray(raw)
        if self.conversion is COUNTS and position_format == "left":
            raw <<= 8
        return tuple(raw >> shift & 0xFFFF for shift in range(16 * (self.words - 1), -1, -16))

    def accepts(self, words: Sequence[int]) -> bool:
        """Whether a device may take these raw words: within the bounds, in whichever position format."""
        if self.conversion is COUNTS:
            return True
        raw = self.decode(words) * self.conversion.divisor / self.conversion.multiple
        return self.conversion.lowest <= raw <= self.conversion.highest

    def asserted(self, word: int) -> tuple[str, ...]:
        """Names of the flags that `word` asserts, lowest bit first."""
        return tuple([flag.name for flag in self.flags if bool(word >> flag.bit & 1) != flag.active_low])

    def mask(self, *names: str) -> int:
        """Word in which exactly the named flags' bits are 1.

        Raises
        ------
        RegisterError
            The register has no flag of this name.
        """
        bits = {flag.name: 1 << flag.bit for flag in self.flags}
        unknown = [name for name in names if name not in bits]
        if unknown:
            raise RegisterError(f"{self.name} has no flag {unknown[0]!r}; it has {', '.join(bits)}")
        return sum(bits[name] for name in set(names))


def flags(register: Register, word: int) -> tuple[str, ...]:
    """Names of the flags that `word` asserts in `register`."""
    return register.asserted(word)


def _position_from_pair(name: str, raw: int, position_format: PositionFormat) -> int:
    if position_format == "left":
        if raw & 0xFF:
            raise RegisterError(
                f"{name}: 0x{raw:08X} has a non-zero low byte, so it is not left-justified; "
                'set position_format = "right"',
            )
        return raw >> 8
    if raw >> POSITION_BITS:
        raise RegisterError(
            f'{name}: 0x{raw:08X} has more than 24 bits, so it is left-justified; set position_format = "left"',
        )
    return raw


LIMIT_FLAGS = tuple(
    Flag(bit, name)
    for bit, name in enumerate(
        f"axis{axis}_{kind}_{side}_limit"
        for kind in ("hard", "soft")
        for axis in (1, 2)
        for side in ("positive", "negative")
    )
)
MOVEMENT_FLAGS = tuple(
    Flag(bit, name)
    for bit, name in enumerate(
        (
            "slewing",
            "remote_control",
            "paddle",
            "joystick",
            "analogue_autoguider",
            "digital_autoguider",
            "movement_unused",
            "tracking",
        ),
    )
)
SUPPLY_FLAGS = tuple(
    Flag(bit, name)
    for bit, name in enumerate(
        (
            "manual_power_on",
            "remote_power_on",
            "motor_power_enabled",
            "system_fan_running",
            "supply_shut_down",
            "supply_over_current",
            "supply_over_voltage",
            "supply_under_voltage",
        ),
    )
)
SLEW_FLAGS = tuple(
    Flag(bit, f"axis{axis}_{name}")
    for axis, first in ((1, 0), (2, 4))
    for bit, name in enumerate(("slewing", "decelerating", "slew_negative"), start=first)
)
DIGITAL_INPUT_FLAGS = tuple(
    Flag(bit, name, active_low=True)
    for bit, name in enumerate(
        (
            "joystick_button_0",
            "joystick_button_1",
            "joystick_present",
            "autoguider_north",
            "autoguider_south",
            "autoguider_east",
            "autoguider_west",
            "autoguider_present",
        ),
    )
)
FAN_FLAGS = (Flag(0, "axis1_fan_running"), Flag(1, "axis2_fan_running"))
VELOCITY_CONTROL_FLAGS = (
    Flag(0, "slew_to_target"),
    Flag(1, "remote_control"),
    Flag(3, "joystick"),
    Flag(4, "analogue_autoguider"),
    Flag(5, "digital_autoguider"),
    Flag(7, "tracking"),
)

_DISCRETE_MEANINGS = (  # first address, names (Tables 18 to 22)
    (0x00, [flag.name for flag in SUPPLY_FLAGS[:4]], "power control"),
    (
        0x08,
        ["joystick_detected", "autoguider_detected", "axis1_encoder_detected", "axis2_encoder_detected"],
        "peripheral sense",
    ),
    (0x10, [flag.name for flag in SUPPLY_FLAGS[4:]], "power supply alarm"),
    (0x18, [flag.name for flag in LIMIT_FLAGS], "limit reached"),
    (0x20, [flag.name for flag in MOVEMENT_FLAGS], "source of the present motion"),
)


def _discrete_inputs() -> list[Register]:
    return [
        Register("discrete", first + offset, name, f"{meaning}: {name.replace('_', ' ')}", BIT)
        for first, names, meaning in _DISCRETE_MEANINGS
        for offset, name in enumerate(names)
    ]


def _general_inputs() -> list[Register]:
    def row(
        address: int,
        name: str,
        meaning: str,
        conversion: Conversion = WORD,
        named: tuple[Flag, ...] = (),
    ) -> Register:
        return Register("input", address, name, meaning, conversion, flags=named)

    return [
        row(0x00, "system_temperature", "temperature inside the drive", CELSIUS),
        row(0x01, "supply_current", "power supply current", MILLIAMPERE),
        row(0x02, "supply_voltage", "power supply voltage", MILLIVOLT),
        row(0x03, "slew_flags", "state of the slew to target", named=SLEW_FLAGS),
        row(0x04, "limit_flags", "limits reached", named=LIMIT_FLAGS),
        row(0x05, "movement_flags", "source of the present motion", named=MOVEMENT_FLAGS),
        row(0x06, "supply_flags", "power control and power supply alarms", named=SUPPLY_FLAGS),
        row(0x07, "digital_inputs", "joystick and autoguider, digital parts", named=DIGITAL_INPUT_FLAGS),
        row(0x08, "joystick_adc_axis1", "raw joystick deflection, axis 1"),
        row(0x09, "joystick_adc_axis2", "raw joystick deflection, axis 2"),
        row(0x0A, "autoguider_adc_axis1", "raw analogue autoguider deflection, axis 1"),
        row(0x0B, "autoguider_adc_axis2", "raw analogue autoguider deflection, axis 2"),
        row(0x0C, "axis1_controller_temperature", "temperature of the motor controller of axis 1", CELSIUS),
        row(0x0D, "axis2_controller_temperature", "temperature of the motor controller of axis 2", CELSIUS),
        row(0x0E, "fan_flags", "motor controller fans", named=FAN_FLAGS),
    ]


def _axis_inputs(axis: int) -> list[Register]:
    base = 0x10 * axis

    def row(offset: int, name: str, meaning: str, conversion: Conversion, words: int = 1) -> Register:
        return Register(
            "input",
            base + offset,
            f"axis{axis}_{name}",
            meaning,
            conversion,
            words=words,
            axis=axis,
        )

    return [
        row(0x0, "drive_type", "motor drive: 0 none, 1 Gecko, 2 IMS", WORD),
        row(0x1, "velocity", "present velocity", VELOCITY, 2),
        row(0x3, "encoder_raw", "absolute encoder as it reads, Gray code", GRAY),
        row(0x4, "encoder", "absolute encoder, binary", TURN),
    ]


def _general_holdings() -> list[Register]:
    def row(
        address: int,
        name: str,
        meaning: str,
        conversion: Conversion,
        words: int = 1,
        *,
        saved: bool = True,
        named: tuple[Flag, ...] = (),
    ) -> Register:
        return Register("holding", address, name, meaning, conversion, "read-write", words, named, saved=saved)

    return [
        row(
            0x00,
            "velocity_control",
            "sources allowed to move the axes",
            BYTE,
            saved=False,
            named=VELOCITY_CONTROL_FLAGS,
        ),
        row(0x01, "joystick_mode", "bit 7 logarithmic; else bits 0–5 shift the velocity right", BYTE),
        row(0x02, "autoguider_mode", "bit 7 logarithmic; else bits 0–5 shift the velocity right", BYTE),
        row(0x03, "fan_start_temperature", "the system fan starts at", CELSIUS),
        row(0x04, "fan_stop_temperature", "the system fan stops at", CELSIUS),
        row(0x05, "latitude", "site latitude, north positive; kept for the host", MILLIARCSECOND, 2),
        row(0x07, "longitude", "site longitude, east positive; kept for the host", MILLIARCSECOND, 2),
        row(0x0A, "mount_type", "0 unknown, 1 equatorial fork, 2 altazimuth fork, 3 German, 16… custom", BYTE),
        row(0x0C, "mount_x", "rotation of the mount's axes about x; kept for the host", MILLIARCSECOND, 2),
        row(0x0E, "mount_y", "rotation of the mount's axes about y; kept for the host", MILLIARCSECOND, 2),
    ]


def _axis_configuration(axis: int) -> list[Register]:
    base = 0x10 if axis == 1 else 0x30

    def row(offset: int, name: str, meaning: str, conversion: Conversion, words: int = 1) -> Register:
        return Register(
            "holding",
            base + offset,
            f"axis{axis}_{name}",
            meaning,
            conversion,
            "read-write",
            words,
            axis=axis,
            saved=True,
        )

    return [
        row(0x00, "tracking_velocity", "velocity while tracking", VELOCITY, 2),
        row(0x02, "negative_limit", "soft limit of decreasing positions", LIMIT_FROM_BELOW),
        row(0x03, "positive_limit", "soft limit of increasing positions", LIMIT_FROM_ABOVE),
        row(0x04, "acceleration", "velocity gained every 2 ms", RAMP),
        row(0x05, "deceleration", "velocity lost every 2 ms", RAMP),
        row(0x06, "max_speed", "largest velocity", MAX_SPEED),
        row(0x07, "joystick_centre", "ADC value of the joystick at rest; 0 is found by the drive", BYTE),
        row(0x08, "motor_current", "phase current: 1 to 3 A for IMS, 1 to 5 A for Gecko", AMPERE),
        row(0x09, "encoder_zero", "encoder reading where the position is zero", TURN),
        row(0x0B, "motor_steps", "full steps of a motor revolution", GEAR),
        row(0x0C, "main_gear_multiplier", "main gear ratio, numerator", GEAR),
        row(0x0D, "main_gear_divisor", "main gear ratio, denominator", GEAR),
        row(0x0E, "secondary_gear_multiplier", "secondary gear ratio, numerator", GEAR),
        row(0x0F, "secondary_gear_divisor", "secondary gear ratio, denominator", GEAR),
        row(0x10, "park", "park position", PARK),
    ]


def _axis_control(axis: int) -> list[Register]:
    base = 0x50 if axis == 1 else 0x60

    def row(offset: int, name: str, meaning: str, conversion: Conversion) -> Register:
        return Register(
            "holding",
            base + offset,
            f"axis{axis}_{name}",
            meaning,
            conversion,
            "read-write",
            2,
            axis=axis,
        )

    return [
        row(0x0, "position", "present position; writing it synchronises without motion", COUNTS),
        row(0x2, "target_position", "where a slew to target goes", COUNTS),
        row(0x4, "target_velocity", "velocity under remote control", VELOCITY),
    ]


def _actions() -> list[Register]:
    rows = (
        (0x70, "all_stop", "end the slew and zero the target velocities; tracking goes on"),
        (0x71, "load_factory", "load the factory configuration without saving it"),
        (0x72, "save_configuration", "save the configuration to non-volatile memory"),
        (0x73, "load_configuration", "load the configuration from non-volatile memory"),
    )
    return [Register("holding", address, name, meaning, ACTION, "write") for address, name, meaning in rows]


REGISTERS: tuple[Register, ...] = (
    Register("coil", 0x00, "power", "1 powers the motors, 0 is standby", BIT, "read-write"),
    *_discrete_inputs(),
    *_general_inputs(),
    *_axis_inputs(1),
    *_axis_inputs(2),
    *_general_holdings(),
    *_axis_configuration(1),
    *_axis_configuration(2),
    *_axis_control(1),
    *_axis_control(2),
    *_actions(),
)

# Discrete inputs share their names with the flags of input registers 4 to 6, which show the same bits.
_BY_NAME = {register.name: register for register in REGISTERS}
_BY_ADDRESS = {
    (register.kind, register.address + word): register for register in REGISTERS for word in range(register.words)
}


def by_name(name: str) -> Register:
    """The register called `name`.

    Raises
    ------
    RegisterError
        There is none.
    """
    try:
        return _BY_NAME[name]
    except KeyError:
        raise RegisterError(f"the TC410 has no register {name!r}; `clockdrive drive show` lists them") from None


def of_axis(axis: int, name: str) -> Register:
    """The register `name` of axis 1 or 2, as in ``of_axis(1, "position")``."""
    return by_name(f"axis{axis}_{name}")


def at(kind: Kind, address: int) -> Register:
    """The register that holds this address, in either of its words.

    Raises
    ------
    RegisterError
        The address is undefined or reserved and must not be touched.
    """
    try:
        return _BY_ADDRESS[kind, address]
    except KeyError:
        raise RegisterError(
            f"{kind} address 0x{address:04X} is undefined or reserved in the TC410 and must not be touched; "
            "use the addresses of its register table",
        ) from None
