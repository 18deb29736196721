"""What can be found out about an AWR Microstep on the sky: its units, what its rates count from, its declination.

Keys are held for a second or two, at rest, and a witness sees how far the telescope turned. What the drive rate makes
on the sky is known, it is sidereal; so the ways tell the frequency unit, and how long the ramps last tells the
acceleration unit. Where one is refuted the position is not trusted any more, as it was reckoned by it.
"""

import math
from typing import Any

from mounts.awr.registers import BY_NAME
from mounts.commissioning import Finding, Step, Steps, judged

_MOVE_S, _SLEW_S, _CENTRE_S = 2.0, 1.0, 2.0
_PLAY_S, _TAKING_UP_S = 1.0, 0.5
_PLAY_SIGNIFICANCE = 3.0
_SIGNIFICANCE = 4.0  # standard deviations that are a difference
_RAMP_SIGMA_S = 0.012  # of how long both ramps last, by two events of keys that act off their times
_MECHANICS_ARCSEC = 3.0
BOUND_DEG = 6.0  # were the slew three times as fast as it should be
_NO_WITNESS = "no witness sees the sky; give --witness command:PROGRAM (a plate solver) or typed"
_REFUTED = "`commission` refuted {}, by which the position was reckoned: change it, then `sync` on a known star"


def _units(bench: Any) -> Steps[list[Finding]]:  # noqa: ANN401 - the application's bench
    """Frequency and acceleration unit, the reference of rates, steps a degree of axis 2."""
    move = yield from _way(bench, "LEFT", "move", _MOVE_S, taken_up=True)
    if move is None:
        return [Finding("units", "untested", _NO_WITNESS)]
    frequency, unit = _frequency(bench, *move)
    findings = [frequency]
    findings.append((yield from _acceleration(bench, unit)))
    findings.append((yield from _reference(bench)))
    findings.append((yield from _declination(bench, unit)))
    wrong = [each.key for each in findings if each.verdict == "refuted"]
    if wrong:
        bench.drive.refuted(_REFUTED.format(" and ".join(wrong)))
    return findings


def _way(
    bench: Any,  # noqa: ANN401
    key: str,
    speed: str,
    seconds: float,
    *,
    tracking: bool = False,
    taken_up: bool = False,
) -> Steps[Any]:
    """Hold a key between two looks; return degrees on the sky, their sigma, the trial, seconds of tracking.

    With `taken_up` it is held for a moment before, so that its motor has crossed the play.
    """
    axis = 0 if key in {"LEFT", "RIGHT"} else 1
    before = yield from bench.look()
    if before.sky_deg is None:
        return None
    if taken_up:
        bench.drive.hand.trial(key, "move", _TAKING_UP_S)
        yield 0.5
        bench.session.poll()
        before = yield from bench.look()
    trial, tracked = bench.drive.hand.trial(key, speed, seconds, tracking=tracking)
    yield 0.5
    bench.session.poll()
    after = yield from bench.look()
    degrees = math.remainder(after.sky_deg[axis] - before.sky_deg[axis], 360.0)
    across = 1.0 if axis else max(0.05, abs(math.cos(math.radians(after.sky_deg[1]))))
    sigma = math.hypot(math.sqrt(2.0) * after.sigma_arcsec / across, _MECHANICS_ARCSEC) / 3600.0
    return degrees, sigma, trial, tracked


def _word(bench: Any, name: str, *, ram: bool = False) -> float:  # noqa: ANN401
    words = bench.drive.words
    return float((words.ram if ram else words.lasting)[BY_NAME[name].address])


def _frequency(
    bench: Any,  # noqa: ANN401
    degrees: float,
    sigma: float,
    trial: Any,  # noqa: ANN401
    _tracked: float,
) -> tuple[Finding, float]:
    """A way at MOVE speed is speed times hold; axis 1 is known by the sidereal rate. Also return the unit."""
    steps = abs(degrees) * bench.counts_per_deg(0)
    rate = steps / trial.hold
    found = rate / _word(bench, "move_left" if bench.drive.words.tracks > 0 else "move_right")
    relative = math.hypot(sigma / abs(degrees) if degrees else math.inf, 0.007 / trial.hold)
    key, said = "drive.frequency_unit", f"MOVE goes {rate:.0f} steps/s"
    finding = _judged(bench, "frequency unit", key, found, relative, said)
    return finding, found if finding.changes else float(bench.configured(key))


def _acceleration(bench: Any, unit: float) -> Steps[Finding]:  # noqa: ANN401
    """Both ramps of a slew last twice as long as it takes to full speed; the motion so much longer than the hold."""
    trial, _ = bench.drive.hand.trial("RIGHT", "slew", _SLEW_S)
    yield 0.5
    bench.session.poll()
    rate, climb = _word(bench, "slew_right", ram=True) * unit, trial.duration - trial.hold
    subject, key = "acceleration unit", "drive.acceleration_unit"
    if climb >= _SLEW_S or climb <= 5.0 * _RAMP_SIGMA_S:
        return Finding(subject, "untested", f"the ramp of a slew lasts {climb:.2f} s, too long or short to tell", key)
    found = rate / climb / _word(bench, "max_accel_ra")
    said = f"a slew of {rate:.0f} steps/s is at full speed after {climb:.3f} s"
    return _judged(bench, subject, key, found, math.hypot(_RAMP_SIGMA_S / climb, 0.01), said)


def _reference(bench: Any) -> Steps[Finding]:  # noqa: ANN401
    """While axis 1 tracks, CENTRE west goes at its own rate, or that much faster than the sky."""
    subject, key = "rate reference", "drive.rate_reference"
    seen = yield from _way(bench, "LEFT", "centre", _CENTRE_S, tracking=True, taken_up=True)
    if seen is None:
        return Finding(subject, "untested", _NO_WITNESS, key)
    degrees, sigma, trial, tracked = seen
    sidereal, rate = float(bench.configured("drive.sidereal_steps_per_s")), bench.drive.words.centre_rate
    ways = {
        "motor": abs(rate) * trial.hold + sidereal * (tracked - trial.hold),
        "sky": abs(rate) * trial.hold + sidereal * tracked,
    }
    steps = abs(degrees) * bench.counts_per_deg(0)
    found = min(ways, key=lambda name: abs(ways[name] - steps))
    configured = str(bench.configured(key))
    said = f"{steps:.0f} steps west, {ways['motor']:.0f} were they the motor's, {ways['sky']:.0f} on the sky"
    unsure = math.hypot(sigma * bench.counts_per_deg(0), 0.1 * sidereal)
    if abs(ways["sky"] - ways["motor"]) < 2.0 * _SIGNIFICANCE * unsure:
        return Finding(subject, "untested", f"{said}; use a more exact witness", key, configured)
    return Finding(subject, judged(found == configured), said, key, configured, found)


def _declination(bench: Any, unit: float) -> Steps[Finding]:  # noqa: ANN401
    """MOVE in declination: its speed is known by now."""
    subject, key = "axis2 steps per degree", "axis2.steps_per_degree"
    seen = yield from _way(bench, "UP", "move", _MOVE_S, taken_up=True)
    if seen is None:
        return Finding(subject, "untested", _NO_WITNESS, key)
    degrees, sigma, trial, _ = seen
    steps = _word(bench, "move_up") * unit * trial.hold
    found = steps / abs(degrees) if degrees else math.inf
    relative = math.hypot(sigma / abs(degrees) if degrees else math.inf, 0.007 / trial.hold)
    return _judged(bench, subject, key, found, relative, f"{steps:.0f} steps turn it by {abs(degrees):.4f}°")


def _judged(bench: Any, subject: str, key: str, found: float, relative: float, said: str) -> Finding:  # noqa: ANN401
    """Compare with the configured value."""
    configured = float(bench.configured(key))
    right = abs(found / configured - 1.0) <= _SIGNIFICANCE * relative
    detail = f"{said}: {found:.5g} ± {100.0 * relative:.1f} %, configured {configured:.5g}"
    return Finding(subject, judged(right), detail, key, configured, configured if right else float(f"{found:.4g}"))


def _plays(bench: Any) -> Steps[list[Finding]]:  # noqa: ANN401
    """The play of both axes: by how much less a key turns the telescope that turns its motor round."""
    one = yield from _play(bench, 0, "LEFT", "RIGHT")
    two = yield from _play(bench, 1, "UP", "DOWN")
    return [one, two]


def _play(bench: Any, axis: int, ahead: str, back: str) -> Steps[Finding]:  # noqa: ANN401
    """A key whose motor pushes the axis already, then the other one, which turns it round."""
    name = f"axis{axis + 1}"
    subject, key = f"{name} backlash", f"{name}.backlash_arcsec"
    turns = []
    for pressed in (ahead, back):
        seen = yield from _way(bench, pressed, "move", _PLAY_S, taken_up=pressed == ahead)
        if seen is None:
            return Finding(subject, "untested", _NO_WITNESS, key)
        turns.append(seen)
    (there, sigma1, first, _), (returned, sigma2, second, _) = turns
    speeds = bench.drive.words.speeds
    one, two = (
        abs(rate) * (trial.duration - abs(rate) / speeds.accelerations[axis])
        for rate, trial in zip(speeds.motor("move", axis), (first, second), strict=True)
    )
    left = 3600.0 * (abs(there) * two / one - abs(returned))
    timed = 2.0 * speeds.settings.jitter.stamp_s * abs(there) / first.hold  # four events
    sigma = 3600.0 * math.hypot(sigma1, sigma2, timed)
    return _judged_play(bench, axis, left, sigma, Finding(subject, "measured", "", key))


def _judged_play(bench: Any, axis: int, left: float, sigma: float, asked: Finding) -> Finding:  # noqa: ANN401
    """Compare what is left of the play, arcseconds, with what should be; with the unit's blips it is all there is."""
    per_arcsec, words = bench.counts_per_deg(axis) / 3600.0, bench.drive.words
    right = abs(left - words.plays[axis].steps / per_arcsec) <= _PLAY_SIGNIFICANCE * sigma
    found = max(0.0, left + words.taken_up[axis] / per_arcsec)
    configured = bench.configured(asked.key)
    said = "as much as the unit takes up" if configured is None else f"{configured:g}″"
    detail = f"{left:+.1f}″ ± {sigma:.1f}″ are left of it, so it is {found:.1f}″; configured {said}"
    return Finding(
        asked.subject, judged(right), detail, asked.key, configured, configured if right else round(found, 1)
    )


BEFORE: tuple[Step, ...] = (
    Step(
        "units", "frequency and acceleration unit, rate reference, steps a degree", _units, 1.0, BOUND_DEG,
        allows_motion=True, together=False,
    ),
)  # fmt: skip
AFTER: tuple[Step, ...] = (
    Step(
        "backlash", "the play of both axes that the unit does not take up", _plays, 0.5, 2.0, needs=("units",),
        allows_motion=True, together=False,
    ),
)  # fmt: skip
LEFT_OUT = frozenset({"gearing", "encoder-ratio", "speed", "stop"})
"""Shared steps that ask for gears, for encoders, or for a speed that is read."""
