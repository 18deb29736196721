"""The keys that an AWR Microstep is moved by."""

import math
from typing import Any

from mounts.awr.slew_model import AwrTravel
from mounts.awr.uncertainty import TWO_SIDED_95
from pointing.plan import Axis, AxisPlan, Unsaid
from pointing.slew import Waiting


class AwrWords(Unsaid):
    """Presses of keys."""

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
