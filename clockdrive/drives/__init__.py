"""The kinds of drives: one folder each, which says what a configuration means for the drive of this kind.

Nothing outside these folders knows a kind by name, but the table of keys. A part of a kind is loaded when it is first
asked for, so that a plan for one drive does not load the others.
"""

from collections.abc import Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, cast

from clockdrive.errors import InputError

if TYPE_CHECKING:
    from clockdrive.configuration import Configuration
    from clockdrive.configuration_keys import Facts
    from clockdrive.drives.kind import Kind
    from mounts.commissioning import Step

_FOLDERS = {"tc410": "tc410", "avr-box": "avr_box", "apo": "apo", "sdss": "apo", "awr": "awr"}

Finding = tuple[tuple[str, ...], str]  # the keys that contradict each other, and the sentence


class Check(Protocol):
    """What the keys of one kind may be beside each other; the module `check` of its folder."""

    def contradictions(self, facts: "Facts") -> Iterator[Finding]:
        """What is impossible though each value alone is allowed."""
        ...

    def cautions(self, facts: "Facts") -> Iterator[str]:
        """What is possible, and unwise."""
        ...


class Commissioned(Protocol):
    """What a kind of drive adds to a commissioning; it may leave out others by `LEFT_OUT`, and have `encoders`."""

    BEFORE: "tuple[Step, ...]"
    AFTER: "tuple[Step, ...]"


def kind_of(configuration: "Configuration") -> "Kind":
    """What a configuration's kind of drive is here."""
    return cast("Kind", _part(configuration.drive.kind, "kind"))


def check_of(kind: str) -> Check:
    """What the keys of a kind may be beside each other."""
    return cast("Check", _part(kind, "check"))


def commissioning_of(kind: str) -> Commissioned:
    """The steps of a commissioning that a kind of drive has of its own."""
    return cast("Commissioned", import_module(f"mounts.{_FOLDERS[kind]}.commissioning"))


def part_of(kind: str, name: str) -> Any:  # noqa: ANN401 - a module
    """A module of the folder of a kind that not every kind has.

    Raises
    ------
    InputError
        It has none.
    """
    from importlib.util import find_spec  # noqa: PLC0415 - seldom needed

    having = [each for each in _FOLDERS if find_spec(f"clockdrive.drives.{_FOLDERS[each]}.{name}") is not None]
    if kind not in having:
        raise InputError(f'[drive] kind = "{kind}" has no {name.replace("_", " ")}; {" and ".join(having)} has')
    return _part(kind, name)


def _part(kind: str, name: str) -> object:
    return import_module(f"clockdrive.drives.{_FOLDERS[kind]}.{name}")
