"""What a person corrects: the position by `sync`, the place on the sky by offsets."""

import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from clockdrive.corrections import CLEARED, DISPLACEMENTS, OFFSETS, SYNC
from clockdrive.displacing import displace, values_of
from clockdrive.errors import Refused
from clockdrive.pursuit import Pursuit
from clockdrive.session import Session
from clockdrive.state import Correction, Synchronisation
from pointing.mount import Mount, Posture
from pointing.targets import Target

if TYPE_CHECKING:
    from pointing.model.fitted import Fit
    from pointing.model.pointing_model import PointingModel

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

    def sync(self, target: Target, posture: Posture | None, *, force: bool) -> float:
        """Declare that the telescope points at a target now; return the correction of the larger axis, degrees.

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
        moved = math.degrees(max(abs(angle1 - here[0]), abs(angle2 - here[1])))
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
            Synchronisation(now, counts, _SYNC_UNCERTAINTY_ARCSEC, f"sync on {target.name}")
        )
        session.history.forget("a sync came after it")
        cleared = [name for name in DISPLACEMENTS if session.store.clear_correction(name)]
        session.store.set_correction(Correction(SYNC, moved * 3600.0, "arcsec", f"sync on {target.name}", now))
        also = f"; {', '.join(cleared)} cleared, as the position holds them now" if cleared else ""
        session.note("sync", f"on {target.name}, by {moved * 3600.0:.1f}″{also}")
        session.taken(session.drive.read(session.clock.now()))
        if session.pursuit is not None and session.wanted is not None:
            session.pursuit = Pursuit(planner, session.wanted, side, (angle1, angle2), session.drive.leading)
        return moved

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

    def use_model(self, model: "Fit | PointingModel | str | Path | None") -> None:
        """Point with another pointing model, or with none, from now on.

        Raises
        ------
        Refused
            The telescope is not at rest: the target that it tracks would be elsewhere.
        PointingError
            It is no model of this mount.
        """
        session, mount = self._session, self._session.planner.mount
        session.require_free(parked=True)
        if session.pursuit is not None:
            raise Refused(f"the telescope tracks {session.pursuit.target.name}: `stop` it, then change the model")
        found = _model_of(model, mount)
        session.planner.mount = replace(mount, model=found)
        session.note("pointing model", "none" if found is None else " ".join(each.name for each in found.terms))

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


def _model_of(model: "Fit | PointingModel | str | Path | None", mount: Mount) -> "PointingModel | None":
    """The model that somebody gives: itself, that of a fit, or that of a file."""
    if isinstance(model, str | Path):
        from pointing.model.model_on_file import ModelOnFile  # noqa: PLC0415 - only where one is given

        return ModelOnFile.read(Path(model), mount.type.kind, mount.latitude)
    return None if model is None else cast("PointingModel", getattr(model, "model", model))
