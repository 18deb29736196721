"""What can be found out about a stepper box by moves of a third of a degree that its encoders watch.

Each move is of a known number of microsteps on the wire, one value of the axis bit and one sign. Which encoder
answers, by how much and in which sense, tells the axis bit, what the count means, and the sense of each axis. Before
that the axes are left to themselves: tracking tells the encoders' ratio, and what guiding does.
"""

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

from mounts.avr_box import commands
from mounts.avr_box.commissioning_tracking import tracking
from mounts.commissioning import Bench, Finding, Step, Steps, judged

if TYPE_CHECKING:
    from mounts.avr_box.box import Told

_COUNTS = 20.0  # encoder counts of a trial, by the configured gears
_LOOSE = 0.2  # by which a way may differ from what is expected
_SEEN_COUNTS = 6.0
_SEEN_NORTH = 2  # of the 4.6 that a move of 5′ makes of 20 000 a turn
REACH_DEG = 1.4
BOUND_DEG = 2.0  # were the count halves, and the axis the other one


@dataclass(frozen=True)
class Trial:
    """A move as it was sent, and what each encoder made of it beyond tracking, counts."""

    bit: int
    wire: int
    seen: tuple[float, float]

    @property
    def axis(self) -> int | None:
        """Which axis moved, 0 or 1; None where neither did, or both.

        An encoder 1 that counts backwards sees twice the tracking, up to 8 counts.
        """
        one, two = map(abs, self.seen)
        if max(one, two) < max(_SEEN_COUNTS, 2.0 * min(one, two)):
            return None
        return 0 if one > two else 1


def _trial(bench: Bench, bit: int, ratio: float, *, falling: bool) -> Steps[Trial]:
    drive = bench.drive
    axis = drive.axes[1 if bit == bench.configured("drive.axis_bit") else 0]
    half = commands.harmless_below(round(_COUNTS * axis.encoder.step * ratio / 2.0))
    seconds = 2.0 * axis.duration(2 * half) + 1.0
    before: Told = drive.trials.encoders()
    wire = drive.trials.move(axis.index, half, falling=falling)
    yield seconds
    after: Told = drive.trials.encoders()
    tracked = drive.axes[0].own_rate * (after.middle - before.middle - axis.duration(half) * (axis.index == 0))
    tracked /= drive.axes[0].encoder.steps_per_count * ratio
    one, two = (later - earlier for later, earlier in zip(after.pair, before.pair, strict=True))
    return Trial(bit, wire, (one - tracked, float(two)))


def _moves(bench: Bench) -> Steps[list[Finding]]:
    """Encoder ratio and guiding while it tracks; axis bit, count and senses by moves."""
    found: list[Finding] = []
    measured = yield from tracking(bench, found)
    ratio = measured / bench.drive.axes[0].encoder.step
    trials: list[Trial] = []
    for bit, falling in product((0, 1), (False, True)):
        trials += [(yield from _trial(bench, bit, ratio, falling=falling))]
    senses = _senses(bench, trials)
    north = yield from _north(bench, known=senses[1].verdict == "confirmed")
    bench.drive.give_back()
    return [*found, *_axis_bit(bench, trials), *_count(bench, trials, ratio), *senses, north]


def _north(bench: Bench, *, known: bool) -> Steps[Finding]:
    """Which way `N` turns axis 2, as its encoder counts, where it is known which way that counts."""
    subject, key, configured = "north", "drive.north_reversed", bench.configured("drive.north_reversed")
    before: Told = bench.drive.trials.encoders()
    yield bench.drive.trials.north() + 1.0
    after: Told = bench.drive.trials.encoders()
    made = after.pair.two - before.pair.two
    if abs(made) < _SEEN_NORTH:
        return Finding(subject, "untested", f"encoder 2 saw {made:+d} counts of a move of 5′; check its cable", key)
    if not known:
        return Finding(subject, "untested", f"`N` makes {made:+d} counts: first mend the sense of axis 2", key)
    found = made < 0
    return Finding(subject, judged(found == configured), f"`N` makes {made:+d} counts", key, configured, found)


def _axis_bit(bench: Bench, trials: list[Trial]) -> list[Finding]:
    subject, key, configured = "axis bit", "drive.axis_bit", bench.configured("drive.axis_bit")
    seconds = {trial.bit for trial in trials if trial.axis == 1}
    if len(seconds) != 1:
        return [Finding(subject, "untested", f"the encoders saw {_seen(trials)}; check their cables", key)]
    found = seconds.pop()
    return [Finding(subject, judged(found == configured), f"bit {found} moves axis 2", key, configured, found)]


def _count(bench: Bench, trials: list[Trial], ratio: float) -> list[Finding]:
    subject, key, configured = "move count", "drive.move_count", bench.configured("drive.move_count")
    per_wire = []
    for trial in trials:
        if trial.axis is not None:
            steps = abs(trial.seen[trial.axis]) * bench.drive.axes[trial.axis].encoder.step * ratio
            per_wire.append(steps / trial.wire)
    if not per_wire:
        return [Finding(subject, "untested", "no encoder saw a move; check their cables", key)]
    made = sum(per_wire) / len(per_wire)
    found = {1: "total", 2: "half"}.get(round(made))
    detail = f"{made:.3f} microsteps are made for each that is counted"
    if found is None or abs(made / round(made) - 1.0) > _LOOSE:
        why = f"{detail}: neither 1 nor 2; check gears and encoder_counts_per_turn"
        return [Finding(subject, "untested", why, key)]
    return [Finding(subject, judged(found == configured), detail, key, configured, found)]


def _senses(bench: Bench, trials: list[Trial]) -> list[Finding]:
    findings = []
    for i, axis in enumerate(bench.drive.axes):
        subject = f"axis{i + 1} sense"
        rising = [trial.seen[i] for n, trial in enumerate(trials) if trial.axis == i and n % 2 == 0]
        if not rising:
            findings.append(Finding(subject, "untested", "its encoder saw no move"))
            continue
        agrees = rising[0] * axis.encoder.steps_per_count > 0.0
        way = "as" if agrees else "against what"
        detail = f"its encoder counts {way} the axis is told" + (
            "" if agrees else ": swap its A and B wires, or, where the axis turned the wrong way, change `reversed`"
        )
        findings.append(Finding(subject, judged(agrees), detail))
    return findings


def _seen(trials: list[Trial]) -> str:
    return ", ".join(f"{trial.seen[0]:+.1f}/{trial.seen[1]:+.1f} counts at bit {trial.bit}" for trial in trials)


def _has_encoders(bench: Bench) -> bool:
    return bool(bench.configured("drive.encoder_counts_per_turn"))


BEFORE = (
    Step(
        "moves",
        "encoder ratio, guiding, axis bit, what a move counts, senses",
        _moves,
        REACH_DEG,
        BOUND_DEG,
        applies=_has_encoders,
    ),
)
AFTER: tuple[Step, ...] = ()
LEFT_OUT = frozenset({"sense", "gearing", "encoder-ratio", "stop", "speed"})
"""Shared steps that ask for absolute encoders, for a stop, or for a speed that is read."""
