"""Every key of the configuration, once: what checks a file, fills it, writes a new one and documents it reads here.

Defaults stand as a file would have them and pass the same checks. A default that follows from other keys is
`Computed` from keys above it in the table. Angles are in degrees where the name says so.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

from clockdrive.gear_teeth import GearTeeth
from mounts.tc410.input_modes import MODES
from mounts.tc410.motors import RATINGS

Kind = Literal["text", "path", "link", "source", "flag", "integer", "number", "ratio"]
Raw = str | int | float | bool
Value = Raw | GearTeeth | Path | None

OPTIONAL = "rotator"  # a table without which the telescope has none: its keys have defaults only where it is given
DriveKind = Literal["tc410", "avr-box", "apo", "sdss", "awr"]
DRIVE_KINDS: tuple[DriveKind, ...] = get_args(DriveKind)
DEFAULT_KIND: DriveKind = "tc410"
READABLE: DriveKind = "tc410"  # its unit keeps keys of the configuration in registers of its own
ROTATOR_MODES = ("sky", "horizon", "mount")
MOUNT_TYPES = ("equatorial-fork", "german", "altaz-fork")
TC410_UNITS_PER_S = 20000  # the fastest it counts: one unit each 50 microseconds (manual, 4.7.3.2)
TC410_HALF_RANGE = 1 << 23  # counts from the centre to either end (4.7.3.1)
TC410_MICROSTEPS = {"gecko": 10, "ims": 16}  # reported units a full step (4.7.1)

Facts = Mapping[str, Value]  # the values settled so far, by dotted name
Rule = Callable[[Facts, str], Value]  # with the section whose default is asked


@dataclass(frozen=True)
class Computed:
    """A default that follows from other keys, and how the documentation says so."""

    text: str
    rule: Rule


@dataclass(frozen=True)
class Key:
    """One key: where it stands, what it may be, what it means."""

    section: str
    name: str
    kind: Kind
    default: Raw | Computed | None
    meaning: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: bool = False  # `low` itself is not allowed
    choices: tuple[Raw, ...] = ()
    drives: tuple[str, ...] = DRIVE_KINDS
    in_unit: bool = (
        False  # the readable drive keeps it in its own registers; absent from the file, it is read from there
    )
    example: Raw = ""  # shown where there is no default

    @property
    def dotted(self) -> str:
        """`section.name`, as errors, flags and origins call it."""
        return f"{self.section}.{self.name}"

    @property
    def allowed(self) -> str:
        """The allowed values in words."""
        return f"{self._allowed()} {self.unit}".rstrip()

    def _allowed(self) -> str:
        if self.choices == MODES:
            return "0 to 17 | 128"
        if self.choices:
            paths = [KIND_WORDS["path"]] if self.kind == "path" else []
            return " | ".join([*paths, *map(str, self.choices)])
        if self.low is None or self.high is None:
            return KIND_WORDS[self.kind]
        bounds = f"above {_plain(self.low)}, at most" if self.above else f"{_plain(self.low)} to"
        words = f"{KIND_WORDS['ratio']}, each " if self.kind == "ratio" else ""
        return f"{words}{bounds} {_plain(self.high)}"


def _plain(value: float) -> str:
    return f"{value:.10g}".replace("-", "−")


KIND_WORDS: dict[Kind, str] = {
    "text": "a text",
    "path": "the path of a file",
    "link": "sim: | tcp://HOST:PORT | serial:///dev/ttyUSB0?baud=9600 | COM3",
    "source": "file:PATH | command:… | alpaca:URL",
    "flag": "true or false",
    "integer": "a whole number",
    "number": "a number",
    "ratio": 'two whole numbers as "1/285"',
}

_APACHE_POINT = {
    "site.name": "Apache Point",
    "site.latitude_deg": 32.7803,
    "site.longitude_deg": -105.8203,
    "site.height_m": 2788.0,
}
SITES: dict[str, dict[str, object]] = {"apo": _APACHE_POINT, "sdss": _APACHE_POINT}
"""Where a kind of drives stands that has one place only."""
_FORK, _GERMAN, _ALTAZ = MOUNT_TYPES
# Smallest and largest position, speed, acceleration, jerk, of the 3.5 m and the 2.5 m telescope.
_CONTROLLER_RANGE: dict[tuple[str, str], tuple[float, ...]] = {
    ("apo", "axis1"): (-180.0, 360.0, 1.75, 0.1, 0.5),
    ("apo", "axis2"): (6.0, 85.0, 1.5, 0.1, 0.5),
    ("apo", "rotator"): (-180.0, 180.0, 3.5, 0.7, 7.0),
    ("sdss", "axis1"): (-195.0, 435.0, 2.0, 0.2, 0.2),
    ("sdss", "axis2"): (18.2, 90.0, 1.5, 0.08, 0.08),
    ("sdss", "rotator"): (-180.0, 361.0, 2.0, 0.25, 0.25),
}


def number_of(facts: Facts, dotted: str) -> float:
    """The value of a key that is a number."""
    value = facts[dotted]
    if not isinstance(value, int | float):
        raise TypeError(dotted)
    return float(value)


def _rest(facts: Facts, section: str) -> float:
    """The angle of axis `section` where a telescope of this mount type naturally rests, degrees."""
    latitude = number_of(facts, "site.latitude_deg")
    pole = 90.0 if latitude >= 0.0 else -90.0
    angles = {_FORK: (0.0, latitude), _GERMAN: (90.0, pole), _ALTAZ: (0.0, 45.0)}[str(facts["mount.type"])]
    return {"axis1": angles[0], "axis2": angles[1]}.get(section, 0.0)


def _centre(facts: Facts, section: str) -> float:
    return _rest(facts, section) if facts["drive.kind"] == "tc410" else 0.0


def _range(facts: Facts, section: str) -> tuple[float, float]:
    controller = _CONTROLLER_RANGE.get((str(facts["drive.kind"]), section))
    if controller is not None:
        return controller[0], controller[1]
    north = number_of(facts, "site.latitude_deg") >= 0.0
    past = number_of(facts, "limits.hour_angle_past_meridian_deg")
    return {  # a fork stops short of its lower crossing; an altazimuth's cables take three quarters of a turn
        (_FORK, "axis1"): (-170.0, 170.0),
        (_FORK, "axis2"): (-90.0, 90.0),
        (_GERMAN, "axis1"): (-past, 180.0 + past),
        (_GERMAN, "axis2"): (-90.0, 270.0) if north else (-270.0, 90.0),
        (_ALTAZ, "axis1"): (-270.0, 270.0),
        (_ALTAZ, "axis2"): (-5.0, 95.0),
    }.get((str(facts["mount.type"]), section), (-180.0, 180.0))


def _park(facts: Facts, section: str) -> float:
    low, high = number_of(facts, f"{section}.min_deg"), number_of(facts, f"{section}.max_deg")
    return min(max(_rest(facts, section), low), high)


def tc410_fastest_deg_s(facts: Facts, section: str) -> float:
    """Degrees a second at 20000 units a second with the axis's gearing (manual, 4.7.5)."""
    main, secondary = facts[f"{section}.main_gear"], facts[f"{section}.secondary_gear"]
    if not (isinstance(main, GearTeeth) and isinstance(secondary, GearTeeth)):
        raise TypeError(section)
    microsteps = TC410_MICROSTEPS[str(facts[f"{section}.drive_type"])]
    step = 360.0 * float(main * secondary) / (number_of(facts, f"{section}.motor_steps") * microsteps)
    return TC410_UNITS_PER_S * step


def _tc410_speed(facts: Facts, section: str) -> float:
    return min(4.5, float(f"{0.9 * tc410_fastest_deg_s(facts, section):.3g}"))


def _controller(index: int) -> Rule:
    return lambda facts, section: _CONTROLLER_RANGE[str(facts["drive.kind"]), section][index]


def _isa_pressure(facts: Facts, _section: str) -> float:
    """Pressure of the International Standard Atmosphere, troposphere, hPa."""
    return round(1013.25 * math.pow(1.0 - 2.25577e-5 * number_of(facts, "site.height_m"), 5.25588), 2)


def _isa_temperature(facts: Facts, _section: str) -> float:
    """Temperature of the International Standard Atmosphere, troposphere, Celsius."""
    return round(15.0 - 0.0065 * number_of(facts, "site.height_m"), 2)


def _mount_type(facts: Facts, _section: str) -> str:
    return _ALTAZ if facts["drive.kind"] in {"apo", "sdss"} else _FORK


def _of_the_example(value: float) -> Rule:
    """A number that only a simulator may do without: of a telescope it must be given."""
    return lambda facts, _: value if facts["drive.link"] == "sim:" else None


def _as_in_drive(name: str) -> Rule:
    return lambda facts, _: facts.get(f"drive.{name}")


def _event_jitter(facts: Facts, _section: str) -> Value:
    return 0.0001 if facts["drive.link"] == "sim:" else 0.002


_TC410, _AVR, _APO, _AWR = ("tc410",), ("avr-box",), ("apo",), ("awr",)
_SDSS, _NODES = ("sdss",), ("apo", "sdss")

# fmt: off
_SITE = (
    Key("site", "name", "text", "Kaikoura", "the observatory, in displays and file headers"),
    Key("site", "latitude_deg", "number", -42.4, "geodetic latitude, north positive", "deg", -90, 90, in_unit=True),
    Key("site", "longitude_deg", "number", 173.7, "longitude, east positive", "deg", -180, 360, in_unit=True),
    Key("site", "height_m", "number", 30.0, "height above the ellipsoid", "m", -500, 9000),
)
_WEATHER = (
    Key("site.weather", "source", "source", None, "where live values come from; the others stand in when it is old",
        example="file:weather.toml"),
    Key("site.weather", "refraction", "flag", default=True, meaning="correct for refraction"),
    Key("site.weather", "pressure_hpa", "number", Computed("ISA at the height", _isa_pressure),
        "pressure at the telescope, not reduced to sea level", "hPa", 300, 1100),
    Key("site.weather", "temperature_c", "number", Computed("ISA at the height", _isa_temperature),
        "air temperature at the telescope", "°C", -90, 60),
    Key("site.weather", "relative_humidity", "number", 0.5, "relative humidity as a fraction", "", 0, 1),
    Key("site.weather", "wavelength_um", "number", 0.55, "wavelength for which refraction is corrected", "µm", 0.1,
        100),
)
_DRIVE = (
    Key("drive", "kind", "text", DEFAULT_KIND, "which drive the telescope has", choices=DRIVE_KINDS),
    Key("drive", "link", "link", "sim:", "where it is reached; `sim:` is the embedded simulator"),
    Key("drive", "position_format", "text", "auto",
        "how the 24-bit position lies in its two registers; `auto` finds out", choices=("auto", "right", "left"),
        drives=_TC410),
    Key("drive", "slew_idle", "text", "both",
        "tracking resumes when both axes have ended the slew, or each by itself", choices=("both", "per-axis"),
        drives=_TC410),
    Key("drive", "joystick_mode", "integer", 128, "shift of the linear speed range, or 128: logarithmic",
        choices=MODES, drives=_TC410, in_unit=True),
    Key("drive", "autoguider_mode", "integer", 12, "shift of the linear speed range, or 128: logarithmic",
        choices=MODES, drives=_TC410, in_unit=True),
    Key("drive", "fan_start_c", "number", 35.0, "the system fan starts at this temperature", "°C", -40, 100,
        drives=_TC410, in_unit=True),
    Key("drive", "fan_stop_c", "number", 30.0, "the system fan stops at this temperature", "°C", -40, 100,
        drives=_TC410, in_unit=True),
    Key("drive", "move_count", "text", "total", "whether a move counts all its microsteps or half of them",
        choices=("total", "half"), drives=_AVR),
    Key("drive", "axis_bit", "integer", 1, "value of the axis bit that means axis 2", choices=(0, 1), drives=_AVR),
    Key("drive", "guide_counts", "integer", 4, "timer counts by which guiding changes the rate", "counts", 1, 50,
        drives=_AVR),
    Key("drive", "busy", "text", "restart", "what a move does to an axis that still moves: begin anew, or nothing",
        choices=("restart", "ignore"), drives=_AVR),
    Key("drive", "north_reversed", "flag", default=False,
        meaning="its commands to the north turn axis 2 to smaller angles", drives=_AVR),
    Key("drive", "pec", "flag", default=False, meaning="the box corrects its periodic error", drives=_AVR),
    Key("drive", "encoder_counts_per_turn", "integer", 20000, "encoder counts a turn of the axis; 0: none",
        "counts", 0, 1e7, drives=_AVR),
    Key("drive", "max_uninterruptible_s", "number", 30.0, "longest move, as no command stops one", "s", 1, 600,
        drives=_AVR),
    Key("drive", "slew_table", "path", None,
        "the box's own slew table when it is not the standard one",
        choices=("standard",), drives=_AVR, example="slew_table.csv"),
    Key("drive", "on_expiry", "text", "halt", "what a controller does when its path has run out",
        choices=("halt", "extrapolate"), drives=_NODES),
    Key("drive", "landing", "text", "each", "whether the axes arrive each as soon as it can, or all together",
        choices=("each", "together"), drives=_NODES),
    Key("drive", "stow", "flag", default=False,
        meaning="`park` ends with the controllers' own stow, `P`, within a degree of park_deg", drives=_NODES),
    Key("drive", "max_nodes", "integer", 32, "path nodes a controller holds", "", 4, 1000, drives=_NODES),
    Key("drive", "timeout_s", "number", 0.5, "in which a controller must answer, beside the line's own time", "s",
        0.1, 2.0, drives=_NODES),
    Key("drive", "axis_select", "text", "prefix",
        "how an axis is named on the shared line: by a word before each command, or on a line of its own",
        choices=("prefix", "line"), drives=_SDSS),
    Key("drive", "limits_command", "text", "SET.LIMITS", "what the controllers call the command of the soft limits",
        drives=_NODES),
    Key("drive", "sidereal_steps_per_s", "number", Computed("none; of the simulator 50", _of_the_example(50.0)),
        "motor steps a second at sidereal rate, on the factory sheet", "steps/s", 0, 1e6, above=True, drives=_AWR,
        example=50.0),
    Key("drive", "drive_ra_counts", "integer", Computed("none; of the simulator 18000", _of_the_example(18000)),
        "counts of the sidereal rate, as `drive show` has them: for the registers of `rates`", "", 16, 0xFFFF,
        drives=_AWR),
    Key("drive", "drive_ra_postscaler", "integer", Computed("none; of the simulator 4", _of_the_example(4)),
        "likewise its postscaler", "", 0, 0xFF, drives=_AWR),
    Key("drive", "press_jitter_s", "number", 0.005, "by how much a key acts off its time, root mean square", "s", 0,
        0.1, drives=_AWR),
    Key("drive", "event_jitter_s", "number", Computed("0.002; of the simulator 0.0001", _event_jitter),
        "by how much the times of the unit's events are off on this computer, root mean square", "s", 0, 0.1,
        drives=_AWR),
    Key("drive", "timeout_s", "number", 0.1, "in which each packet of an answer must come, beside its line time",
        "s", 0.1, 1.0, drives=_AWR),
    Key("drive", "frequency_unit", "number", 1.0, "steps a second of one unit of a frequency register", "steps/s",
        0, 1e6, above=True, drives=_AWR),
    Key("drive", "acceleration_unit", "number", 1.0, "steps/s² of one unit of an acceleration register", "steps/s²",
        0, 1e6, above=True, drives=_AWR),
    Key("drive", "rate_reference", "text", "motor", "what guide and centre rates are counted from",
        choices=("motor", "sky"), drives=_AWR),
    Key("drive", "postscaler", "text", "times", "a rate falls with its postscaler, or with one more than that",
        choices=("times", "plus-one"), drives=_AWR),
    Key("drive", "reads_ram", "flag", default=True, meaning="a read with bit 7 is taken for the word in RAM",
        drives=_AWR),
)
_MOUNT = (
    Key("mount", "type", "text", Computed("altaz-fork for apo and sdss, else equatorial-fork", _mount_type),
        "how the axes lie", choices=MOUNT_TYPES, in_unit=True),
    Key("mount", "mount_x_mas", "integer", 0, "misalignment about the mount's x axis", "mas", -324e6, 324e6,
        in_unit=True),
    Key("mount", "mount_y_mas", "integer", 0, "misalignment about the mount's y axis", "mas", -324e6, 324e6,
        in_unit=True),
    Key("mount", "pointing_model", "path", None,
        "pointing model, a TPOINT model file; it adds to the two above", example="model.mod"),
    Key("mount", "flip", "text", "command", "when a German mount changes sides: on command, or by itself",
        choices=("command", "auto")),
    Key("mount", "guide_rate", "number", 0.5, "speed of a guide pulse on the sky", "× sidereal", 0.05, 2),
)
_LIMITS = (
    Key("limits", "horizon_deg", "number", 15.0, "lowest altitude", "deg", -5, 90),
    Key("limits", "horizon", "path", None, "file of azimuth_deg,altitude_deg, in place of horizon_deg",
        example="horizon.csv"),
    Key("limits", "sun_escape", "text", "stop",
        "when the Sun's zone comes to the telescope: stop and say so, or move it away", choices=("stop", "away")),
    Key("limits", "sun_avoidance_deg", "number", 20.0, "distance kept from the Sun; 0: none", "deg", 0, 90),
    Key("limits", "hour_angle_past_meridian_deg", "number", 10.0,
        "German: how far the mechanical hour angle goes beyond 0..180", "deg", 0, 90),
)
_AXIS = (
    Key("axis", "motor_steps", "integer", 200, "full steps a turn of the motor", "steps", 1, 65535,
        drives=(*_TC410, *_AVR), in_unit=True),
    Key("axis", "main_gear", "ratio", "1/285", "worm and wheel", "", 1, 65535, drives=_TC410, in_unit=True),
    Key("axis", "main_gear", "ratio",
        Computed('"1/360", axis2 "2/360"', lambda _, axis: "1/360" if axis == "axis1" else "2/360"),
        "worm and wheel", "", 1, 65535, drives=_AVR),
    Key("axis", "secondary_gear", "ratio", "16/40", "motor to worm", "", 1, 65535, drives=_TC410, in_unit=True),
    Key("axis", "secondary_gear", "ratio", "11/57", "motor to worm", "", 1, 65535, drives=_AVR),
    Key("axis", "microsteps", "integer", 64, "microsteps a full step", "", 1, 256, drives=_AVR),
    Key("axis", "drive_type", "text", "gecko", "motor controller: 10 or 16 units a full step",
        choices=("gecko", "ims"), drives=_TC410, in_unit=True),
    Key("axis", "acceleration_register", "integer", 26, "acceleration, 152.588 units/s² each", "", 1, 255,
        drives=_TC410, in_unit=True),
    Key("axis", "deceleration_register", "integer", 26, "deceleration, likewise", "", 1, 255, drives=_TC410,
        in_unit=True),
    Key("axis", "max_speed_deg_s", "number",
        Computed("4.5, or 90 % of 20000 units/s where that is less", _tc410_speed), "fastest slew", "deg/s", 0, 100,
        above=True, drives=_TC410, in_unit=True),
    Key("axis", "motor_current_a", "number", 2.0, "phase current; at most 3 for ims", "A", 1, 5, drives=_TC410,
        in_unit=True),
    Key("axis", "motor_wiring", "text", "4-lead", "how the motor is wired, for the current it may have",
        choices=("4-lead", "6-lead-half", "6-lead-full", "8-lead-parallel", "8-lead-series"), drives=_TC410),
    Key("axis", "motor_rated_a", "number", None, "the current on the motor's label, to check motor_current_a by", "A",
        0.1, 20, drives=_TC410, example=2.8),
    Key("axis", "motor_rating", "text", "per-phase", "what that current is for; bipolar: in parallel, with 8 leads",
        choices=RATINGS, drives=_TC410),
    Key("axis", "encoder_bits", "integer", 0, "bits of the absolute encoder; 0: none", choices=(0, 14, 16),
        drives=_TC410),
    Key("axis", "encoder_reversed", "flag", default=False, meaning="the encoder counts against the axis",
        drives=_TC410),
    Key("axis", "encoder_zero", "integer", 0, "encoder reading remembered for the zero", "", 0, 65535,
        drives=_TC410, in_unit=True),
    Key("axis", "encoder_zero_at", "text", "centre", "where that zero is: at the centre count, or at count 0",
        choices=("centre", "zero"), drives=_TC410),
    Key("axis", "backlash_arcsec", "number", None,
        "play of its gears, which the unit is told to take up; none: what the unit takes up is right", "arcsec", 0,
        3600, drives=_AWR, example=30.0),
    Key("axis", "backlash_sigma_arcsec", "number", 0.0, "how far off that may be, root mean square", "arcsec", 0,
        3600, drives=_AWR),
    Key("axis", "link", "link", None, "where this axis's controller is reached", drives=_APO,
        example="tcp://127.0.0.1:1024"),
    Key("axis", "max_speed_deg_s", "number", Computed("the controller's", _controller(2)), "fastest motion",
        "deg/s", 0, 100, above=True, drives=_NODES),
    Key("axis", "acceleration_deg_s2", "number", Computed("the controller's", _controller(3)),
        "largest acceleration", "deg/s²", 0, 100, above=True, drives=_NODES),
    Key("axis", "jerk_deg_s3", "number", Computed("the controller's", _controller(4)), "largest jerk", "deg/s³", 0,
        1000, above=True, drives=_NODES),
    Key("axis", "centre_deg", "number",
        Computed("tc410: fork 0 / latitude, German 90 / ±90 at the visible pole, altazimuth 0 / 45; others 0",
                 _centre), "axis angle at the drive's centre count or zero", "deg", -360, 360),
    Key("axis", "reversed", "flag", default=False, meaning="counts decrease while the angle increases"),
    Key("axis", "min_deg", "number",
        Computed("fork −170 / −90, German −10 / −90 north or −270 south, altazimuth −270 / −5; apo, sdss: theirs",
                 lambda facts, axis: _range(facts, axis)[0]), "smallest axis angle", "deg", -720, 720,
        in_unit=True),
    Key("axis", "max_deg", "number",
        Computed("fork 170 / 90, German 190 / 270 north or 90 south, altazimuth 270 / 95; apo, sdss: theirs",
                 lambda facts, axis: _range(facts, axis)[1]), "largest axis angle", "deg", -720, 720, in_unit=True),
    Key("axis", "park_deg", "number",
        Computed("where the mount rests: fork 0 / latitude, German 90 / ±90, altazimuth 0 / 45, within the limits",
                 _park), "axis angle when parked", "deg", -720, 720, in_unit=True),
)
_AXIS2 = (
    Key("axis2", "steps_per_degree", "number", Computed("none; of the simulator 12000", _of_the_example(12000.0)),
        "motor steps a degree of axis 2", "steps/deg", 0, 1e8,
        above=True, drives=_AWR, example=12000.0),
)
_INSTRUMENTS = (
    Key("instruments.*", "x_arcsec", "number", 0.0,
        "pointing origin, from the tube's axis along increasing axis 1; fixed to the tube, no rotator turns it",
        "arcsec", -36000, 36000),
    Key("instruments.*", "y_arcsec", "number", 0.0, "likewise along increasing axis 2, in normal posture", "arcsec",
        -36000, 36000),
)
_TARGETS = (
    Key("targets", "kernel", "path", None,
        "JPL ephemeris (SPK file) for Sun, Moon and planets; none: DE421 of the extra `planets`, 1899 to 2053",
        example="de440s.bsp"),
)
_STATE = (
    Key("state", "path", "path", Computed("the platform's state directory", lambda _facts, _section: None),
        "folder that keeps positions, corrections and history", example="state"),
)
_SIMULATOR = (
    Key("simulator", "misalignment_x_arcsec", "number", 0.0, "true misalignment about x", "arcsec", -36000, 36000),
    Key("simulator", "misalignment_y_arcsec", "number", 0.0, "true misalignment about y", "arcsec", -36000, 36000),
    Key("simulator", "collimation_arcsec", "number", 0.0, "true collimation error", "arcsec", -36000, 36000),
    Key(
        "simulator", "nonperpendicularity_arcsec", "number", 0.0, "true non-perpendicularity", "arcsec",
                 -36000, 36000),
    Key("simulator", "flexure_arcsec", "number", 0.0, "true tube flexure at the horizon", "arcsec", -3600, 3600),
    Key("simulator", "periodic_error_arcsec", "number", 0.0, "amplitude a turn of the worm of axis 1", "arcsec", 0,
        3600),
    Key("simulator", "backlash_arcsec", "number", 0.0, "dead travel on reversing", "arcsec", 0, 3600),
    Key("simulator", "encoder_noise_arcsec", "number", 0.0, "standard deviation of an encoder reading", "arcsec", 0,
        3600),
    Key("simulator", "sky_noise_arcsec", "number", 0.0, "how far off a look at the true sky is, root mean square",
        "arcsec", 0, 3600),
    Key("simulator", "acceleration_error", "number", 0.0, "fraction by which it accelerates off its register", "",
        -0.5, 0.5),
    Key("simulator", "landing_s", "number", 0.0, "slow creep at the end of a slew", "s", 0, 60),
    Key("simulator", "clock_drift_ppm", "number", 0.0, "drift of the drive's own clock", "ppm", -1000, 1000),
    Key("simulator", "latency_s", "number", 0.001, "delay of the link, each way", "s", 0, 10),
    Key("simulator", "baud", "integer", 0, "speed of a serial link to imitate; 0: none", "baud", 0, 1e6),
    Key("simulator", "position_format", "text", "right", "how it lays out the position", choices=("right", "left"),
        drives=_TC410),
    Key("simulator", "slew_idle", "text", "both", "when it resumes tracking", choices=("both", "per-axis"),
        drives=_TC410),
    Key("simulator", "landing_counts", "integer", 20, "counts of that creep", "counts", 1, 10000, drives=_TC410),
    Key("simulator", "slew_bit_clears", "flag", default=True, meaning="the bit that starts a slew clears itself",
        drives=_TC410),
    Key("simulator", "limit_shift", "integer", 8, "bits that soft limits and park positions leave out", "bits", 0,
        8, drives=_TC410),
    Key("simulator", "speed_shift", "integer", 8, "bits that the maximum speed leaves out", "bits", 0, 8,
        drives=_TC410),
    Key("simulator", "encoder_zero_at", "text", "centre", "where its encoder zero is", choices=("centre", "zero"),
        drives=_TC410),
    Key("simulator", "volatile_targets", "flag", default=True, meaning="it forgets its targets without power",
        drives=_TC410),
    Key("simulator", "power_at_boot", "flag", default=True, meaning="its motors have power after it started",
        drives=_TC410),
    Key("simulator", "standby_steps", "number", 2.0, "full steps by which it may move in standby", "steps", 0, 100,
        drives=_TC410),
    Key("simulator", "dead_zone", "integer", 4, "idle range of its joystick round the centre", "", 0, 127,
        drives=_TC410),
    Key("simulator", "guide_velocity", "integer", 6937, "velocity register of its digital autoguider", "", 0,
        0xFFFFFF, drives=_TC410),
    Key("simulator", "on_expiry", "text", "halt", "what it does when its path has run out",
        choices=("halt", "extrapolate"), drives=_NODES),
    Key("simulator", "max_nodes", "integer", 32, "path nodes it holds", "", 2, 1000, drives=_NODES),
    Key("simulator", "first_node", "text", "wait", "until the first node's time it goes on as it was, or joins it",
        choices=("wait", "join"), drives=_NODES),
    Key("simulator", "refusals", "text", "told", "whether it says ERR: or drops in silence what it does not obey",
        choices=("told", "silence"), drives=_NODES),
    Key("simulator", "limits_command", "text", "SET.LIMITS", "what it calls the command of the soft limits",
        drives=_NODES),
    Key("simulator", "tells_settings", "flag", default=True, meaning="it tells its soft limits and MAXV when asked",
        drives=_NODES),
    Key("simulator", "axis_select", "text", "prefix", "how it expects the axis to be named",
        choices=("prefix", "line"), drives=_SDSS),
    Key("simulator", "clock_offset_s", "number", 0.0, "by how much its clocks are ahead", "s", -86400, 86400,
        drives=_NODES),
    Key("simulator", "clock_set", "flag", default=True, meaning="its clocks have been set", drives=_NODES),
    Key("simulator", "boot_s", "number", 5.0, "how long a controller is silent when it restarts", "s", 0, 600,
        drives=_NODES),
    Key("simulator", "move_count", "text", "total", "what its moves count", choices=("total", "half"), drives=_AVR),
    Key("simulator", "axis_bit", "integer", 1, "value of its axis bit that means axis 2", choices=(0, 1),
        drives=_AVR),
    Key("simulator", "guide_counts", "integer", 4, "timer counts by which its guiding changes the rate", "counts", 1,
        50, drives=_AVR),
    Key("simulator", "reversed1", "flag", default=False, meaning="its moves of axis 1 go the other way",
        drives=(*_AVR, *_AWR)),
    Key("simulator", "reversed2", "flag", default=False, meaning="likewise of axis 2", drives=(*_AVR, *_AWR)),
    Key("simulator", "north_reversed", "flag", default=False, meaning="its commands to the north go the other way",
        drives=_AVR),
    Key("simulator", "encoder_reversed1", "flag", default=False, meaning="its encoder 1 counts against the axis",
        drives=_AVR),
    Key("simulator", "encoder_reversed2", "flag", default=False, meaning="likewise encoder 2", drives=_AVR),
    Key("simulator", "encoder_still1", "flag", default=False, meaning="its encoder 1 counts nothing, its cable off",
        drives=_AVR),
    Key("simulator", "encoder_still2", "flag", default=False, meaning="likewise encoder 2", drives=_AVR),
    Key("simulator", "busy", "text", "restart", "what a move does to an axis that moves: begin anew, or nothing",
        choices=("restart", "ignore"), drives=_AVR),
    Key("simulator", "lost_steps", "number", 0.0, "fraction of the fast steps of a slew that its motors miss", "", 0,
        0.5, drives=_AVR),
    Key("simulator", "encoder_counts_per_turn", "integer", 0, "what its encoders count; 0: as the drive's key says",
        "counts", 0, 1e7, drives=_AVR),
    Key("simulator", "slew_table", "path", None,
        "its slew table, where it is another one than the drive's key says",
        choices=("standard",), drives=_AVR, example="slew_table.csv"),
    Key("simulator", "table_clocks", "text", "byte+1", "how many timer clocks a byte of its slew table means",
        choices=("byte+1", "byte"), drives=_AVR),
    Key("simulator", "guide_ends", "text", "tick", "its guiding ends at the n-th tick, or lasts so many whole ones",
        choices=("tick", "whole"), drives=_AVR),
    Key("simulator", "fine_compare", "integer", 255, "compare value of its timer for single microsteps of axis 2", "",
        1, 255, drives=_AVR),
    Key("simulator", "interrupted", "text", "lost", "what becomes of a microstep of tracking that a slew interrupts",
        choices=("lost", "kept"), drives=_AVR),
    Key("simulator", "index_pulse", "flag", default=True, meaning="a Hall sensor resets its PEC bin once a worm turn",
        drives=_AVR),
    Key("simulator", "sidereal_steps_per_s", "number",
        Computed("as in [drive]", _as_in_drive("sidereal_steps_per_s")), "what its drive rate truly is", "steps/s", 0,
        1e6, above=True, drives=_AWR),
    Key("simulator", "frequency_unit", "number", 1.0, "what one unit of its frequencies truly is", "steps/s", 0, 1e6,
        above=True, drives=_AWR),
    Key("simulator", "acceleration_unit", "number", 1.0, "what one unit of its accelerations truly is", "steps/s²", 0,
        1e6, above=True, drives=_AWR),
    Key("simulator", "rate_reference", "text", "motor", "what its guide and centre rates are counted from",
        choices=("motor", "sky"), drives=_AWR),
    Key("simulator", "postscaler", "text", "times", "what its rates truly fall with", choices=("times", "plus-one"),
        drives=_AWR),
    Key("simulator", "firmware", "number", 0.77, "its firmware, as the label has it", "", 0, 99.99, drives=_AWR),
    Key("simulator", "press_jitter_s", "number", 0.005, "by how much its keys act off their time, root mean square",
        "s", 0, 0.1, drives=_AWR),
    Key("simulator", "event_jitter_s", "number", 0.0001, "by how much its events are off theirs, root mean square",
        "s", 0, 0.1, drives=_AWR),
    Key("simulator", "debug", "number", 0.0, "how likely debug text follows what it says", "", 0, 1, drives=_AWR),
    Key("simulator", "byte_loss", "number", 0.0, "how likely a byte is lost, either way", "", 0, 0.5,
        drives=_AVR + _AWR),
    Key("simulator", "byte_doubling", "number", 0.0, "how likely a byte comes twice", "", 0, 0.5, drives=_AVR + _AWR),
    Key("simulator", "hand_every_s", "number", 0.0,
        "how often somebody moves an axis by its hand controller, 5′; 0: never", "s", 0, 86400, drives=_AVR),
    Key("simulator", "byte_delay", "number", 0.0, "how likely a byte is late with all behind it, either way", "", 0,
        0.5, drives=_AWR),
    Key("simulator", "byte_delay_s", "number", 0.05, "by how much it is late", "s", 0, 2, drives=_AWR),
    Key("simulator", "takes_up_backlash", "flag", default=True, meaning="its words take up what play it has",
        drives=_AWR),
    Key("simulator", "reads_ram", "flag", default=True, meaning="it tells what its RAM holds", drives=_AWR),
    Key("simulator", "reads_plain", "flag", default=False, meaning="it tells the non-volatile word instead",
        drives=_AWR),
    Key("simulator", "seed", "integer", 1, "of everything random in it", "", 0, 2**31 - 1),
)
# fmt: on


def _for_axis(section: str, keys: Iterable[Key]) -> tuple[Key, ...]:
    return tuple(replace(key, section=section) for key in keys)


_ROTATOR = (
    Key("rotator", "mode", "text", "sky", "what it holds: the sky, the horizon, or its own angle on the mount",
        choices=ROTATOR_MODES, drives=_NODES),
    Key("rotator", "position_angle_deg", "number", 0.0,
        "the instrument's y axis, counted to the east from north (sky), from the zenith (horizon), from the tube's "
        "own up (mount)", "deg", -360, 360, drives=_NODES),
    *(
        replace(key, drives=tuple(k for k in key.drives if k in _NODES))
        for key in _AXIS if set(key.drives) & set(_NODES)
    ),
)  # fmt: skip

KEYS: tuple[Key, ...] = (
    *_SITE, *_WEATHER, *_DRIVE, *_MOUNT, *_LIMITS, *_for_axis("axis1", _AXIS), *_for_axis("axis2", _AXIS), *_AXIS2,
    *_for_axis("rotator", _ROTATOR), *_INSTRUMENTS, *_TARGETS, *_SIMULATOR, *_STATE,
)  # fmt: skip


def keys_of(drive: str) -> tuple[Key, ...]:
    """The keys that a telescope with `drive` can have, in the order of a file."""
    return tuple(key for key in KEYS if drive in key.drives)
