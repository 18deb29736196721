"""What the encoder of axis 1 tells while the axis tracks, by a crystal, at a rate that nothing changes but guiding.

A count takes 4.3 s, but the moment at which it comes is seen to a few hundredths: the way between two such moments is
known to 15 microsteps. So the steps of a count are measured without any move, and the rate that `+` makes. The
moments are multiples of four counts apart, as the four edges of an incremental encoder are not evenly spaced.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mounts.avr_box.guiding import MOST_TICKS
from mounts.avr_box.timers import DEFAULT_COMPARE
from mounts.commissioning import Bench, Finding, Steps, judged

if TYPE_CHECKING:
    from mounts.avr_box.drive import AvrBoxDrive

_LOOK_S = 0.03
_ALONE = 12  # counts that it is left alone
_TIMES_TOO_LONG = 6.0  # as long as expected, until nothing is expected any more
_RIGHT = 0.005  # by which a ratio may differ
_DIGITS = 3


@dataclass(frozen=True)
class Edge:
    """The moment, POSIX seconds, at which an encoder came to a count."""

    count: int
    time: float


class NoEdgeError(Exception):
    """Encoder 1 does not count."""


def tracking(bench: Bench, found: list[Finding]) -> Steps[float]:
    """Measure microsteps a count, and add what is found; return them, or those configured where nothing counts."""
    drive: AvrBoxDrive = bench.drive
    encoder = drive.axes[0].encoder
    configured = bench.configured("drive.encoder_counts_per_turn")
    assert encoder is not None  # noqa: S101 - the step applies where there is one
    drive.trials.begin()
    try:
        first = yield from _edge(drive, 1)
        last = yield from _edge(drive, _ALONE)
    except NoEdgeError as none:
        found.append(Finding("encoder ratio", "untested", str(none), "drive.encoder_counts_per_turn"))
        return encoder.step
    own = abs(drive.axes[0].own_rate)
    step = own * (last.time - first.time) / abs(last.count - first.count)
    found.append(_ratio(configured, configured * encoder.step / step))
    found.append((yield from _guiding(bench, drive, last, step)))
    return step


def _ratio(configured: int, measured: float) -> Finding:
    rounded = round(measured, _DIGITS - 1 - math.floor(math.log10(measured)))
    right = abs(measured / configured - 1.0) < _RIGHT
    detail = f"{measured:.0f} ± {_RIGHT / 2.0 * measured:.0f} counts a turn of axis 1 while it tracks, by its gears"
    key = "drive.encoder_counts_per_turn"
    return Finding("encoder ratio", judged(right), detail, key, configured, configured if right else int(rounded))


def _guiding(bench: Bench, drive: "AvrBoxDrive", first: Edge, step: float) -> Steps[Finding]:
    """Let `+` run for as long as one command lasts, and compare the way with the time."""
    subject, key, own = "guide counts", "drive.guide_counts", abs(drive.axes[0].own_rate)
    configured = bench.configured(key)
    lasts = drive.trials.guide(MOST_TICKS)
    yield lasts
    whole = 4 * math.ceil(lasts * own * 1.1 / step / 4.0)
    try:
        last = yield from _edge(drive, whole, since=first)
    except NoEdgeError as none:
        return Finding(subject, "untested", str(none), key)
    faster = (step * abs(last.count - first.count) - own * (last.time - first.time)) / lasts
    counts = (DEFAULT_COMPARE + 1) * faster / (own + faster)
    detail = f"`+` makes axis 1 {100.0 * faster / own:+.2f} % faster, {counts:.2f} timer counts"
    if counts < 0.5:
        return Finding(subject, "untested", f"{detail}; it does nothing: check that the box takes its flags", key)
    return Finding(subject, judged(round(counts) == configured), detail, key, configured, round(counts))


def _edge(drive: "AvrBoxDrive", counts: int, since: Edge | None = None) -> Steps[Edge]:
    """Wait until the encoder is so many counts from an edge, or from where it is, and tell when that was."""
    axis = drive.axes[0]
    assert axis.encoder is not None  # noqa: S101 - likewise
    before = drive.trials.encoders()
    start = before.pair.one if since is None else since.count
    expected = counts * axis.encoder.step / abs(axis.own_rate)
    due = before.middle + _TIMES_TOO_LONG * max(expected, axis.encoder.step / abs(axis.own_rate))
    while before.middle < due:
        yield _LOOK_S
        told = drive.trials.encoders()
        if abs(told.pair.one - start) >= counts > abs(before.pair.one - start):
            return Edge(told.pair.one, (before.middle + told.middle) / 2.0)
        before = told
    raise NoEdgeError("encoder 1 does not count while axis 1 tracks; check its cable, and the box's power")
