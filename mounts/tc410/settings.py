"""What the driver of a TC410 must know of its telescope."""

from dataclasses import dataclass
from typing import Literal

from mounts.tc410.encoders import Encoder
from pointing.gearing import Gearing

PositionFormatChoice = Literal["auto", "right", "left"]
SlewIdle = Literal["both", "per-axis"]


@dataclass(frozen=True)
class AxisSettings:
    """One axis: its gearing, its soft limits in counts, and the registers the configuration expects.

    `expected` maps register names without the axis prefix (``"acceleration"``) to values; the unit's own registers
    govern its motion, so a difference is listed, not written.
    """

    gearing: Gearing
    lowest_counts: int
    highest_counts: int
    counts_per_step: int
    expected: tuple[tuple[str, float], ...] = ()
    encoder: Encoder | None = None


@dataclass(frozen=True)
class TC410Settings:
    """Both axes, and the assumptions about the unit that its manual leaves open."""

    axes: tuple[AxisSettings, AxisSettings]
    position_format: PositionFormatChoice = "auto"
    slew_idle: SlewIdle = "both"
    baud: int | None = None
    expected: tuple[tuple[str, float], ...] = ()
    meaning: str = ""  # by which counts become places; counts synchronised under another one mean nothing
