"""Where a telescope comes to that nobody holds: for a drive that tracks on when its program has ended."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from clockdrive.utc import utc

if TYPE_CHECKING:
    from mounts.drive import Reading
    from pointing.limits import Check
    from pointing.planner import Planner

UNSTOPPED = "nothing switches its tracking off"
NOWHERE = f"{UNSTOPPED}, and nobody knows how far a limit is: its power switch stops it"
_SPAN_S = 86_400.0
_STEP_S = 300.0
_CLOSE_S = 1.0


@dataclass(frozen=True)
class LeftAlone:
    """When axis 1 meets a limit that tracks on by itself.

    Parameters
    ----------
    time : float
        When that was looked for, POSIX seconds.
    limit : float, optional
        When it is there, POSIX seconds; None where it does not come to one within a day.
    check : Check, optional
        The first that fails then.
    """

    time: float
    limit: float | None = None
    check: "Check | None" = None

    @classmethod
    def of(cls, planner: "Planner", reading: "Reading", rate: float) -> Self:
        """What comes of an axis 1 that goes on at `rate`, counts per second, and an axis 2 that stays."""
        one, two = reading.counts

        def broken(seconds: float) -> "Check | None":
            angles = planner.angles((one + rate * seconds, two))
            return next((each for each in planner.standing(angles, reading.time + seconds) if not each.ok), None)

        late, found = 0.0, broken(0.0)
        while found is None and late < _SPAN_S:
            late += _STEP_S
            found = broken(late)
        early = max(0.0, late - _STEP_S)
        while found is not None and late - early > _CLOSE_S:
            middle = (early + late) / 2.0
            at_middle = broken(middle)
            early, late, found = (middle, late, found) if at_middle is None else (early, middle, at_middle)
        return cls(reading.time, None if found is None else reading.time + late, found)

    def said(self, now: float) -> str:
        """As people read it."""
        if self.limit is None or self.check is None:
            return f"{UNSTOPPED}; left alone it meets no limit within a day"
        if self.limit <= now:
            return f"{UNSTOPPED}, and it stands beyond a limit: {self.check.detail}"
        return (
            f"{UNSTOPPED}: left alone, without this program, it is at a limit "
            f"({self.check.name}) in {_time(self.limit - now)}; its power switch stops it"
        )

    def json(self, now: float) -> dict[str, Any]:
        """For a status."""
        if self.limit is None or self.check is None:
            return {"limit_utc": None, "in_s": None, "name": None}
        return {"limit_utc": utc(self.limit), "in_s": self.limit - now, "name": self.check.name}


def unheld(left: LeftAlone | None, now: float) -> str:
    """What comes of one that is not held though this program runs, for nobody knows where it is."""
    if left is None:
        where = "nobody knows how far a limit is"
    elif left.limit is None or left.check is None:
        where = "from where it was last known it meets no limit within a day"
    elif left.limit <= now:
        where = f"from where it was last known it is beyond a limit by now ({left.check.name})"
    else:
        where = f"from where it was last known it is at a limit ({left.check.name}) in {_time(left.limit - now)}"
    return f"axis 1 tracks on and is not held, as its position is not synchronised: {where}. Switch it off, or `sync`"


def _time(seconds: float) -> str:
    hours, minutes = divmod(int(seconds / 60.0), 60)
    return f"{hours} h {minutes:02d} min"
