"""What a person corrects: the position by `sync`, the place on the sky by offsets."""

import math
from contextlib import suppress

from clockdrive.corrections import CLEARED, DISPLACEMENTS, OFFSETS, SYNC
from clockdrive.displacing import displace, values_of
from clockdrive.errors import Refused
from clockdrive.pursuit import Pursuit
from clockdrive.session import Session
from clockdrive.state import Correction, Synchronisation
from mounts.drive import Reading
from pointing.mount import Posture
from pointing.targets import Target

_LARGEST_OFFSET_ARCSEC = 3600.0
_LARGEST_SYNC_DEG = 5.0  # a sync beyond this asks for confirmation
_SYNC_UNCERTAINTY_ARCSEC = 1.0  # counts are whole
_BY_INSTRUMENT = "choose another instrument, `clockdrive instrument NAME`"
_NOT_CLEARED = {
    SYNC: "a sync is in the position itself and cannot be taken back: sync again, on what it points at",
    "mount x": "take mount_x_mas out of the configuration",
    "mount y": "take mount_y_mas out of the configuration",
    "pointing model": "take pointing_model out of the configuration",
    "pointing origin x": _BY_INSTRUMENT,
    "pointing origin y": _BY_INSTRUMENT,
    "refraction": "set refraction = false in [site.weather]",
    "Earth orientation UT1−UTC": "it is the Earth's",
    "host clock": "set the computer's clock",
}


class Adjusting:
    """Corrects the telescope of a session.

    Parameters
    ----------
    session : Session
        Whose position and target are corrected.
    """

    def __init__(self, session: Session) -> None:
        self._session = session

    def sync(self, target: Target, posture: Posture | None, *, force: bool) -> tuple[float, float]:
        """Declare that the telescope points at a target now; return the correction of each axis, degrees.

        What offsets, guide pulses and centring corrected is in the position from then on, so they are cleared.

        Raises
        ------
        Refused
            It slews; the mount cannot point there; or the correction is beyond 5° and `force` is not given.
        """
        session, planner = self._session, self._session.planner
        session.require_free(parked=True)
        with suppress(Refused):  # what had to stop has stopped; a sync may be what repairs it
            session.poll()
        reading = session.reading
        if reading is None:
            raise Refused("the drive has not answered yet; try again in a moment")
        now = session.clock.now()
        here = planner.angles(reading.counts)
        trusted = not reading.unsynchronised
        near = here if trusted else self._last_trusted()
        side = posture or ("normal" if near is None else planner.mount.posture(near[1]))
        (angle1, _), (angle2, _) = planner.track(target, now, side, near or self._middle())
        each = _moved_deg(here, (angle1, angle2))
        moved = max(map(abs, each))
        if trusted and moved > _LARGEST_SYNC_DEG and not force:
            raise Refused(
                f"a sync on {target.name} would move the position by {moved:.2f}°, more than {_LARGEST_SYNC_DEG:g}°: "
                "check the target, or say --force"
            )
        failed = [check.detail for check in planner.standing((angle1, angle2), now) if not check.ok]
        if failed:
            raise Refused(
                f"the telescope cannot point at {target.name} now: {'; '.join(failed)}; check target, clock and site"
            )
        counts = planner.axes[0].gearing.counts(angle1), planner.axes[1].gearing.counts(angle2)
        session.drive.sync(counts, now)
        session.store.record_synchronisation(
            Synchronisation(now, counts, _SYNC_UNCERTAINTY_ARCSEC, f"sync on {target.name}"),
            _moved_deg(planner.angles(_at(reading, now)), (angle1, angle2)) if trusted else None,
        )
        session.history.forget("a sync came after it")
        cleared = [name for name in DISPLACEMENTS if session.store.clear_correction(name)]
        session.store.set_correction(Correction(SYNC, moved * 3600.0, "arcsec", f"sync on {target.name}", now))
        also = f"; {', '.join(cleared)} cleared, as the position holds them now" if cleared else ""
        by = " and ".join(
            f"{axis.name} by {way * 3600.0:+.1f}″" for axis, way in zip(planner.axes, each, strict=True)
        )
        session.note("sync", f"on {target.name}, {by}{also}")
        session.taken(session.drive.read(session.clock.now()))
        if session.pursuit is not None and session.wanted is not None:
            leading, rotator = session.drive.leading, session.pursuit.turning(session.wanted, side)
            session.pursuit = Pursuit(planner, session.wanted, side, (angle1, angle2), leading, rotator=rotator)
        return each

    def _last_trusted(self) -> tuple[float, float] | None:
        """Axis angles when the position was last trusted: the telescope still stands in that turn of each axis."""
        counts = self._session.trusted_counts
        return None if counts is None else self._session.planner.angles(counts)

    def _middle(self) -> tuple[float, float]:
        one, two = self._session.planner.axes
        return (one.minimum + one.maximum) / 2.0, (two.minimum + two.maximum) / 2.0

    def offset(self, east_arcsec: float, north_arcsec: float) -> None:
        """Add to the person's offsets; the target in pursuit moves with them.

        Raises
        ------
        Refused
            A total is beyond a degree, which is another target; or a limit forbids it.
        """
        session = self._session
        added = zip(values_of(session, OFFSETS), (east_arcsec, north_arcsec), strict=True)
        totals = dict(zip(OFFSETS, (total + add for total, add in added), strict=True))
        for name, total in totals.items():
            if not abs(total) <= _LARGEST_OFFSET_ARCSEC:
                raise Refused(f"{name} of {total:g}″: at most ±{_LARGEST_OFFSET_ARCSEC:g}″; `goto` another target")
        now = session.clock.now()
        displace(
            session,
            {name: Correction(name, total, "arcsec", "offset command", now) for name, total in totals.items()},
        )

    def clear(self, name: str) -> None:
        """Remove a correction that a person made, or both of a kind by the names `offset`, `guide`, `centre`.

        Raises
        ------
        Refused
            No such correction can be removed; says what else changes it.
        """
        session = self._session
        if name in _NOT_CLEARED:
            raise Refused(f"{name} cannot be cleared: {_NOT_CLEARED[name]}")
        there = {each.name for each in session.store.corrections()}
        names = there.intersection(CLEARED.get(name, (name,)))
        if not names:
            known = ", ".join(sorted(there - {SYNC})) or "none"
            raise Refused(f"no correction {name!r} to clear; of those that a person made there is {known}")
        displace(session, dict.fromkeys(sorted(names)))


def _at(reading: Reading, time: float) -> tuple[float, float]:
    """Counts at a moment shortly after a reading."""
    one, two = (axis.counts + axis.rate * (time - reading.time) for axis in reading.axes[:2])
    return one, two


def _moved_deg(before: tuple[float, float], after: tuple[float, float]) -> tuple[float, float]:
    one, two = (math.degrees(new - old) for old, new in zip(before, after, strict=True))
    return one, two
