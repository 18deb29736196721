"""Taking a pointing run: place by place slew, settle, look, keep; whatever fails is skipped with its reason.

The telescope goes on tracking while a witness looks, which may take a minute. What a witness sees is taken for a
place of the moment of its exposure, where the counts are those of that moment too. A place that lies implausibly far
from where the telescope believes to point is not taken. What was skipped is tried once more at the end, for a cloud
passes.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from clockdrive.control import Steps
from clockdrive.corrections import DISPLACEMENTS, displacement
from clockdrive.errors import Refused
from clockdrive.failures import FAILURES
from clockdrive.run_store import Observation, PlacedStar, RunStore
from clockdrive.run_under_way import RunUnderWay
from clockdrive.session import Session
from clockdrive.slewing import Progress, Slewing
from clockdrive.witness import Sighting, SkyWitness, WitnessError, WitnessLeft
from mounts.errors import DriveError
from pointing.catalogue import bright_stars
from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.limits import separation
from pointing.run_plan import RunPlace
from pointing.targets import Star
from pointing.vectors import azimuth_altitude
from transports.errors import TransportError

T = TypeVar("T")
IMPLAUSIBLE_DEG = 5.0
"""Beyond which a place is not believed: a mount that is not aligned at all is off by less."""
_BLIND = 5  # places from the beginning, or from where it is resumed, without one sighting: the witness sees nothing
_STUCK = 3  # slews one after the other that failed: the telescope does not go
_LINK_PATIENCE_S = 600.0  # for a link that is lost; nothing is skipped meanwhile


@dataclass(frozen=True)
class RunProgress:
    """One place that was visited, or is about to be.

    Parameters
    ----------
    number, of : int
        Which place, and how many there are.
    place : RunPlace
        Where.
    state : str
        `slewing`, `looking`, `observed` or `skipped`.
    detail : str
        How far off it was seen, or why it was skipped.
    observed, skipped : int
        How many places so far.
    run : str
        Of which run.
    minutes_left : float or None
        For the places that are still to be visited, by those so far; None before the first one.
    """

    number: int
    of: int
    place: RunPlace
    state: str
    detail: str
    observed: int
    skipped: int
    run: str = ""
    minutes_left: float | None = None


Watch = Callable[[RunProgress], object]


class _WatchFailed(Exception):  # noqa: N818 - what happened
    """Whoever watches has had enough, or stopped the telescope: no failure of a place."""

    def __init__(self, why: BaseException) -> None:
        super().__init__(str(why))
        self.why = why


class Observing:
    """Takes pointing runs with the telescope of a session.

    Parameters
    ----------
    session : Session
        Whose telescope.
    slewing : Slewing
        Moves it.
    store : RunStore
        Keeps what was seen.
    """

    def __init__(self, session: Session, slewing: Slewing, store: RunStore) -> None:
        self._session = session
        self._slewing = slewing
        self._store = store

    def run(self, name: str, witness: SkyWitness, settle_s: float, watch: Watch) -> Steps[None]:
        """Visit all places of a run that are not visited yet; the telescope rests afterwards.

        Raises
        ------
        Refused
            Not now; the telescope does not go or the witness sees nothing. What was seen is kept: resume it then.
        """
        session = self._session
        session.require_free()
        session.synchronised()
        try:
            with self._store.taking(name):
                yield from self._visit_all(RunUnderWay(self._store, name), witness, settle_s, watch)
        except _WatchFailed as ended:
            raise ended.why from None
        finally:
            self._rest()

    def _visit_all(self, run: RunUnderWay, witness: SkyWitness, settle_s: float, watch: Watch) -> Steps[None]:
        stuck, began = 0, self._session.clock.now()
        while (placed := run.next()) is not None:
            tell = partial(self._tell, run, placed, began, watch)
            try:
                tell("slewing", "")
                seen = yield from self.visit(placed.place, witness, settle_s, partial(tell, "looking", ""))
            except WitnessLeft as error:
                raise Refused(f"{error}: what was seen is kept, `pointing-run resume {run.name}` goes on") from error
            except FAILURES as error:
                self._session.forget_target()
                stuck = 0 if isinstance(error, WitnessError | PointingError) else stuck + 1
                yield from self._meanwhile(run.skipped(placed, str(error)))
                tell("skipped", str(error))
                yield from self._link_back(run.name)
                _require_going(run, stuck, str(error))
            else:
                stuck = 0
                yield from self._meanwhile(run.observed(placed, seen))
                tell("observed", self._off(seen))

    def _rest(self) -> None:
        """Leave the telescope at rest, whatever has ended the run; where that fails, every cycle tries again."""
        if self._session.doing == "tracking":
            with suppress(DriveError, TransportError):
                self._session.stop()

    def _link_back(self, name: str) -> Steps[None]:
        """Wait for a drive that does not answer.

        Raises
        ------
        Refused
            It does not come back; the run can be resumed.
        """
        session = self._session
        since = session.clock.now()
        while session.link_lost_since is not None:
            if session.clock.now() - since > _LINK_PATIENCE_S:
                raise Refused(
                    f"the drive has not answered for {_LINK_PATIENCE_S:.0f} s: check its link; "
                    f"`pointing-run resume {name}` goes on from here"
                )
            yield session.cycle()

    def _meanwhile(self, steps: Steps[None]) -> Steps[None]:
        """Write what is known of a place; the telescope goes on as it is, and is looked after."""
        while True:
            try:
                wait = next(steps)
            except StopIteration:
                return
            due = self._session.clock.now() + wait
            while (left := due - self._session.clock.now()) > 0.0:
                yield min(left, self._session.cycle())

    def visit(
        self, place: RunPlace, witness: SkyWitness, settle_s: float, arrived: Callable[[], object] = lambda: None
    ) -> Steps[Observation]:
        """Go to a place, tell that it `arrived`, settle, and look.

        Raises
        ------
        WitnessError
            The witness sees nothing, or something that cannot be.
        Refused, Unreachable, DriveError
            As for any slew.
        """
        self._session.forget_target()
        target = self._met(place, settle_s)
        yield from self._slewing.goto(target, _nobody, posture=place.posture)
        arrived()
        return (yield from self.look(target.name, witness, settle_s))

    def look(self, name: str, witness: SkyWitness, settle_s: float) -> Steps[Observation]:
        """Look at what is tracked, of a name.

        Raises
        ------
        WitnessError, Refused
            As for `visit`.
        """
        session = self._session
        yield from self._tracked(_pause(settle_s))
        sighting = yield from self._tracked(_looked(witness))
        session.poll()  # so that there is a reading after the exposure
        counts = self._counts(sighting.time)
        off = math.degrees(separation(session.planner.observed(counts), sighting.observed))
        if not off <= IMPLAUSIBLE_DEG:
            raise WitnessError(
                f"the witness saw it {off:.1f}° from where the telescope believes to point, at most "
                f"{IMPLAUSIBLE_DEG:g}° are believed: check the witness, the clock and the site, or `sync`"
            )
        return self._observation(name, counts, sighting)

    def tried(self, witness: SkyWitness) -> Steps[dict[str, Any]]:
        """Let a witness look where the telescope rests; nothing moves and nothing is kept.

        Returns
        -------
        dict
            Where it was seen, how well, and how far that is from where the telescope believes to point.

        Raises
        ------
        Refused
            The telescope moves or tracks, or does not know where it points.
        WitnessError
            The witness sees nothing.
        """
        session = self._session
        session.require_free(parked=True)
        if session.pursuit is not None:
            raise Refused("the telescope tracks, and a witness is tried where it rests: `stop` first")
        believed = session.planner.observed(session.synchronised().counts)
        seen: list[Sighting] = []

        def noted() -> Steps[None]:
            seen.append((yield from _looked(witness)))

        yield from self._meanwhile(noted())
        azimuth, altitude = azimuth_altitude(seen[0].observed)
        return {
            "ok": True,
            "azimuth_deg": math.degrees(azimuth) % 360.0,
            "altitude_deg": math.degrees(altitude),
            "sigma_arcsec": seen[0].sigma_arcsec,
            "off_arcsec": math.degrees(separation(believed, seen[0].observed)) * 3600.0,
        }

    def _counts(self, time: float) -> tuple[float, float]:
        """Where the axes were at the moment of an exposure.

        Raises
        ------
        WitnessError
            It is not known: the witness tells another time.
        """
        try:
            return self._session.history.counts(time)
        except Refused as error:
            raise WitnessError(f"the time of the exposure is of no use: {error}") from error

    def _met(self, place: RunPlace, settle_s: float) -> Star:
        """The star that stands at a place when one looks: so a place is seen the same way whenever that is.

        Raises
        ------
        Unreachable
            Nothing allowed leads there now.
        """
        session = self._session
        arrival = session.plan(self.target(place, session.clock.now()), place.posture).arrival
        return self.target(place, arrival + settle_s)

    def target(self, place: RunPlace, time: float) -> Star:
        """The star of a place: the one of its name, else whatever stands there at a time."""
        named = next((star for star in bright_stars() if star.name == place.name), None)
        if named is not None:
            return named
        frame = self._session.planner.sky.at(Instant.from_posix(time))
        x, y, z = frame.astrometric(place.direction)
        azimuth, altitude = math.degrees(place.azimuth) % 360.0, math.degrees(place.altitude)
        name = f"the sky at azimuth {azimuth:.1f}°, altitude {altitude:.1f}°"
        return Star.from_degrees(math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.asin(z)), name)

    def _tracked(self, steps: Steps[T]) -> Steps[T]:
        """Go on tracking while something else takes its steps."""
        session = self._session
        due = wake = session.clock.now()
        try:
            while True:
                if session.clock.now() >= wake:
                    try:
                        wake = session.clock.now() + next(steps)
                    except StopIteration as done:
                        value: T = done.value
                        return value
                if session.clock.now() >= due:
                    session.poll()
                    due = session.clock.now() + session.follow()
                yield max(0.0, min(wake, due) - session.clock.now())
        finally:
            steps.close()

    def _observation(self, target: str, counts: tuple[float, float], sighting: Sighting) -> Observation:
        session, planner = self._session, self._session.planner
        axis1, axis2 = planner.angles(counts)
        azimuth, altitude = azimuth_altitude(sighting.observed)
        return Observation(
            time=sighting.time,
            counts=counts,
            axes_deg=(math.degrees(axis1), math.degrees(axis2)),
            posture=planner.mount.posture(axis2),
            azimuth_deg=math.degrees(azimuth) % 360.0,
            altitude_deg=math.degrees(altitude),
            sigma_arcsec=sighting.sigma_arcsec,
            target=target,
            weather=session.surroundings.air.weather.as_dict(),
            in_force=self._in_force(),
        )

    def _in_force(self) -> dict[str, Any]:
        """Everything that stood between the target and the counts."""
        mount, store = self._session.planner.mount, self._session.store
        east, north = displacement(store.corrections(), DISPLACEMENTS)
        return {
            "mount_x_deg": math.degrees(mount.x),
            "mount_y_deg": math.degrees(mount.y),
            "pointing_model_arcsec": None if mount.model is None else mount.model.arcsec,
            "offset_east_arcsec": east,
            "offset_north_arcsec": north,
            "zero": vars(store.zero()),
        }

    def _off(self, seen: Observation) -> str:
        """How far from its place a star was seen, by what is in force now."""
        planner = self._session.planner
        axis1, axis2 = (math.radians(angle) for angle in seen.axes_deg)
        there = RunPlace(math.radians(seen.azimuth_deg), math.radians(seen.altitude_deg), seen.posture).direction
        off = math.degrees(separation(planner.mount.observed(axis1, axis2), there)) * 3600.0
        return f"{off:.1f}″ from where it was sent"

    def _tell(
        self, run: RunUnderWay, placed: PlacedStar, began: float, watch: Watch, state: str, detail: str
    ) -> None:
        seen, skipped, visited = run.count("observed"), run.count("skipped"), run.seen + run.blind
        each_min = (self._session.clock.now() - began) / 60.0 / visited if visited else None
        left = None if each_min is None else each_min * run.count("planned")
        try:
            watch(RunProgress(placed.number, run.of, placed.place, state, detail, seen, skipped, run.name, left))
        except Exception as error:
            raise _WatchFailed(error) from error


def _require_going(run: RunUnderWay, stuck: int, why: str) -> None:
    """Refuse to go on with a telescope that does not go, or a witness that sees nothing.

    Raises
    ------
    Refused
        So it is.
    """
    resume = f"`pointing-run resume {run.name}` goes on from here"
    if stuck >= _STUCK:
        raise Refused(f"{stuck} slews one after the other failed, the last one: {why}. Find its cause; {resume}")
    if not run.seen and run.blind == _BLIND:
        raise Refused(f"nothing was seen at the first {_BLIND} places, the last time: {why}. {resume}")


def _looked(witness: SkyWitness) -> Steps[Sighting]:
    """Look; what a witness of one's own fails with is one of its failures, too."""
    try:
        return (yield from witness.look())
    except FAILURES:
        raise
    except Exception as error:
        raise WitnessError(f"the witness failed: {error!r}") from error


def _pause(seconds: float) -> Steps[None]:
    yield seconds


def _nobody(progress: Progress) -> None:
    """Nobody watches a single slew."""
