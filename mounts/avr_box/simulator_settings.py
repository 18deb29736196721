"""How a simulated box differs from the ideal one: every assumption of the readings has its switch here."""

from dataclasses import dataclass
from typing import Literal

from mounts.avr_box.simulator_wire import DEFAULT_COMPARE, FINE_COMPARE, standard_table


@dataclass(frozen=True)
class SimulatorSettings:
    """One unit.

    Parameters
    ----------
    move_count : str
        Whether `M` counts all microsteps of a move, or half of them.
    axis_bit : int
        The value of the axis bit that means axis 2.
    guide_counts : int
        Timer counts by which `+` and `-` change the compare value.
    reversed1, reversed2 : bool
        A positive move of `M` turns the axis to smaller angles. Tracking always turns axis 1 westward.
    north_reversed : bool
        `>`, `N`, `n` and `D` turn axis 2 to smaller angles, `<`, `S` and `s` to larger ones.
    encoder_reversed1, encoder_reversed2 : bool
        An encoder counts against its axis.
    encoder_still1, encoder_still2 : bool
        An encoder counts nothing, as its cable is off, and is said to stand where it was when it was switched on.
    encoder_counts_per_turn : int
        0: none are fitted, and `Q` answers zeros.
    guide_ends : str
        When `+` and `-` end: at the n-th "tick" of TIMER1, or n "whole" ticks after they were heard.
    slew_table : tuple of int
        The table in its program memory.
    table_clocks : str
        How many clocks a byte of it means: "byte+1", as a timer counts up to it, or "byte".
    fine_compare : int
        Compare value of TIMER0 for `<` and `>`.
    interrupted : str
        What becomes of the microstep of tracking that a slew of axis 1 interrupts: it is "lost", or "kept" until the
        slew has ended.
    pec_table : tuple of int
        Its compare values by PEC bin.
    busy : str
        What a move does to an axis that still moves: it begins anew from this moment, or is not heard.
    clock_drift_ppm : float
        By how much its crystal is fast.
    lost_steps : float
        Fraction of the steps of a slew at full speed that the motors do not make.
    index_pulse : bool
        A Hall sensor resets the PEC pointer once a turn of the worm.
    byte_loss, byte_doubling : float
        How likely a byte is lost, or comes twice, either way.
    hand_every_s : float
        How often somebody presses a key of the hand controller, on the average, which moves an axis 5′; 0: never.
    seed : int
        Of what is random in it.
    """

    move_count: Literal["total", "half"] = "total"
    axis_bit: int = 1
    guide_counts: int = 4
    guide_ends: Literal["tick", "whole"] = "tick"
    reversed1: bool = False
    reversed2: bool = False
    north_reversed: bool = False
    encoder_reversed1: bool = False
    encoder_reversed2: bool = False
    encoder_still1: bool = False
    encoder_still2: bool = False
    encoder_counts_per_turn: int = 20000
    slew_table: tuple[int, ...] = standard_table()
    table_clocks: Literal["byte+1", "byte"] = "byte+1"
    fine_compare: int = FINE_COMPARE
    interrupted: Literal["lost", "kept"] = "lost"
    pec_table: tuple[int, ...] = (DEFAULT_COMPARE,) * 519
    busy: Literal["restart", "ignore"] = "restart"
    clock_drift_ppm: float = 0.0
    lost_steps: float = 0.0
    index_pulse: bool = True
    byte_loss: float = 0.0
    byte_doubling: float = 0.0
    hand_every_s: float = 0.0
    seed: int = 1
