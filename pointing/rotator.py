"""The instrument rotator: at which angle it holds what it is to hold, and how fast it turns.

The rotator's angle is that of the instrument's y axis in the focal plane, counted from the tube's upper side in the
sense in which position angles count on the sky, from north through east. So with the tube's upper side at the
position angle p, an instrument at the rotator angle r has the position angle p + r. What can be held:

=========  ==========================================================================================================
`sky`      a position angle on the sky at the target: the rotator turns against the field rotation
`horizon`  an angle from the zenith, for what must stand upright: on a level altazimuth mount the rotator stands still
`mount`    an angle of the rotator itself: it stands still on any mount
=========  ==========================================================================================================

Angles follow from the target through the pointing model to how the tube is rolled, in both postures. Rates are
central differences of fourth order over a step in which no axis turns by more than 0.01 rad: within 1e-8 of the rate,
near the zenith too, where a shorter step would show the rounding.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

from pointing.errors import PointingError
from pointing.field_rotation import SkyAt, turned, upright
from pointing.geometry import Geometry, outside
from pointing.instant import Instant
from pointing.limits import Check
from pointing.mount import Posture
from pointing.plan import Axis
from pointing.sky import SkyFrame
from pointing.targets import Target
from pointing.vectors import Vector, angle_eastward

Mode = Literal["sky", "horizon", "mount"]
MODES: tuple[Mode, ...] = get_args(Mode)

_LONGEST_STEP = 1.0  # s, of a difference
_STEP_ANGLE = 0.01  # rad, by which the faster axis turns in it at most
_LOOK_S = 300.0  # between two looks ahead
_LOOK_ANGLE = math.radians(30.0)  # by which it turns between two at most
_CLOSE_S = 0.01


@dataclass(frozen=True)
class Hold:
    """What a rotator holds.

    Parameters
    ----------
    mode : str
        `sky`, `horizon` or `mount`.
    angle : float
        Radians: the position angle of the instrument's y axis, its angle from the zenith or the tube's upper side,
        all in the sense of north through east.

    Raises
    ------
    PointingError
        There is no such mode; the angle is no number.
    """

    mode: Mode = "sky"
    angle: float = 0.0

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise PointingError(f"a rotator that holds {self.mode!r}: possible are {', '.join(MODES)}")
        if not abs(self.angle) <= 2.0 * math.tau:
            raise PointingError(f"an angle of {math.degrees(self.angle):g}° to hold: possible are −720° to 720°")

    def __str__(self) -> str:
        degrees = f"{math.degrees(self.angle):g}°"
        return {
            "sky": f"position angle {degrees} on the sky",
            "horizon": f"{degrees} from the zenith",
            "mount": f"{degrees} on the mount",
        }[self.mode]

    def angle_at(self, frame: SkyFrame, observed: Vector, up: Vector) -> float:
        """The rotator's angle in (−π, π], not wound, with the tube's upper side `up` at an observed direction.

        Raises
        ------
        PointingError
            There is no north, or no way up, at the place.
        """
        if self.mode == "mount":
            return math.remainder(self.angle, math.tau)
        if self.mode == "sky":
            wanted = SkyAt(frame, observed).direction(self.angle)
        else:
            wanted = turned(upright(observed), observed, self.angle)
        return angle_eastward(up, wanted, observed)


@dataclass(frozen=True)
class Rotator:
    """The rotator of one telescope: its axis, with gearing and limits, and what it holds."""

    axis: Axis
    hold: Hold
    park: float = 0.0  # where it is parked, radians

    def holding(self, hold: Hold | None) -> "Rotator":
        """The same rotator, to hold something else; None for what it holds already."""
        return self if hold is None else replace(self, hold=hold)

    def check(self, angle: float, what: str = "rotator") -> Check:
        """The soft limit of the rotator at an angle, radians."""
        low, high = self.axis.minimum, self.axis.maximum
        degrees, lowest, highest = map(math.degrees, (angle, low, high))
        ok = low <= angle <= high
        allowed = f"allowed {lowest:.2f}° to {highest:.2f}°"
        beyond = "" if ok else f" is {outside(max(lowest - degrees, degrees - highest))} its travel,"
        detail = f"{what} at {degrees:.3f}°{beyond or ','} {allowed}"
        if not ok:
            detail += "; `goto` the target again to wind it back, or hold another angle"
        return Check("rotator soft limit", ok, detail, min(angle - low, high - angle))


@dataclass(frozen=True)
class Held:
    """What is to be held at a moving target, in one posture: the rotator's angle against time."""

    geometry: Geometry
    target: Target
    posture: Posture
    hold: Hold

    def angle(self, time: float) -> float:
        """The rotator's angle in (−π, π], not wound, at POSIX `time`.

        Raises
        ------
        TargetError, PointingError
            The target has no place then; there is no north, or no way up, where it is.
        """
        if self.hold.mode == "mount":
            return math.remainder(self.hold.angle, math.tau)
        frame = self.geometry.sky.at(Instant.from_posix(time))
        observed = self.target.observed(frame)
        mount = self.geometry.mount
        return self.hold.angle_at(frame, observed, mount.up(*mount.axes(observed, self.posture)))

    def state(self, time: float, near: float) -> tuple[float, float]:
        """(angle, rate) at POSIX `time`, radians and radians per second, wound to be the nearest to `near`."""
        angle = _nearest(self.angle(time), near)
        if self.hold.mode == "mount":
            return angle, 0.0
        step = self._step(time)
        ahead, behind = (math.remainder(self.angle(time + k * step) - angle, math.tau) for k in (1.0, -1.0))
        far, back = (math.remainder(self.angle(time + k * step) - angle, math.tau) for k in (2.0, -2.0))
        return angle, (8.0 * (ahead - behind) - (far - back)) / (12.0 * step)

    def _step(self, time: float) -> float:
        """Seconds of a difference: a power of two, which POSIX seconds hold without rounding."""
        (_, one), (_, two) = self.geometry.track(self.target, time, self.posture, (0.0, 0.0))
        fastest = max(abs(one), abs(two), _STEP_ANGLE / _LONGEST_STEP)
        return math.exp2(math.floor(math.log2(_STEP_ANGLE / fastest)))


class RotatorPath:
    """The way of a rotator along a target.

    Parameters
    ----------
    rotator : Rotator
        The axis.
    held : Held
        What it holds.
    near : float
        Radians; the winding is the nearest to this at first, later to where it was last asked to be.
    since : float
        POSIX seconds from which on it is there; before, it is on its way and no limit of the field's is its own.
    """

    def __init__(self, rotator: Rotator, held: Held, near: float, since: float = -math.inf) -> None:
        self.rotator = rotator
        self.held = held
        self.near = near
        self.since = since

    def moved_to(self, target: Target, posture: Posture) -> "RotatorPath":
        """The way along another target from where this one is, to hold the same."""
        held = replace(self.held, target=target, posture=posture)
        return RotatorPath(self.rotator, held, self.near, self.since)

    def angle(self, time: float) -> float:
        """The angle at POSIX `time`, radians."""
        self.near = _nearest(self.held.angle(time), self.near)
        return self.near

    def state(self, time: float) -> tuple[float, float]:
        """(angle, rate) at POSIX `time`, radians and radians per second."""
        state = self.held.state(time, self.near)
        self.near = state[0]
        return state

    def at(self, time: float) -> tuple[float, float]:
        """(counts, counts per second) at POSIX `time`."""
        angle, rate = self.state(time)
        gearing = self.rotator.axis.gearing
        return gearing.counts(angle), rate * gearing.counts_per_radian

    def next_limit(self, time: float, until: float) -> tuple[float, Check] | None:
        """When, from `time` to `until`, it first meets its limit, POSIX seconds to 0.01 s, and the check.

        None when it does not by then, or nobody knows the target's place any further.
        """
        time = max(time, self.since)
        angle = _nearest(self.held.angle(time), self.near)
        while True:
            check = self.rotator.check(angle)
            if not check.ok:
                return time, check
            if time >= until:
                return None
            due, there = self._ahead(time, angle, until)
            check = self.rotator.check(there)
            if not check.ok:
                return self._closed_in(time, angle, due, check)
            time, angle = due, there

    def _ahead(self, time: float, angle: float, until: float) -> tuple[float, float]:
        """The next moment to look at and the angle then: near enough for the winding to be known."""
        step = min(_LOOK_S, until - time)
        while True:
            middle = _nearest(self.held.angle(time + step / 2.0), angle)
            there = _nearest(self.held.angle(time + step), middle)
            if max(abs(middle - angle), abs(there - middle)) <= _LOOK_ANGLE or step <= _CLOSE_S:
                return time + step, there
            step /= 2.0

    def _closed_in(self, clear: float, angle: float, broken: float, check: Check) -> tuple[float, Check]:
        while broken - clear > _CLOSE_S:
            middle = (clear + broken) / 2.0
            there = _nearest(self.held.angle(middle), angle)
            looked = self.rotator.check(there)
            if looked.ok:
                clear, angle = middle, there
            else:
                broken, check = middle, looked
        return broken, check


def field_rotation(geometry: Geometry, target: Target, time: float, posture: Posture) -> tuple[float, float]:
    """How the sky lies in the focal plane, and how fast it turns there, with no rotator or one that stands still.

    Returns
    -------
    tuple
        The angle of north from the tube's upper side, radians in (−π, π] as a rotator counts, and its rate, radians
        per second: the field rotation.

    Raises
    ------
    TargetError, PointingError
        As for `Held.angle`.
    """
    return Held(geometry, target, posture, Hold()).state(time, 0.0)


def _nearest(angle: float, near: float) -> float:
    """The winding of `angle` nearest to `near`."""
    return angle + math.tau * round((near - angle) / math.tau)
