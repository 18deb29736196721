"""Motor currents: what a motor may be given by its rating, its wiring and its controller (manual, sections 3, 4.7.2).

The drive works bipolar. A rating is per phase, as for unipolar drives, or bipolar, which for eight leads is that of
the coils in parallel.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

Rating = Literal["per-phase", "bipolar"]
RATINGS: tuple[Rating, ...] = ("per-phase", "bipolar")

FACTORS: Mapping[tuple[str, str], float] = MappingProxyType(
    {
        ("4-lead", "per-phase"): 1.0,
        ("4-lead", "bipolar"): 1.0,
        ("6-lead-half", "per-phase"): 1.0,
        ("6-lead-full", "per-phase"): 0.7,
        ("8-lead-parallel", "per-phase"): 1.4,
        ("8-lead-parallel", "bipolar"): 1.0,
        ("8-lead-series", "per-phase"): 0.7,
        ("8-lead-series", "bipolar"): 0.5,
    }
)
"""The current to configure over the motor's rated one, by wiring and what the rating is for."""

LEAST_A = 1.0
MOST_A: Mapping[str, float] = MappingProxyType({"gecko": 5.0, "ims": 3.0})
ERRATIC = 0.5  # of the rated current, below which microsteps become uneven
_ROUNDING_A = 0.05  # the register holds tenths


def rated_current_a(wiring: str, rating: str, rated_a: float) -> float | None:
    """The current that a motor so wired is rated for; None where a rating of this kind does not exist."""
    factor = FACTORS.get((wiring, rating))
    return None if factor is None else factor * rated_a


def overdriven(current_a: float, rated_a: float) -> bool:
    """Whether the motor would overheat, with little more torque to show for it."""
    return current_a > rated_a + _ROUNDING_A


def erratic(current_a: float, rated_a: float) -> bool:
    """Whether its microsteps would be uneven."""
    return current_a < ERRATIC * rated_a - 1e-9
