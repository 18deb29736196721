"""A stepper box in a person's hands: its PEC bin and zero, which are all that can be set and read back."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from clockdrive.answers import Answer
from clockdrive.errors import InputError

NAMES = ("pec_bin", "pec_zero")


@runtime_checkable
class HasPec(Protocol):
    """A drive with a PEC table."""

    def registers(self) -> Mapping[str, str]:
        """Everything that it tells."""
        ...

    def set_pec(self, name: str, number: int) -> None:
        """Set `pec_bin` or `pec_zero`."""
        ...


def pec_set(drive: HasPec, name: str, value: float | str) -> Answer:
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
