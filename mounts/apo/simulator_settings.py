"""What simulated axis controllers are like, and the axes behind them.

Every reading of the manual that is an assumption has its switch here, so that a driver can be set against the
opposite one.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from mounts.apo.commands import Kind


@dataclass(frozen=True)
class SimulatorSettings:
    """The defaults are controllers as they are assumed to be, with clocks that are right.

    Attributes
    ----------
    on_expiry : str
        When the last node is past: "halt" brakes and stays, "extrapolate" goes on at its velocity. Both set bit 1.
    max_nodes : int
        How many nodes ahead a controller holds; one more is refused.
    first_node : str
        Until the time of the first node the axis goes on as it was, and is on the node then ("wait"), or a cubic
        leads it there at once ("join"). They agree where the node lies on the axis's path, as DRIFT makes sure.
    refusals : str
        What is not obeyed is "told" by `ERR:`, or dropped in "silence" with an OK.
    limits_command : str
        The name of SET.LIMITS.
    unknown : tuple of str
        Commands that it does not have; the names of some are not in the manual's text.
    tells_settings : bool
        Whether MAXV and SET.LIMITS without arguments answer what is set, rather than `ERR:`.
    axis_select : str
        SDSS: the axis is named in a "prefix" of each command, or on a "line" of its own for all that follow.
    ok : str
        OK stands on the "last" line behind a blank, or "alone".
    line_end : str
        Any run of CR and LF.
    clock_offset_s, clock_drift_ppm : float
        By how much the clocks are ahead of TAI, and gain.
    clock_set : bool
        Whether the clocks have been set; otherwise they tell −1.
    boot_s : float
        How long a controller is silent when it restarts.
    boot_banner : str
        What it says then, unasked; it arrives with its next answer.
    latency_s, baud : float, int
        Of the links; 0 baud is a line that takes no time. Used by whoever opens them.
    """

    on_expiry: Literal["halt", "extrapolate"] = "halt"
    max_nodes: int = 32
    first_node: Literal["wait", "join"] = "wait"
    refusals: Literal["told", "silence"] = "told"
    limits_command: str = "SET.LIMITS"
    unknown: tuple[str, ...] = ()
    tells_settings: bool = True
    axis_select: Literal["prefix", "line"] = "prefix"
    ok: Literal["last", "alone"] = "last"
    line_end: str = "\r\n"
    clock_offset_s: float = 0.0
    clock_drift_ppm: float = 0.0
    clock_set: bool = True
    boot_s: float = 5.0
    boot_banner: str = ""
    latency_s: float = 0.001
    baud: int = 0


@dataclass(frozen=True)
class AxisHardware:
    """One axis: what it may do, and what is bolted to it; degrees and seconds.

    Attributes
    ----------
    lowest_deg, highest_deg : float
        Soft limits, as the controller starts with.
    velocity, acceleration, jerk : float
        The largest it may have. The servo limits the first two; the jerk is the planner's business.
    stow_deg : float
        Where `P` drives it.
    switch_margin_deg : float
        How far beyond the soft limits the limit switches are.
    fiducials_deg : tuple of float
        Centres of the fiducials.
    fiducial_width_deg, fiducial_threshold_deg : float
        From edge to edge; and the largest error that is corrected by itself.
    following_error_deg : float
        How far the axis may be off an interpolated path before the servo gives up.
    """

    lowest_deg: float
    highest_deg: float
    velocity: float
    acceleration: float
    jerk: float
    stow_deg: float
    switch_margin_deg: float = 1.0
    fiducials_deg: tuple[float, ...] = ()
    fiducial_width_deg: float = 0.22
    fiducial_threshold_deg: float = 0.02
    following_error_deg: float = 0.1


_APO_FIDUCIALS = tuple(15.0 * count - 0.2 for count in range(-11, 24))

HARDWARE: Mapping[Kind, tuple[AxisHardware, ...]] = MappingProxyType(
    {
        "apo": (
            AxisHardware(-180.0, 360.0, 1.75, 0.1, 0.5, stow_deg=0.0, fiducials_deg=_APO_FIDUCIALS),
            AxisHardware(6.0, 85.0, 1.5, 0.1, 0.5, stow_deg=30.0, fiducials_deg=(14.9, 44.7, 74.9)),
            AxisHardware(-180.0, 180.0, 3.5, 0.7, 7.0, stow_deg=0.0, fiducials_deg=(-90.0, 0.1, 90.0)),
        ),
        "sdss": (
            AxisHardware(-195.0, 435.0, 2.0, 0.2, 0.2, stow_deg=121.0, fiducials_deg=_APO_FIDUCIALS),
            AxisHardware(18.2, 90.0, 1.5, 0.08, 0.08, stow_deg=30.0, fiducials_deg=(29.9, 59.9)),
            AxisHardware(-180.0, 361.0, 2.0, 0.25, 0.25, stow_deg=0.0, fiducials_deg=(-90.0, 0.1, 90.0)),
        ),
    }
)
"""Azimuth, altitude and rotator of both telescopes."""
