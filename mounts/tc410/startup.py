"""What is found out and made safe when a TC410 is connected, before anything may move."""

from mounts.errors import DriveRefused, WrongProtocol
from mounts.tc410.registers import DRIVE_TYPES, MICROSTEPS, PositionFormat, RegisterError, by_name, of_axis
from mounts.tc410.settings import AxisSettings, PositionFormatChoice, TC410Settings
from mounts.tc410.slew import Tc410SlewModel
from mounts.tc410.unit import Unit
from transports.errors import ExceptionReply, NoAnswer, WrongAnswer

_PROBE = 0x5A  # a low byte that a left-justified pair cannot hold


def identify(unit: Unit) -> int:
    """Make sure that a TC410 answers; return its velocity control register.

    Raises
    ------
    WrongProtocol
        Nothing answers, or not like a TC410.
    """
    try:
        kinds = [int(unit.read(f"axis{axis}_drive_type")[f"axis{axis}_drive_type"]) for axis in (1, 2)]
        control = int(unit.read("velocity_control")["velocity_control"])
    except (NoAnswer, WrongAnswer, ExceptionReply, RegisterError) as error:
        raise WrongProtocol(f"no TC410 answers at this link ({error}); check [drive] kind and link") from error
    if any(kind not in {1, 2} for kind in kinds):
        raise DriveRefused(
            f"the unit reports drive types {kinds[0]} and {kinds[1]}, 1 is Gecko and 2 IMS: "
            "without a motor drive on both axes nothing can be pointed; check its motor controllers"
        )
    return control


def find_position_format(unit: Unit, chosen: PositionFormatChoice) -> PositionFormat:
    """Decide how position pairs are justified, without motion; no slew may be enabled.

    A high word above 0x00FF is left-justified, a non-zero low byte right-justified. Where neither speaks, a probe
    with a low byte, written to a target register, comes back whole only from a right-justified unit.

    Raises
    ------
    DriveRefused
        The unit contradicts the configuration.
    """
    name = "axis1_target_position"
    present = unit.words("axis1_position"), unit.words("axis2_position")
    if any(high > 0x00FF for high, _ in present):
        found: PositionFormat = "left"
    elif any(low & 0xFF for _, low in present):
        found = "right"
    else:
        high, low = kept = unit.words(name)
        unit.write_words(name, (high & 0x00FF, low & 0xFF00 | _PROBE))
        found = "right" if unit.words(name)[1] & 0xFF == _PROBE else "left"
        unit.write_words(name, (kept[0], kept[1]))
    if chosen not in {"auto", found}:
        raise DriveRefused(
            f'the unit gives its positions {found}-justified, the configuration says "{chosen}": '
            f'set [drive] position_format = "{found}" or "auto"; nothing was moved'
        )
    return found


def read_models(unit: Unit, settings: TC410Settings) -> tuple[tuple[Tc410SlewModel, Tc410SlewModel], list[str]]:
    """Read how the unit moves, and list what differs from the configuration.

    Raises
    ------
    DriveRefused
        Its counts are other parts of a motor step than those of the configuration.
    """
    models: list[Tc410SlewModel] = []
    notes: list[str] = []
    for axis, expected in zip((1, 2), settings.axes, strict=True):
        found = {
            **unit.read(f"axis{axis}_tracking_velocity", f"axis{axis}_encoder_zero").values,
            **unit.read(f"axis{axis}_motor_steps", f"axis{axis}_park").values,
            **unit.read(f"axis{axis}_drive_type").values,
        }
        models.append(
            Tc410SlewModel(
                acceleration=int(found[f"axis{axis}_acceleration"]),
                deceleration=int(found[f"axis{axis}_deceleration"]),
                max_velocity=int(found[f"axis{axis}_max_speed"]),
            )
        )
        _refuse_other_microsteps(axis, int(found[f"axis{axis}_drive_type"]), expected)
        wanted = [(f"axis{axis}_{name}", value) for name, value in expected.expected]
        notes += _differences(found, wanted)
    if settings.expected:
        general = {
            **unit.read("joystick_mode", "longitude").values,
            **unit.read("mount_type").values,
            **unit.read("mount_x", "mount_y").values,
        }
        notes += _differences(general, list(settings.expected))
    return (models[0], models[1]), notes


def _refuse_other_microsteps(axis: int, kind: int, settings: AxisSettings) -> None:
    if kind in MICROSTEPS and MICROSTEPS[kind] != settings.counts_per_step:
        raise DriveRefused(
            f"axis {axis}: the unit has a drive of type {DRIVE_TYPES[kind]}, {MICROSTEPS[kind]} counts a full step, "
            f"the configuration counts {settings.counts_per_step}: every angle would be wrong by their ratio; "
            f'set [axis{axis}] drive_type = "{DRIVE_TYPES[kind].lower()}"'
        )


def _differences(found: dict[str, float], expected: list[tuple[str, float]]) -> list[str]:
    """Compare as the registers would hold both."""
    notes = []
    for name, value in expected:
        row = by_name(name)
        if row.encode(found[name]) != row.encode(value):
            unit = f" {row.unit}" if row.unit else ""
            notes.append(f"{name}: the unit has {found[name]:g}{unit}, the configuration {value:g}{unit}")
    return notes


def write_soft_limits(unit: Unit, settings: TC410Settings) -> None:
    """Write the soft limits, rounded inward, and read them back.

    Raises
    ------
    DriveRefused
        They read back otherwise: there is no other bound in the drive if the host dies.
    """
    for axis, limits in zip((1, 2), settings.axes, strict=True):
        for side, counts in (("negative", limits.lowest_counts), ("positive", limits.highest_counts)):
            row = of_axis(axis, f"{side}_limit")
            words = row.encode(counts)
            unit.write_words(row.name, words)
            read = unit.words(row.name)
            if read != words:
                raise DriveRefused(
                    f"{row.name} reads back 0x{read[0]:04X} instead of 0x{words[0]:04X}: "
                    "without its soft limits the drive must not move; check the unit"
                )
