"""The drive's own registers in a person's hands: look, change, compare with the configuration, save, load.

Registers are changed only while the telescope is at rest. What was changed is lost with the power until it is saved.
What a drive offers of this is in the folder of its kind.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from clockdrive.answers import Answer
from clockdrive.configuration import Configuration
from clockdrive.control import Control
from clockdrive.drives import kind_of
from clockdrive.drives.by_hand import AtRest, ByHand
from clockdrive.session import Session

if TYPE_CHECKING:
    from clockdrive.telescope import Telescope

Call = Callable[[dict[str, Any], object], object]


class DriveRegisters:
    """The registers of a telescope's drive.

    Parameters
    ----------
    session : Session
        Whose drive it is.
    configuration : callable
        Returns that with which the registers are compared; a polar alignment may change it.
    control : Control
        Where the work is done.
    """

    def __init__(self, session: Session, configuration: Callable[[], Configuration], control: Control) -> None:
        self._at_rest = AtRest(session, configuration)
        self._control = control

    def show(self, *names: str) -> Answer:
        """Return the registers named, all without a name; ``show("park")`` means both axes.

        Raises
        ------
        Refused, DriveError
            This drive has none, or none of this name.
        """
        return self._done(lambda hand: hand.show(names))

    def set(self, name: str, value: float | str, *, force: bool = False) -> Answer:
        """Write one register and read it back; flags also by their names, ``"joystick, tracking"``.

        Raises
        ------
        Refused, DriveError
            Not now, not this register, not this value, or not without `force`.
        """
        return self._done(lambda hand: hand.set(name, value, force=force))

    def diff(self) -> Answer:
        """Return the registers that the unit has otherwise than the configuration, with both values."""
        return self._done(lambda hand: hand.diff())

    def push(self, *keys: str) -> Answer:
        """Write what the configuration says into the unit: the keys or registers named, else all that differ.

        Raises
        ------
        InputError, Refused, DriveError
            It is no such key, or as for `set`; what was written before stays written.
        """
        return self._done(lambda hand: hand.push(keys))

    def raw(self, axis: str, text: str, *, confirmed: bool = False) -> Answer:
        """Give an axis controller, by any name of the axis, a command of its manual, at rest; risks are confirmed.

        Raises
        ------
        InputError
            It was not confirmed.
        Refused, DriveError, TransportError
            This drive takes none, or not now; there is no such command; the controller refuses it.
        """
        return self._done(lambda hand: hand.raw(axis, text, confirmed=confirmed))

    def set_clocks(self, *, confirmed: bool) -> Answer:
        """Have the controllers set their clocks by NTP, at rest, and measure them afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        Refused, DriveError, TransportError
            This drive has no clocks to set, or not now; a clock is not right afterwards.
        """
        return self._done(lambda hand: hand.set_clocks(confirmed=confirmed))

    def save(self) -> Answer:
        """Have the unit keep its configuration over a power-cycle."""
        return self._done(lambda hand: hand.save())

    def factory(self, *, confirmed: bool) -> Answer:
        """Have the unit load its factory configuration, unsaved; the position is unsynchronised afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        """
        return self._done(lambda hand: hand.factory(confirmed=confirmed))

    def reload(self, *, confirmed: bool) -> Answer:
        """Have the unit load its saved configuration; the position is unsynchronised afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        """
        return self._done(lambda hand: hand.reload(confirmed=confirmed))

    def encoders(self) -> Answer:
        """Return what the encoders read, and where they say the axes are.

        Raises
        ------
        Refused, TransportError
            This drive has none; they do not answer.
        """
        return self._done(lambda hand: hand.encoders())

    def fiducials(self, axis: str | None = None) -> Answer:
        """Return the last passages of fiducials, of all axes or of one by any of its names.

        Raises
        ------
        Refused, DriveError, TransportError
            This drive has none; a controller does not tell them, or does not answer.
        """
        return self._done(lambda hand: hand.fiducials(axis))

    def _done(self, work: Callable[[ByHand], Answer]) -> Answer:
        """Do it on the control thread, as the kind of the drive does it."""
        hand = kind_of(self._at_rest.configuration).by_hand(self._at_rest)
        return self._control.call(lambda: work(hand))


def drive_calls(telescope: "Telescope") -> dict[str, Call]:
    """The calls that the doors offer, by name."""
    drive = telescope.drive
    return {
        "drive_diff": lambda _args, _: drive.diff().json,
        "drive_encoders": lambda _args, _: drive.encoders().json,
        "drive_factory": lambda args, _: drive.factory(confirmed=bool(args.get("confirmed"))).json,
        "drive_fiducials": lambda args, _: drive.fiducials(args.get("axis")).json,
        "drive_push": lambda args, _: drive.push(*args.get("keys", ())).json,
        "drive_raw": lambda args, _: (
            drive.raw(args["axis"], args["command"], confirmed=bool(args.get("confirmed"))).json
        ),
        "drive_reload": lambda args, _: drive.reload(confirmed=bool(args.get("confirmed"))).json,
        "drive_save": lambda _args, _: drive.save().json,
        "drive_set": lambda args, _: drive.set(args["register"], args["value"], force=bool(args.get("force"))).json,
        "drive_set_time": lambda args, _: drive.set_clocks(confirmed=bool(args.get("confirmed"))).json,
        "drive_show": lambda args, _: drive.show(*args.get("registers", ())).json,
    }
