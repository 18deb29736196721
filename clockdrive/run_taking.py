"""How a pointing run begins: a new one, one that was interrupted, or more stars for one that was taken."""

import math
from collections.abc import Iterable

from clockdrive.answers import utc
from clockdrive.errors import InputError, Refused
from clockdrive.observing import Observing
from clockdrive.pointing_runs import PointingRuns
from clockdrive.run_store import PlacedStar, StoredRun
from clockdrive.session import Session
from clockdrive.slewing import Slewing
from pointing.catalogue import bright_stars
from pointing.run_plan import RunPlace, short_way, spread_places, star_places

_EACH_S = 90.0  # that a place may take, for how far the Sun gets on


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

    def begun(self, stars: int, name: str | None, *, witness: str, resume: bool, append: bool, bright: bool) -> str:
        """Begin or find a run; return its name.

        Raises
        ------
        Refused
            The telescope cannot begin now, or puts targets beside the tube's axis.
        InputError, PointingError
            The name is taken, or there is none of it; so many stars cannot be had.
        """
        session, store = self._session, self._runs.store
        if resume and append:
            raise InputError("resume or append: a run that was interrupted is resumed, one that is done appended to")
        session.require_free()
        session.synchronised()
        if session.planner.mount.origin_distance:
            off = math.degrees(session.planner.mount.origin_distance)
            raise Refused(f"targets are put {off:.3f}° beside the tube's axis: choose an instrument at 0, 0 first")
        if resume:
            return store.read(name).name
        if append:
            found = store.read(name)
            store.append(found.name, self._places(stars, bright=bright, other=len(found.places)))
            return found.name
        places = self._places(stars, bright=bright)
        now, mount = session.clock.now(), session.planner.mount
        name = name or utc(now)[:19]
        settings = {"stars": stars, "witness": witness, "bright": bright}
        placed = tuple(_placed(places))
        store.begin(StoredRun(name, now, mount.type.kind, math.degrees(mount.latitude), settings, placed, ()))
        return name

    def _places(self, stars: int, *, bright: bool, other: int = 0) -> tuple[RunPlace, ...]:
        session = self._session
        planner, now = session.planner, session.clock.now()
        lasts = stars * _EACH_S
        places = (
            star_places(planner, stars, now, lasts, bright_stars(), other)
            if bright
            else spread_places(planner, stars, now, lasts, other)
        )
        one, two = (
            model.max_rate / abs(axis.gearing.counts_per_radian)
            for model, axis in zip(session.timing().slew, planner.axes, strict=True)
        )
        return short_way(planner, places, planner.angles(session.start().counts), (one, two))


def _placed(places: Iterable[RunPlace]) -> Iterable[PlacedStar]:
    return (PlacedStar(number, place) for number, place in enumerate(places, start=1))
