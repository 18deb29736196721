"""What the driver of axis controllers must know of its telescope."""

from dataclasses import dataclass
from typing import Literal

from mounts.apo.commands import Kind

LEAD_S = 1.0
"""By which the first node of a way must be sent ahead."""
_HALTING_S = 0.5  # to tell the other axes, where one does not answer
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
    stows: bool = False  # whether `park` ends with the controllers' own stow
    together: bool = False  # whether an axis that would arrive first begins later
    meaning: str = ""  # by which degrees become places; those synchronised under another one mean nothing
    call_s: float = 2.0  # that a call to a controller may take, with repeating it; the time of the line apart

    @property
    def shortest_slew_s(self) -> float:
        """That a slew lasts at least: till then a call to a silent axis has ended, and the others were halted.

        The way of the axis that was told first begins its lead after that, so the lead is spared.
        """
        return max(self.call_s - LEAD_S, 0.0) + _HALTING_S
