"""What stops the telescope, whoever moves it: asked of every reading."""

from mounts.drive import Reading
from pointing.planner import Planner


class Guard:
    """The standing safety rules of one telescope.

    A telescope that is already where it must not be, at start-up or after a person moved it, may be led out by a
    slew: the sky and axis rules bind it from the first reading that keeps them, a limit of the drive from the moment
    it is left. Tracking never goes on there.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._was_clear = False
        self._known_limits: set[str] = set()

    def why_stop(self, reading: Reading, doing: str) -> str:
        """The reason to stop, with its bound and what to do; empty when there is none.

        Parameters
        ----------
        reading : Reading
            What the drive says.
        doing : str
            "at rest", "tracking", or a slew, whose path was checked before it began.
        """
        counts = reading.axes[0].counts, reading.axes[1].counts
        checks = self._planner.standing(self._planner.angles(counts), reading.time)
        broken = "; ".join(check.detail for check in checks if not check.ok)
        was_clear, self._was_clear = self._was_clear, not broken
        known = self._known_limits.intersection(reading.limits) if doing != "tracking" else set()
        self._known_limits = set(reading.limits) if doing == "at rest" else known
        if doing == "at rest":
            return ""
        reached = sorted(set(reading.limits) - known)
        return _of_the_drive(reading, reached) or (
            f"{broken}; `goto` or `park` leads away from there"
            if broken and (was_clear or doing == "tracking")
            else ""
        )


def _of_the_drive(reading: Reading, reached: list[str]) -> str:
    if reading.unsynchronised:
        return reading.unsynchronised
    if not reading.powered:
        return "the motors lost their power (standby); `drive power on`, then check the position"
    if reading.alarms:
        return f"power supply alarm: {', '.join(reading.alarms)}; find its cause before moving again"
    if reached:
        return f"limit reached: {', '.join(reached)}; `goto` or `park` leads away from it"
    return ""
