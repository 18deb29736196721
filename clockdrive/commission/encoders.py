"""What the absolute encoders of a mount are: their sense, bits, and turns for a count of the motor.

An encoder reads in steps, so its ratio is as sure as the way is long over which it was read: a few degrees tell gears
from gears, but not where an encoder stands whole turns away. For that both ends of a long way are read many times,
each time a part of a step farther, and all from the same side, where the gears' play is the same.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from clockdrive.commission.bench import CommissioningBench, Seen
from clockdrive.commission.gears import SIGNIFICANCE, Line, Point, fitted
from clockdrive.control import Steps
from mounts.commissioning import BACK, Encoder, Finding, Step, alone, judged

_BITS_SEEN = 8  # different readings, after which bits that never change are not there
_READ_OFF = 0.4  # of a step: standard deviation of a reading
_REACH_DEG = 30.0  # to each side
_LOOKS = 16  # at each end
_APART_DEG = 0.15  # 27.3 steps of 16 bits, 6.8 of 14: each look falls elsewhere in a step
_TAKE_UP_DEG = 0.3


def sense_findings(
    bench: CommissioningBench, i: int, first: Seen, second: Seen, turned: float | None
) -> list[Finding]:
    """Whether an encoder counts with its motor, by the degrees it `turned` from one look to the other."""
    subject, key = f"axis{i + 1} encoder sense", f"axis{i + 1}.encoder_reversed"
    configured = bool(bench.configured(key))
    if turned is None:
        if not bench.configured(f"axis{i + 1}.encoder_bits"):
            return []
        return [
            Finding(subject, "untested", "the unit detects no encoder; check its plug, or set encoder_bits = 0", key)
        ]
    counts = second.counts[i] - first.counts[i]
    commanded = counts / bench.counts_per_deg(i)
    said = f"{counts:+.0f} counts turn the encoder by {turned:+.3f}°"
    if abs(turned) < abs(commanded) / 5.0:
        return [Finding(subject, "untested", f"{said}: hardly at all; check its coupling", key, configured)]
    if bench.witness is None:
        bench.scales[i] = max(1.0, abs(turned / commanded))
    found = turned * commanded < 0.0
    return [Finding(subject, judged(found == configured), said, key, configured, found)]


def encoder_line(
    bench: CommissioningBench, i: int, looks: Sequence[tuple[int, Seen]]
) -> tuple[Line, int | None] | None:
    """What the encoder says of axis `i`, and how many bits it has, None when too few readings tell."""
    bits = _bits(bench.encoder_words[i])
    points = []
    near = None
    for direction, seen in looks:
        encoder = seen.encoders[i]
        if encoder is None:
            return None
        angle = 360.0 * _turns(encoder, bits or 16)
        near = angle if near is None else near + math.remainder(angle - near, 360.0)
        points.append(Point(seen.counts[i] / bench.counts_per_deg(i), near, direction))
    line = fitted(points, _READ_OFF * 360.0 / 2 ** (bits or 16))
    return (line, bits) if line.slope else None


def _bits(words: set[int]) -> int | None:
    """Bits of an encoder by its readings: of 14 the lowest two of the Gray code are never set."""
    if len(words) < _BITS_SEEN:
        return None
    return 14 if not any((word ^ word >> 1) & 3 for word in words) else 16


def _turns(encoder: Encoder, bits: int) -> float:
    return float(encoder.word >> (16 - bits)) / (1 << bits)


def bits_finding(bench: CommissioningBench, i: int, bits: int | None, looks: Sequence[tuple[int, Seen]]) -> Finding:
    """Whether an encoder has the bits configured."""
    subject, key = f"axis{i + 1} encoder bits", f"axis{i + 1}.encoder_bits"
    configured = bench.configured(key)
    if bits is None:
        return Finding(subject, "untested", f"{len(looks)} looks showed too few different readings", key, configured)
    detail = f"its readings have {bits} bits, the configuration says {configured}"
    return Finding(subject, judged(bits == configured), detail, key, configured, bits)


def ratio_finding(i: int, encoder: Line, sky: Line) -> Finding:
    """Whether an encoder turns as far as its axis."""
    ratio = abs(encoder.slope / sky.slope)
    sigma = math.hypot(encoder.sigma / encoder.slope, sky.sigma / sky.slope) if encoder.slope else math.inf
    detail = f"the encoder turns {ratio:.4f} ± {sigma:.4f} times as far as the axis; it is taken as 1:1"
    right = abs(ratio - 1.0) <= SIGNIFICANCE * sigma
    return Finding(f"axis{i + 1} encoder ratio", judged(right), detail)


def _long_way(bench: CommissioningBench) -> Steps[list[Finding]]:
    """Read each encoder whose ratio is roughly known at both ends of a long way, and know it better."""
    findings = []
    for i in (0, 1):
        if bench.encoder_senses[i] is None:
            continue
        looks = []
        for first in (_TAKE_UP_DEG - _REACH_DEG, _REACH_DEG - (_LOOKS - 1) * _APART_DEG):
            yield from bench.move(alone(i, first - _TAKE_UP_DEG))
            for k in range(_LOOKS):
                yield from bench.move(alone(i, first + k * _APART_DEG))
                looks.append((1, bench.glance()))
        yield from bench.move(BACK)
        seen = encoder_line(bench, i, looks)
        if seen is not None:
            findings.append(_kept(bench, i, _sure(*seen)))
    return findings


def _sure(line: Line, bits: int | None) -> Line:
    """A line no surer than an encoder whose scale is off by a step from one end of the way to the other."""
    off = 360.0 / 2 ** (bits or 16) / (2.0 * _REACH_DEG)
    return replace(line, sigma=math.hypot(line.sigma, off / SIGNIFICANCE))


def _kept(bench: CommissioningBench, i: int, line: Line) -> Finding:
    """Keep the ratio of the long way where it is the surer one."""
    keep_sense(bench, i, line)
    off = 100.0 * (abs(line.slope) - 1.0)
    detail = (
        f"over {2.0 * _REACH_DEG:g}° the encoder turns {off:+.4f} ± {100.0 * line.sigma:.4f} % farther than by the "
        "configured gears"
    )
    return Finding(f"axis{i + 1} encoder over a long way", "measured", detail)


def keep_sense(bench: CommissioningBench, i: int, line: Line) -> None:
    """Keep a line as what the encoder of axis `i` turns for a count, unless a surer one is known."""
    relative = SIGNIFICANCE * line.sigma / abs(line.slope)
    before = bench.encoder_senses[i]
    if before is None or relative < before[1]:
        bench.encoder_senses[i] = line.slope / 360.0 / bench.counts_per_deg(i), relative


LONG_WAY = Step(
    "encoder-ratio",
    "the encoders' ratio over a long way, one axis at a time",
    _long_way,
    _REACH_DEG,
    1.25 * _REACH_DEG,
    needs=("gearing",),
    together=False,
    applies=lambda bench: any(sense is not None for sense in bench.encoder_senses),
)
"""Where the stored zero of an encoder lies whole turns away, only a ratio so well known tells where."""
