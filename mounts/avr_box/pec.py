"""The periodic error of the worm: measured, fitted by harmonics, and made the table of the firmware (manual, 7).

The table has a compare value for each of 519 bins, one a tick of TIMER1; a turn of the worm takes 518.2 of them at
the sidereal rate. The rate that a bin wants lies between two divisors, 0.44 % apart: what one bin makes too much the
next ones make less, so that the motor is never half a step of the rate from where it should be.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mounts.avr_box.commands import BINS
from mounts.avr_box.timers import CRYSTAL_HZ, TICK_S, TRACKING_PRESCALER, tracking_rate
from mounts.errors import DriveError

MOST_HARMONICS = 50
"""Of the worm, to be fitted: each wave of the last has ten bins of the table."""
LARGEST_ARCSEC = 3600.0
"""By which a worm may run ahead: no worm does by a degree."""
_LARGEST = 255
_FEWEST_TURNS = 0.9  # of the worm that must be measured


class PecError(DriveError):
    """No table can be made of what was measured."""


@dataclass(frozen=True)
class PeriodicError:
    """By how much an axis that is driven evenly runs ahead, over the turn of its worm.

    Parameters
    ----------
    cosines, sines : tuple of float
        Of each harmonic from the first on, microsteps.
    drift : float
        Of the measured rate, microsteps a second ahead; no part of the table.
    rms : float
        Of what the harmonics leave, microsteps.
    """

    cosines: tuple[float, ...]
    sines: tuple[float, ...]
    drift: float = 0.0
    rms: float = 0.0

    def at(self, phase: float) -> float:
        """Microsteps ahead at a phase of the worm, radians from where bin 0 begins."""
        return sum(
            a * math.cos(k * phase) + b * math.sin(k * phase)
            for k, (a, b) in enumerate(zip(self.cosines, self.sines, strict=True), start=1)
        )


def fitted(times: Sequence[float], ahead: Sequence[float], worm_s: float, harmonics: int = 4) -> PeriodicError:
    """Fit what was measured, seconds since bin 0 and microsteps ahead, by harmonics of the worm and a drift.

    `worm_s` is how long a turn of the worm took while it was measured.

    Raises
    ------
    PecError
        There is too little of it: less than a turn of the worm, or fewer looks than twice the unknowns.
    """
    if not 1 <= harmonics <= MOST_HARMONICS:
        raise PecError(
            f"{harmonics} harmonics: give 1 to {MOST_HARMONICS}; the bins of the table are too wide for more"
        )
    unknowns = 2 + 2 * harmonics
    if len(times) != len(ahead) or len(times) < 2 * unknowns:
        raise PecError(f"{len(times)} looks for {unknowns} unknowns: give {2 * unknowns} or more, or fewer harmonics")
    t = np.asarray(times, dtype=float)
    if not np.isfinite(t).all() or not np.isfinite(ahead).all():
        raise PecError("a time or a displacement is no number")
    if np.ptp(t) < _FEWEST_TURNS * worm_s:
        raise PecError(f"{np.ptp(t):.0f} s are less than a turn of the worm: measure for {worm_s:.0f} s or more")
    phase = math.tau * t / worm_s
    waves = [wave(k * phase) for k in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    design = np.column_stack([np.ones_like(t), t, *waves])
    found, *_ = np.linalg.lstsq(design, np.asarray(ahead, dtype=float), rcond=None)
    rms = float(np.sqrt(np.mean((design @ found - ahead) ** 2)))
    return PeriodicError(tuple(map(float, found[2::2])), tuple(map(float, found[3::2])), float(found[1]), rms)


def table(error: PeriodicError, rate: float, worm_s: float) -> tuple[int, ...]:
    """The compare value of each bin that drives at a rate, microsteps a second, and against the error.

    Raises
    ------
    PecError
        No divisor makes the rate that a bin wants.
    """
    found, made = [], 0.0
    for number in range(BINS):
        phase = math.tau * (number + 1) * TICK_S / worm_s
        due = rate * (number + 1) * TICK_S - (error.at(phase) - error.at(0.0))
        compare = round(CRYSTAL_HZ * TICK_S / (2 * TRACKING_PRESCALER * (due - made)) - 1.0) if due > made else -1
        if not 0 <= compare <= _LARGEST:
            raise PecError(f"bin {number} wants {(due - made) / TICK_S:.1f} microsteps/s: look at what was measured")
        found.append(compare)
        made += tracking_rate(compare) * TICK_S
    return tuple(found)


def as_c(values: Sequence[int]) -> str:
    """The table as C for avr-gcc."""
    return f"const uint8_t PEC_table[{len(values)}] PROGMEM = {{\n{_rows(values, '    ', ',')}\n}};\n"


def as_assembler(values: Sequence[int]) -> str:
    """The table as data of the assembler."""
    return f"PEC_table:\n{_rows(values, '    .byte ', '')}\n    .balign 2\n"


def read_measured(path: Path | str) -> tuple[list[float], list[float]]:
    """Read a file of two columns, PEC bins and arcseconds ahead; `#` begins a remark.

    Raises
    ------
    PecError
        It cannot be read; a line has not two numbers, or one that no worm makes.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise PecError(f"{path} cannot be read: {error}") from None
    one, two = [], []
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            first, second = map(float, words)
        except ValueError:
            raise PecError(f"{path}, line {number}: {line.strip()!r} is not two numbers") from None
        if not (math.isfinite(first) and abs(second) <= LARGEST_ARCSEC):
            raise PecError(
                f"{path}, line {number}: {line.strip()!r} is no bin with arcseconds ahead, at most "
                f"±{LARGEST_ARCSEC:g}″: is it in other units?"
            )
        one.append(first)
        two.append(second)
    return one, two


def _rows(values: Sequence[int], begin: str, end: str) -> str:
    rows = (values[i : i + 16] for i in range(0, len(values), 16))
    return f"{end}\n".join(begin + ", ".join(map(str, row)) for row in rows)
