"""Centring: what an image says of where the telescope pointed is taken into the place of the target, once.

The *pointing error* is where the counts said that the telescope pointed, minus where the image says that it did, both
as observed places of the pointing origin at the middle of the exposure. It does not depend on what the telescope was
sent to: neither offsets nor pulses nor an earlier centring are in it. The target, with the person's offset, is
carried by the rotation that carries the place of the image to the place of the counts. That is where the counts must
say it points so that it truly points at the target. The correction is what this differs from the target by, less the
offset; it replaces the centring before, and guide pulses, which corrected the same error, are cleared.

So one solution used twice, or a second one after the telescope has moved, gives the same correction again. What is
left is by how much the pointing error itself changes over the way of the correction: about its square.
"""

import math
from dataclasses import dataclass

from clockdrive.control import Steps
from clockdrive.corrections import CENTRE, GUIDE, OFFSETS
from clockdrive.displacing import Changes, displace, displaced, require_pursuit, values_of, write
from clockdrive.errors import Refused
from clockdrive.session import Session
from clockdrive.slewing import Report, Slewing
from clockdrive.state import Correction
from clockdrive.utc import utc
from pointing.instant import Instant
from pointing.limits import separation
from pointing.offset import carried, offset_between
from pointing.targets import ARCSEC, Star, Target

_LARGEST_DEG = 5.0  # a pointing error beyond this asks for confirmation
_LARGEST_FORCED_DEG = 90.0
_SLEWN_ARCSEC = 60.0  # tracking closes less by itself; for more the way is checked, as that of any slew


@dataclass(frozen=True)
class Centred:
    """What an image told.

    Parameters
    ----------
    target : str
        What is tracked.
    exposure : float
        The moment of the image, POSIX seconds.
    error : tuple of float
        Where the counts said that the telescope pointed, minus where the image says, arcseconds east and north.
    centre : tuple of float
        The correction in force since, likewise.
    moved_arcsec : float
        By how much the target was moved for it.
    slewed : bool
        Whether that took a slew.
    cleared : tuple of float
        The sum of the guide pulses that it took in and cleared, arcseconds east and north.
    """

    target: str
    exposure: float
    error: tuple[float, float]
    centre: tuple[float, float]
    moved_arcsec: float
    slewed: bool
    cleared: tuple[float, float] = (0.0, 0.0)


class Centring:
    """Centres what the telescope of a session tracks.

    Parameters
    ----------
    session : Session
        Whose target is displaced.
    slewing : Slewing
        Goes the longer ways.
    """

    def __init__(self, session: Session, slewing: Slewing) -> None:
        self._session = session
        self._slewing = slewing

    def centre(self, seen: Target, exposure: float | None, report: Report, *, force: bool) -> Steps[Centred]:
        """Take in where an image says that the pointing origin in force pointed.

        Parameters
        ----------
        seen : Target
            The place of the image that is on the pointing origin, ICRS.
        exposure : float or None
            Middle of the exposure, POSIX seconds; None for now.
        report : callable
            Told of a slew's progress.
        force : bool
            Accept a pointing error beyond 5°.

        Raises
        ------
        Refused
            Nothing is tracked; the moment is not covered by readings of this target and this position; or the
            pointing error is beyond 5°.
        Unreachable
            Nothing allowed leads to where the target would be.
        """
        session = self._session
        if not isinstance(seen, Star):
            raise Refused(f"{seen.name} is no place of an image: give right ascension and declination, ICRS")
        require_pursuit(session, "centring")
        session.poll()
        target = require_pursuit(session, "centring")
        moment = session.synchronised().time if exposure is None else exposure
        if moment < session.wanted_since:
            since = f"{target.name} is tracked since {utc(session.wanted_since)}"
            raise Refused(f"the image of {utc(moment)} is of another target: {since}; take another")
        pulses = values_of(session, GUIDE)
        error, centre = self._found(seen, target, moment, force=force)
        origin, now = f"image of {utc(moment)} on {target.name}", session.clock.now()
        changes: Changes = {
            **dict.fromkeys(GUIDE),
            **{
                name: Correction(name, value, "arcsec", origin, now)
                for name, value in zip(CENTRE, centre, strict=True)
            },
        }
        moved = self._way_arcsec(changes)
        slewed = moved > _SLEWN_ARCSEC
        if slewed:
            yield from self._slew(target, changes, report)
        else:
            displace(session, changes)
        ended = f"; guide pulses of {_told(pulses)} cleared" if any(pulses) else ""
        said = f"{target.name}: the counts stood {_told(error)} of the image; moved by {moved:.1f}″{ended}"
        session.note("centre", said)
        return Centred(target.name, moment, error, centre, moved, slewed, pulses)

    def _found(
        self, seen: Target, target: Target, moment: float, *, force: bool
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """The pointing error and the correction, arcseconds east and north; see the head of the module."""
        session, planner = self._session, self._session.planner
        said = planner.observed(session.history.counts(moment))
        frame = planner.sky.at(Instant.from_posix(moment))
        latitude = planner.sky.site.latitude
        truly = seen.observed(frame)
        off = math.degrees(separation(truly, said))
        if off > _LARGEST_FORCED_DEG or (off > _LARGEST_DEG and not force):
            remedy = "or say --force" if off <= _LARGEST_FORCED_DEG else "no force helps beyond 90°"
            raise Refused(
                f"the image is {off:.2f}° from where the telescope pointed, more than {_LARGEST_DEG:g}°: check the "
                f"solution, its time and the clock, {remedy}"
            )
        aim = carried(session.displaced(target).observed(frame), truly, said)
        east, north = offset_between(target.observed(frame), aim, latitude)
        offset_east, offset_north = values_of(session, OFFSETS)
        error_east, error_north = offset_between(truly, said, latitude)
        return (error_east / ARCSEC, error_north / ARCSEC), (
            east / ARCSEC - offset_east,
            north / ARCSEC - offset_north,
        )

    def _way_arcsec(self, changes: Changes) -> float:
        session = self._session
        frame = session.planner.sky.at(Instant.from_posix(session.clock.now()))
        after = displaced(session, changes)
        if session.pursuit is None or after is None:
            return 0.0
        return separation(session.pursuit.target.observed_with_rate(frame)[0], after.observed(frame)) / ARCSEC

    def _slew(self, target: Target, changes: Changes, report: Report) -> Steps[None]:
        """Go there as to any target; where nothing leads there, nothing has changed."""
        session = self._session
        there = displaced(session, changes)
        if there is not None:
            session.planner.plan(there, session.start(), session.timing())
        write(session, changes)
        yield from self._slewing.goto(target, report)


def _told(error: tuple[float, float]) -> str:
    (east, north), sides = error, ("east" if error[0] >= 0.0 else "west", "north" if error[1] >= 0.0 else "south")
    return f"{abs(east):.1f}″ {sides[0]}, {abs(north):.1f}″ {sides[1]}"
