"""Declaring where the instrument rotator stands: by its own angle, or by how an image lies on the sky.

A star says nothing of a rotator; a solved image does, but for whole turns.
"""

import math
from contextlib import suppress

from clockdrive.errors import ArgumentError, Refused
from clockdrive.session import Session
from mounts.drive import ROTATOR, Declares, Reading
from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.rotator import Hold, Rotator

_LARGEST_DEG = 5.0  # beyond which it asks for confirmation, as a sync on a star does
_ANYWHERE_DEG = 180.0  # of an uncertainty: it may be anywhere


def sync_rotator(
    session: Session, angle_deg: float | None, position_angle_deg: float | None, *, force: bool
) -> float:
    """Declare the rotator's own angle, or the position angle of the instrument's y axis now; return the correction.

    What is tracked goes on: the rotator is turned to where it holds that.

    Raises
    ------
    ArgumentError
        Both angles are given, or none.
    Refused
        There is no rotator; it slews; the angle is outside its limits, or does not say which turn it is; the
        correction is beyond 5° and `force` is not given.
    """
    rotator, drive = session.planner.rotator, session.drive
    if rotator is None or not isinstance(drive, Declares):
        raise Refused("this telescope has no rotator: a table [rotator] in its configuration says that there is one")
    if (angle_deg is None) is (position_angle_deg is None):
        raise ArgumentError("a sync of the rotator: give its own angle, or the position angle of an image; not both")
    session.require_free(parked=True)
    with suppress(Refused):  # what had to stop has stopped; this may be what repairs it
        session.poll()
    reading = session.reading
    if reading is None or len(reading.axes) <= ROTATOR:
        raise Refused("the rotator has not answered yet; try again in a moment")
    read = reading.axes[ROTATOR]
    lost, believed = read.uncertainty_counts > _ANYWHERE_DEG, rotator.axis.gearing.angle(read.counts)
    if angle_deg is not None:
        angle = math.radians(angle_deg)
    else:
        angle = _wound(session, rotator, reading, math.radians(position_angle_deg or 0.0), None if lost else believed)
    check = rotator.check(angle, "the rotator cannot stand")
    if not check.ok:
        raise Refused(f"{check.detail.partition(';')[0]}; check the angle, centre_deg and reversed of [rotator]")
    moved = math.degrees(angle - believed)
    if not lost and abs(moved) > _LARGEST_DEG and not force:
        raise Refused(
            f"this would turn the rotator's scale by {moved:.2f}°, more than {_LARGEST_DEG:g}°: check the angle, or "
            "say --force"
        )
    drive.declare(ROTATOR, rotator.axis.gearing.counts(angle), reading.time)
    session.note("sync", f"the rotator at {math.degrees(angle):.4f}°, by {moved:+.4f}°; the axes are as before")
    session.taken(session.drive.read(session.clock.now()))
    session.follow()
    return moved


def _wound(session: Session, rotator: Rotator, reading: Reading, wanted: float, believed: float | None) -> float:
    """The angle, radians, at which the instrument lies at a position angle where the axes point."""
    planner = session.planner
    angles = planner.angles(reading.counts)
    frame = planner.sky.at(Instant.from_posix(reading.time))
    try:
        angle = Hold("sky", wanted).angle_at(frame, planner.mount.observed(*angles), planner.mount.up(*angles))
    except PointingError as error:
        raise Refused(f"{error}; give the rotator's own angle") from error
    possible = list(rotator.axis.windings(angle))
    if believed is not None and possible:
        return min(possible, key=lambda each: abs(each - believed))
    if len(possible) > 1:
        turns = ", ".join(f"{math.degrees(each):.2f}°" for each in possible)
        raise Refused(f"the rotator stands at one of {turns}, and an image does not say at which: give its own angle")
    return possible[0] if possible else angle
