"""The parts of a telescope: session, commands, control thread; how work is put to them, stopped and closed."""

import queue
from contextlib import suppress
from typing import TYPE_CHECKING, TypeVar

from clockdrive import assembly, model_in_force
from clockdrive.adjusting import Adjusting
from clockdrive.automatic import Automatic
from clockdrive.centring import Centring
from clockdrive.choosing import Choosing
from clockdrive.clock import SystemClock
from clockdrive.configuration import Configuration
from clockdrive.control import Steps, control_for
from clockdrive.direct_speed import DirectSpeed
from clockdrive.drive_registers import DriveRegisters
from clockdrive.drives import kind_of
from clockdrive.embedded import Embedded
from clockdrive.guiding import Guiding
from clockdrive.mount_registers import MountRegisters
from clockdrive.owner import Ownership
from clockdrive.planning import (
    Drift,
    drifting,
    posix,
    resolve,
    sources_of,
)
from clockdrive.session import Session
from clockdrive.slewing import Slewing
from clockdrive.state import StateStore
from mounts.errors import StillMoving
from pointing.targets import Target

if TYPE_CHECKING:
    from collections.abc import Callable

    from clockdrive.planning import TargetLike, TimeLike
    from clockdrive.pointing_runs import PointingRuns
    from transports.link import Clock
    from transports.memory import Device

T = TypeVar("T")


class Parts:
    """What every part of a telescope works with; see `Telescope`."""

    def __init__(
        self,
        configuration: Configuration,
        clock: "Clock | None" = None,
        *,
        command: str = "Python",
        line: "Callable[[Device], Device] | None" = None,
    ) -> None:
        self._kind = kind_of(configuration)
        self.clock = clock or SystemClock()
        self.configuration = configuration
        self._closed = False
        self._replies: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._embedded: Embedded | None = None
        self._runs: PointingRuns | None = None
        identity = configuration.identity
        self.ownership = Ownership(
            configuration.state_directory,
            identity,
            name=configuration.site.name or identity,
            command=command,
            time=self.clock.now(),
        )
        try:
            self._store = StateStore(configuration.state_directory, identity)
            self._session = self._opened(line)
        except BaseException:
            self.ownership.release()
            raise
        self._slewing = Slewing(self._session)
        self._adjusting = Adjusting(self._session)
        self._guiding = Guiding(self._session, self.configuration.mount.guide_rate)
        self._centring = Centring(self._session, self._slewing)
        self._choosing = Choosing(self._session, self._slewing, self._instruments)
        self._direct = DirectSpeed(self._session)
        self._automatic = Automatic(
            self._session,
            self._slewing,
            flips=self.configuration.mount.flip == "auto",
            escapes=self.configuration.limits.sun_escape == "away",
        )
        self._control = control_for(self.clock, self._automatic.cycle)
        self.drive = DriveRegisters(self._session, lambda: self.configuration, self._control)
        """The drive's own registers: show, set, diff, push, save, factory, reload, encoders."""

    def stop(self) -> None:
        """Stop everything at once, tracking included; jumps the queue.

        Raises
        ------
        StillMoving
            A drive without a stop sends nothing more, and ends by itself what is under way: when, the text says.
        """

        def stop() -> None:
            self._automatic.cancel()
            self._session.stop()

        self._control.interrupt(stop, "stopped by command")

    def close(self, *, keep_tracking: bool = False) -> bool:
        """Leave the drive safe and give up the telescope; return whether it goes on tracking."""
        if self._closed:
            return False
        self._closed = True
        self._control.close()
        try:
            return self._session.close(keep_tracking=keep_tracking)
        finally:
            if self._runs is not None:
                self._runs.close()
            self._store.close()
            self.ownership.release()

    def _opened(self, line: "Callable[[Device], Device] | None") -> Session:
        configuration, now = self.configuration, self.clock.now()
        try:
            memory = self._store.learnt("drive")
            if configuration.simulated:
                self._embedded = Embedded(configuration, self._store, self.clock, line)
                memory = self._kind.memory_at_park(configuration, now) if self._embedded.new else memory
            lines = self._embedded.lines if self._embedded else ()
            drive, self.configuration = self._kind.drive(
                configuration, self.clock, lines, memory, lambda kept: self._store.learn("drive", kept, now)
            )
            self._instruments = assembly.instruments(self.configuration)
            planner = self._instruments.planner
            chosen = self._store.instrument()
            if chosen is not None and chosen in self._instruments.sections:  # else it is no longer configured
                self._instruments.take(chosen)
            around = assembly.surroundings(self.configuration, planner, self.clock)
            session = Session(planner, drive, self._store, self.clock, self._read, around)
            self._model = model_in_force.ModelInForce(session, configuration.state_directory)
            self._model.take_up()
            self._registers = MountRegisters(session, self.configuration, self._reconfigured)
            session.open(make_safe=self.ownership.previous_owner_died)
            if self._embedded is not None and self._embedded.inherited:
                session.note("simulator", f"{self._embedded.inherited}: {configuration.state_directory}")
        except BaseException:
            self._store.close()
            raise
        return session

    def _read(self) -> None:
        """Each reading of the drive moves its simulator on, which is remembered."""
        if self._embedded is not None:
            self._embedded.keep(at_once=self._closed)

    def _reconfigured(self, configuration: Configuration) -> None:
        self.configuration = configuration

    def _perform(self, steps: Steps[T]) -> T:
        """Run a command that moves the telescope; an interruption of the waiting stops it first."""
        try:
            return self._control.perform(steps)
        except KeyboardInterrupt:
            with suppress(StillMoving):  # an event says so
                self.stop()
            raise

    def _time(self, at: "TimeLike | None") -> float:
        return self.clock.now() if at is None else posix(at)

    def _target(self, given: "TargetLike", time: float, drift: Drift | None = None) -> Target:
        return drifting(resolve(given, self._session.planner, time, sources_of(self.configuration)), drift, time)
