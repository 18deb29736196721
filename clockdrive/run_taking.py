"""How a pointing run begins: a new one, one that was interrupted, or more stars for one that was taken."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral

from clockdrive.errors import ArgumentError, InputError, Refused
from clockdrive.observing import Observing
from clockdrive.pointing_runs import PointingRuns
from clockdrive.run_store import PlacedStar, StoredRun, named
from clockdrive.session import Session
from clockdrive.slewing import Slewing
from clockdrive.utc import utc
from pointing.catalogue import bright_stars
from pointing.run_plan import MOST_PLACES, RunPlace, short_way, spread_places, star_places

_EACH_S = 90.0  # that a place may take, for how far the Sun gets on


_LONGEST_SETTLING_S = 600.0
_SAME_DEG = 1.0 / 3600.0  # of latitudes: what the tilt of the axis differs by


@dataclass(frozen=True)
class RunSettings:
    """What run to take.

    Parameters
    ----------
    stars : int
        How many; not asked for a run that is resumed.
    name : str, optional
        Of the run; by default the moment at which it begins, or the newest to resume or append to.
    resume, append : bool
        Go on with a run that was interrupted; add stars to a run.
    bright : bool
        Go to bright stars, not to places of the sky.
    settle_s : float
        Between the arrival and the look.

    Raises
    ------
    InputError
        One of them is impossible; nothing has moved.
    """

    stars: int = 50
    name: str | None = None
    resume: bool = False
    append: bool = False
    bright: bool = False
    settle_s: float = 1.0

    def __post_init__(self) -> None:
        if self.name is not None:
            named(self.name)
        if not isinstance(self.stars, Integral) or isinstance(self.stars, bool) or not 1 <= self.stars <= MOST_PLACES:
            raise ArgumentError(f"a run of {self.stars!r} stars: give a whole number from 1 to {MOST_PLACES}")
        if self.resume and self.append:
            raise InputError("resume or append: a run that was interrupted is resumed, one that is done appended to")
        if not 0.0 <= self.settle_s <= _LONGEST_SETTLING_S:
            raise InputError(f"settling for {self.settle_s:g} s: give 0 to {_LONGEST_SETTLING_S:.0f}")


class RunTaking:
    """Begins pointing runs.

    Parameters
    ----------
    session : Session
        Whose telescope.
    slewing : Slewing
        Moves it.
    runs : PointingRuns
        Where runs are kept.
    """

    def __init__(self, session: Session, slewing: Slewing, runs: PointingRuns) -> None:
        self._session = session
        self._runs = runs
        self.observing = Observing(session, slewing, runs.store)

    def begun(self, wanted: RunSettings, witness: str) -> str:
        """Begin or find a run; return its name.

        Raises
        ------
        Refused
            The telescope cannot begin now, or puts targets beside the tube's axis.
        InputError, PointingError
            The name is taken, or there is none of it; so many stars cannot be had.
        """
        session, store = self._session, self._runs.store
        session.require_free()
        session.synchronised()
        if session.planner.mount.origin_distance:
            off = math.degrees(session.planner.mount.origin_distance)
            raise Refused(f"targets are put {off:.3f}° beside the tube's axis: choose an instrument at 0, 0 first")
        if wanted.resume or wanted.append:
            found = store.read(wanted.name)
            self._require_same(found)
        if wanted.resume:
            return found.name
        if wanted.append:
            store.append(found.name, self._places(wanted, found.places))
            return found.name
        places = self._places(wanted)
        now, mount = session.clock.now(), session.planner.mount
        name = wanted.name or utc(now)[:19]
        settings = {"stars": wanted.stars, "witness": witness, "bright": wanted.bright, "mount_type": mount.type.text}
        placed = tuple(_placed(places))
        store.begin(StoredRun(name, now, mount.type.kind, math.degrees(mount.latitude), settings, placed, ()))
        return name

    def _require_same(self, run: StoredRun) -> None:
        """Refuse to go on with a run of another telescope under the same name.

        Raises
        ------
        Refused
            The site or the type of the mount is another.
        """
        mount = self._session.planner.mount
        begun, now = (run.settings.get("mount_type", mount.type.text), mount.type.text)
        if run.mount != mount.type.kind or begun != now:
            was = begun if begun != now else run.mount
            raise Refused(f"the run {run.name} is one of a mount {was}, this one is {now}: take a new run")
        here = math.degrees(mount.latitude)
        if abs(run.latitude_deg - here) > _SAME_DEG:
            raise Refused(
                f"the run {run.name} is of latitude {run.latitude_deg:.4f}°, the telescope stands at {here:.4f}°: "
                "take a new run, or correct [site] latitude_deg"
            )

    def _places(self, wanted: RunSettings, before: Sequence[PlacedStar] = ()) -> tuple[RunPlace, ...]:
        session = self._session
        planner, now = session.planner, session.clock.now()
        lasts, other = wanted.stars * _EACH_S, len(before)
        taken = [each.place.name for each in before]
        places = (
            star_places(planner, wanted.stars, now, lasts, bright_stars(), other, taken)
            if wanted.bright
            else spread_places(planner, wanted.stars, now, lasts, other)
        )
        one, two = (
            model.max_rate / abs(axis.gearing.counts_per_radian)
            for model, axis in zip(session.timing().slew, planner.axes, strict=True)
        )
        return short_way(planner, places, planner.angles(session.start().counts), (one, two))


def _placed(places: Iterable[RunPlace]) -> Iterable[PlacedStar]:
    return (PlacedStar(number, place) for number, place in enumerate(places, start=1))
