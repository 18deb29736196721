"""What to turn, by how much and when to stop, from what is known of where axis 1 points."""

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pointing.axis_estimate import FEWEST, AxisEstimate, Turn, knob_axes, rotation, tangent
from pointing.errors import PointingError
from pointing.model.place import MountKind
from pointing.model.polar_alignment import (
    AxisTilt,
    PolarAlignment,
    Registers,
    advice,
    angle_text,
    refracted_pole,
    to_turn,
)
from pointing.model.words import POLES, Pole
from pointing.mount import Mount, MountType
from pointing.site import Weather
from pointing.vectors import Vector, equatorial_to_horizon, horizon_to_equatorial

Array = NDArray[np.float64]
Step = Literal["turn", "look", "stop"]
Knobs = PolarAlignment | AxisTilt

COLLIMATION_ARCSEC = 180.0
"""The collimation error whose harm is told."""
_ARCSEC = math.radians(1.0 / 3600.0)
_DIFFERENCE = 1e-6  # of a derivative, radians
_UNSURE = 0.25  # σ of what is off, or of the goal, beyond which a turn is not worth while
_SURELY = 2.0  # σ within which it is
_CLEARLY = 3.0  # σ
_WRONG_WAY = 0.2  # of what was advised
_NEWTON = 12
_INDEX: dict[MountKind, tuple[str, float]] = {"equatorial": ("IH", -1.0), "altazimuth": ("IA", 1.0)}
_NAMES: dict[MountKind, tuple[str, str]] = {
    "equatorial": ("altitude of the polar axis", "azimuth of the polar axis"),
    "altazimuth": ("height of the north side", "height of the west side"),
}


@dataclass(frozen=True)
class FieldMove:
    """Where the knobs should bring a star that is in the centre of the field now, arcseconds from the centre.

    Parameters
    ----------
    east_arcsec, north_arcsec : float
        On the sky.
    right_arcsec, up_arcsec : float
        The same over the horizon, as one stands before it.
    """

    east_arcsec: float
    north_arcsec: float
    right_arcsec: float
    up_arcsec: float

    @property
    def text(self) -> str:
        """One sentence."""
        across, along = _way(self.east_arcsec, "east", "west"), _way(self.north_arcsec, "north", "south")
        side, height = _way(self.right_arcsec, "right", "left"), _way(self.up_arcsec, "up", "down")
        return (
            f"the star that is in the centre now must come to {across}, {along} of the centre by the knobs alone, "
            f"while the telescope tracks ({side}, {height} as one stands before it)"
        )


@dataclass(frozen=True)
class AxisAdvice:
    """What to do next.

    Parameters
    ----------
    knobs : PolarAlignment or AxisTilt
        Each knob's way and angle.
    off_arcsec, sigma_arcsec : float
        How far axis 1 is from where it should point, on the sky, and the larger of its standard deviations.
    goal_arcsec : float
        What is near enough.
    step : {"turn", "look", "stop"}
        Turn the knobs; look at another star first; or leave them.
    why : str
        Of that.
    move : FieldMove
        What the turn does to the star in the field.
    warnings : tuple of str
        What is strange: a knob turned the wrong way, looks that disagree.
    """

    knobs: Knobs
    off_arcsec: float
    sigma_arcsec: float
    goal_arcsec: float
    step: Step
    why: str
    move: FieldMove
    warnings: tuple[str, ...]

    @property
    def text(self) -> str:
        """The advice, a sentence a line."""
        off = f"axis 1 is {angle_text(self.off_arcsec, self.sigma_arcsec)} off"
        turns = () if self.step == "stop" else (*self.knobs.text.split("\n")[:2], self.move.text)
        return "\n".join((*self.warnings, f"{off}: {self.why}", *turns))

    def _repr_html_(self) -> str:
        return "".join(f"<p>{line}</p>" for line in self.text.split("\n"))


def advise(estimate: AxisEstimate, goal_arcsec: float, pole: Pole, weather: Weather) -> AxisAdvice:
    """Say what to turn.

    Parameters
    ----------
    estimate : AxisEstimate
        Of at least three looks.
    goal_arcsec : float
        How near is near enough.
    pole : {"true", "refracted"}
        To which a polar axis shall point; of no matter to altazimuth mounts.
    weather : Weather
        That refracts the pole.

    Raises
    ------
    PointingError
        Fewer than three looks; no such pole; the goal is not above 0.
    """
    if len(estimate.looks) < FEWEST:
        raise PointingError(f"{len(estimate.looks)} looks: three are needed for axis 1 and the index errors")
    if pole not in POLES:
        raise PointingError(f"there is no pole {pole!r}: possible are {' and '.join(POLES)}")
    if not 0.0 < goal_arcsec < math.inf:
        raise PointingError(f"a goal of {goal_arcsec:g}″: give a number above 0, as 20")
    mount = estimate.mount
    lift = refracted_pole(mount.latitude, weather) if pole == "refracted" else 0.0
    off, sigma = off_axis(estimate, _wanted(mount, lift))
    step, why = _step(off / _ARCSEC, sigma / _ARCSEC, goal_arcsec, _looks_since(estimate))
    end, sigmas = _end(mount, estimate.pole), _turn_sigmas(estimate)
    knobs = advice(mount.type.kind, mount.latitude, end, sigmas, registers_of(estimate), pole, weather)
    turns = turns_of(knobs)
    move = field_move(mount, estimate.looks[-1].seen, turns)
    return AxisAdvice(
        knobs, off / _ARCSEC, sigma / _ARCSEC, goal_arcsec, step, why, move,
        (*_wrong_ways(estimate), *_misfit(estimate)),
    )  # fmt: skip


def turns_of(knobs: Knobs) -> tuple[float, float]:
    """The advised turns by knob in the order of `knob_axes`, radians."""
    if isinstance(knobs, AxisTilt):
        return knobs.north_arcsec * _ARCSEC, knobs.west_arcsec * _ARCSEC
    return knobs.raise_arcsec * _ARCSEC, knobs.east_arcsec * _ARCSEC


def off_axis(estimate: AxisEstimate, wanted: Array) -> tuple[float, float]:
    """How far axis 1 is from a direction, and the larger standard deviation of where it is, radians."""
    pole = estimate.pole
    off = math.atan2(float(np.linalg.norm(np.cross(pole, wanted))), float(pole @ wanted))
    return off, math.sqrt(float(np.linalg.eigvalsh(_on_sky(estimate)).max()))


def field_move(mount: Mount, seen: Vector, turns: tuple[float, float]) -> FieldMove:
    """Where a star that is in the centre stands in the field once the knobs are turned."""
    centre = rotation(knob_axes(mount) @ np.array((*turns, 0.0))) @ np.array(seen)
    left, up = tangent(centre) @ np.array(seen)
    one, two = (np.array(horizon_to_equatorial(tuple(v), mount.latitude)) for v in (centre, seen))
    east, north = tangent(one) @ two
    return FieldMove(east / _ARCSEC, north / _ARCSEC, -left / _ARCSEC, up / _ARCSEC)


def harm_of_collimation(estimate: AxisEstimate, arcsec: float = COLLIMATION_ARCSEC) -> float:
    """By how much a collimation error that nobody knows of would put axis 1 elsewhere, arcseconds."""
    other = replace(estimate, mount=replace(estimate.mount, origin_x=estimate.mount.origin_x + arcsec * _ARCSEC)).pole
    return float(np.linalg.norm(np.cross(estimate.pole, other))) / _ARCSEC


def registers_of(estimate: AxisEstimate) -> Registers:
    """The mount's registers that put the software's axis 1 where the real one is, whole, with the model in force.

    With (X, Y) in force, M the model's tilt and R the estimate, all in the base frame:
    R·R(X, Y)·M = R(X′, Y′)·M·Rz(ψ). X′ and Y′ follow from where the pole of M has to go, and ψ is left to the index
    error of axis 1.
    """
    mount = estimate.mount
    base = _base(mount)
    before = rotation(np.array((mount.x, mount.y, 0.0)))
    tilt = before.T @ base @ _frame(mount)
    after = base @ estimate.attitude @ base.T @ before @ tilt
    x, y = mount.x, mount.y
    for _ in range(_NEWTON):
        ahead = np.cross(rotation(np.array((x, y, 0.0))) @ tilt[:, 2], after[:, 2])
        x, y = x + float(ahead[0]), y + float(ahead[1])
    left = (rotation(np.array((x, y, 0.0))) @ tilt).T @ after
    index, sign = _INDEX[mount.type.kind]
    turn = math.atan2(left[1, 0], left[0, 0])
    return Registers(x / _ARCSEC * 1000.0, y / _ARCSEC * 1000.0, index, sign * turn / _ARCSEC)


def _wanted(mount: Mount, lift: float) -> Array:
    """Where the end of axis 1 with increasing axis 2 should be, horizon frame."""
    if mount.type is MountType.ALTAZ_FORK:
        return np.array((0.0, 0.0, 1.0))
    end = -1.0 if mount.latitude < 0.0 else 1.0
    altitude = abs(mount.latitude) + lift
    return end * np.array((-end * math.cos(altitude), 0.0, math.sin(altitude)))


def _end(mount: Mount, pole: Array) -> Vector:
    """The end of axis 1 that is above the horizon."""
    south = mount.type is not MountType.ALTAZ_FORK and mount.latitude < 0.0
    x, y, z = (float(each) for each in (-pole if south else pole))
    return x, y, z


def _turn_sigmas(estimate: AxisEstimate) -> tuple[float, float]:
    """Standard deviations of both angles to turn, arcseconds."""
    mount, pole = estimate.mount, estimate.pole

    def turned(step: Array) -> Array:
        return np.array(to_turn(mount.type.kind, _end(mount, rotation(step) @ pole)))

    design = np.array([turned(step) - turned(-step) for step in _DIFFERENCE * np.eye(3)]).T / (2.0 * _DIFFERENCE)
    one, two = np.sqrt(np.diag(design @ estimate.covariance @ design.T)) / _ARCSEC
    return float(one), float(two)


def _on_sky(estimate: AxisEstimate) -> Array:
    """Covariance of where axis 1 is on the sky, square radians: (2, 2)."""
    pole = estimate.pole
    across = np.cross(pole, np.eye(3)[int(np.argmin(np.abs(pole)))])
    basis = np.array((across, np.cross(pole, across))) / np.linalg.norm(across)
    return np.asarray(basis @ estimate.covariance @ basis.T)  # of a rotation about across, the pole goes as far


def _step(off: float, sigma: float, goal: float, looks: int) -> tuple[Step, str]:
    """What to do, with so many looks since the last turn."""
    if off + _SURELY * sigma <= goal:
        return "stop", f"surely within {goal:g}″; stop"
    if off <= _SURELY * sigma and looks >= FEWEST:
        return "stop", f"no more than its uncertainty after {looks} looks; stop"
    if sigma > _UNSURE * max(off, goal):
        return "look", f"±{sigma:.0f}″ is too unsure to turn by, or to stop at; look at another star first"
    return "turn", "turn the knobs, then look again"


def _looks_since(estimate: AxisEstimate) -> int:
    """How many looks there were since the last turn."""
    turns = [i for i, each in enumerate(estimate.events) if isinstance(each, Turn)]
    return len(estimate.events) - (turns[-1] + 1 if turns else 0)


def _wrong_ways(estimate: AxisEstimate) -> tuple[str, ...]:
    """A sentence for each knob that went clearly the other way at the last turn; known after a look only."""
    turns = [each for each in estimate.events if isinstance(each, Turn)]
    if not turns or not _looks_since(estimate):
        return ()
    done, sigmas = estimate.last_turn()
    return tuple(
        f"the {name} was turned the wrong way: {angle_text(abs(own) / _ARCSEC, sigma / _ARCSEC)} against the advice"
        for name, wanted, own, sigma in zip(
            _NAMES[estimate.mount.type.kind], turns[-1].advised, done, sigmas, strict=True
        )
        if own * wanted < 0.0 and abs(own) > max(_CLEARLY * sigma, _WRONG_WAY * abs(wanted))
    )


def _misfit(estimate: AxisEstimate) -> tuple[str, ...]:
    """A sentence where the looks disagree by more than their standard deviations."""
    times = estimate.disagreement
    if times == 1.0:
        return ()
    causes = "collimation, NP or flexure that no model takes out, play, or a witness that is worse than it says"
    return (f"the looks disagree by {times:.1f} times their σ, and the σ told are so much larger: {causes}",)


def _base(mount: Mount) -> Array:
    """Rows that take the horizon frame to the mount's base frame."""
    if mount.type is MountType.ALTAZ_FORK:
        return np.eye(3)
    return np.array([equatorial_to_horizon(tuple(axis), mount.latitude) for axis in np.eye(3)])


def _frame(mount: Mount) -> Array:
    """Columns are the axes of the mount in force, its model's tilt included, horizon frame."""
    return np.array(mount.frame).T


def _way(arcsec: float, positive: str, negative: str) -> str:
    return f"{angle_text(abs(arcsec))} {positive if arcsec >= 0.0 else negative}"
