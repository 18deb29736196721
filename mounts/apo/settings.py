"""What the driver of axis controllers must know of its telescope."""

from dataclasses import dataclass
from typing import Literal

from mounts.apo.commands import Kind

OnExpiry = Literal["halt", "extrapolate"]


@dataclass(frozen=True)
class AxisSettings:
    """One axis in its controller's degrees: the travel it is held to, and the limits of its motion.

    `word` addresses it where several share a line.
    """

    name: str
    word: str
    lowest_deg: float
    highest_deg: float
    max_speed_deg_s: float
    acceleration_deg_s2: float
    jerk_deg_s3: float


@dataclass(frozen=True)
class ApoSettings:
    """The axes, azimuth, altitude and perhaps a rotator, and the assumptions that the manual leaves open."""

    kind: Kind
    axes: tuple[AxisSettings, ...]
    on_expiry: OnExpiry = "halt"
    max_nodes: int = 32
    together: bool = False  # whether an axis that would arrive first begins later
    meaning: str = ""  # by which degrees become places; those synchronised under another one mean nothing
