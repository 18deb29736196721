"""A stepper box in a person's hands: its PEC bin and zero, all that can be set and read back, and its encoders."""

import math
from typing import TYPE_CHECKING, Any, cast

from clockdrive.answers import Answer
from clockdrive.drives.by_hand import ByHand
from clockdrive.errors import InputError, Refused

if TYPE_CHECKING:
    from mounts.avr_box.drive import AvrBoxDrive
    from mounts.avr_box.encoders import EncoderSeen
    from pointing.plan import Axis
    from pointing.planner import Planner

NAMES = ("pec_bin", "pec_zero")


class AvrBoxByHand(ByHand):
    """Its PEC bin and zero, and its encoders."""

    instead = f", `drive set` sets {' and '.join(NAMES)}"

    @property
    def _drive(self) -> "AvrBoxDrive":
        return cast("AvrBoxDrive", self.at_rest.session.drive)

    def set(self, name: str, value: float | str, *, force: bool) -> Answer:  # noqa: ARG002 - nothing is risky
        """Set the PEC bin or zero."""
        return self.at_rest.changing(lambda: pec_set(self._drive, name, value))

    def encoders(self) -> Answer:
        """Return what the encoders read, and where they say that the axes are."""
        return encoders_answer(self._drive, self.at_rest.session.planner)


def pec_set(drive: "AvrBoxDrive", name: str, value: float | str) -> Answer:
    """Set one of them and read it back.

    Raises
    ------
    InputError
        It is another name, or no whole number.
    """
    if name not in NAMES:
        raise InputError(f"{name} cannot be set in a stepper box; there is {' and '.join(NAMES)}, 0 to 518")
    try:
        number = int(str(value), 0)
    except ValueError:
        raise InputError(f"{name} = {value}: give a whole number, 0 to 518") from None
    before = drive.registers()[name]
    drive.set_pec(name, number)
    row = {"group": "pec", "text": drive.registers()[name], "raw": []}
    return Answer({"ok": True, "registers": {name: row}, "before": before, "note": ""})


def encoders_answer(drive: "AvrBoxDrive", planner: "Planner") -> Answer:
    """What the encoders read, and where they say that the axes are.

    Raises
    ------
    Refused
        None are fitted.
    TransportError
        They do not answer.
    """
    seen = drive.encoders_seen()
    if not seen:
        raise Refused(
            "there are no encoders to read: [drive] encoder_counts_per_turn is 0; where some are fitted, set it"
        )
    rows = [_row(i, axis, each) for i, (axis, each) in enumerate(zip(planner.axes, seen, strict=True), start=1)]
    return Answer({"ok": True, "encoders": rows})


def _row(number: int, axis: "Axis", seen: "EncoderSeen") -> dict[str, Any]:
    arcsec = math.degrees(1.0 / abs(axis.gearing.counts_per_radian)) * 3600.0
    row = {"axis": number, "reading": seen.said, "step_arcsec": seen.step * arcsec, "counts": seen.counts}
    if seen.counts is None:
        return row
    return row | {"uncertainty_arcsec": seen.step * arcsec, "off_arcsec": (seen.counts - seen.reckoned) * arcsec}
