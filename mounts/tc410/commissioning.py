"""What the TC410's manual leaves open, asked of the unit itself: a table of small steps.

Each row that the manual does not settle has a step here, or a sentence that says why no step can settle it. The
steps that stand still use what the unit shows of its registers; those that move do it by `Bench.move`.
"""

import math
from contextlib import suppress

from mounts.commissioning import BACK, Bench, Encoder, Finding, Move, Step, Steps, alone, judged
from mounts.errors import DriveError
from mounts.tc410.drive import TC410
from mounts.tc410.registers import CENTRE, by_name
from mounts.tc410.unit import Unit
from transports.errors import TransportError

_AXES = (1, 2)
_KEPT_BITS = 8  # of a position or velocity that its 16-bit registers leave out, as the readings have it
_SPEED_DEG_S = 0.2  # asked of the maximum speed register, and reached within half a second
_CRUISE_S = (0.6, 3.5)  # since the start, between which the speed is measured
_SPEED_REACH_DEG = 1.0
_SPEED_TOLERANCE = 0.1
_UNSEEN_DEG = 2.0  # by which a position may be off that nobody compared with the sky
_SYNC_DEG = 0.1  # left by a synchronisation on a star: alignment, flexure, centring
_TRACK_DEG_S = 0.0125  # after a slew: 50 counts/s in the manual's gearing
_TRACK_S = 4.0
_MOST_UNSURE_DEG = 20.0  # beyond which an encoder that fits fits by chance
_SAME_ACCELERATION = 1.0  # per cent
_SAME_LANDING_S = 0.05
_SLEW = by_name("velocity_control").mask("slew_to_target")


def encoders(drive: TC410) -> tuple[Encoder | None, Encoder | None]:
    """What the absolute encoders read; None for one that the unit does not detect."""
    one, two = (_encoder(drive.unit, axis) for axis in _AXES)
    return one, two


def _encoder(unit: Unit, axis: int) -> Encoder | None:
    detected = f"axis{axis}_encoder_detected"
    if not unit.read(detected)[detected]:
        return None
    name = f"axis{axis}_encoder_raw"  # Gray, so that no reading is far off while a bit changes
    return Encoder(int(unit.read(name)[name]))


def _position_format(bench: Bench) -> Steps[list[Finding]]:
    """How the 24 bits lie was decided when the unit was connected, without motion."""
    yield 0.0
    found, key = bench.drive.unit.position_format, "drive.position_format"
    configured = bench.configured(key)
    right = configured in {"auto", found}
    detail = f'positions are {found}-justified; the configuration says "{configured}"'
    return [Finding("position format", judged(right), detail, key, configured, found)]


def _limits(bench: Bench) -> Steps[list[Finding]]:
    """Set each soft limit just below and just above the position, and look whether the unit thinks it is reached."""
    findings = []
    for axis in _AXES:
        findings.append(_limits_of(bench.drive, axis))
        yield 0.0
    return findings


def _limits_of(drive: TC410, axis: int) -> Finding:
    subject = f"axis{axis} soft-limit registers"
    here = int(drive.unit.read(f"axis{axis}_position")[f"axis{axis}_position"]) >> _KEPT_BITS
    if not 1 <= here < 0xFFFF:
        return Finding(subject, "untested", "the axis stands at the end of what the drive can count; move it away")
    trials = (("positive", here, True), ("positive", here + 1, False),
              ("negative", here + 1, True), ("negative", here - 1, False))  # fmt: skip
    wrong = 0
    try:
        for side, word, reached in trials:
            drive.borrow({f"axis{axis}_{side}_limit": word << _KEPT_BITS})
            flags = by_name("limit_flags").asserted(int(drive.unit.read("limit_flags")["limit_flags"]))
            wrong += (f"axis{axis}_soft_{side}_limit" in flags) != reached
            drive.give_back()
    finally:
        with suppress(DriveError, TransportError):  # the next connection gives back what this one cannot
            drive.give_back()
    if not wrong:
        return Finding(subject, "confirmed", "limits are reached where position24 >> 8 says, to 256 counts")
    return Finding(
        subject,
        "refuted",
        f"{wrong} of {len(trials)} limits set round the position were not taken as position24 >> 8: the drive's own "
        "soft limits bound nothing; do not move it from a host, and send this report",
    )


def _longitude(bench: Bench) -> Steps[list[Finding]]:
    yield 0.0
    mas = bench.drive.unit.read("longitude")["longitude"]
    configured = bench.configured("site.longitude_deg")
    east, found = math.remainder(configured, 360.0), math.remainder(mas / 3.6e6, 360.0)
    subject, both = "sign of the longitude register", f"the unit has {found:+.4f}°, the configuration {east:+.4f}°"
    if not mas:
        return [Finding(subject, "untested", "the unit keeps no longitude; the host uses its own, east positive")]
    if abs(math.remainder(found - east, 360.0)) < 0.1:
        return [Finding(subject, "confirmed", f"east is positive: {both}")]
    if abs(math.remainder(found + east, 360.0)) < 0.1:
        return [Finding(subject, "refuted", f"west is positive in this unit: {both}; the host uses its own")]
    return [Finding(subject, "untested", f"{both}; the host uses its own, so check that one")]


def _speed_register(bench: Bench) -> Steps[list[Finding]]:
    """Lower the maximum speed, and measure the speed that comes of it."""
    findings = []
    drive: TC410 = bench.drive
    for i, axis in enumerate(_AXES):
        readings = yield from bench.move(alone(i, _SPEED_REACH_DEG, top_deg_s=_SPEED_DEG_S, until_s=_CRUISE_S[1]))
        began = readings[0].time
        cruise = [(r.time, r.axes[i].counts) for r in readings if r.axes[i].slewing and r.time > began + _CRUISE_S[0]]
        asked = min(_SPEED_DEG_S * bench.counts_per_deg(i), drive.slew_models[i].max_rate)
        findings.append(_speed_finding(axis, asked, cruise))
        yield from bench.move(BACK)
    return findings


def _speed_finding(axis: int, asked: float, cruise: list[tuple[float, float]]) -> Finding:
    subject = f"axis{axis} maximum-speed register"
    if len(cruise) < 2 or cruise[-1][0] - cruise[0][0] < 0.2:
        return Finding(
            subject, "untested", "the link is too slow to see the axis at an even speed; use a quicker one"
        )
    seen = abs(cruise[-1][1] - cruise[0][1]) / (cruise[-1][0] - cruise[0][0])
    ratio = seen / asked
    said = f"asked for {asked:.0f} counts/s, the axis went at {seen:.0f}"
    if abs(ratio - 1.0) < _SPEED_TOLERANCE:
        return Finding(subject, "confirmed", f"it holds velocity24 >> 8: {said}")
    shift = _KEPT_BITS + round(math.log2(max(ratio, 1e-9)))
    return Finding(subject, "refuted", f"it does not hold velocity24 >> 8 (more like >> {shift}): {said}")


def _slew_bit(bench: Bench) -> Steps[list[Finding]]:
    yield from bench.move(Move((0.1, 0.1)))
    control = int(bench.drive.unit.read("velocity_control")["velocity_control"])
    yield from bench.move(BACK)
    clears = not control & _SLEW
    word = "clears itself" if clears else "stays set"
    detail = f"the bit that starts a slew {word} when the slew has ended; either way it is written 0, then 1"
    return [Finding("slew bit", judged(clears), detail)]


def _idle(bench: Bench) -> Steps[list[Finding]]:
    """Slews whose axes land at different times, and track on: which shows when tracking resumes, and the landing."""
    rates = (_TRACK_DEG_S, _TRACK_DEG_S)
    for place in ((3.0, 0.4), (2.7, 3.4), (0.2, 3.1), (0.5, 0.1)):
        yield from bench.move(Move(place, rates_after_deg_s=rates))
        yield from bench.wait(_TRACK_S)
        yield from bench.halt()
    yield from bench.move(BACK)
    return [_idle_finding(bench), *_law_findings(bench)]


def _idle_finding(bench: Bench) -> Finding:
    key, found = "drive.slew_idle", bench.drive.learnt.slew_idle
    configured = bench.configured(key)
    if found is None:
        why = "no axis was seen landed while the other still slewed; use a quicker link"
        return Finding("tracking after a slew", "untested", why, key, configured)
    word = "when both axes have landed" if found == "both" else "on each axis when it has landed"
    verdict = judged(found == configured)
    return Finding("tracking after a slew", verdict, f"tracking resumes {word}", key, configured, found)


def _law_findings(bench: Bench) -> list[Finding]:
    """What all slews so far have taught of the landing law; the planner uses it from now on."""
    findings = []
    for axis, model in zip(_AXES, bench.drive.slew_models, strict=True):
        off = 100.0 * (model.acceleration_scale - 1.0)
        findings.append(
            Finding(
                f"axis{axis} acceleration",
                judged(abs(off) < _SAME_ACCELERATION),
                f"{off:+.1f} % off its register; planned with as it is",
            )
        )
        findings.append(
            Finding(
                f"axis{axis} landing",
                judged(model.landing_s < _SAME_LANDING_S),
                f"{model.landing_s:.3f} s longer than by the law; planned with as it is",
            )
        )
    return findings


def _encoder_zero(bench: Bench) -> Steps[list[Finding]]:
    """Compare where the stored zero says the encoder should stand with where it stands."""
    findings = []
    for i, encoder in enumerate(bench.encoders()):
        if encoder is not None:
            findings.append(_zero_finding(bench, i, encoder))
        yield 0.0
    return findings or [Finding("encoder zero", "untested", "the unit detects no encoders")]


def _zero_finding(bench: Bench, i: int, encoder: Encoder) -> Finding:
    axis, key = i + 1, f"axis{i + 1}.encoder_zero_at"
    subject = f"axis{axis} encoder zero"
    known, configured = bench.encoder_sense(i), bench.configured(key)
    unit: Unit = bench.drive.unit
    zero = unit.read(f"axis{axis}_encoder_zero")[f"axis{axis}_encoder_zero"] / 0x10000
    apart = abs(math.remainder(CENTRE / bench.counts_per_deg(i), 360.0))
    step = 360.0 / 2 ** (bench.configured(f"axis{axis}.encoder_bits") or 16)
    if apart < step:
        why = f"with these gears centre and count 0 lie whole turns apart, to {apart:.4f}°: either means the same"
        return Finding(subject, "confirmed", why, key, configured, configured)
    if known is None:
        return Finding(
            subject,
            "untested",
            "the encoder's sense is not known, as the step `gearing` found no ratio: see why",
            key,
        )
    if not zero:
        return Finding(subject, "untested", "the unit's encoder zero is 0, as never set; set it after a `sync`", key)
    counts = unit.read(f"axis{axis}_position")[f"axis{axis}_position"]
    fits = {
        name: _zero_fit(encoder.turns - zero, (counts - origin) * known[0], known[1], _position_margin(bench, i))
        for name, origin in (("centre", CENTRE), ("zero", 0))
    }
    said = "; ".join(f"zero at {name}: off by {off:.3f}° of {most:.3f}°" for name, (off, most) in fits.items())
    matching = [name for name, (off, most) in fits.items() if off < most < _MOST_UNSURE_DEG]
    if len(matching) != 1:
        why = f"the encoder does not decide it ({said}); `sync` on a star, then run it again with --witness"
        return Finding(subject, "untested", why, key)
    return Finding(subject, judged(matching[0] == configured), said, key, configured, matching[0])


def _zero_fit(read: float, turned: float, relative: float, margin_deg: float) -> tuple[float, float]:
    """How far an encoder stands from where it would with one zero, and how far it may, degrees."""
    return 360.0 * abs(math.remainder(read - turned, 1.0)), margin_deg + 360.0 * abs(turned) * relative


def _position_margin(bench: Bench, i: int) -> float:
    """How far the position may be off, degrees: as the witness saw it, and when the zero was stored."""
    seen = bench.position_error_deg(i)
    return _UNSEEN_DEG if seen is None else _SYNC_DEG + seen


_UNTESTABLE = (
    ("park registers", "their 16 bits are taken as those of the soft limits; only a power-cycle would show them"),
    ("actions 0x70 to 0x73", "0x71 and 0x73 would overwrite the configuration; `drive factory`, `drive reload` do"),
    ("boot cookie", "that target registers are lost with the power shows at the next power-cycle"),
    ("logarithmic joystick", "its law is not published; its speeds are shown as they are"),
)  # fmt: skip


def _left_open(bench: Bench) -> Steps[list[Finding]]:  # noqa: ARG001 - a step takes the bench
    yield 0.0
    return [Finding(subject, "untested", why) for subject, why in _UNTESTABLE]


BEFORE = (
    Step("position-format", "how the 24 bits of a position lie in two registers", _position_format),
    Step("limits", "which bits the soft-limit registers hold", _limits, allows_motion=True),
    Step("longitude", "the sign of the longitude register", _longitude),
    Step("speed-register", "which bits the maximum-speed registers hold", _speed_register,
         _SPEED_REACH_DEG, 2.0 * _SPEED_REACH_DEG, allows_motion=True),
)  # fmt: skip
"""Steps that come before those of all drives: without them no motion would be what it seems."""

AFTER = (
    Step("landing", "when tracking resumes after a slew, true acceleration and landing", _idle, 3.6, 4.5,
         needs=("sense",)),
    Step("slew-bit", "whether the bit that starts a slew clears itself", _slew_bit, 0.1, 0.2),
    Step("encoder-zero", "where the encoders' stored zero is", _encoder_zero, needs=("gearing",)),
    Step("left-open", "what cannot be tested", _left_open),
)  # fmt: skip
