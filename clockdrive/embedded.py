"""The simulator in the process of its telescope: its lines, its memory from one command to the next, its sky."""

import math
from typing import TYPE_CHECKING

from clockdrive.configuration import Configuration
from clockdrive.drives import kind_of
from clockdrive.state import StateStore
from mounts.errors import DriveError
from transports.link import Clock

if TYPE_CHECKING:
    from collections.abc import Callable

    from clockdrive.true_sky import Call, SimulatedSky
    from transports.memory import Device

_PERIOD_S = 1.0
_INHERITED = (
    "the simulator goes on as it was left {:.0f} s ago; give `state.path` another folder for a new one, or "
    "remove what this one holds"
)

_ANEW = "the simulator begins anew at park, as what an earlier build of it left cannot be read ({!r})"
_UNREADABLE = (DriveError, LookupError, TypeError, ValueError, AttributeError)


class Embedded:
    """The simulator of a configuration, as the store remembers it; a new one stands synchronised at park.

    Parameters
    ----------
    configuration : Configuration
        Of the telescope.
    store : StateStore
        Remembers it.
    clock : Clock
        The time.
    line : callable, optional
        Given a line of it, returns what the driver reaches in its place.
    """

    def __init__(
        self,
        configuration: Configuration,
        store: StateStore,
        clock: Clock,
        line: "Callable[[Device], Device] | None" = None,
    ) -> None:
        self._configuration, self._store, self._clock, self._line = configuration, store, clock, line
        self._kept_at = -math.inf
        self._sky: SimulatedSky | None = None
        kept, now = store.simulator(), clock.now()
        if kept is not None and kept[1] > now and "t0" in kept[0]:  # set back since: its own time goes on from now
            kept[0]["t0"] = float(str(kept[0]["t0"])) - (kept[1] - now)
        self.new = kept is None
        self.inherited = "" if kept is None else _INHERITED.format(max(0.0, now - kept[1]))
        """What must be said of one that was left by an earlier command; empty for a new one."""
        simulated = kind_of(configuration).simulated
        try:
            self.device = simulated(configuration, now, None if kept is None else kept[0])
        except _UNREADABLE as error:
            if kept is None:
                raise
            self.new, self.inherited = True, _ANEW.format(error)
            self.device = simulated(configuration, now, None)

    @property
    def lines(self) -> "tuple[Device, ...]":
        """Its lines, as the driver reaches them."""
        lines = self.device.lines
        return lines if self._line is None else tuple(self._line(each) for each in lines)

    def keep(self, *, at_once: bool) -> None:
        """Remember it, each second or at once."""
        now = self._clock.now()
        if at_once or now - self._kept_at >= _PERIOD_S:
            self._store.record_simulator(self.device.snapshot(), now)
            self._kept_at = now

    def sky(self, call: "Call") -> "SimulatedSky":
        """The sky over it, which asks it where `call` does its work."""
        if self._sky is None:
            from clockdrive.true_sky import SimulatedSky  # noqa: PLC0415 - only where a simulator is asked

            self._sky = SimulatedSky.of(self.device, self._configuration, self._clock, call)
        return self._sky
