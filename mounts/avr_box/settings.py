"""What the driver of a box must know of it: gears, and each assumption of the readings as it is configured."""

from dataclasses import dataclass
from typing import Literal

from mounts.avr_box.timers import tracking_rate

_ENDED_IN_S = 3.0  # after its computed end, in which a runaway is seen and ended, answers lost among them
SIDEREAL_DAY_S = 86164.0905
_PEC_UNCERTAINTY = 1e-3  # of a table that nobody has read: a quarter of the step between two divisors
MoveCount = Literal["total", "half"]
Busy = Literal["restart", "ignore"]


@dataclass(frozen=True)
class AvrSettings:
    """One telescope with a box.

    Parameters
    ----------
    steps_per_turn : tuple of float
        Microsteps of each motor for a turn of its axis.
    signs : tuple of int
        +1 where the counts of an axis rise with its angle, −1 where they fall. Tracking turns axis 1 to larger ones.
    slew_table : tuple of int
        The table in its program memory.
    move_count : str
        Whether `M` counts all microsteps of a move, or half of them.
    axis_bit : int
        The value of the axis bit that means axis 2.
    guide_counts : int
        Timer counts by which `+` and `-` change the compare value.
    busy : str
        What a move does to an axis that still moves: it begins anew from this moment, or is not heard.
    north_reversed : bool
        `>`, `N`, `n` and `D` turn axis 2 to smaller angles: its motor is wired the other way.
    pec : bool
        The box corrects its periodic error.
    encoder_counts_per_turn : int
        0: none are fitted.
    longest_s : float
        Of one move, as no command ends it.
    meaning : str
        What must not change between a sync and the next goto.
    """

    steps_per_turn: tuple[float, float]
    signs: tuple[int, int]
    slew_table: tuple[int, ...]
    move_count: MoveCount = "total"
    axis_bit: int = 1
    guide_counts: int = 4
    busy: Busy = "restart"
    north_reversed: bool = False
    pec: bool = False
    encoder_counts_per_turn: int = 20000
    longest_s: float = 30.0
    meaning: str = ""

    @property
    def own_rate(self) -> float:
        """Microsteps a second with which axis 1 tracks by itself, by the nominal crystal.

        That of the default divisor; with PEC the table is taken to make the sidereal rate, turn by turn of the worm.
        """
        return self.steps_per_turn[0] / SIDEREAL_DAY_S if self.pec else tracking_rate()

    @property
    def rate_uncertainty(self) -> float:
        """By which fraction that may be off, besides the crystal."""
        return _PEC_UNCERTAINTY if self.pec else 0.0

    @property
    def longest_piece_s(self) -> float:
        """Seconds of one move: with encoders, so that one that became longer is ended within `longest_s` all told."""
        return (
            max(self.longest_s - _ENDED_IN_S, self.longest_s / 2.0)
            if self.encoder_counts_per_turn
            else self.longest_s
        )

    @property
    def wire_per_half(self) -> int:
        """What a move of two microsteps counts in `M`."""
        return 2 if self.move_count == "total" else 1
