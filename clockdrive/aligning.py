"""Putting axis 1 right, live: three stars, then a look after every turn of the knobs.

The telescope goes on tracking the last star while the knobs are turned. The star drifts out of the field then, and a
witness sees where the tube points by now; the readings of the axes are what they were. The terms of the pointing
model in force are taken as they are, but for index errors and tilt, which the stars tell.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from html import escape
from typing import Any

import numpy as np

from clockdrive.control import Steps
from clockdrive.errors import ClockdriveError, Refused
from clockdrive.observing import Observing
from clockdrive.run_report import pointing_run
from clockdrive.run_store import Observation, StoredRun
from clockdrive.session import Session
from clockdrive.witness import SkyWitness, WitnessError
from mounts.errors import DriveError
from pointing.errors import PointingError
from pointing.model.axis_tracking import FEWEST, AxisTracking, best_stars
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.polar_alignment import AxisTilt, PolarAlignment, angle_text
from pointing.model.run import PointingRun
from pointing.model.words import Pole
from pointing.mount import POSTURES
from pointing.run_plan import RunPlace, spread_places

_CANDIDATES = 40  # places of which the best are taken
_TRIES = 8  # places at most for the first three stars
_LASTS_S = 3600.0
_COLLIMATION: dict[MountKind, str] = {"equatorial": "CH", "altazimuth": "CA"}
_ASSUMED_ARCSEC = 180.0  # of collimation, for saying what it would do
_WORSE = 1.5  # times as far off as before: a knob went the wrong way
_FAILURES = (ClockdriveError, DriveError, PointingError)


@dataclass(frozen=True, eq=False)
class AlignmentState:
    """What is known of axis 1 after a look, and what to do.

    Parameters
    ----------
    tracking : AxisTracking
        All that the looks have told.
    advice : PolarAlignment or AxisTilt
        What to turn.
    field_east_arcsec, field_north_arcsec : float
        Where the star that is in the middle of the field now stands in it when the knobs are right.
    notes : tuple of str
        What was assumed, what to beware of.
    """

    tracking: AxisTracking
    advice: PolarAlignment | AxisTilt
    field_east_arcsec: float
    field_north_arcsec: float
    notes: tuple[str, ...] = ()

    @property
    def off_arcsec(self) -> float:
        """How far axis 1 is from where the advice leads it, on the sky."""
        return _off(self.advice)

    @property
    def text(self) -> str:
        """What to turn, how the star must move for it, and what to beware of."""
        east, north = self.field_east_arcsec, self.field_north_arcsec
        sides = (
            f"{angle_text(abs(east))} {'east' if east >= 0.0 else 'west'}",
            f"{angle_text(abs(north))} {'north' if north >= 0.0 else 'south'}",
        )
        moved = f"turn until what is in the middle of the field now stands {' and '.join(sides)} of it"
        first, second, *rest = self.advice.text.split("\n")
        return "\n".join((first, second, moved, *rest, *self.notes))

    @property
    def json(self) -> dict[str, Any]:
        """As `polar-align --json` has it."""
        registers = self.tracking.registers
        one, other = _angles(self.advice)
        names = ("raise", "east") if isinstance(self.advice, PolarAlignment) else ("north", "west")
        return {
            "ok": True,
            "stars": self.tracking.stars,
            "off_arcsec": self.off_arcsec,
            **{f"{name}_arcsec": angle[0] for name, angle in zip(names, (one, other), strict=True)},
            **{f"{name}_sigma_arcsec": angle[1] for name, angle in zip(names, (one, other), strict=True)},
            "field_east_arcsec": self.field_east_arcsec,
            "field_north_arcsec": self.field_north_arcsec,
            "mount_x_mas": round(registers.x_mas),
            "mount_y_mas": round(registers.y_mas),
            "advice": self.text.split("\n"),
        }

    def __repr__(self) -> str:
        return f"<AlignmentState: {angle_text(self.off_arcsec)} off>\n{self.text}"

    def _repr_html_(self) -> str:
        return "".join(f"<p>{escape(line)}</p>" for line in self.text.split("\n"))


class Aligning:
    """Aligns the telescope of a session.

    Parameters
    ----------
    session : Session
        Whose telescope.
    observing : Observing
        Visits stars.
    witness : SkyWitness
        Says where it points.
    pole : str
        To which a polar axis shall point.
    settle_s : float
        Before a look.
    """

    def __init__(
        self, session: Session, observing: Observing, witness: SkyWitness, pole: Pole, settle_s: float
    ) -> None:
        self._session = session
        self._observing = observing
        self._witness = witness
        self._pole = pole
        self._settle_s = settle_s
        self._place: RunPlace | None = None
        self.states: list[AlignmentState] = []

    def begin(self, report: Callable[[str], object]) -> Steps[AlignmentState]:
        """Look at three stars; the telescope stays on the last one.

        Raises
        ------
        Refused
            Not now, or too few stars were seen; says why.
        """
        session = self._session
        session.require_free()
        session.synchronised()
        seen: list[Observation] = []
        why = "nothing is reached"
        for place in self._places():
            try:
                found = yield from self._observing.visit(place, self._witness, self._settle_s)
            except _FAILURES as error:
                why = str(error)
                report(f"skipped: {why}")
            else:
                seen.append(found)
                self._place = place
                report(f"star {len(seen)} of {FEWEST} seen")
            if len(seen) == FEWEST:
                break
        else:
            session.stop()
            raise Refused(f"{len(seen)} of {FEWEST} stars were seen, the last time: {why}")
        run, sigma = self._run(*seen), max(each.sigma_arcsec for each in seen)
        model = session.planner.mount.model
        tracking = AxisTracking.of(run, sigma, model)
        return self._told(tracking, run, self._assumptions(run, model))

    def look(self) -> Steps[AlignmentState]:
        """Look at the star again, after the knobs were turned.

        Raises
        ------
        WitnessError
            The witness sees nothing, or something that cannot be; look again.
        Refused
            The alignment has not begun, or not now.
        """
        session = self._session
        if not self.states or self._place is None:
            raise Refused("the alignment has not begun: it looks at three stars first")
        if session.pursuit is None:
            seen = yield from self._observing.visit(self._place, self._witness, self._settle_s)
        else:
            name = session.pursuit.target.name
            seen = yield from self._observing.look(name, self._witness, self._settle_s)
        run = self._run(seen)
        before = self.states[-1]
        try:
            tracking = before.tracking.knobs_turned().seen(run, seen.sigma_arcsec)
        except PointingError as error:
            raise WitnessError(str(error)) from error
        return self._told(tracking, run, ())

    def _told(self, tracking: AxisTracking, run: PointingRun, notes: tuple[str, ...]) -> AlignmentState:
        advice = tracking.advice(self._pole, self._session.surroundings.air.weather)
        (one, _), (other, _) = _angles(advice)
        axes = float(run.axis1[-1]), float(run.axis2[-1])
        if self.states and _off(advice) > _WORSE * self.states[-1].off_arcsec + 3.0 * max(_sigmas(advice)):
            was, now = angle_text(self.states[-1].off_arcsec), angle_text(_off(advice))
            notes = (*notes, f"axis 1 is {now} off and was {was} before: did a knob go the other way?")
        state = AlignmentState(tracking, advice, *tracking.field_shift(*axes, one, other), notes)
        self.states.append(state)
        return state

    def _places(self) -> tuple[RunPlace, ...]:
        """The places to try, in the posture that has most of them: the best three, and others in their stead."""
        session = self._session
        planner = session.planner
        places = spread_places(planner, _CANDIDATES, session.clock.now(), _LASTS_S)
        places = max((tuple(place for place in places if place.posture == posture) for posture in POSTURES), key=len)
        bare = replace(planner.mount, model=None)
        axes = np.array([bare.axes(place.direction, place.posture) for place in places])
        kind, latitude = planner.mount.type.kind, planner.mount.latitude
        order = best_stars(kind, latitude, axes[:, 0], axes[:, 1], min(_TRIES, len(places)))[::-1]
        first, spare = list(order[:FEWEST])[::-1], order[FEWEST:]
        return tuple(places[i] for i in (*first, *spare))

    def _run(self, *seen: Observation) -> PointingRun:
        """Looks as fits read them, in the frame of the sky: whatever the mount's registers hold."""
        mount = self._session.planner.mount
        latitude_deg = math.degrees(mount.latitude)
        return pointing_run(StoredRun("", seen[-1].time or 0.0, mount.type.kind, latitude_deg, {}, (), seen))

    def _assumptions(self, run: PointingRun, model: PointingModel | None) -> tuple[str, ...]:
        """What the advice rests on, and by how much an error of collimation that nobody knows would spoil it."""
        name = _COLLIMATION[run.mount]
        if model is not None and name in model.arcsec:
            return (f"{name} and the other terms of the pointing model in force are taken as they are",)
        spoilt = AxisTracking.of(run, 1.0, PointingModel(run.mount, run.latitude, *_collimation(name, run.mount)))
        plain = AxisTracking.of(run, 1.0)
        apart = angle_text(math.dist(_turns(spoilt), _turns(plain)))
        said = f"no {name} is known: {angle_text(_ASSUMED_ARCSEC)} of collimation would change this by {apart}"
        return (f"{said}; `pointing-run` finds it, and `[mount] pointing_model` puts it in force",)


def _collimation(name: str, kind: MountKind) -> tuple[Any, tuple[float, ...]]:
    from pointing.model.terms import terms  # noqa: PLC0415 - seldom needed

    return terms([name], kind), (math.radians(_ASSUMED_ARCSEC / 3600.0),)


def _turns(tracking: AxisTracking) -> tuple[float, float]:
    (one, _), (other, _) = _angles(tracking.advice())
    return one, other


def _angles(advice: PolarAlignment | AxisTilt) -> tuple[tuple[float, float], tuple[float, float]]:
    """Both angles to turn with their standard deviations, arcseconds."""
    if isinstance(advice, PolarAlignment):
        return (
            (advice.raise_arcsec, advice.raise_sigma_arcsec),
            (advice.east_arcsec, advice.east_sigma_arcsec),
        )
    return (advice.north_arcsec, advice.north_sigma_arcsec), (advice.west_arcsec, advice.west_sigma_arcsec)


def _sigmas(advice: PolarAlignment | AxisTilt) -> tuple[float, float]:
    (_, one), (_, other) = _angles(advice)
    return one, other


def _off(advice: PolarAlignment | AxisTilt) -> float:
    """Of axis 1 from where it shall point, on the sky, arcseconds."""
    (one, _), (other, _) = _angles(advice)
    across = math.cos(math.radians(advice.latitude_deg)) if isinstance(advice, PolarAlignment) else 1.0
    return math.hypot(one, other * across)
