"""The clocks of the box, in cycles of its 16 MHz crystal (manual, section 6).

A timer divides the crystal by its prescaler and counts up to a compare value; motor pins toggle there, so that a
microstep lasts two such counts.
"""

from dataclasses import dataclass

CRYSTAL_HZ = 16_000_000

TICK_CYCLES = 1024 * 7217
"""TIMER1: the tick of the PEC pointer and of guiding, 0.461888 s (6.2)."""
TICK_S = TICK_CYCLES / CRYSTAL_HZ

TRACKING_PRESCALER = 128
DEFAULT_COMPARE = 225
"""OCR2A with PEC off: 276.5487 Hz, 0.206 % below the sidereal rate of the manual's gears (6.3)."""


@dataclass(frozen=True)
class Gears:
    """The two prescalers of an axis in a slew, crystal cycles a count (8)."""

    low: int
    high: int


SLEW_GEARS = (Gears(128, 32), Gears(256, 64))
"""TIMER2 of axis 1 and TIMER0 of axis 2."""


FINE_COMPARE = 255
"""OCR0A for `<` and `>`: the slowest of the low gear (A)."""


def fine_cycles(compare: int = FINE_COMPARE) -> int:
    """Crystal cycles of a microstep of `<` and `>` with a compare value of TIMER0."""
    return 2 * SLEW_GEARS[1].low * (compare + 1)


def tracking_cycles(compare: int) -> int:
    """Crystal cycles of a microstep while axis 1 tracks with a compare value of TIMER2."""
    return 2 * TRACKING_PRESCALER * (compare + 1)


def tracking_rate(compare: int = DEFAULT_COMPARE) -> float:
    """Microsteps a second with a compare value of TIMER2."""
    return CRYSTAL_HZ / tracking_cycles(compare)
