"""The drive's own registers in a person's hands: look, change, compare with the configuration, save, load.

Registers are changed only while the telescope is at rest. What was changed is lost with the power until it is saved.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

from clockdrive.answers import Answer
from clockdrive.configuration import Configuration
from clockdrive.control import Control
from clockdrive.direct_speed import check_way
from clockdrive.drives.apo.by_hand import SETS_CLOCKS, ByHand, clocks_answer, differing, given_by_hand, told
from clockdrive.drives.avr_box.by_hand import NAMES as PEC
from clockdrive.drives.avr_box.by_hand import HasPec, encoders_answer, pec_set
from clockdrive.drives.awr.by_hand import HasWords, key_of, pressed, relay_of, relay_set, word_set
from clockdrive.drives.awr.by_hand import differing as differing_words
from clockdrive.drives.tc410.registers import Difference, differences, registers, registers_of, registers_of_key
from clockdrive.errors import InputError, Refused, finite
from clockdrive.session import Session
from mounts.tc410.encoders import Encoders, fault, read_encoder
from mounts.tc410.registers import Register, RegisterError, by_name
from mounts.tc410.unit import Unit
from mounts.tc410.upkeep import Shown, Upkeep

if TYPE_CHECKING:
    from clockdrive.telescope import Telescope

_AT_REST = frozenset({"idle", "parked"})
_NOT_SAVED = "not saved: `drive save` keeps it over a power-cycle"
_CONFIRM = "all registers are loaded anew and the position is unsynchronised until `sync`: confirm it with --yes"
_CONFIRM_DISCARD = "what was written in RAM and not committed is lost: confirm it with --yes"

Call = Callable[[dict[str, Any], object], object]
T = TypeVar("T")


@runtime_checkable
class HasRegisters(Protocol):
    """A drive whose registers a person may look at and change."""

    upkeep: Upkeep
    encoders: Encoders

    @property
    def unit(self) -> Unit:
        """The registers."""
        ...

    @property
    def lent(self) -> Mapping[str, float]:
        """What the registers that are changed for a while hold otherwise, by name."""
        ...


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
        self._session = session
        self._configuration = configuration
        self._control = control

    def show(self, *names: str) -> Answer:
        """Return the registers named, all without a name; ``show("park")`` means both axes.

        Raises
        ------
        Refused, DriveError
            This drive has none, or none of this name.
        """
        if not isinstance(self._session.drive, HasRegisters):
            return self._control.call(lambda: told(self._session.drive.registers(), names))
        return self._control.call(lambda: Answer({"ok": True, "registers": _rows(self._drive.upkeep.show(names))}))

    def set(self, name: str, value: float | str, *, force: bool = False) -> Answer:
        """Write one register and read it back; flags also by their names, ``"joystick, tracking"``.

        Raises
        ------
        Refused, DriveError
            Not now, not this register, not this value, or not without `force`.
        """
        drive = self._session.drive
        if isinstance(drive, HasPec):
            return self._control.call(lambda: self._changing(lambda: pec_set(drive, name, value)))
        if isinstance(drive, HasWords):
            return self._control.call(lambda: self._word(drive, name, value))
        if not isinstance(drive, HasRegisters):
            raise Refused(f"{name} cannot be set: {self._without_registers}")
        row = by_name(name)
        number = _value(row, value) if isinstance(value, str) else value

        def work() -> Answer:
            before = None if row.access != "read-write" else self._drive.upkeep.show([name])[0]
            found = self._changing(lambda: self._drive.upkeep.write(name, number, force=force))
            self._session.note("drive", f"{name} set to {found.text}")
            note = _NOT_SAVED if row.saved else ""
            was = "" if before is None else before.text
            return Answer({"ok": True, "registers": _rows((found,)), "before": was, "note": note})

        return self._control.call(work)

    def _word(self, drive: HasWords, name: str, value: float | str) -> Answer:
        """A relay is switched at any time, a word written at rest."""
        relay = relay_of(name)
        if relay is None:
            answer = self._changing(lambda: word_set(drive, name, value))
        else:
            answer = relay_set(drive, relay, value)
        self._session.note("drive", f"{name} set to {value}")
        return answer

    def diff(self) -> Answer:
        """Return the registers that the unit has otherwise than the configuration, with both values."""
        drive = self._session.drive
        if isinstance(drive, ByHand):
            return self._control.call(lambda: differing(drive, self._configuration()))
        if isinstance(drive, HasWords):
            return self._control.call(lambda: differing_words(drive))
        return self._control.call(
            lambda: Answer({"ok": True, "differences": [_told(d) for d in self._differences()]})
        )

    def push(self, *keys: str) -> Answer:
        """Write what the configuration says into the unit: the keys or registers named, else all that differ.

        Raises
        ------
        InputError, Refused, DriveError
            It is no such key, or as for `set`; what was written before stays written.
        """
        unknown = [key for key in keys if not registers_of_key(key)]
        if unknown:
            raise InputError(f"{unknown[0]} is no key that the drive keeps; `drive diff` lists those that differ")
        return self._control.call(lambda: self._push(keys))

    def _push(self, keys: Sequence[str]) -> Answer:
        names = [name for key in keys for name in registers_of_key(key)]
        names = names or [found.register for found in self._differences()]
        wanted = {name: value for name, value in registers(self._configuration()).items() if name in names}
        upkeep = self._drive.upkeep
        written = self._changing(
            lambda: [upkeep.write(name, value, force=True, beside=wanted) for name, value in wanted.items()]
        )
        if written:
            self._session.note("drive", f"{len(written)} register(s) written from the configuration")
        return Answer({"ok": True, "registers": _rows(written), "note": _NOT_SAVED if written else ""})

    def raw(self, axis: str, text: str, *, confirmed: bool = False) -> Answer:
        """Give an axis controller, by any name of the axis, a command of its manual, at rest; risks are confirmed.

        Raises
        ------
        InputError
            It was not confirmed.
        Refused, DriveError, TransportError
            This drive takes none, or not now; there is no such command; the controller refuses it.
        """
        drive = self._session.drive
        if isinstance(drive, HasWords):
            return self._control.call(lambda: self._pressed(drive, axis, text))
        if not isinstance(drive, ByHand):
            kind = self._configuration().drive.kind
            raise Refused(f"a drive of kind {kind} takes no commands by hand; `drive set` writes what it has")

        def work() -> Answer:
            given = given_by_hand(drive, axis, text, confirmed=confirmed, within=self._changing)
            self._session.note("drive", f"{axis}: {given['command']}")
            return given

        return self._control.call(work)

    def _pressed(self, drive: HasWords, axis: str, text: str) -> Answer:
        name, speed, seconds = key_of(axis, text)

        def work() -> dict[str, Any]:
            one, two = drive.way_of(name, speed, seconds)
            self._session.poll()
            first, second = (axis.gearing.counts_per_radian * seconds for axis in self._session.planner.axes)
            check_way(self._session, (one / first, two / second), seconds, f"{name} at {speed} speed")
            return pressed(drive, name, speed, seconds)

        given = self._changing(work)
        self._session.note("drive", given["command"])
        return Answer(given)

    def set_clocks(self, *, confirmed: bool) -> Answer:
        """Have the controllers set their clocks by NTP, at rest, and measure them afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        Refused, DriveError, TransportError
            This drive has no clocks to set, or not now; a clock is not right afterwards.
        """
        drive, session = self._session.drive, self._session
        if not isinstance(drive, ByHand):
            raise Refused(f"a drive of kind {self._configuration().drive.kind} has no clock that could be set")
        if not confirmed:
            raise InputError(f"`drive set-time`: {SETS_CLOCKS}")

        def work() -> Answer:
            answer = clocks_answer(self._changing(lambda: drive.set_clocks(session.clock.now())))
            session.note("drive", answer["note"])
            return answer

        return self._control.call(work)

    def save(self) -> Answer:
        """Have the unit keep its configuration over a power-cycle."""
        drive = self._session.drive
        if isinstance(drive, HasWords):
            return self._control.call(lambda: self._committed(drive))
        return self._act("save_configuration", "the drive has saved its configuration")

    def factory(self, *, confirmed: bool) -> Answer:
        """Have the unit load its factory configuration, unsaved; the position is unsynchronised afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        """
        return self._act("load_factory", "the factory configuration is loaded, not saved", confirmed=confirmed)

    def reload(self, *, confirmed: bool) -> Answer:
        """Have the unit load its saved configuration; the position is unsynchronised afterwards.

        Raises
        ------
        InputError
            It was not confirmed.
        """
        drive = self._session.drive
        if isinstance(drive, HasWords):
            if not confirmed:
                raise InputError(_CONFIRM_DISCARD)
            return self._control.call(lambda: self._discarded(drive))
        return self._act("load_configuration", "the saved configuration is loaded", confirmed=confirmed)

    def _committed(self, drive: HasWords) -> Answer:
        names = self._changing(drive.commit)
        done = f"committed to the non-volatile memory: {', '.join(names)}"
        self._session.note("drive", done)
        return Answer({"ok": True, "note": done})

    def _discarded(self, drive: HasWords) -> Answer:
        self._changing(drive.discard)
        done = "the soft writes are discarded"
        self._session.note("drive", done)
        return Answer({"ok": True, "note": done})

    def encoders(self) -> Answer:
        """Return what the encoders read, and where they say the axes are.

        Raises
        ------
        Refused, TransportError
            This drive has none; they do not answer.
        """
        drive = self._session.drive
        if isinstance(drive, HasPec):
            return self._control.call(lambda: encoders_answer(drive, self._session.planner))
        if not isinstance(drive, HasRegisters):
            raise Refused(f"there are no absolute encoders to read: {self._without_registers}")
        return self._control.call(lambda: Answer({"ok": True, "encoders": [self._encoder(axis) for axis in (1, 2)]}))

    def _encoder(self, axis: int) -> dict[str, Any]:
        drive = self._drive
        reading, encoder = read_encoder(drive.unit, axis), drive.encoders.configured[axis - 1]
        shown = {
            "axis": axis,
            "detected": reading.detected,
            "gray": reading.gray,
            "binary": reading.binary,
            "angle_deg": reading.degrees,
            "bits": encoder.bits if encoder else 0,
        }
        if encoder is None or self._session.reading is None:
            return shown
        counts = self._session.reading.axes[axis - 1].counts
        arcsec = encoder.uncertainty_arcsec / encoder.uncertainty_counts
        return shown | {
            "belief": drive.encoders.as_json()[axis - 1],
            "counts": encoder.counts(reading.binary, counts),
            "uncertainty_arcsec": encoder.uncertainty_arcsec,
            "off_arcsec": (encoder.counts(reading.binary, counts) - counts) * arcsec,
            "fault": fault(axis, encoder, reading),
        }

    def _act(self, action: str, done: str, *, confirmed: bool = True) -> Answer:
        upkeep = self._drive.upkeep
        if not confirmed:
            raise InputError(_CONFIRM)

        def work() -> Answer:
            self._changing(lambda: upkeep.act(action))
            self._session.note("drive", done)
            return Answer({"ok": True, "note": done})

        return self._control.call(work)

    def _changing(self, work: Callable[[], T]) -> T:
        """Change something at rest, and see at once what the unit says afterwards."""
        session = self._session
        session.require_free(parked=True)
        if session.doing not in _AT_REST:
            raise Refused(f"the telescope is {session.doing}; registers are changed at rest only: `stop` first")
        try:
            return work()
        finally:
            session.poll()

    def _differences(self) -> tuple[Difference, ...]:
        drive = self._drive
        return differences(self._configuration(), {**registers_of(drive.unit), **drive.lent})

    @property
    def _drive(self) -> HasRegisters:
        drive = self._session.drive
        if not isinstance(drive, HasRegisters):
            raise Refused(self._without_registers)
        return drive

    @property
    def _without_registers(self) -> str:
        """That the drive has no registers, and what it has instead."""
        kind, other = self._configuration().drive.kind, ""
        if isinstance(self._session.drive, ByHand):
            other = ", `drive raw AXIS COMMAND` gives a controller a command, as MAXV, SET.LIMITS or MS.DUMP"
        if isinstance(self._session.drive, HasPec):
            other = f", `drive set` sets {' and '.join(PEC)}"
        return f"a drive of kind {kind} has no registers of that kind: `drive show` tells all that it has{other}"


def drive_calls(telescope: "Telescope") -> dict[str, Call]:
    """The calls that the doors offer, by name."""
    drive = telescope.drive
    return {
        "drive_diff": lambda _args, _: drive.diff().json,
        "drive_encoders": lambda _args, _: drive.encoders().json,
        "drive_factory": lambda args, _: drive.factory(confirmed=bool(args.get("confirmed"))).json,
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


def _rows(shown: Sequence[Shown]) -> dict[str, Mapping[str, Any]]:
    return {
        each.register.name: {
            "group": each.group,
            "kind": each.register.kind,
            "address": each.register.address,
            "value": each.value,
            "unit": each.register.unit,
            "text": each.text,
            "flags": list(each.flags),
            "raw": list(each.raw),
            "access": each.register.access,
            "saved": each.register.saved,
            "meaning": each.register.meaning,
        }
        for each in shown
    }


def _told(found: Difference) -> dict[str, Any]:
    return {
        "key": found.key,
        "register": found.register,
        "unit": found.unit,
        "configured": found.configured,
        "units": by_name(found.register).unit,
        "unit_value": found.unit_value,
    }


def _value(row: Register, text: str) -> float:
    """The value that a person wrote: a number, 0x… for a whole one, or the names of flags.

    Raises
    ------
    InputError
        It is none of these.
    """
    words = text.replace("−", "-").strip()
    try:
        number = float(int(words, 0)) if words.lower().startswith(("0x", "-0x")) else float(words)
        return finite(f"{row.name} =", number, row.unit or "its unit")
    except ValueError:
        if not row.flags:
            raise InputError(f"{row.name} = {text!r}: give a number in {row.unit or 'its unit'}, or 0x…") from None
    names = [name.strip() for name in words.replace("+", ",").split(",")]
    try:
        return float(row.mask(*(name for name in names if name and name != "none")))
    except RegisterError as error:
        raise InputError(str(error)) from None
