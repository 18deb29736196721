"""Putting axis 1 right, live: three stars, then a look after every turn of the knobs.

The telescope goes on tracking the last star while the knobs are turned. The star drifts out of the field then, and a
witness sees where the tube points by now; the readings of the axes are what they were. The terms of the pointing
model in force are taken as they are, but for index errors and tilt, which the stars tell.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from clockdrive.control import Steps
from clockdrive.errors import InputError, Refused
from clockdrive.failures import FAILURES
from clockdrive.observing import Observing
from clockdrive.run_store import Observation
from clockdrive.session import Session
from clockdrive.witness import SkyWitness, WitnessError, WitnessLeft
from pointing.axis_advice import (
    COLLIMATION_ARCSEC,
    AxisAdvice,
    advise,
    harm_of_collimation,
    registers_of,
    turns_of,
)
from pointing.axis_estimate import FEWEST, AxisEstimate, Look
from pointing.axis_places import CANDIDATES, telling_places
from pointing.errors import PointingError
from pointing.model.place import MountKind
from pointing.model.polar_alignment import PolarAlignment, angle_text
from pointing.model.words import POLES, Pole
from pointing.run_plan import RunPlace, spread_places
from pointing.vectors import from_azimuth_altitude

_TRIES = 8  # places at most for the first three stars
_BLIND = 3  # of them without one sighting: the witness does not work
_TRIES_ANOTHER = 3  # for one more
_LASTS_S = 3600.0
_WITNESS_ARCSEC = 1.0  # taken for what a witness scatters before one has spoken; only the order of places rests on it
_ARCSEC = math.radians(1.0 / 3600.0)
_COLLIMATION: dict[MountKind, str] = {"equatorial": "CH", "altazimuth": "CA"}
_ANOTHER_TURN = (
    "the knobs were turned by quite another angle than was advised: if they were not, the witness saw another field; "
    "begin anew then"
)


@dataclass(frozen=True)
class AlignmentSettings:
    """How to align.

    Parameters
    ----------
    pole : {"true", "refracted"}
        To which a polar axis shall point.
    goal_arcsec : float
        How near is near enough.
    scatter_arcsec : float
        What a look scatters beyond what its witness says, on the sky: periodic error, flexure without a model.
    settle_s : float
        Before a look.

    Raises
    ------
    InputError
        One of them is impossible; nothing has moved.
    """

    pole: Pole = "true"
    goal_arcsec: float = 20.0
    scatter_arcsec: float = 1.0
    settle_s: float = 1.0

    def __post_init__(self) -> None:
        if self.pole not in POLES:
            raise InputError(f"there is no pole {self.pole!r}: possible are {' and '.join(POLES)}")
        if not self.goal_arcsec > 0.0:
            raise InputError(f"a goal of {self.goal_arcsec:g}″: give a number above 0, as 20")
        if min(self.scatter_arcsec, self.settle_s) < 0.0:
            raise InputError(f"a scatter of {self.scatter_arcsec:g}″, settling for {self.settle_s:g} s: from 0 on")


@dataclass(frozen=True, eq=False)
class AlignmentState:
    """What is known of axis 1 after a look, and what to do.

    Parameters
    ----------
    estimate : AxisEstimate
        All that the looks have told.
    advice : AxisAdvice
        What to turn, and whether.
    notes : tuple of str
        What was assumed, what to beware of.
    """

    estimate: AxisEstimate
    advice: AxisAdvice
    notes: tuple[str, ...] = ()

    @property
    def off_arcsec(self) -> float:
        """How far axis 1 is from where the advice leads it, on the sky."""
        return self.advice.off_arcsec

    @property
    def text(self) -> str:
        """What to turn, how the star must move for it, and what to beware of."""
        return "\n".join((self.advice.text, *self.notes))

    @property
    def json(self) -> dict[str, Any]:
        """As `polar-align --json` has it."""
        advice, knobs = self.advice, self.advice.knobs
        names = ("raise", "east") if isinstance(knobs, PolarAlignment) else ("north", "west")
        angles = {f"{each}_arcsec": getattr(knobs, f"{each}_arcsec") for each in names}
        sigmas = {f"{each}_sigma_arcsec": getattr(knobs, f"{each}_sigma_arcsec") for each in names}
        registers = registers_of(self.estimate)
        return {
            "ok": True,
            "step": advice.step,
            "looks": len(self.estimate.looks),
            "turns": self.estimate.turns,
            "off_arcsec": advice.off_arcsec,
            "sigma_arcsec": advice.sigma_arcsec,
            **angles,
            **sigmas,
            "field": {name: getattr(advice.move, name) for name in vars(advice.move)},
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
    settings : AlignmentSettings
        How.
    """

    def __init__(
        self, session: Session, observing: Observing, witness: SkyWitness, settings: AlignmentSettings
    ) -> None:
        self._session = session
        self._observing = observing
        self._witness = witness
        self._settings = settings
        self._place: RunPlace | None = None
        self._visited: list[RunPlace] = []
        self._estimate = AxisEstimate(session.planner.mount)
        self._synchronised = self._last_sync()
        self.states: list[AlignmentState] = []
        self._turn_unseen = False
        self._refusals = 0  # looks that did not belong, one after the other

    def anew(self) -> "Aligning":
        """The same alignment before its first star."""
        return Aligning(self._session, self._observing, self._witness, self._settings)

    @property
    def doubt(self) -> str:
        """Why the advice may not be that of now; empty where it is."""
        if self._refusals:
            return f"the last look was not taken: this advice is from before it; {self._way_on}"
        if self._turn_unseen:
            return "the knobs were turned, and no look was taken since: this advice is from before that; look again"
        return ""

    @property
    def _way_on(self) -> str:
        return "begin anew (`n`, `alignment.anew()`)" if self._refusals > 1 else "look again"

    def begin(self, report: Callable[[str], object]) -> Steps[AlignmentState]:
        """Look at three stars; the telescope stays on the last one, and rests where that fails.

        Raises
        ------
        Refused
            Not now, or too few stars were seen; says why.
        """
        self._session.require_free()
        self._session.synchronised()
        try:
            return (yield from self._three_stars(report))
        except BaseException:
            if self._session.pursuit is not None:
                self._session.stop()
            raise

    def _three_stars(self, report: Callable[[str], object]) -> Steps[AlignmentState]:
        estimate, left = self._estimate, _TRIES
        why = "nothing is reached"
        while len(estimate.looks) < FEWEST and left > (0 if estimate.looks else _TRIES - _BLIND):
            for place in self._telling(estimate, FEWEST - len(estimate.looks)):
                left -= 1
                try:
                    seen = yield from self._visit(place)
                    estimate = estimate.looked(self._look_of(seen))
                except WitnessLeft:
                    raise
                except FAILURES as error:
                    why = str(error)
                    report(f"skipped: {why}")
                    break
                report(f"star {len(estimate.looks)} of {FEWEST} seen")
        if len(estimate.looks) < FEWEST:
            raise Refused(f"{len(estimate.looks)} of {FEWEST} stars were seen, the last time: {why}")
        return self._told(estimate, self._assumptions(estimate))

    def look(self, report: Callable[[str], object], *, turned: bool, another: bool) -> Steps[AlignmentState]:
        """Look at the star again after the knobs were turned, or at another one.

        Parameters
        ----------
        report : callable
            Told of a star that was skipped.
        turned : bool
            Whether the knobs were turned since the last look.
        another : bool
            Look at the star that tells most, not at the last one.

        Raises
        ------
        WitnessError
            The witness sees nothing, or something that cannot be; what is known is as before.
        Refused
            The alignment has not begun, what it rests on has changed, or not now.
        """
        self._require_same()
        self._turn_unseen = self._turn_unseen or turned
        before = self._estimate
        if self._turn_unseen:
            before = before.turned(turns_of(self.states[-1].advice.knobs))
        if another:
            seen = yield from self._another(before, report)
        elif self._session.pursuit is None:
            seen = yield from self._visit(self._place or self._visited[-1])
        else:
            name = self._session.pursuit.target.name
            seen = yield from self._observing.look(name, self._witness, self._settings.settle_s)
        estimate, notes = self._learned(before, seen)
        self._turn_unseen, self._refusals = False, 0
        return self._told(estimate, notes)

    @property
    def registers(self) -> tuple[int, int]:
        """`mount_x_mas` and `mount_y_mas` that hold the lean of axis 1 as it is.

        Raises
        ------
        Refused
            The alignment has not begun, or what it rests on has changed; the last look was not taken.
        """
        self._require_same()
        if self.doubt:
            raise Refused(self.doubt)
        found = registers_of(self._estimate)
        return round(found.x_mas), round(found.y_mas)

    def _require_same(self) -> None:
        if not self.states:
            raise Refused("the alignment has not begun: it looks at three stars first")
        if self._session.planner.mount != self._estimate.mount:
            raise Refused("the pointing model, the mount's registers or the instrument were changed: begin anew")
        if self._last_sync() != self._synchronised:
            raise Refused("the telescope was synchronised, so its readings mean something else now: begin anew")

    def _last_sync(self) -> float | None:
        known = self._session.store.synchronisations(1)
        return known[0].time if known else None

    def _telling(self, estimate: AxisEstimate, n: int) -> Sequence[RunPlace]:
        """The places that tell most, of those where the telescope was not yet."""
        session = self._session
        try:
            places = spread_places(session.planner, CANDIDATES, session.clock.now(), _LASTS_S)
        except PointingError as error:
            raise Refused(
                f"the telescope reaches too little of the sky for {FEWEST} stars that tell axis 1: see `[limits]`, "
                "`[axis1]` and `[axis2]`, or align while the Sun is elsewhere"
            ) from error
        side = {self._place.posture} if self._place is not None else {each.posture for each in places}
        left = [each for each in places if each.posture in side and each not in self._visited]
        sigma = math.hypot(self._settings.scatter_arcsec, _WITNESS_ARCSEC)
        return telling_places(session.planner, left, estimate, n, sigma * _ARCSEC)

    def _visit(self, place: RunPlace) -> Steps[Observation]:
        self._visited.append(place)
        seen = yield from self._observing.visit(place, self._witness, self._settings.settle_s)
        self._place = place
        return seen

    def _another(self, estimate: AxisEstimate, report: Callable[[str], object]) -> Steps[Observation]:
        left = _TRIES_ANOTHER
        while True:
            (place,) = self._telling(estimate, 1)
            try:
                return (yield from self._visit(place))
            except WitnessLeft:
                raise
            except FAILURES as error:
                report(f"skipped: {error}")
                left -= 1
                if not left:
                    raise

    def _learned(self, estimate: AxisEstimate, seen: Observation) -> tuple[AxisEstimate, tuple[str, ...]]:
        """Learn from what was seen; return what is known, and what to beware of.

        Raises
        ------
        WitnessError
            It cannot be.
        """
        look = self._look_of(seen)
        if estimate.belongs(look):
            return estimate.looked(look), ()
        if self._turn_unseen:
            free = self._estimate.turned((0.0, 0.0), free=True)
            if free.belongs(look):
                return free.looked(look), (_ANOTHER_TURN,)
        self._refusals += 1
        sigmas = math.sqrt(estimate.strangeness(look))
        raise WitnessError(
            f"the look is {sigmas:.0f} standard deviations from where the mount can point, and was not taken: it "
            "saw another field, or something but the knobs has moved; after a turn say that they were turned, where "
            f"looks scatter give more with --scatter, or {self._way_on}"
        )

    def _look_of(self, seen: Observation) -> Look:
        axis1, axis2 = (math.radians(angle) for angle in seen.axes_deg)
        direction = from_azimuth_altitude(math.radians(seen.azimuth_deg), math.radians(seen.altitude_deg))
        on_the_sky = math.hypot(seen.sigma_arcsec, self._settings.scatter_arcsec)
        return Look(axis1, axis2, direction, on_the_sky * _ARCSEC / math.sqrt(2.0))

    def _told(self, estimate: AxisEstimate, notes: tuple[str, ...]) -> AlignmentState:
        settings, air = self._settings, self._session.surroundings.air.weather
        advice = advise(estimate, settings.goal_arcsec, settings.pole, air)
        state = AlignmentState(estimate, advice, notes)
        self._estimate = estimate
        self.states.append(state)
        return state

    def _assumptions(self, estimate: AxisEstimate) -> tuple[str, ...]:
        """What the advice rests on, and by how much an error of collimation that nobody knows would spoil it."""
        mount = estimate.mount
        name, model = _COLLIMATION[mount.type.kind], mount.model
        if model is not None and name in model.arcsec:
            return (f"{name} and the other terms of the pointing model in force are taken as they are",)
        apart = angle_text(harm_of_collimation(estimate))
        unknown = f"no {name} is known: {angle_text(COLLIMATION_ARCSEC)}"
        said = f"{unknown} of collimation would put axis 1 {apart} elsewhere"
        return (f"{said}; `pointing-run` finds it, and `[mount] pointing_model` puts it in force",)
