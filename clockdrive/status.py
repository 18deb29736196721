"""Everything that is known about a telescope at one moment."""

import math
from typing import Any

from clockdrive.answers import limit_answer, observed
from clockdrive.configuration import Configuration
from clockdrive.corrections import ledger
from clockdrive.rotating import field, rotator_status
from clockdrive.session import Session
from clockdrive.state import StateStore
from clockdrive.utc import utc
from mounts.drive import ROTATOR, Reading
from pointing.instant import Instant
from pointing.vectors import longitude_latitude


def _rotator(session: Session, reading: Reading, angles: tuple[float, float]) -> dict[str, Any]:
    """The rotator, where there is one, and how the field turns while a target is followed."""
    planner, pursuit = session.planner, session.pursuit
    said: dict[str, Any] = {} if pursuit is None else field(planner, pursuit.target, reading.time, pursuit.posture)
    if planner.rotator is not None and len(reading.axes) > ROTATOR:
        hold = None if pursuit is None else pursuit.hold
        turns = pursuit is not None and pursuit.turns_at(reading.time)
        said["rotator"] = rotator_status(planner, planner.rotator, reading, angles, hold, turns=turns)
    return said


def _notes(session: Session, configuration: Configuration, now: float) -> tuple[str, ...]:
    left = session.left_alone
    said = "" if left is None else left.said(now)
    return (*session.drive.notes, said, session.surroundings.air.trouble, configuration.notice)


def status_of(session: Session, store: StateStore, configuration: Configuration, instrument: str) -> dict[str, Any]:
    """Return the status as plain values: degrees, counts, UTC."""
    now, planner = session.clock.now(), session.planner
    status: dict[str, Any] = {
        "ok": True,
        "telescope": configuration.site.name or configuration.identity,
        "drive": configuration.identity,
        "utc": utc(now),
        "doing": session.doing,
        "target": session.target_name or None,
        "waiting": session.waiting.json(now) if session.waiting and session.doing == "waiting" else None,
        "instrument": instrument,
        "parked": store.parked(),
        "trouble": session.trouble,
        "warnings": list(session.warnings),
        "left_alone": None if session.left_alone is None else session.left_alone.json(now),
        "notes": [note for note in _notes(session, configuration, now) if note],
        "link_silent_s": None if session.link_lost_since is None else now - session.link_lost_since,
    }
    reading = session.reading
    if reading is None:
        return status
    status["coming_to_rest"] = session.doing == "idle" and any(axis.rate for axis in reading.axes)
    counts = reading.counts
    angles = planner.angles(counts)
    direction = planner.mount.observed(*angles)
    ra, dec = longitude_latitude(planner.sky.at(Instant.from_posix(reading.time)).astrometric(direction))
    place = observed(direction, planner.mount.latitude)
    return status | {
        "synchronised": not reading.unsynchronised,
        "unsynchronised_because": reading.unsynchronised,
        "posture": planner.mount.posture(angles[1]),
        "observed": place,
        "icrs": {"ra_deg": math.degrees(ra), "dec_deg": math.degrees(dec)},
        "position_utc": utc(reading.time),
        "position_age_s": now - reading.time,
        "axes": [
            {
                "name": axis.name,
                "angle_deg": math.degrees(angle),
                "counts": read.counts,
                "units": axis.units,
                "uncertainty_counts": read.uncertainty_counts,
                "rate_deg_s": math.degrees(read.rate / axis.gearing.counts_per_radian),
                "slewing": read.slewing,
            }
            for axis, angle, read in zip(planner.axes, angles, reading.axes, strict=False)
        ],
        **_rotator(session, reading, angles),
        "error_arcsec": session.pursuit.error_arcsec(reading) if session.pursuit else None,
        "next_limit": limit_answer(session.pursuit.next_limit(now)) if session.pursuit else None,
        "led": bool(session.pursuit and session.pursuit.led),
        "powered": reading.powered,
        "motion": list(reading.motion),
        "limits": list(reading.limits),
        "alarms": list(reading.alarms),
        "checks": [
            {"name": check.name, "ok": check.ok, "detail": check.detail} for check in planner.standing(angles, now)
        ],
        "corrections": ledger(
            planner,
            session.corrections(),
            instrument,
            configuration,
            session.surroundings,
            angles,
            now,
        ),
    }
