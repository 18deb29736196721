"""A telescope to be used from Python: astropy types in, answers out; one control thread behind it.

`Telescope` is the owner of its drive while it is open. Every command is also reachable through the control socket
(`clockdrive.service`), so other terminals use the same telescope.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from clockdrive.configuration import load
from clockdrive.configuration_keys import DEFAULT_KIND
from clockdrive.telescope.correcting import Correcting
from clockdrive.telescope.looking import Looking
from clockdrive.telescope.moving import Moving, nobody

if TYPE_CHECKING:
    from transports.link import Clock
    from transports.memory import Device

__all__ = ["Telescope", "nobody"]


class Telescope(Moving, Correcting, Looking):
    """One telescope, opened and owned.

    Use `open` or `simulated`; leave it with `close` or as a context manager.

    Parameters
    ----------
    configuration : Configuration
        What it is.
    clock : Clock, optional
        The time; the computer's own by default.
    command : str
        Who opens it, as other processes are told.
    line : callable, optional
        Given a line of the embedded simulator, returns what the driver reaches in its place: a faulty line to it.

    Raises
    ------
    ConfigurationError, OwnedElsewhere, DriveError, TransportError
        It cannot be opened; nothing was moved.
    """

    @classmethod
    def open(
        cls,
        path: str | Path | None = None,
        *,
        overrides: Mapping[str, object] | None = None,
        clock: "Clock | None" = None,
    ) -> Self:
        """Open the telescope of a configuration file; without one, the embedded simulator."""
        return cls(load(path, overrides=overrides), clock)

    @classmethod
    def simulated(
        cls,
        kind: str = DEFAULT_KIND,
        *,
        overrides: Mapping[str, object] | None = None,
        clock: "Clock | None" = None,
        line: "Callable[[Device], Device] | None" = None,
    ) -> Self:
        """Open an embedded simulator; `overrides` are configuration values by dotted name.

        It goes on as it was left, parked or unsynchronised, by the last who opened one of this kind, and says so; one
        with `state.path` of its own in `overrides` begins anew.
        """
        configuration = load(None, overrides={"drive.kind": kind, "drive.link": "sim:", **(overrides or {})})
        return cls(configuration, clock, line=line)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Telescope {self.configuration.identity}: {self._session.doing}>"
