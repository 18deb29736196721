"""What the driver of an AWR Microstep must know: the factory's calibration, and the assumptions as configured."""

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from mounts.awr.uncertainty import Jitter

RateReference = Literal["motor", "sky"]
Postscaler = Literal["times", "plus-one"]
CLOCK_UNCERTAINTY = 5e-5  # fraction by which the unit's crystal and the sheet may be off (A)


@dataclass(frozen=True)
class AwrSettings:
    """One telescope with a unit.

    Parameters
    ----------
    sidereal_steps_per_s : float
        Motor steps of axis 1 a second at sidereal rate, from the factory's sheet.
    frequency_unit, acceleration_unit : float
        Steps a second, and a second squared, of one unit of those registers.
    rate_reference : str
        Whether guide and centre rates are those of the motor, or on the sky.
    drive_ra : tuple of int, optional
        Counts and postscaler that the unit holds for the sidereal rate, as configured.
    postscaler : str
        Whether a rate falls with its postscaler, 0 counting as 1, or with one more than that.
    reads_ram : bool
        Whether a read of an address with bit 7 is taken for the word in RAM.
    jitter : Jitter
        By how much keys and events are off their times.
    fastest : tuple of float
        Steps a second at most by the drive registers, which go on when the program is gone.
    near : tuple of float
        Steps that a goto goes at most before anybody has seen that the keys move the axes as assumed.
    meaning : str
        What must not change between a sync and the next goto.
    plays : tuple of float, optional
        Motor steps of play in the gears of each axis; None for as much as the unit takes up.
    play_sigmas : tuple of float
        Standard deviation of that.
    """

    sidereal_steps_per_s: float
    frequency_unit: float = 1.0
    acceleration_unit: float = 1.0
    rate_reference: RateReference = "motor"
    drive_ra: tuple[int | None, int | None] = (None, None)
    postscaler: Postscaler = "times"
    reads_ram: bool = True
    jitter: Jitter = field(default_factory=Jitter)
    fastest: tuple[float, float] = (math.inf, math.inf)
    near: tuple[float, float] = (math.inf, math.inf)
    meaning: str = ""
    plays: tuple[float | None, float | None] = (None, None)
    play_sigmas: tuple[float, float] = (0.0, 0.0)

    def divides_by(self, postscaler: int) -> int:
        """What a postscaler divides a rate by."""
        return max(1, postscaler) if self.postscaler == "times" else postscaler + 1

    @property
    def otherwise(self) -> "AwrSettings":
        """The same with the other reading of the postscaler."""
        return replace(self, postscaler="plus-one" if self.postscaler == "times" else "times")

    @property
    def assumed(self) -> str:
        """All by which the way of a key is reckoned."""
        units = (self.sidereal_steps_per_s, self.frequency_unit, self.acceleration_unit, self.rate_reference)
        return "; ".join((*map(str, units), self.meaning))
