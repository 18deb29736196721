"""Axis controllers in a person's hands: what they tell, what differs, and commands of their manual."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, cast

from clockdrive.answers import Answer
from clockdrive.axis_names import axis_of
from clockdrive.configuration import Configuration
from clockdrive.drives.apo.settings import NAMES, gearing
from clockdrive.drives.by_hand import ByHand, told
from clockdrive.errors import ArgumentError, InputError
from clockdrive.utc import utc

if TYPE_CHECKING:
    from mounts.apo.by_hand import Given
    from mounts.apo.clock_setting import ClockSet
    from mounts.apo.connecting import Setting
    from mounts.apo.drive import ApoDrive
    from mounts.apo.readings import FiducialPassage

_SETS_CLOCKS = "it sets the clocks of all controllers by their own NTP server, at rest: confirm it with --yes"
_ASKING = frozenset({"STATUS", "ID", "HELP", "MS.DUMP"})
_SECTION_OF = dict(zip(NAMES, ("axis1", "axis2", "rotator"), strict=True))


class ApoByHand(ByHand):
    """What controllers tell, what differs, commands of their manual, and their clocks."""

    instead = ", `drive raw AXIS COMMAND` gives a controller a command, as MAXV, SET.LIMITS or MS.DUMP"

    @property
    def _drive(self) -> "ApoDrive":
        return cast("ApoDrive", self.at_rest.session.drive)

    def show(self, names: Sequence[str]) -> Answer:
        """What the controllers tell, all or what a name is part of; an axis by any of its names."""
        return told(self._drive.registers(), [_controller(name) for name in names])

    def diff(self) -> Answer:
        """What the controllers hold otherwise than the configuration, with the key that says it."""
        configuration = self.at_rest.configuration
        return Answer({"ok": True, "differences": [_told(each, configuration) for each in self._drive.differences()]})

    def raw(self, axis: str, text: str, *, confirmed: bool) -> Answer:
        """Give a controller a command; risks are confirmed."""
        given = given_by_hand(self._drive, axis, text, confirmed=confirmed, within=self.at_rest.changing)
        self.at_rest.session.note("drive", f"{axis}: {given['command']}")
        return given

    def set_clocks(self, *, confirmed: bool) -> Answer:
        """Have the controllers set their clocks by NTP, at rest, and measure them afterwards."""
        from mounts.apo.clock_setting import require_settable  # noqa: PLC0415 - only where a clock is set

        require_settable(self._drive.kind)
        if not confirmed:
            raise InputError(f"`drive set-time`: {_SETS_CLOCKS}")
        session, drive = self.at_rest.session, self._drive
        answer = clocks_answer(self.at_rest.changing(lambda: drive.set_clocks(session.clock.now())))
        session.note("drive", answer["note"])
        return answer

    def fiducials(self, axis: str | None) -> Answer:
        """The last passages of fiducials of an axis, or of all."""
        drive = self._drive
        names = [each.name for each in drive.axes] if axis is None else [NAMES[axis_of(axis, len(drive.axes))]]
        rows = [
            {"axis": name, **_passage(each)} for name in names for each in drive.by_hand(name, "MS.DUMP").fiducials
        ]
        none = [name for name in names if not any(row["axis"] == name for row in rows)]
        note = f"{' and '.join(none)}: no fiducial was passed since the controller started" if none else ""
        return Answer({"ok": True, "fiducials": rows, "note": note})


def given_by_hand(
    drive: "ApoDrive", axis: str, text: str, *, confirmed: bool, within: "Callable[[Callable[[], Given]], Given]"
) -> Answer:
    """Give a command; one that changes anything `within` what sees to it that the telescope is at rest.

    Raises
    ------
    InputError
        It is risky and was not confirmed.
    """
    from mounts.apo.by_hand import risk_of  # noqa: PLC0415 - only where a command is given
    from mounts.apo.commands import decode  # noqa: PLC0415 - likewise

    what, axis = decode(text), NAMES[axis_of(axis, len(NAMES))]
    if (risk := risk_of(text)) and not confirmed:
        raise InputError(f"{what.text}: {risk}; confirm it with --yes")
    given = drive.by_hand(axis, text) if what.name in _ASKING else within(lambda: drive.by_hand(axis, text))
    passages = [_passage(each) for each in given.fiducials]
    lines = list(given.reply.lines)
    answer = {"ok": True, "axis": axis, "command": given.command.text, "lines": lines, "fiducials": passages}
    return Answer({**answer, "note": _set_note(axis, given.moved_deg)})


def _passage(each: "FiducialPassage") -> dict[str, Any]:
    """One edge of a fiducial, in the controller's degrees."""
    return {
        "utc": utc(each.time),
        "position_deg": each.position_deg,
        "velocity_deg_s": each.velocity_deg_s,
        "error_deg": each.error_deg,
        "edge": each.edge,
        "correction_deg": each.correction_deg,
    }


def _set_note(axis: str, moved_deg: float | None) -> str:
    """What setting a position by hand did to it, and what is left to do; empty where none was set."""
    if moved_deg is None:
        return ""
    then = (
        "the axes are as before"
        if axis == NAMES[-1]
        else "the telescope is unsynchronised until `sync` on a target, which sets both axes"
    )
    return f"{axis}: its position is {moved_deg:+.4f}° from what it was; {then}"


def clocks_answer(found: "Sequence[ClockSet]") -> Answer:
    """How far each clock was off before it was set, and is after."""
    rows = [
        {"axis": each.axis, "before_s": each.before_s, "after_s": each.after_s, "uncertainty_s": each.uncertainty_s}
        for each in found
    ]
    return Answer({"ok": True, "clocks": rows, "note": "; ".join(map(_clock, found))})


def _clock(each: "ClockSet") -> str:
    before = "not set" if each.before_s is None else f"{each.before_s:+.4f} s off"
    return f"{each.axis}: the clock was {before}, it is {each.after_s:+.4f} ± {each.uncertainty_s:.4f} s off"


def _controller(name: str) -> str:
    """What a controller is called, by any name of its axis; the name itself where it is that of no axis."""
    try:
        return NAMES[axis_of(name, len(NAMES))]
    except ArgumentError:
        return name


def _told(each: "Setting", configuration: Configuration) -> dict[str, Any]:
    section = _SECTION_OF[each.axis]
    if each.name == "MAXV":
        key, value = "max_speed_deg_s", each.told
    else:
        gear = gearing(configuration, section)
        upper = (each.name == "upper soft limit") is not gear.reversed
        key, value = "max_deg" if upper else "min_deg", round(math.degrees(gear.angle(each.told)), 6)
    return {
        "key": f"{section}.{key}",
        "register": f"{each.axis} {each.name}",
        "unit": each.told,
        "configured": each.configured,
        "units": each.unit,
        "unit_value": value,
    }
