"""Who does the work: the running owner of the telescope, or this command as its owner for its own duration."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from clockdrive.configuration import Configuration, load
from clockdrive.errors import ClockdriveError, OwnedElsewhere
from mounts.errors import DriveError
from transports.errors import TransportError

if TYPE_CHECKING:
    from clockdrive.telescope import Telescope

_MOVING = frozenset(
    {"centre", "drive_at", "flip", "goto", "home", "instrument", "jog", "park", "pointing_run"}
    | {"polar_anew", "polar_begin", "polar_look"}
)

OnEvent = Callable[[Mapping[str, Any]], object]


class Backend(Protocol):
    """Where calls go."""

    attached: bool
    leaves_tracking: bool
    tracks_alone: bool

    def call(self, name: str, on_event: OnEvent | None = None, **args: object) -> dict[str, Any]:
        """Make a call of `clockdrive.service` and wait for its result."""
        ...


class Attached:
    """The running owner, through its control socket."""

    attached = True
    tracks_alone = True  # the owner goes on with it

    def __init__(self, client: Any) -> None:  # noqa: ANN401 - a ControlClient, imported by `attach`
        self._client = client
        self.leaves_tracking = True

    def call(self, name: str, on_event: OnEvent | None = None, **args: object) -> dict[str, Any]:
        """Let the owner do it; an interruption of what moves the telescope stops it."""
        try:
            result = self._client.call(name, args, on_event)
        except KeyboardInterrupt:
            if name in _MOVING:
                self._client.call("stop")
            raise
        return dict(result or {})


class Owning:
    """The process that runs, which other terminals reach meanwhile."""

    attached = False

    def __init__(self, telescope: "Telescope") -> None:
        from clockdrive.service import Service  # noqa: PLC0415 - what needs no telescope starts without

        self._service = Service(telescope)
        telescope.ownership.serve(self._service)
        self.leaves_tracking = False
        self.tracks_alone = telescope.tracks_alone
        self.answer: dict[str, Any] = {}
        """To the last call."""

    def call(self, name: str, on_event: OnEvent | None = None, **args: object) -> dict[str, Any]:
        """Do it here; an interruption of what moves the telescope stops it."""
        result = self._service(name, args, on_event or (lambda event: None))  # noqa: ARG005 - nobody listens
        self.answer = dict(result) if isinstance(result, Mapping) else {}
        return self.answer

    def has_said(self, beginning: str) -> bool:
        """Whether a note of the last answer began so."""
        return any(str(note).startswith(beginning) for note in self.answer.get("notes", ()))


def configuration_of(
    path: str | None, *, with_files: bool = False, overrides: Mapping[str, object] | None = None
) -> Configuration:
    """Load the configuration and say what must be said of it."""
    configuration = load(path, overrides=overrides, with_files=with_files)
    if configuration.notice:
        print(f"clockdrive: {configuration.notice}", file=sys.stderr)
    return configuration


def running(configuration: Configuration) -> Attached | None:
    """The owner that runs, if there is one."""
    from clockdrive.owner import attach  # noqa: PLC0415 - what needs no telescope starts without

    client = attach(configuration.state_directory, configuration.identity)
    return None if client is None else Attached(client)


@contextmanager
def backend(
    path: str | None, command: str, *, keep_tracking: bool = False, may_attach: bool = True
) -> Iterator[Backend]:
    """The owner that runs, or else this process, until the block ends.

    Parameters
    ----------
    path : str or None
        The configuration file.
    command : str
        What this process does, for those whom it keeps out.
    keep_tracking : bool
        Leave a drive that tracks tracking when this process ends; `leaves_tracking` may still change it.
    may_attach : bool
        Whether another owner may do the work; else that there is one is an error.

    Raises
    ------
    ClockdriveError, DriveError, TransportError
        The telescope cannot be opened, or could not be left as it should be.
    """
    configuration = configuration_of(path)
    owner = running(configuration) if may_attach else None
    if owner is not None:
        yield owner
        return
    from clockdrive.left_alone import UNSTOPPED  # noqa: PLC0415 - as above
    from clockdrive.owner import unanswered  # noqa: PLC0415 - as above
    from clockdrive.telescope import Telescope  # noqa: PLC0415 - as above

    try:
        telescope = Telescope(configuration, command=command)
    except OwnedElsewhere as error:
        frozen = unanswered(configuration.state_directory, configuration.identity) if may_attach else ""
        raise OwnedElsewhere(frozen or str(error)) from error
    try:
        owning = Owning(telescope)
        owning.leaves_tracking = keep_tracking
        yield owning
    except BaseException:
        with _told():
            telescope.close(keep_tracking=keep_tracking)
        raise
    left = telescope.left_alone() or "the drive goes on tracking by itself, bounded by its own soft limits"
    wanted = owning.leaves_tracking and telescope.is_tracking
    if telescope.close(keep_tracking=owning.leaves_tracking):
        if not owning.has_said(UNSTOPPED):
            print(f"clockdrive: {left}", file=sys.stderr)
    elif wanted:
        print("clockdrive: the telescope was stopped", file=sys.stderr)


@contextmanager
def interruption_stops(telescope: Backend) -> Iterator[None]:
    """Stop the telescope when the block is interrupted, between its calls as well as in them."""
    try:
        yield
    except KeyboardInterrupt:
        if note := telescope.call("stop").get("note"):
            print(f"clockdrive: {note}", file=sys.stderr)
        raise


@contextmanager
def _told() -> Iterator[None]:
    """Say what went wrong on the way out, and let what went wrong before be the outcome."""
    try:
        yield
    except (ClockdriveError, DriveError, TransportError) as error:
        print(f"clockdrive: {error}", file=sys.stderr)
