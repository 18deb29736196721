"""A TC410 in a person's hands: its registers, looked at, changed, compared with the configuration, saved, loaded."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from clockdrive.answers import Answer
from clockdrive.drives.by_hand import ByHand
from clockdrive.drives.tc410.registers import Difference, differences, registers, registers_of, registers_of_key
from clockdrive.errors import InputError, finite
from mounts.tc410.encoders import fault, read_encoder
from mounts.tc410.registers import Register, RegisterError, by_name
from mounts.tc410.upkeep import Shown

if TYPE_CHECKING:
    from mounts.tc410.drive import TC410

_NOT_SAVED = "not saved: `drive save` keeps it over a power-cycle"
_CONFIRM = "all registers are loaded anew and the position is unsynchronised until `sync`: confirm it with --yes"


class Tc410ByHand(ByHand):
    """What was changed is lost with the power until it is saved."""

    @property
    def _drive(self) -> "TC410":
        return cast("TC410", self.at_rest.session.drive)

    def show(self, names: Sequence[str]) -> Answer:
        """Return the registers named, all without a name; `park` means both axes."""
        return Answer({"ok": True, "registers": _rows(self._drive.upkeep.show(names))})

    def set(self, name: str, value: float | str, *, force: bool) -> Answer:
        """Write one register and read it back; flags also by their names."""
        row, upkeep = by_name(name), self._drive.upkeep
        number = _value(row, value) if isinstance(value, str) else value
        before = "" if row.access != "read-write" else upkeep.show([name])[0].text
        found = self.at_rest.changing(lambda: upkeep.write(name, number, force=force))
        self.at_rest.session.note("drive", f"{name} set to {found.text}")
        note = _NOT_SAVED if row.saved else ""
        return Answer({"ok": True, "registers": _rows((found,)), "before": before, "note": note})

    def diff(self) -> Answer:
        """Return the registers that the unit has otherwise than the configuration, with both values."""
        return Answer({"ok": True, "differences": [_told(each) for each in self._differences()]})

    def push(self, keys: Sequence[str]) -> Answer:
        """Write what the configuration says into the unit: the keys or registers named, else all that differ."""
        unknown = [key for key in keys if not registers_of_key(key)]
        if unknown:
            raise InputError(f"{unknown[0]} is no key that the drive keeps; `drive diff` lists those that differ")
        names = [name for key in keys for name in registers_of_key(key)]
        names = names or [found.register for found in self._differences()]
        wanted = {name: value for name, value in registers(self.at_rest.configuration).items() if name in names}
        upkeep = self._drive.upkeep
        written = self.at_rest.changing(
            lambda: [upkeep.write(name, value, force=True, beside=wanted) for name, value in wanted.items()]
        )
        if written:
            self.at_rest.session.note("drive", f"{len(written)} register(s) written from the configuration")
        return Answer({"ok": True, "registers": _rows(written), "note": _NOT_SAVED if written else ""})

    def save(self) -> Answer:
        """Have the unit keep its configuration over a power-cycle."""
        return self._act("save_configuration", "the drive has saved its configuration")

    def factory(self, *, confirmed: bool) -> Answer:
        """Have the unit load its factory configuration, unsaved."""
        return self._act("load_factory", "the factory configuration is loaded, not saved", confirmed=confirmed)

    def reload(self, *, confirmed: bool) -> Answer:
        """Have the unit load its saved configuration."""
        return self._act("load_configuration", "the saved configuration is loaded", confirmed=confirmed)

    def encoders(self) -> Answer:
        """Return what the encoders read, and where they say the axes are."""
        return Answer({"ok": True, "encoders": [self._encoder(axis) for axis in (1, 2)]})

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
        if encoder is None or self.at_rest.session.reading is None:
            return shown
        counts = self.at_rest.session.reading.axes[axis - 1].counts
        arcsec = encoder.uncertainty_arcsec / encoder.uncertainty_counts
        return shown | {
            "belief": drive.encoders.as_json()[axis - 1],
            "counts": encoder.counts(reading.binary, counts),
            "uncertainty_arcsec": encoder.uncertainty_arcsec,
            "off_arcsec": (encoder.counts(reading.binary, counts) - counts) * arcsec,
            "fault": fault(axis, encoder, reading),
        }

    def _act(self, action: str, done: str, *, confirmed: bool = True) -> Answer:
        if not confirmed:
            raise InputError(_CONFIRM)
        self.at_rest.changing(lambda: self._drive.upkeep.act(action))
        return self.at_rest.done(done)

    def _differences(self) -> tuple[Difference, ...]:
        drive = self._drive
        return differences(self.at_rest.configuration, {**registers_of(drive.unit), **drive.lent})


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
