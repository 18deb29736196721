"""A drive in a person's hands: what can be looked at and changed by hand, and who sees to it that it rests meanwhile.

All of it is called on the control thread.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NoReturn, TypeVar

from clockdrive.answers import Answer
from clockdrive.errors import Refused
from clockdrive.session.account import AT_REST

if TYPE_CHECKING:
    from clockdrive.configuration import Configuration
    from clockdrive.session import Session

T = TypeVar("T")


class AtRest:
    """Sees to it that the telescope is at rest while its drive is changed by hand.

    Parameters
    ----------
    session : Session
        Whose drive it is.
    configuration : callable
        Returns that with which the drive is compared; a polar alignment may change it.
    """

    def __init__(self, session: "Session", configuration: "Callable[[], Configuration]") -> None:
        self.session = session
        self._configuration = configuration

    @property
    def configuration(self) -> "Configuration":
        """What the drive is compared with."""
        return self._configuration()

    def changing(self, work: Callable[[], T]) -> T:
        """Change something at rest, and see at once what the unit says afterwards.

        Raises
        ------
        Refused
            The telescope moves, or is busy.
        """
        session = self.session
        session.require_free(parked=True)
        if session.doing not in AT_REST:
            raise Refused(f"the telescope is {session.doing}; registers are changed at rest only: `stop` first")
        try:
            return work()
        finally:
            session.poll()

    def done(self, text: str) -> Answer:
        """Answer with what was done, and keep it in the history."""
        self.session.note("drive", text)
        return Answer({"ok": True, "note": text})


class ByHand:
    """A drive in a person's hands; what its kind does not offer is refused.

    Parameters
    ----------
    at_rest : AtRest
        Whose drive it is.
    """

    instead = ""
    """What there is in place of registers, as a person does it."""

    def __init__(self, at_rest: AtRest) -> None:
        self.at_rest = at_rest

    def show(self, names: Sequence[str]) -> Answer:
        """What the drive tells, all or what a name is part of."""
        return told(self.at_rest.session.drive.registers(), names)

    def set(self, name: str, value: float | str, *, force: bool) -> Answer:  # noqa: ARG002 - a kind reads them
        """Write one register and read it back."""
        raise Refused(f"{name} cannot be set: {self.without}")

    def diff(self) -> Answer:
        """What the unit has otherwise than the configuration."""
        return self._refuse()

    def push(self, keys: Sequence[str]) -> Answer:  # noqa: ARG002 - likewise
        """Write what the configuration says into the unit."""
        return self._refuse()

    def raw(self, axis: str, text: str, *, confirmed: bool) -> Answer:  # noqa: ARG002 - likewise
        """Give the drive a command of its manual."""
        raise Refused(f"a drive of kind {self._kind} takes no commands by hand; `drive set` writes what it has")

    def set_clocks(self, *, confirmed: bool) -> Answer:  # noqa: ARG002 - likewise
        """Have the drive set its clocks."""
        raise Refused(f"a drive of kind {self._kind} has no clock that could be set")

    def save(self) -> Answer:
        """Have the unit keep its configuration over a power-cycle."""
        return self._refuse()

    def factory(self, *, confirmed: bool) -> Answer:  # noqa: ARG002 - likewise
        """Have the unit load its factory configuration."""
        return self._refuse()

    def reload(self, *, confirmed: bool) -> Answer:  # noqa: ARG002 - likewise
        """Have the unit load its saved configuration."""
        return self._refuse()

    def encoders(self) -> Answer:
        """What the encoders read, and where they say the axes are."""
        raise Refused(f"there are no absolute encoders to read: {self.without}")

    def fiducials(self, axis: str | None) -> Answer:  # noqa: ARG002 - likewise
        """The last passages of fiducials."""
        raise Refused(f"a drive of kind {self._kind} has no fiducials: `drive show` tells all that it has")

    @property
    def without(self) -> str:
        """That the drive has no registers, and what it has instead."""
        has = f"`drive show` tells all that it has{self.instead}"
        return f"a drive of kind {self._kind} has no registers of that kind: {has}"

    @property
    def _kind(self) -> str:
        return self.at_rest.configuration.drive.kind

    def _refuse(self) -> NoReturn:
        raise Refused(self.without)


def told(registers: Mapping[str, str], names: Sequence[str]) -> Answer:
    """What a drive tells, all or what a name is part of.

    Raises
    ------
    Refused
        Nothing has this name.
    """
    found = {name: text for name, text in registers.items() if not names or any(part in name for part in names)}
    if not found:
        raise Refused(f"nothing is called {names[0]!r}; there is {', '.join(registers)}")
    groups = {name: name.partition(" ")[0] if " " in name else "" for name in found}
    rows = {name: {"group": groups[name], "text": text, "raw": []} for name, text in found.items()}
    return Answer({"ok": True, "registers": rows})
