"""Displacing what is tracked: offsets, guide pulses and centring all end here.

A displacement is asked for and checked before it stands in the ledger; then the telescope follows at once.
"""

from collections.abc import Mapping

from clockdrive.corrections import DISPLACEMENTS, displacement
from clockdrive.errors import Refused
from clockdrive.session import MOVING, Session
from clockdrive.state import Correction
from pointing.offset import OffsetTarget
from pointing.targets import ARCSEC, Target

Changes = Mapping[str, Correction | None]  # by name; None removes one


def values_of(session: Session, names: tuple[str, str]) -> tuple[float, float]:
    """East and north of one kind of displacement, arcseconds."""
    return displacement(session.store.corrections(), names)


def displace(session: Session, changes: Changes) -> None:
    """Put corrections in force or remove them, all at once, and let the telescope follow.

    Raises
    ------
    Refused
        What is tracked would come where the telescope must not point; nothing has changed.
    """
    if session.doing in MOVING:
        raise Refused(f"the telescope is {session.doing}; wait for it, or `stop` first")
    target = displaced(session, changes)
    if target is None:
        write(session, changes)
        return
    require_allowed(session, target)
    write(session, changes)
    if session.pursuit is not None:
        session.pursuit = session.pursuit.moved_to(target, session.clock.now())
    session.follow()


def displaced(session: Session, changes: Changes) -> Target | None:
    """Return what would be tracked after these changes; None while nothing is."""
    if session.pursuit is None or session.wanted is None:
        return None
    kept = [each for each in session.store.corrections() if each.name not in changes]
    east, north = displacement([*kept, *filter(None, changes.values())], DISPLACEMENTS)
    return OffsetTarget(session.wanted, east * ARCSEC, north * ARCSEC) if east or north else session.wanted


def write(session: Session, changes: Changes) -> None:
    """Put corrections into the ledger, or take them out of it."""
    for name, correction in changes.items():
        if correction is None:
            session.store.clear_correction(name)
        else:
            session.store.set_correction(correction)


def require_allowed(session: Session, target: Target) -> None:
    """Refuse a displaced target on which the telescope must not stand now.

    Raises
    ------
    Refused
        Which limit forbids it, and by how much.
    """
    if session.pursuit is None:
        return
    now = session.clock.now()
    (angle1, _), (angle2, _) = session.pursuit.moved_to(target, now).angles(now)
    failed = [check.detail for check in session.planner.standing((angle1, angle2), now) if not check.ok]
    if failed:
        raise Refused(f"{target.name} so displaced: {'; '.join(failed)}")


def require_pursuit(session: Session, what: str) -> Target:
    """The target as it was asked for, which `what` belongs to.

    Raises
    ------
    Refused
        The telescope slews, is parked or not synchronised, its link is silent, or it tracks nothing.
    """
    session.require_free()
    if session.pursuit is None or session.wanted is None:
        raise Refused(f"{what} belongs to the target that is tracked, and nothing is: `goto` one first")
    if session.link_lost_since is not None:
        raise Refused("the drive does not answer; check the link, then try again")
    session.synchronised()
    return session.wanted
