"""From the words of a command to the second on the target: what a goto promises, on the simulated telescope."""

# ruff: noqa: SLF001 - what is true is inside
import math
import random
import tempfile
from functools import cache

from benchmarks.benchmark import benchmark
from benchmarks.start import process_seconds
from clockdrive import Refused, Telescope, VirtualClock
from clockdrive.state import Activity
from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.targets import FixedAltAz, Star

START = 1_800_000_000.0
TARGETS = 40
TICK_S = 0.002


@benchmark("`clockdrive plan … --from`, from process start", unit="s", at_most=0.5)
def plan_command() -> tuple[float, str]:
    """Words to plan, no drive contacted."""
    words = ("-m", "clockdrive", "plan", "M42", "--at", "2026-11-22T13:00:00Z", "--from", "8388608,8388608")
    return process_seconds(*words, "--json"), f"`import erfa` alone {process_seconds('-c', 'import erfa'):.3f} s"


@benchmark("worst axis at the stated arrival, beyond rate × 2 ms", unit="counts", at_most=1.0)
def arrival() -> tuple[float, str]:
    """Targets all over the sky, each reached by one slew."""
    worst, slews = _campaign()
    return worst, f"{TARGETS} targets, {slews} slews, one count is 0.91″"


@benchmark("worst true axis position in ten minutes of tracking", unit="″", at_most=0.5)
def tracking() -> tuple[float, str]:
    """Each axis once a second, by the simulated unit's own 48 bits."""
    offs = []
    with _telescope() as scope:
        scope.goto("best")
        axes = scope._session.planner.axes
        for _ in range(600):
            scope.wait(1.0)
            wanted = scope._session.pursuit.at(scope.clock.now())
            scope.simulator.advance(scope.clock.now())
            offs += [
                (scope.simulator.true_position(number) - want) * axis.gearing.step_arcsec
                for number, axis, (want, _) in zip((1, 2), axes, wanted, strict=True)
            ]
    rms = math.sqrt(sum(off * off for off in offs) / len(offs))
    return max(map(abs, offs)), f"RMS {rms:.3f}″"


def _telescope() -> Telescope:
    here = {"state.path": tempfile.mkdtemp(), "limits.sun_avoidance_deg": 0.0}
    return Telescope.simulated(clock=VirtualClock(START), overrides=here)


@cache
def _campaign() -> tuple[float, int]:
    """Return the worst miss beyond what a tick allows, and the slews."""
    chance = random.Random(1)  # noqa: S311 - places on the sky
    worst, slews, reached = 0.0, 0, 0
    with _telescope() as scope:
        seen = _Announced(scope)
        while reached < TARGETS:
            scope.wait(chance.uniform(0.0, 300.0))
            try:
                done = scope.goto(_star(scope, chance.uniform(0.0, math.tau), chance.uniform(0.3, 1.4)))
            except (Unreachable, Refused):
                continue
            reached, slews = reached + 1, slews + done["slews"]
            for (want, rate), counts in zip(scope._session.pursuit.at(seen.time), seen.counts(), strict=True):
                worst = max(worst, abs(counts - want) - abs(rate) * TICK_S)
    return worst, slews


class _Announced:
    """Looks at the simulated unit at exactly the second for which an arrival was announced."""

    def __init__(self, scope: Telescope) -> None:
        self.time = math.inf
        self._scope, self._device = scope, scope.simulator
        self._found: tuple[float, float] | None = None
        self._begin, self._advance = scope._session.begin, self._device.advance
        scope._session.begin, self._device.advance = self._begun, self._advanced

    def counts(self) -> tuple[float, float]:
        """True counts of both axes then."""
        if self._found is None:  # the goto returned some milliseconds before it
            self._scope.wait(self.time - self._scope.clock.now())
            self._advanced(self.time)
        return self._found

    def _begun(self, activity: Activity) -> None:
        self.time, self._found = activity.until, None
        self._begin(activity)

    def _advanced(self, t: float) -> None:
        if self._found is None and t >= self.time:
            self._advance(self.time)
            self._found = self._device.true_position(1), self._device.true_position(2)
        self._advance(t)


def _star(scope: Telescope, azimuth: float, altitude: float) -> Star:
    """Make a star that stands there now."""
    frame = scope._session.planner.sky.at(Instant.from_posix(scope.clock.now()))
    x, y, z = frame.astrometric(FixedAltAz(azimuth, altitude).observed(frame))
    return Star(f"{azimuth:.3f} {altitude:.3f}", math.atan2(y, x), math.asin(z), epoch=2027.04)
