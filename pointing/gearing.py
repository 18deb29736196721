"""Axis angle to motor counts and back, through an exact rational step.

The step is kept as a fraction, so a configuration of 200 steps, 1/285 and 16/40 means exactly that; the conversion
itself runs in floats, whose rounding over the whole 24-bit range is below 1e-8 count.
"""

import math
from dataclasses import dataclass, field
from fractions import Fraction

from pointing.errors import PointingError


@dataclass(frozen=True)
class Gearing:
    """How one axis turns counts into angle.

    Parameters
    ----------
    step_deg : Fraction
        Axis degrees per count, positive.
    centre_counts : int
        The count at which the axis stands at `centre_deg`.
    centre_deg : float
        Axis angle at the centre count, degrees.
    reversed : bool
        Counts fall as the angle rises.

    Raises
    ------
    PointingError
        The step is not positive, or the centre is no number.
    """

    step_deg: Fraction
    centre_counts: int
    centre_deg: float
    reversed: bool = False
    counts_per_radian: float = field(init=False, repr=False)
    """Signed: negative for a reversed axis."""
    centre: float = field(init=False, repr=False)
    """Axis angle at the centre count, radians."""

    def __post_init__(self) -> None:
        if self.step_deg <= 0:
            raise PointingError(f"a step of {self.step_deg}° a count: it must be above 0; check the gears")
        if not math.isfinite(self.centre_deg):
            raise PointingError(f"an axis centre at {self.centre_deg}°: give a finite angle")
        sign = -1 if self.reversed else 1
        object.__setattr__(self, "counts_per_radian", sign * float(180 / self.step_deg) / math.pi)
        object.__setattr__(self, "centre", math.radians(self.centre_deg))

    @classmethod
    def of_motor(
        cls,
        steps_per_turn: int,
        main_gear: Fraction,
        secondary_gear: Fraction,
        counts_per_step: int,
        *,
        centre_counts: int,
        centre_deg: float,
        reversed: bool = False,  # noqa: A002 - the configuration's word
    ) -> "Gearing":
        """Build from a stepper motor and its gears (TC410 manual, section 4.7.5: 360/n · m1/d1 · m2/d2)."""
        step = Fraction(360, steps_per_turn) * main_gear * secondary_gear / counts_per_step
        return cls(step, centre_counts, centre_deg, reversed)

    def counts(self, angle: float) -> float:
        """Counts, unrounded, at which the axis stands at `angle` radians."""
        return self.centre_counts + (angle - self.centre) * self.counts_per_radian

    def angle(self, counts: float) -> float:
        """Axis angle in radians at `counts`; the inverse of `counts`."""
        return self.centre + (counts - self.centre_counts) / self.counts_per_radian

    @property
    def step_deg_float(self) -> float:
        """Degrees of axis angle per count, rounded to a float."""
        return 180.0 / math.pi / abs(self.counts_per_radian)

    @property
    def step_arcsec(self) -> float:
        """Arcseconds of axis angle per count."""
        return float(self.step_deg * 3600)
