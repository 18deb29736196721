"""How a simulated AWR Microstep differs from the ideal one: every assumption of the readings has its switch here."""

from dataclasses import dataclass, field
from typing import Literal

SIDEREAL = 50.0  # steps a second, of the example of the configuration
_COUNTS = 18000  # of the sidereal rate
_POSITIVE, _ENABLE, _POSTSCALER = 0x2, 0x1, 0x0400
_FORWARD, _BACK = _POSTSCALER | _POSITIVE | _ENABLE, _POSTSCALER | _ENABLE
_STOPPED = _POSTSCALER | _POSITIVE


def factory(
    sidereal: float = SIDEREAL,
    *,
    frequency_unit: float = 1.0,
    acceleration_unit: float = 1.0,
    reversed1: bool = False,
    rate_reference: str = "motor",
    backlash: tuple[int, int] = (0, 0),
) -> dict[int, int]:
    """The words of a unit as it comes: guide 30 %, centre 2×, move 32×, slew 480× sidereal, 1.2 s to full speed.

    Parameters
    ----------
    sidereal : float
        Motor steps a second at sidereal rate.
    frequency_unit, acceleration_unit : float
        Steps a second, and a second squared, of one unit.
    reversed1 : bool
        Larger hour angles are the way of RIGHT.
    rate_reference : str
        Whether guide and centre rates are those of the motor or on the sky.
    backlash : tuple of int
        Steps that either axis takes up.
    """
    ahead, against = (_FORWARD, _BACK) if not reversed1 else (_BACK, _FORWARD)
    with_drive, drive = (1.0, ahead)
    left, right = ("guide_left", "guide_right") if not reversed1 else ("guide_right", "guide_left")
    own = with_drive if rate_reference == "motor" else 0.0
    rates = {
        "drive_ra": (1.0, drive),
        "drive_dec": (1.0, _STOPPED),
        "guide_up": (0.3, _FORWARD),
        "centre_up": (2.0, _FORWARD),
        left: (own + 0.3, ahead),
        right: (abs(own - 0.3), ahead if own > 0.3 else against),
        left.replace("guide", "centre"): (own + 2.0, ahead),
        right.replace("guide", "centre"): (abs(own - 2.0), against),
    }
    order = ("drive_ra", "drive_dec", "guide_up", "guide_right", "guide_left", "centre_up", "centre_right",
             "centre_left")  # fmt: skip
    words = {0x00: 0}
    for i, name in enumerate(order):
        times, flags = rates[name]
        words[1 + 2 * i], words[2 + 2 * i] = round(_COUNTS / times), flags
    to_larger, to_smaller = (0x13, 0x12) if not reversed1 else (0x12, 0x13)
    frequencies = {0x11: 32.0, to_larger: 33.0, to_smaller: 31.0, 0x14: 480.0, 0x15: 480.0}
    words |= {address: max(1, round(times * sidereal / frequency_unit)) for address, times in frequencies.items()}
    words |= {address: max(1, round(400.0 * sidereal / acceleration_unit)) for address in (0x16, 0x17)}
    return words | {0x18: 0, 0x19: backlash[0], 0x1A: backlash[1], 0x3F: 0xC3C3}


@dataclass(frozen=True)
class SimulatorSettings:
    """One unit.

    Parameters
    ----------
    sidereal_steps_per_s : float
        What its factory words make of the drive rate of axis 1.
    frequency_unit, acceleration_unit : float
        Steps a second, and a second squared, of one unit of those registers.
    rate_reference : str
        Whether guide and centre rates are those of the motor or on the sky.
    words : dict
        Its non-volatile words by address.
    firmware : float
        As its label has it, 0.77.
    sense1, sense2 : int
        -1 where the wiring turns an axis the other way; the override of the directions register stands above it.
    execution_s, execution_jitter_s : float
        A key acts so long after its command was heard, and by how much that scatters, root mean square.
    stamp_jitter_s : float
        By how much an `X` event is late or early against the motion that it tells, root mean square.
    clock_drift_ppm : float
        By how much its clock is fast.
    acceleration_error : float
        Fraction by which it accelerates off its registers.
    debug : float
        How likely text that is no packet follows a packet.
    byte_loss, byte_doubling : float
        How likely a byte, either way, does not come, or comes twice.
    reads_ram : bool
        A read with bit 7 of the address tells the word in RAM; else it fails.
    worm_steps : float
        Motor steps of axis 1 for a turn of its worm, at which it tells an index pulse; 0: no sensor is fitted.
    seed : int
        Of everything random in it.
    """

    sidereal_steps_per_s: float = SIDEREAL
    frequency_unit: float = 1.0
    acceleration_unit: float = 1.0
    rate_reference: Literal["motor", "sky"] = "motor"
    words: dict[int, int] = field(default_factory=factory)
    firmware: float = 0.77
    sense1: int = 1
    sense2: int = 1
    execution_s: float = 0.025
    execution_jitter_s: float = 0.005
    stamp_jitter_s: float = 0.0001
    clock_drift_ppm: float = 0.0
    acceleration_error: float = 0.0
    debug: float = 0.0
    byte_loss: float = 0.0
    byte_doubling: float = 0.0
    reads_ram: bool = True
    worm_steps: float = 0.0
    seed: int = 1
