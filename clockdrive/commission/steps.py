"""The steps that every drive can take: link, sense of the axes, gears and encoders, stop, top speed.

Each compares what a witness sees with what was commanded and says how sure it is. Only differences beyond the stated
uncertainty are differences; nothing else is written anywhere.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from clockdrive.commission.bench import CommissioningBench, Seen
from clockdrive.commission.encoders import (
    LONG_WAY,
    bits_finding,
    encoder_line,
    keep_sense,
    ratio_finding,
    sense_findings,
)
from clockdrive.commission.gears import SIGNIFICANCE, Line, Point, candidates, fitted, measured_gear
from clockdrive.control import Steps
from mounts.commissioning import BACK, Finding, Move, Step, alone, judged
from mounts.drive import Reading

_SENSE_DEG = (0.1, 0.4)  # play is taken up on the way to the first
_GEARING_REACH_DEG = 4.3
_PITCH_DEG = (0.5, 1.3)  # a worm's turn that suits the reach
_USUAL_PITCH_DEG = 1.2
_TAKE_UP_DEG = 0.15
_LOOKS = 4  # in each direction
_MECHANICS_ARCSEC = 3.0  # of an axis that returns to the same phase of its worm
_ALIGNMENT = math.radians(10.0 / 60.0)  # within which the first axis lies where the configuration says
_MOST_UNSURE = 0.05  # relative uncertainty of gears that is no answer any more
_STOP_AFTER_S = 0.8
_SPEED_REACH_DEG = 20.0  # to each side
_SPEED_TOLERANCE = 0.02
_CRUISE_S = 2.5
_LEAST_CRUISE_S = 0.4
_STEADY = 1e-3  # by which an even speed changes from one reading to the next
_NO_WITNESS = "no witness sees the sky; give --witness command:PROGRAM (a plate solver) or typed"


def _link(bench: CommissioningBench) -> Steps[list[Finding]]:
    """How long a reading takes, and a start, as learnt from all starts."""
    clock, drive = bench.session.clock, bench.drive
    taken = []
    for _ in range(5):
        began = clock.now()
        drive.read(began)
        taken.append(clock.now() - began)
        yield 0.0
    ms = 1000.0 * sorted(taken)[2]
    detail = (
        f"a reading takes {ms:.1f} ms; from the start of a slew to the motion {1000.0 * drive.start_latency:.1f} ms"
    )
    return [Finding("link", "measured", detail)]


def _sense(bench: CommissioningBench) -> Steps[list[Finding]]:
    """Which way the axes and their encoders turn, and whether by about as much as they should."""
    looks = []
    for k, offset in enumerate((0.0, *_SENSE_DEG)):
        if offset:
            yield from bench.move(Move((offset, offset)))
        looks.append((yield from bench.look()))
        if k == 1:
            _scale(bench, looks)
    yield from bench.move(BACK)
    bench.position_errors_deg = _position_errors(bench, looks[0])
    findings = []
    for i in (0, 1):
        findings += _axis_sense(bench, i, looks[1], looks[2])
    return findings


def _position_errors(bench: CommissioningBench, seen: Seen) -> tuple[float | None, float | None]:
    """How far from its position each axis is seen where the step began, before any motion went astray."""
    if seen.sky_deg is None:
        return None, None
    believed = bench.session.planner.angles(seen.counts)
    one, two = (abs(sky - math.degrees(angle)) for sky, angle in zip(seen.sky_deg, believed, strict=True))
    return one, two


def _scale(bench: CommissioningBench, looks: Sequence[Seen]) -> None:
    """Gears that turn the axis much further than they should make all further moves smaller."""
    for i in (0, 1):
        commanded, sky, encoder = _between(bench, i, looks[-2], looks[-1])
        moved = max(abs(each) for each in (sky or 0.0, encoder or 0.0))
        bench.scales[i] = max(1.0, moved / abs(commanded)) if commanded else 1.0


def _between(
    bench: CommissioningBench, i: int, first: Seen, second: Seen
) -> tuple[float, float | None, float | None]:
    """Degrees of axis `i` from one look to another: by the configured gears, on the sky, by the encoder."""
    planner = bench.session.planner
    commanded = math.degrees(planner.angles(second.counts)[i] - planner.angles(first.counts)[i])
    sky = None
    if first.sky_deg is not None and second.sky_deg is not None:
        sky = math.remainder(second.sky_deg[i] - first.sky_deg[i], 360.0)
    one, two = first.encoders[i], second.encoders[i]
    encoder = None
    if one is not None and two is not None:
        encoder = 360.0 * math.remainder(two.turns - one.turns, 1.0)
    return commanded, sky, encoder


def _axis_sense(bench: CommissioningBench, i: int, first: Seen, second: Seen) -> list[Finding]:
    commanded, sky, encoder = _between(bench, i, first, second)
    subject, key = f"axis{i + 1} sense", f"axis{i + 1}.reversed"
    configured = bool(bench.configured(key))
    findings = []
    if sky is None:
        findings.append(Finding(subject, "untested", _NO_WITNESS, key, configured))
    else:
        said = f"sent by {commanded:+.3f}°, seen to turn by {sky:+.3f}°"
        sigma = math.sqrt(2.0) * second.sigma_arcsec / 3600.0 / max(_cosine(second, i), 0.05)
        if abs(sky) < SIGNIFICANCE * sigma + abs(commanded) / 10.0:
            why = f"{said}: hardly at all; check clutch and gears, and the witness"
            findings.append(Finding(subject, "untested", why, key, configured))
        else:
            right = sky * commanded > 0.0
            findings.append(Finding(subject, judged(right), said, key, configured, configured == right))
        bench.scales[i] = max(1.0, abs(sky / commanded))
    return findings + (sense_findings(bench, i, first, second, encoder) if bench.has_encoder(i) else [])


def _gearing(bench: CommissioningBench) -> Steps[list[Finding]]:
    """Both axes in turn: looks whole turns of the worm apart, on the way out and on the way back."""
    findings = []
    for i in (0, 1):
        pitch = 360.0 * float(bench.configured(f"axis{i + 1}.main_gear"))
        if not _PITCH_DEG[0] <= pitch <= _PITCH_DEG[1]:
            pitch = _USUAL_PITCH_DEG
        out = [_TAKE_UP_DEG + k * pitch for k in range(_LOOKS)]
        back = [k * pitch for k in reversed(range(_LOOKS))]
        looks = []
        for direction, places in ((1, out), (-1, back)):
            for place in places:
                yield from bench.move(alone(i, place))
                looks.append((direction, (yield from bench.look())))
        findings += _gear_findings(bench, i, looks)
    return findings


def _gear_findings(bench: CommissioningBench, i: int, looks: Sequence[tuple[int, Seen]]) -> list[Finding]:
    sky, encoder = _sky_line(bench, i, looks), encoder_line(bench, i, looks)
    findings = []
    if encoder is not None:
        line, bits = encoder
        bench.encoder_senses[i] = None
        keep_sense(bench, i, line)
        if sky is not None:
            keep_sense(bench, i, replace(sky, slope=math.copysign(sky.slope, line.slope)))
        findings.append(bits_finding(bench, i, bits, looks))
        if sky is not None:
            ratio = ratio_finding(i, line, sky)
            if ratio.verdict == "refuted":
                bench.encoder_senses[i] = None
            findings.append(ratio)
    shown = sky or (encoder and encoder[0])
    if shown is None:
        why = "neither a witness of the sky nor an encoder sees this axis turn; give --witness"
        return [*findings, Finding(f"axis{i + 1} gears", "untested", why)]
    by = "the sky" if sky is not None else "the encoder, taken as 1:1 on the axis"
    return [*findings, _gear_finding(bench, i, shown, by), _play_finding(i, shown)]


def _sky_line(bench: CommissioningBench, i: int, looks: Sequence[tuple[int, Seen]]) -> Line | None:
    """What the sky says of axis `i`; the first axis is as sure as its direction, by tan of the second."""
    planner = bench.session.planner
    points, sigma, tangent = [], 0.0, 0.0
    near = None
    for direction, seen in looks:
        if seen.sky_deg is None:
            return None
        angle = seen.sky_deg[i] if near is None else near + math.remainder(seen.sky_deg[i] - near, 360.0)
        near = angle
        points.append(Point(math.degrees(planner.angles(seen.counts)[i]), angle, direction))
        sigma = max(sigma, seen.sigma_arcsec / max(_cosine(seen, i), 1e-3))
        tangent = math.tan(math.radians(seen.sky_deg[1])) if i == 0 else 0.0
    line = fitted(points, math.hypot(sigma, _MECHANICS_ARCSEC) / 3600.0)
    return Line(line.slope, math.hypot(line.sigma, abs(line.slope * tangent) * _ALIGNMENT), line.play)


def _cosine(seen: Seen, i: int) -> float:
    """How much of a turn of axis `i` shows on the sky."""
    return 1.0 if i or seen.sky_deg is None else abs(math.cos(math.radians(seen.sky_deg[1])))


def _gear_finding(bench: CommissioningBench, i: int, line: Line, by: str) -> Finding:
    """Compare with the configured gears; where they differ, find the teeth, else the ratio as measured."""
    axis = f"axis{i + 1}"
    subject, ratio = f"{axis} gears", abs(line.slope)
    sigma = line.sigma / ratio if ratio else math.inf
    arcsec = 3600.0 / bench.counts_per_deg(i)
    said = f"a count is {arcsec * ratio:.5f}″ ± {100.0 * sigma:.3f} % by {by}, {arcsec:.5f}″ by the configuration"
    if not sigma < _MOST_UNSURE:
        return Finding(subject, "untested", f"{said}; use a more exact witness, or begin farther from the pole")
    bench.scales[i] = max(1.0, ratio)
    if abs(ratio - 1.0) <= SIGNIFICANCE * sigma:
        return Finding(subject, "confirmed", said, f"{axis}.main_gear")
    main, secondary = bench.configured(f"{axis}.main_gear"), bench.configured(f"{axis}.secondary_gear")
    teeth = candidates(main.teeth, secondary.teeth, ratio, sigma)
    if not teeth:
        value = measured_gear(secondary, ratio, sigma)
        detail = f"{said}; no teeth near {main} and {secondary} explain it, so the ratio is given as measured"
        return Finding(subject, "refuted", detail, f"{axis}.secondary_gear", str(secondary), value)
    best = teeth[0]
    others = ", ".join(f"{each.key} {each.value}" for each in teeth[1:5])
    detail = f"{said}; {best.key} {best.value} explains it" + (f", as would {others}: count the teeth" * bool(others))
    return Finding(
        subject, "refuted", detail, f"{axis}.{best.key}", str(bench.configured(f"{axis}.{best.key}")), best.value
    )


def _play_finding(i: int, line: Line) -> Finding:
    return Finding(f"axis{i + 1} play", "measured", f"{3600.0 * line.play:.0f}″ between the two directions")


def _stop(bench: CommissioningBench) -> Steps[list[Finding]]:
    """Send both axes off, stop them under way, and see how long and how far they go on."""
    readings = yield from bench.move(Move((4.0, 4.0), until_s=_STOP_AFTER_S))
    findings = [_stop_finding(bench, i, readings) for i in (0, 1)]
    yield from bench.move(BACK)
    return findings


def _stop_finding(bench: CommissioningBench, i: int, readings: Sequence[Reading]) -> Finding:
    subject = f"axis{i + 1} stop"
    before = [reading for reading in readings if reading.time <= bench.stopped_at]
    if not before or not before[-1].axes[i].slewing:
        return Finding(subject, "untested", "the axis had landed before the stop; the link is too slow")
    last, rest = before[-1].axes[i].counts, readings[-1].axes[i].counts
    stood = next(
        r.time for r in readings if abs(r.axes[i].counts - rest) <= bench.session.planner.axes[i].landed / 2.0
    )
    speed = abs(before[-1].axes[i].rate) / bench.counts_per_deg(i)
    degrees = abs(rest - last) / bench.counts_per_deg(i)
    detail = (
        f"from {speed:.2f}°/s it stood {max(0.0, stood - bench.stopped_at):.2f} s after the stop, {degrees:.3f}° on"
    )
    return Finding(subject, "measured", detail)


def _speed(bench: CommissioningBench) -> Steps[list[Finding]]:
    """Let each axis reach its top speed on the way from one side to the other, and measure it."""
    findings = []
    for i in (0, 1):
        model = bench.drive.slew_models[i]
        needed = _way_to_top_speed(bench, i)
        subject = f"axis{i + 1} top speed"
        if needed is None:
            most = model.max_rate / bench.counts_per_deg(i)
            why = f"{most:.2f}°/s is not reached within {2.0 * _SPEED_REACH_DEG:g}°; it stays as configured"
            findings.append(Finding(subject, "untested", why))
            continue
        yield from bench.move(alone(i, -needed / 2.0))
        readings = yield from bench.move(alone(i, needed / 2.0))
        findings.append(_speed_finding(bench, i, readings))
        yield from bench.move(BACK)
    return findings


def _way_to_top_speed(bench: CommissioningBench, i: int) -> float | None:
    """Degrees of a move that keeps the top speed for a while."""
    model = bench.drive.slew_models[i]
    for degrees in range(2, int(2.0 * _SPEED_REACH_DEG) + 1):
        travel = model.travel(0.0, degrees * bench.counts_per_deg(i) / bench.scales[i], 0.0, 0.0)
        middle, half = travel.duration / 2.0, _CRUISE_S / 2.0
        if travel.duration > _CRUISE_S:
            covered = travel.position(middle + half) - travel.position(middle - half)
            if covered > 0.999 * _CRUISE_S * model.max_rate:
                return float(degrees)
    return None


_OF_COUNTS = "the configured gears", "is what its register says"


def _speed_finding(bench: CommissioningBench, i: int, readings: Sequence[Reading]) -> Finding:
    most = bench.drive.slew_models[i].max_rate
    subject = f"axis{i + 1} top speed"
    steady = _steady(readings, i)
    if not steady or steady[-1].time - steady[0].time < _LEAST_CRUISE_S:
        return Finding(subject, "untested", "the link is too slow to see the axis at full speed; use a quicker one")
    first, last = steady[0], steady[-1]
    rate = abs(last.axes[i].counts - first.axes[i].counts) / (last.time - first.time)
    by, says = ("its own scale", "is configured") if bench.drive.capabilities.units == "degrees" else _OF_COUNTS
    per_deg = bench.counts_per_deg(i)
    detail = f"{rate / per_deg:.3f}°/s by {by}; {most / per_deg:.3f}°/s {says}"
    return Finding(subject, judged(abs(rate / most - 1.0) <= _SPEED_TOLERANCE), detail)


def _steady(readings: Sequence[Reading], i: int) -> list[Reading]:
    """The readings at the highest speed, as long as it was even.

    While the speed changes, a position read over a slow link and carried on by a speed read later is off.
    """
    slewing = [reading for reading in readings if reading.axes[i].slewing]
    top = max((abs(reading.axes[i].rate) for reading in slewing), default=0.0)
    return [reading for reading in slewing if abs(reading.axes[i].rate) > (1.0 - _STEADY) * top]


FIRST = (
    Step("sense", "which way axes and encoders turn", _sense, _SENSE_DEG[1], 2.0 * _SENSE_DEG[1]),
    Step("gearing", "gears, play, and the encoders' ratio and bits", _gearing, _GEARING_REACH_DEG,
         1.25 * _GEARING_REACH_DEG, needs=("sense",), together=False),
    LONG_WAY,
    Step("stop", "how soon the axes stop", _stop, 4.0, 5.0, needs=("sense",)),
)  # fmt: skip
"""Steps that come before those of the drive that need motion."""

LAST = (
    Step(
        "speed", "true top speed", _speed, _SPEED_REACH_DEG, 1.25 * _SPEED_REACH_DEG, needs=("sense",), together=False
    ),
    Step("link", "how long an exchange and a start take", _link),
)
