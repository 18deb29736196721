"""What is waited for, where, and until when."""

from dataclasses import dataclass
from typing import Any

from clockdrive.utc import utc


@dataclass(frozen=True)
class Waiting:
    """A telescope that stands where a target will come up.

    Parameters
    ----------
    target : str
        The target's name.
    since, until : float
        POSIX seconds.
    azimuth_deg, altitude_deg : float
        Where it stands, observed.
    """

    target: str
    since: float
    until: float
    azimuth_deg: float
    altitude_deg: float

    def __str__(self) -> str:
        return (
            f"for {self.target} at azimuth {self.azimuth_deg:.2f}°, altitude {self.altitude_deg:.2f}°, "
            f"until {utc(self.until)[:19]}Z"
        )

    def json(self, now: float) -> dict[str, Any]:
        """As plain values, with what is left at POSIX `now`."""
        return {
            "target": self.target,
            "until_utc": utc(self.until),
            "left_s": max(0.0, self.until - now),
            "wait_s": self.until - self.since,
            "azimuth_deg": self.azimuth_deg,
            "altitude_deg": self.altitude_deg,
            "text": f"waiting {self}",
        }
