"""What the driver of a box must know of it: gears, and each assumption of the readings as it is configured."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from mounts.avr_box.commands import FIVE_ARCMIN
from mounts.avr_box.slew_model import AvrSlewModel, cycles_in
from mounts.avr_box.slew_table import SlewLaw, laws
from mounts.avr_box.timers import tracking_rate

_ENDED_IN_S = 3.0  # after its computed end, in which a runaway is seen and ended, answers lost among them
_CLOSED_IN_S = (3.0, 5.0)  # of each axis, likewise by letters where no encoder sees it, whether it ran away or not
_LEAST_PART = 0.4  # of the longest move, that a piece may last
LEAST_BLIND_S = 10.0
"""Of the longest move, where no encoder sees it and it must be ended in time."""
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
    def blind(self) -> bool:
        """Whether no encoder sees what becomes of a move."""
        return not self.encoder_counts_per_turn

    def longest_piece_s(self, index: int) -> float:
        """Seconds of one move of an axis, so that one that became longer is ended within `longest_s` all told."""
        if self.blind:
            return max(self.longest_s - _CLOSED_IN_S[index], _LEAST_PART * self.longest_s)
        return max(self.longest_s - _ENDED_IN_S, self.longest_s / 2.0)

    @cached_property
    def longest_half(self) -> tuple[int, int]:
        """Half of the microsteps of the longest move of each axis: the bound of any that nobody asked for."""
        one, two = (law.half_within(cycles_in(self.longest_s)) for law in laws(self.slew_table))
        return one, two

    def slew_model(self, index: int, law: SlewLaw, crystal: float = 1.0) -> AvrSlewModel:
        """How axis 0 or 1 slews, by a crystal of so many times its nominal frequency.

        Letters lead axis 1 to larger angles whatever its way: those that lead back are a bit from a move of any
        length. Where a bit of its moves makes them moves of axis 2, they are none that is too long there.
        """
        rate = self.signs[0] * self.own_rate * crystal if index == 0 else 0.0
        model = AvrSlewModel(
            law, rate, self.longest_piece_s(index), crystal=crystal, wire_per_half=self.wire_per_half
        )
        if not self.blind:
            return model
        return replace(
            model,
            most_half=min(self.longest_half),
            closing_half=FIVE_ARCMIN[index],
            closing_sign=self.signs[0] if index == 0 else 0,
        )

    @property
    def wire_per_half(self) -> int:
        """What a move of two microsteps counts in `M`."""
        return 2 if self.move_count == "total" else 1
