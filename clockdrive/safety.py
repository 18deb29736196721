"""What stops the telescope, whoever moves it: asked of every reading."""

import math
from collections.abc import Collection, Sequence

from mounts.drive import Reading
from pointing.limits import Check
from pointing.path import DEEPER
from pointing.planner import Planner
from pointing.slew import SlewModel

_CYCLES = 2.0  # may pass until a stop is in force
_SAMPLES = 20
_LONG_S = 1e4  # at a speed lead farther than an axis comes in a moment
_MOMENT_S = 0.005


def rests_at(
    reading: Reading, models: Sequence[SlewModel], period_s: float, speeds: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Counts at which both axes would come to rest if they were stopped at the next reading, `period_s` later.

    Until then they keep their rates, or are under way to `speeds`, counts per second.
    """
    one, two = (
        axis.counts + _rest(model, axis.rate, axis.rate if speeds is None else speeds[i], _CYCLES * period_s)
        for i, (axis, model) in enumerate(zip(reading.axes[:2], models[:2], strict=True))
    )
    return one, two


def _rest(model: SlewModel, rate: float, speed: float, seconds: float) -> float:
    """Counts to where an axis comes to rest that is stopped after `seconds` on its way from `rate` to `speed`."""
    kept = rate * seconds + _stopping(model, rate)
    if abs(speed) <= abs(rate) and speed * rate >= 0.0:
        return kept
    faster = model.limited(abs(speed)).travel(0.0, speed * _LONG_S, rate, 0.0)
    before, after = faster.position(seconds - _MOMENT_S), faster.position(seconds + _MOMENT_S)
    hastened = faster.position(seconds) + _stopping(model, (after - before) / (2.0 * _MOMENT_S))
    return max(kept, hastened, key=abs)


def _stopping(model: SlewModel, rate: float) -> float:
    """Counts in which an axis comes to rest from `rate`: how far it overshoots a target where it is."""
    travel = model.travel(0.0, 0.0, rate, 0.0)
    return max((travel.position(travel.duration * i / _SAMPLES) for i in range(_SAMPLES)), key=abs)


def moved_by_others(reading: Reading) -> tuple[str, ...]:
    """Who moves a telescope that this program leaves at rest: every source but the drive's own tracking."""
    return tuple(source for source in reading.motion if source != "tracking")


class Guard:
    """The standing safety rules of one telescope.

    A telescope that is already where it must not be, at start-up or after a person moved it, may be led out by a
    slew: the sky and axis rules bind it from the first reading that keeps them, a limit of the drive from the moment
    it is left. Tracking never goes on there. What others move may lead out as well, by the rule of a slew's path:
    nowhere deeper than it has been by more than 0.01°, asked of every reading.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._was_clear = False
        self._known_limits: set[str] = set()
        self._floors: dict[str, float] = {}  # margins, radians, below which others must not lead

    def why_stop(
        self, reading: Reading, doing: str, rests: tuple[float, float] | None = None, barred: Sequence[Check] = ()
    ) -> str:
        """The reason to stop, with its bound and what to do; empty when there is none.

        Parameters
        ----------
        reading : Reading
            What the drive says.
        doing : str
            "at rest", where only what somebody else moves is stopped, "tracking", or a slew, whose path was checked
            before it began.
        rests : tuple of float, optional
            Counts at which the axes would come to rest, which must be allowed as well for the motion to go on.
        barred : sequence of Check
            What else is known to forbid it.
        """
        counts = reading.counts
        checks = self._planner.standing(self._planner.angles(counts), reading.time)
        broken = "; ".join(check.detail for check in checks if not check.ok)
        was_clear, self._was_clear = self._was_clear, not broken
        known = self._known_limits.intersection(reading.limits) if doing != "tracking" else set()
        self._known_limits = set(reading.limits) if doing == "at rest" else known
        reached = sorted(set(reading.limits) - known)
        deeper = self._deeper(checks, moved=bool(moved_by_others(reading)))
        if doing == "at rest":
            outside = {check.name for check in checks if not check.ok}
            return self._why_stop_others(reading, reached, deeper, outside, rests)
        if why := _of_the_drive(reading, reached):
            return why
        if broken:
            return f"{broken}; `goto` or `park` leads away from there" if was_clear or doing == "tracking" else ""
        ahead = self._why_ahead(rests, reading.time, barred)
        return f"stopped before it would lead out of what is allowed: {ahead}" if ahead else ""

    def _deeper(self, checks: Sequence[Check], *, moved: bool) -> str:
        """What is broken and led deeper; what was gained in one motion is not given back."""
        floors, self._floors = self._floors if moved else {}, {}
        broken = []
        for check in checks:
            floor = floors.get(check.name, -math.inf)
            if not check.ok and check.margin < floor:
                broken.append(check.detail)
            self._floors[check.name] = max(floor, min(0.0, check.margin - DEEPER))
        return "; ".join(broken)

    def _why_stop_others(
        self,
        reading: Reading,
        reached: list[str],
        deeper: str,
        outside: Collection[str],
        rests: tuple[float, float] | None,
    ) -> str:
        """Bound what moves the telescope while this program does not: a hand on it, or another program."""
        others = moved_by_others(reading)
        if not others or reading.unsynchronised:
            return ""
        why = f"limit reached: {', '.join(reached)}" if reached else deeper
        if not why and (ahead := self._why_ahead(rests, reading.time, outside=outside)):
            why = f"stopped before it would lead out of what is allowed: {ahead}"
        return f"moved by {', '.join(others)}: {why}; `goto` or `park` leads away from there" if why else ""

    def _why_ahead(
        self,
        rests: tuple[float, float] | None,
        time: float,
        barred: Sequence[Check] = (),
        outside: Collection[str] = (),
    ) -> str:
        """What forbids to come to rest there, but for checks that are broken already, or is barred otherwise."""
        there = () if rests is None else self._planner.standing(self._planner.angles(rests), time)
        failed = (check for check in (*there, *barred) if not check.ok and check.name not in outside)
        return "; ".join(check.detail for check in failed)


def _of_the_drive(reading: Reading, reached: list[str]) -> str:
    if reading.unsynchronised:
        return reading.unsynchronised
    if not reading.powered:
        return "the motors lost their power (standby); `drive power on`, then check the position"
    if reading.alarms:
        return f"alarm of the drive: {', '.join(reading.alarms)}; find its cause before moving again"
    if reached:
        return f"limit reached: {', '.join(reached)}; `goto` or `park` leads away from it"
    return ""
