"""The incremental encoder of an axis: what it should say, and where it says that the axis is.

It counts from where the box was switched on, so that its zero is tied to the axis whenever that is known. A count is
coarse, 65″ by default: the reckoning is finer as long as both agree, and the encoder is right when they do not.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

TRUST_COUNTS = 1.5  # by which what is said may differ from what is reckoned exactly: both are rounded
SEEN_COUNTS = TRUST_COUNTS + 1.0
"""By which an axis may be off that agrees: what is said and the tie are rounded."""
_CLEAR_COUNTS = 0.7  # of way that tell its sense
ROUNDED_COUNTS = 1.2  # by which a way may differ from what is said of it


class EncoderSeen(NamedTuple):
    """What an encoder said, once."""

    said: int
    step: float  # microsteps of a count
    counts: float | None  # microsteps where it says that the axis is, to a count; None while it is not tied
    reckoned: float  # where the axis was reckoned to be then


@dataclass
class Encoder:
    """One encoder.

    Parameters
    ----------
    steps_per_count : float
        Microsteps of the motor for a count, signed: the sense in which the counts of the axis rise.
    zero : float, optional
        Microsteps at which it counts 0; None while it is not tied.
    """

    steps_per_count: float
    zero: float | None = None
    proved: float | None = None
    """Where the axis was when both last agreed."""
    bound_at: float = -math.inf
    """When the reckoning was last held within a count of what it says, POSIX seconds."""

    crept: float = 0.0
    """Microsteps by which the reckoning had to be brought nearer to what it says since it was tied."""

    @property
    def step(self) -> float:
        """Microsteps of a count."""
        return abs(self.steps_per_count)

    def counts(self, steps: float) -> int:
        """What it says where the axis is, or should."""
        return 0 if self.zero is None else round((steps - self.zero) / self.steps_per_count)

    def tie(self, said: int, steps: float) -> None:
        """The axis is known to be at `steps` while it says this."""
        self.zero = steps - said * self.steps_per_count
        self.proved, self.crept = steps, 0.0

    def steps(self, said: int) -> float:
        """Where the axis is when it says this, to ±1 count: microsteps."""
        if self.zero is None:
            raise ValueError("tie it first")
        return self.zero + said * self.steps_per_count

    def off(self, said: int, steps: float, uncertainty: float) -> float:
        """By how many microsteps the axis is beyond where it is reckoned to be, nothing where both may be right."""
        beyond = self.steps(said) - steps
        return beyond if abs(beyond) > TRUST_COUNTS * self.step + uncertainty else 0.0

    def against(self, asked: float, made: float) -> bool:
        """Whether the axis went, by what it says, as far the other way as was asked of it, microsteps."""
        return abs(asked) > _CLEAR_COUNTS * self.step and abs(made + asked) < ROUNDED_COUNTS * self.step + 0.1 * abs(
            asked
        )


def zeroed(said: tuple[int, int], tracked_counts: float) -> bool:
    """Whether both may have been switched on within the time in which tracking makes so many counts."""
    return abs(said[1]) <= TRUST_COUNTS and abs(said[0]) <= tracked_counts + TRUST_COUNTS
