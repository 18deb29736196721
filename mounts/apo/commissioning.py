"""What can be found out about axis controllers without harm: what they hold, their clocks, buffers, and expiry.

The buffer is filled at rest, with nodes at the place where the axis stands. What a controller does when a path runs
out is seen of one that creeps.
"""

from contextlib import suppress

from mounts.apo.connecting import settings_of
from mounts.apo.node_queue import PathNode
from mounts.commissioning import BACK, Bench, Finding, Step, Steps, judged
from mounts.errors import DriveError

_CREEP_DEG_S = 0.005
_CREEPS_S = 3.0
_RAMP_S = 2.0
_SEEN_S = 4.0  # behind the end of the path
_AHEAD_S = 3.0  # of the first node
_APART_S = 1.0
_FAR_S = 60.0  # of the nodes that fill a buffer, which none of them comes near


def _settings(bench: Bench) -> Steps[list[Finding]]:
    """Soft limits and MAXV, as the controllers tell them."""
    findings = []
    for axis in bench.drive.axes:
        told = settings_of(axis)
        for each in told:
            found = f"{each.told:g} {each.unit}, configured {each.configured:g} {each.unit}"
            findings.append(Finding(f"{axis.name} {each.name}", judged(not each.differs), found))
        if not told:
            why = "the controller tells neither soft limits nor MAXV; see its own documentation"
            findings.append(Finding(f"{axis.name} settings", "untested", why))
    yield 0.0
    return findings


def _clocks(bench: Bench) -> Steps[list[Finding]]:
    """How far the clocks are off."""
    yield from bench.wait(5.0)
    findings = []
    for axis in bench.drive.axes:
        off, unsure = axis.offset.value, axis.offset.uncertainty_s
        detail = axis.clock_trouble() or f"{1e3 * off:+.2f} ms off, within ± {1e3 * unsure:.2f} ms by the line"
        findings.append(Finding(f"{axis.name} clock", "measured", detail))
    return findings


def _buffer(bench: Bench) -> Steps[list[Finding]]:
    """Whether the buffers hold as many nodes as configured: filled with the place where each axis stands."""
    findings = []
    most = int(bench.configured("drive.max_nodes"))
    for axis in bench.drive.axes:
        taken = 0
        try:
            line = axis.drift()
            with suppress(DriveError):
                for taken in range(most):
                    axis.send(PathNode(line.time + _FAR_S + taken * _APART_S, line.position, 0.0))
                taken = most
        finally:
            axis.halt()
        detail = f"{taken} nodes taken, configured {most}"
        subject, key = f"{axis.name} buffer", "drive.max_nodes"
        findings.append(Finding(subject, judged(taken == most), detail, key, most, taken))
        yield 0.0
    return findings


def _expiry(bench: Bench) -> Steps[list[Finding]]:
    """What a controller does when its path has run out: each axis creeps for some seconds, and is left alone."""
    findings = []
    configured = str(bench.configured("drive.on_expiry"))
    yield from bench.wait(1.0)  # in which the drive sees that the axes stand
    for axis in bench.drive.axes[:2]:
        line = axis.drift()
        begin = line.time + _AHEAD_S
        moved = _CREEP_DEG_S * _RAMP_S / 2.0
        axis.send(PathNode(begin, line.position, 0.0))
        axis.send(PathNode(begin + _RAMP_S, line.position + moved, _CREEP_DEG_S))
        end = PathNode(begin + _RAMP_S + _CREEPS_S, line.position + moved + _CREEP_DEG_S * _CREEPS_S, _CREEP_DEG_S)
        axis.send(end)
        axis.let_expire()
        yield from bench.wait(_AHEAD_S + _RAMP_S + _CREEPS_S + _SEEN_S)
        speed = axis.look().velocity
        axis.halt()
        found = "extrapolate" if abs(speed) > _CREEP_DEG_S / 2.0 else "halt"
        detail = f"{_SEEN_S:g} s after the last node it moves at {speed:.5f}°/s of {_CREEP_DEG_S}°/s: {found}"
        subject, key = f"{axis.name} expiry", "drive.on_expiry"
        findings.append(Finding(subject, judged(found == configured), detail, key, configured, found))
        yield from bench.wait(2.0)
    yield from bench.move(BACK)
    return findings


BEFORE = (
    Step("settings", "what the controllers hold otherwise than configured", _settings),
    Step("clocks", "how far the controllers' clocks are off", _clocks),
    Step("buffer", "how many nodes the buffers hold, filled at rest", _buffer),
)
AFTER = (Step("expiry", "what a controller does when its path runs out", _expiry, 0.1, 0.2),)
LEFT_OUT = frozenset({"gearing", "encoder-ratio"})
"""Steps of all drives that ask for what these have not: gears and encoders."""
