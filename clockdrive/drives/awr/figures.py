"""What an AWR Microstep is told of a rate, and the keys that it is moved by."""

import math
from typing import Any

from mounts.awr.registers import BY_NAME, Flags
from mounts.awr.settings import AwrSettings
from mounts.awr.slew_model import AwrTravel
from mounts.awr.speeds import DRIVES, Speeds
from mounts.awr.uncertainty import TWO_SIDED_95
from pointing.plan import Axis, AxisPlan, Unsaid
from pointing.slew import Waiting


class AwrWords(Unsaid):
    """Drive registers and presses of keys.

    Parameters
    ----------
    index : int
        Of the axis, 0 or 1.
    sidereal_steps_per_s : float
        The rate of drive_ra, of the factory's sheet.
    counts, postscaler : int, optional
        What drive_ra holds for it; without them only ratios are known.
    """

    def __init__(self, index: int, sidereal_steps_per_s: float, counts: int | None, postscaler: int | None) -> None:
        self._index = index
        self._sidereal = sidereal_steps_per_s
        self._counts = counts
        self._postscaler = postscaler

    def of_rate(self, axis: Axis, rate: float) -> dict[str, Any]:
        """Return the drive's words for a rate, radians per second, what they make of it, and how far the next is.

        Where nobody has said what drive_ra holds it is the ratio to that, of counts times postscaler.
        """
        steps = rate * axis.gearing.counts_per_radian
        if self._counts is None or self._postscaler is None:
            return {"drive_counts_ratio": round(self._sidereal / abs(steps), 6) if steps else None}
        drive = {
            BY_NAME["drive_ra_counts"].address: self._counts,
            BY_NAME["drive_ra_flags"].address: Flags(enable=True, positive=True, postscaler=self._postscaler).word,
        }
        speeds = Speeds(AwrSettings(self._sidereal), drive, drive)
        words = speeds.words_for(steps, self._postscaler)
        arcsec = 3600.0 * abs(axis.gearing.step_deg_float)
        return {
            "drive_register": DRIVES[self._index],
            "drive_counts": words.counts,
            "drive_flags": f"0x{words.flags.word:04X}",
            "drive_off_arcsec_s": round((speeds.of(words) - steps) * arcsec, 7),
            "drive_next_arcsec_s": round(speeds.apart(words) * arcsec, 7),
        }

    def of_slew(self, axis: Axis, plan: AxisPlan) -> dict[str, Any]:
        """Return its presses, with the error that each leaves, and how sure the end is."""
        travel = plan.travel.travel if isinstance(plan.travel, Waiting) else plan.travel
        presses = travel.presses if isinstance(travel, AwrTravel) else []
        arcsec = 3600.0 * abs(axis.gearing.step_deg_float)
        unknown = math.hypot(*(press.unknown for press in presses))
        return {
            "key_presses": [
                {
                    "speed": press.speed,
                    "hold_s": round(press.hold_s, 3),
                    "error_arcsec": round(press.leaves * arcsec, 2),
                }
                for press in presses
            ],
            "uncertainty_arcsec": round(TWO_SIDED_95 * unknown * arcsec, 2),
        }
