"""A link that is kept open from request to request, closed after a doubt, and opened anew for the next one."""

from collections.abc import Callable, Iterator

from transports.errors import LinkError
from transports.link import Clock, Link

REOPEN_PAUSE_S = 0.1
"""Between attempts to open: what serves one client at a time may still hold the last connection."""
CHUNK = 4096
"""Bytes that are read at once."""


class LinkAtNeed:
    """A link to whatever `open_link` opens: opened when it is needed, and anew after it was closed.

    Parameters
    ----------
    open_link : callable
        Opens the link; raises `LinkError`.
    renewed : callable
        Called when it was opened: what was heard before says nothing of what comes now.

    Attributes
    ----------
    name : str
        The address of the link last opened.
    """

    def __init__(self, open_link: Callable[[], Link], renewed: Callable[[], object] = lambda: None) -> None:
        self.name = "link not opened yet"
        self._open = open_link
        self._renewed = renewed
        self._link: Link | None = None

    def opened(self) -> Link:
        """Return the link, open.

        Raises
        ------
        LinkError
            It cannot be opened.
        """
        if self._link is None:
            self._link = self._open()
            self.name = self._link.name
            self._renewed()
        return self._link

    def close(self) -> None:
        """Close it; what is asked next opens it again."""
        if self._link is not None:
            self._link.close()
            self._link = None


class KeptLink(LinkAtNeed):
    """One that is opened again and again until it is in step.

    Parameters
    ----------
    open_link : callable
        Opens the link, and opens it anew after a doubt; raises `LinkError`.
    clock : Clock
        Measures deadlines and lets pauses pass.
    deadline_s : float
        For which opening is tried, as errors say it.
    remedy : str
        What to do where it cannot be opened.
    """

    def __init__(self, open_link: Callable[[], Link], clock: Clock, *, deadline_s: float, remedy: str) -> None:
        super().__init__(open_link)
        self._clock = clock
        self._deadline = deadline_s
        self._remedy = remedy

    def in_step(self, is_clear: Callable[[Link], bool], settle: Callable[[Link], None], latest: float) -> Link:
        """Return the link, open and in step.

        Parameters
        ----------
        is_clear : callable
            Whether nothing is left on a link that is open; else it is opened anew.
        settle : callable
            Brings a link just opened in step; it may raise `LinkError`, and is then tried again on another.
        latest : float
            POSIX seconds, by which it must have begun.

        Raises
        ------
        LinkError
            It cannot be opened, or does not settle. What else `settle` raises is for whoever calls.
        """
        if self._link is not None and not is_clear(self._link):
            self.close()
        while self._link is None:
            try:
                settle(self.opened())
            except LinkError as error:
                self.close()
                if self._clock.now() + REOPEN_PAUSE_S > latest:
                    raise LinkError(f"{error}; tried for {self._deadline:g} s: {self._remedy}") from error
                self._clock.sleep(REOPEN_PAUSE_S)
        return self._link

    def drained(self, link: Link, quiet_s: float, latest: float) -> Iterator[bytes]:
        """Read until nothing came for `quiet_s`; yield what came.

        Raises
        ------
        LinkError
            It does not fall silent by `latest`, or was lost.
        """
        while data := link.read(CHUNK, quiet_s):
            yield data
            if self._clock.now() > latest:
                raise LinkError(f"{link.name}: the line does not fall silent; check cable, baud rate and earth")
