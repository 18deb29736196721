"""The simulated box's own reading of the manual: letters, flags, answers and clocks.

It shares none of it with the driver, so that a letter, a count or a gear that the driver has wrong shows.
"""

import math

ARGUMENTS = {
    **dict.fromkeys("DENPQSWns", 0),
    **dict.fromkeys("C+-<>", 1),
    **dict.fromkeys("BZ", 2),
    "M": 5,
}
"""Bytes that follow each letter (section 9)."""

RA_GUIDING, PEC, DEC_GUIDING = 1 << 1, 1 << 2, 1 << 4
"""Bits of the byte after `C`; bit 0, of the encoders, changes nothing here, bit 3 is none."""

FIVE_ARCMIN = (2763, 1382)
"""`step_max` of `E` and `W`, and of `N` and `S`; a move makes twice as many microsteps."""

BINS = 519
"""Of the PEC table, one a tick, for a turn of the worm."""

CRYSTAL_HZ = 16_000_000
TICK_CYCLES = 7217 * 1024
"""TIMER1: OCR1A = 7216, prescaler 1024 (6.2)."""

PRESCALERS = ((128, 32), (256, 64))
"""Of the low and the high gear: TIMER2 of axis 1, TIMER0 of axis 2 (8)."""

DEFAULT_COMPARE = 225
"""OCR2A with PEC off (6.3)."""
FINE_COMPARE = 255
"""OCR0A for `<` and `>` (A)."""


def tracking_cycles(compare: int) -> int:
    """Crystal cycles of a microstep of tracking: pins toggle at the compare value, twice a microstep."""
    return (compare + 1) * 128 * 2


def fine_cycles(compare: int) -> int:
    """Crystal cycles of a microstep of `<` and `>`."""
    return (compare + 1) * 256 * 2


def standard_table() -> tuple[int, ...]:
    """The Slew Table as the manual prints its formula."""
    return tuple(min(255, round(512.0 / math.sqrt(entry)) - 1) for entry in range(1, 1025))


def answer(one: int, two: int) -> bytes:
    """Two numbers of a sign and five digits, a tab between, a carriage return after."""
    signs = ["-" if number < 0 else "+" for number in (one, two)]
    return f"{signs[0]}{abs(one):05d}\t{signs[1]}{abs(two):05d}\r".encode("ascii")
