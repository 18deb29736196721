"""How a simulated AWR Microstep differs from the ideal one: every assumption of the readings has its switch here."""

from dataclasses import dataclass, field
from typing import Literal

from mounts.awr.factory import SIDEREAL, factory


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
    postscaler : str
        Whether a rate falls with its postscaler, 0 counting as 1, or with one more than that.
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
    byte_delay, byte_delay_s : float
        How likely a byte, either way, comes late with all that is behind it, and by how much.
    reads_ram : bool
        A read with bit 7 of the address tells the word in RAM; else it fails.
    reads_plain : bool
        A read with bit 7 of the address tells the non-volatile word.
    write_answer : str
        The form of the answer to a write.
    stop : str
        Whether what it says ends with STOP.
    worm_steps : float
        Motor steps of axis 1 for a turn of its worm, at which it tells an index pulse; 0: no sensor is fitted.
    plays : tuple of float
        Motor steps of play in the gears of each axis, which the words of backlash may take up.
    seed : int
        Of everything random in it.
    """

    sidereal_steps_per_s: float = SIDEREAL
    frequency_unit: float = 1.0
    acceleration_unit: float = 1.0
    rate_reference: Literal["motor", "sky"] = "motor"
    postscaler: Literal["times", "plus-one"] = "times"
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
    byte_delay: float = 0.0
    byte_delay_s: float = 0.05
    reads_ram: bool = True
    reads_plain: bool = False
    write_answer: Literal["AA?Y", "AAY"] = "AA?Y"
    stop: Literal["by firmware", "always", "never"] = "by firmware"
    worm_steps: float = 0.0
    plays: tuple[float, float] = (0.0, 0.0)
    seed: int = 1
