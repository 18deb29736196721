"""A telescope to be used from Python: astropy types in, answers out; one control thread behind it.

`Telescope` is the owner of its drive while it is open. Every command is also reachable through the control socket
(`clockdrive.service`), so other terminals use the same telescope.
"""

import math
import queue
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeVar

from clockdrive import assembly, model_in_force, parse
from clockdrive.adjusting import Adjusting
from clockdrive.answers import (
    Answer,
    AxesAnswer,
    PassAnswer,
    PlanAnswer,
    arrival_answer,
    centred_answer,
    instrument_answer,
    plan_answer,
)
from clockdrive.automatic import Automatic
from clockdrive.axis_names import axis_of
from clockdrive.centring import Centring
from clockdrive.choosing import Choosing
from clockdrive.clock import SystemClock
from clockdrive.configuration import Configuration, load
from clockdrive.configuration_keys import DEFAULT_KIND
from clockdrive.control import Steps, control_for
from clockdrive.direct_speed import DirectSpeed
from clockdrive.drive_registers import DriveRegisters
from clockdrive.drives import kind_of
from clockdrive.embedded import Embedded
from clockdrive.errors import ArgumentError, finite
from clockdrive.guiding import Guiding
from clockdrive.left_alone import NOWHERE
from clockdrive.mount_registers import NAMES, MountRegisters
from clockdrive.owner import Ownership
from clockdrive.pass_search import searched, wanted_of
from clockdrive.planning import (
    Drift,
    answered,
    drift_of,
    drifting,
    notes_at,
    plan_or_pass,
    posix,
    rates_of,
    resolve,
    sources_of,
)
from clockdrive.rotating import hold_of
from clockdrive.session import Session
from clockdrive.slewing import Arrival, Progress, Report, Slewing
from clockdrive.state import Event, StateStore
from clockdrive.status import status_of
from mounts.errors import StillMoving
from pointing.errors import Unreachable
from pointing.mount import Posture
from pointing.pass_plan import PassPlan
from pointing.plan import Plan
from pointing.rotator import Hold
from pointing.targets import Target

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord
    from astropy.io.fits import Header

    from clockdrive.alignment import Alignment
    from clockdrive.commission import Stage
    from clockdrive.drives.kind import Simulated
    from clockdrive.observing import RunProgress
    from clockdrive.planning import TargetLike, TimeLike
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.run_report import RunReport
    from clockdrive.run_taking import RunSettings
    from clockdrive.true_sky import SimulatedSky
    from clockdrive.witness import SkyWitness
    from mounts.commissioning import Finding
    from pointing.model.fitted import Fit
    from pointing.model.pointing_model import PointingModel
    from pointing.model.words import Pole
    from transports.link import Clock
    from transports.memory import Device

T = TypeVar("T")
_PATIENCE_S = 0.5  # with another process that writes runs: the control thread has a telescope
_LONGEST_WAIT_S = 1800.0  # that `goto` waits for a satellite


def nobody(progress: Progress) -> None:
    """Watch no progress."""


class Telescope:
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

    # Moving ----------------------------------------------------------------------------------------------------

    def plan(
        self,
        target: "TargetLike",
        at: "TimeLike | None" = None,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> PlanAnswer | PassAnswer:
        """Plan a slew, or the pass of a satellite that is not up yet; nothing moves.

        Parameters
        ----------
        target : str, SkyCoord or Target
            Whatever the command line takes, or a place.
        at : float, datetime, Time or str, optional
            When the slew would start; now by default.
        rate_arcsec_s : sequence of two floats, optional
            Rates of one's own, east (with cos Dec) and north on the sky, on top of the target's own motion.
        rate_from : float, datetime, Time or str, optional
            When these have not displaced the target yet; when the slew starts by default.
        rotator : str, optional
            What the instrument rotator is to hold: `sky`, `horizon` or `mount`; as configured by default.
        position_angle_deg : float, optional
            At which angle: to the east of north, of the zenith, or of the tube's upper side.

        Raises
        ------
        TargetError, Unreachable, Refused
            It is no target; it cannot be reached; the position is not synchronised.
        """
        self._control.require_open()
        time = self._time(at)
        resolved = self._target(target, time, drift_of(rate_arcsec_s, rate_from))
        hold = hold_of(self._session.planner.rotator, rotator, position_angle_deg)
        found = self._planned(resolved, None if at is None else time, hold)
        around = self._session.surroundings
        notes, unsure = self._instruments.notes, self._control.call(self._session.uncertainty_counts)
        return answered(found, time, self._session.planner, around, resolved, notes, unsure)

    def goto(
        self,
        target: "TargetLike",
        progress: Report = nobody,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> Answer:
        """Slew to a target and track it; returns on arrival, tracking goes on until `stop` or `close`.

        Rates of one's own and what the rotator holds, as for `plan`, go on for as long as it is tracked. A satellite
        that comes up within half an hour is waited for.
        """
        resolved = self._target(target, self.clock.now(), drift_of(rate_arcsec_s, rate_from))
        self._control.call(self._session.require_free)
        hold = hold_of(self._session.planner.rotator, rotator, position_angle_deg)
        found = self._planned(resolved, None, hold)
        ahead = found if isinstance(found, PassPlan) else None
        if ahead is not None and ahead.reachable > self.clock.now() + _LONGEST_WAIT_S:
            most = f"`goto` waits for at most {_LONGEST_WAIT_S / 60:.0f} minutes: give it again then"
            raise Unreachable(f"{ahead.target} is not up yet; {most}", ahead.reachable)
        arrival = self._perform(self._gone_to(resolved, progress, ahead, hold))
        return self._arrived(arrival, resolved)

    def flip(self, progress: Report = nobody) -> Answer:
        """Take up the tracked target in the other posture, by a safe way; a German mount changes sides."""
        arrival = self._perform(self._slewing.flip(progress))
        return self._arrived(arrival)

    def park(self, progress: Report = nobody) -> PlanAnswer:
        """Go to the park position and stay there."""
        plan = self._perform(self._slewing.park(self._configured("park_deg"), progress))
        return self._answered(plan)

    def unpark(self) -> bool:
        """Allow motion again; return whether it was parked."""
        return self._control.call(self._session.unpark)

    def home(self, progress: Report = nobody) -> PlanAnswer:
        """Go to the centre of both axes and stay there."""
        plan = self._perform(self._slewing.to_angles("home", self._configured("centre_deg"), progress))
        return self._answered(plan)

    def jog(
        self,
        axis: int | str,
        deg_s: float,
        seconds: float,
        progress: Report = nobody,
    ) -> PlanAnswer:
        """Move one axis at a speed for a time; it cannot go further than that, whatever happens to the host.

        Parameters
        ----------
        axis : int or str
            1, `axis1` or `azimuth`; 2, `axis2` or `altitude`; 3 or `rotator`.
        deg_s, seconds : float
            Degrees a second, and for how long.
        progress : callable
            Told of the way.

        Raises
        ------
        ArgumentError, Refused, Unreachable
            There is no such axis; the speed is impossible; a limit forbids the way.
        """
        which = axis_of(axis, 2 if self._session.planner.rotator is None else 3)
        rate = math.radians(finite("a jog at", deg_s, "degrees a second"))
        steps = self._slewing.jog(which, rate, finite("a jog for", seconds, "seconds"), progress)
        return self._answered(self._perform(steps))

    def drive_at(self, deg_s_1: float, deg_s_2: float, seconds: float, progress: Report = nobody) -> Answer:
        """Move both axes at speeds for a time, then ramp them down; a dead-man process stands beside the drive.

        Raises
        ------
        Refused, Unreachable, DriveError
            Not now, not so fast or not that way; the telescope is at rest.
        """
        one, two = (finite("a speed of", each, "degrees a second") for each in (deg_s_1, deg_s_2))
        rates, seconds = (math.radians(one), math.radians(two)), finite("a speed for", seconds, "seconds")
        moved = self._perform(self._direct.move(rates, seconds, progress))
        ends = {"from_deg": moved.start, "to_deg": moved.end}
        shown = {name: [math.degrees(angle) for angle in angles] for name, angles in ends.items()}
        return Answer({"ok": True, "seconds": moved.seconds, **shown})

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

    def wait(self, seconds: float) -> None:
        """Let time pass while the telescope goes on tracking."""
        self._control.let_pass(finite("a wait of", seconds, "seconds"))

    # Asking ----------------------------------------------------------------------------------------------------

    def rates(
        self,
        target: "TargetLike",
        at: "TimeLike | None" = None,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> AxesAnswer:
        """Tracking rates of both axes at a time; rates of one's own and the rotator as for `plan`."""
        self._control.require_open()
        time = self._time(at)
        wanted, planner = self._target(target, time, drift_of(rate_arcsec_s, rate_from)), self._session.planner
        return rates_of(planner, wanted, time, hold_of(planner.rotator, rotator, position_angle_deg))

    def passes(
        self,
        target: "TargetLike",
        hours: float = 24.0,
        at: "TimeLike | None" = None,
        *,
        above_deg: float | None = None,
        progress: Callable[[float, str], object] | None = None,
    ) -> Answer:
        """Search when a target, or each satellite of a TLE file, can be observed, as `clockdrive passes` does.

        Parameters
        ----------
        target : str, SkyCoord or Target
            Whatever `plan` takes, or the path of a TLE file.
        hours : float
            For how long to search.
        at : float, datetime, Time or str, optional
            From when on; now by default.
        above_deg : float, optional
            An altitude that must be exceeded besides the limits.
        progress : callable, optional
            Called with the fraction that is done and the name of what is looked at.

        Raises
        ------
        InputError, TargetError
            The time or the altitude is none; it is no target.
        """
        self._control.require_open()
        planner, time = self._session.planner, self._time(at)
        wanted = wanted_of(target, planner, time, self.configuration)
        return searched(planner, wanted, time, hours, above_deg, progress)

    def header(self) -> "Header":
        """FITS cards of where the telescope points now, as `clockdrive header`.

        Raises
        ------
        Refused
            The position may be wrong.
        """
        from clockdrive.fits_header import cards  # noqa: PLC0415 - astropy takes a second to load

        return cards(self.status().json, self.configuration)

    def status(self) -> Answer:
        """Everything that is known now: position, activity, limits, corrections in force, notes."""
        return self._control.call(
            lambda: Answer(status_of(self._session, self._store, self.configuration, self._instruments.name))
        )

    def events(self, limit: int = 100) -> tuple[Event, ...]:
        """What happened, newest first."""
        self._control.require_open()
        return self._store.events(limit=limit)

    def registers(self) -> dict[str, str]:
        """The drive's own registers by name, as a person reads them."""
        return self._control.call(lambda: dict(self._session.drive.registers()))

    @property
    def simulator(self) -> "Simulated | None":
        """The embedded simulator, to be asked what it really does."""
        return None if self._embedded is None else self._embedded.device

    @property
    def true_sky(self) -> "SimulatedSky | None":
        """The sky over the embedded simulator, which knows where it really points and has its knobs."""
        return None if self._embedded is None else self._embedded.sky(self._control.call)

    def true_place(self) -> "SkyCoord | None":
        """Where the tube of the embedded simulator really points now, in `AltAz`; None without one."""
        from clockdrive.quantities import observed_place  # noqa: PLC0415 - astropy takes a second to load

        sky = self.true_sky
        site = self._session.planner.sky.site
        return None if sky is None else observed_place(sky.observed(), self.clock.now(), site)

    # Correcting ------------------------------------------------------------------------------------------------

    def sync(self, target: "TargetLike", posture: Posture | None = None, *, force: bool = False) -> float:
        """Declare that the telescope points at a target now; returns the correction in degrees."""
        resolved = self._target(target, self.clock.now())
        return self._control.call(lambda: self._adjusting.sync(resolved, posture, force=force))

    def sync_rotator(
        self, angle_deg: float | None = None, *, position_angle_deg: float | None = None, force: bool = False
    ) -> float:
        """Declare where the instrument rotator stands now, the axes being right; returns the correction in degrees.

        Parameters
        ----------
        angle_deg : float, optional
            Its own angle, as on its scale.
        position_angle_deg : float, optional
            Instead: of the instrument's y axis from north through east, as a solved image taken now tells.
        force : bool
            Accept a correction beyond 5°.

        Raises
        ------
        ArgumentError, Refused
            Not exactly one angle is given; there is no rotator, it slews, or stands at no such angle.
        """
        from clockdrive.rotator_sync import sync_rotator  # noqa: PLC0415 - seldom needed

        given = [
            None if each is None else finite(f"a {what} of", each, "degrees")
            for what, each in (("rotator angle", angle_deg), ("position angle", position_angle_deg))
        ]
        return self._control.call(lambda: sync_rotator(self._session, given[0], given[1], force=force))

    def offset(self, east_arcsec: float, north_arcsec: float) -> None:
        """Displace this and all later targets on the sky, arcseconds; adds to the offset in force.

        Raises
        ------
        Refused
            A total is beyond a degree, or a limit forbids it.
        """
        east, north = (finite("an offset of", each, "arcseconds") for each in (east_arcsec, north_arcsec))
        self._control.call(lambda: self._adjusting.offset(east, north))

    def guide(self, direction: str, milliseconds: float) -> tuple[float, float]:
        """Displace what is tracked by `guide_rate` × sidereal × time, on the sky; a new goto or a sync ends it.

        Parameters
        ----------
        direction : str
            `north`, `south`, `east` (increasing right ascension) or `west`.
        milliseconds : float
            1 to 10000.

        Returns
        -------
        tuple of float
            The sum of all pulses on this target, arcseconds east and north.

        Raises
        ------
        Refused
            Nothing is tracked, it slews, or the pulse is none.
        """
        return self._control.call(lambda: self._guiding.pulse(direction, milliseconds))

    def centre(
        self,
        coord: "TargetLike",
        at: "TimeLike | None" = None,
        progress: Report = nobody,
        *,
        force: bool = False,
    ) -> Answer:
        """Bring the target onto the pointing origin, by where an image says that the telescope pointed.

        Subtracted is: where the counts said at the middle of the exposure, minus where the image says. It replaces
        the centring before, and clears guide pulses; a person's offset stays. A new goto or a sync ends it.

        Parameters
        ----------
        coord : SkyCoord, str or Target
            The place in the image that is on the pointing origin in force: text is ICRS, two numbers degrees.
        at : float, datetime, Time or str, optional
            Middle of the exposure, at most 20 minutes ago; now by default.
        progress : callable
            Told of the slew that more than 60″ takes.
        force : bool
            Accept a pointing error beyond 5°.

        Raises
        ------
        Refused, Unreachable, TargetError
            Nothing is tracked; the moment is not known; beyond 5°; nothing allowed leads there; or it is no place.
        """
        moment = None if at is None else posix(at)
        seen = parse.place(coord) if isinstance(coord, str) else self._target(coord, self._time(at))
        steps = self._centring.centre(seen, moment, progress, force=force)
        return centred_answer(self._perform(steps), self._instruments.name)

    def instrument(self, name: str | None = None, progress: Report = nobody) -> Answer:
        """Say which pointing origin is in force, or put targets on another: what is tracked is slewn onto it.

        Raises
        ------
        Refused, Unreachable
            There is no such instrument; not now; or the target cannot be put on it.
        """
        self._control.require_open()
        moved = False if name is None else self._perform(self._choosing.choose(name, progress))
        return instrument_answer(self._instruments, moved=moved)

    def clear(self, correction: str) -> None:
        """Remove a correction by its name in `status`, or both of a kind: `offset`, `guide`, `centre`."""

        def clear() -> None:
            if correction == model_in_force.NAME and self._model.by_hand:
                self._model.clear()
            elif correction in NAMES and self._registers.by_hand:
                self._registers.clear()
            else:
                self._adjusting.clear(correction)

        self._control.call(clear)

    def power(self, *, on: bool) -> None:
        """Power the motors, or send the drive to standby; standby stops the telescope first."""
        self._control.call(lambda: self._session.power(on=on))

    # Pointing runs ---------------------------------------------------------------------------------------------

    @property
    def runs(self) -> "PointingRuns":
        """The pointing runs that are kept of this telescope."""
        from clockdrive.pointing_runs import PointingRuns  # noqa: PLC0415 - the mathematics takes 0.2 s to load
        from clockdrive.run_store import RunStore  # noqa: PLC0415 - likewise

        if self._runs is None:
            where = self.configuration.state_directory, self.configuration.identity
            store = RunStore(*where, patience_s=_PATIENCE_S)
            self._runs = PointingRuns(store, lambda: self._registers.in_force, self._store.zero)
        return self._runs

    def pointing_run(
        self,
        stars: int = 50,
        witness: "str | SkyWitness" = "simulator",
        *,
        name: str | None = None,
        resume: bool = False,
        append: bool = False,
        bright: bool = False,
        settle_s: float = 1.0,
        watch: "Callable[[RunProgress], object]" = lambda progress: None,  # noqa: ARG005 - nobody watches
        ask: Callable[[str], object] = print,
    ) -> "RunReport":
        """Look at stars all over the reachable sky, keep where the telescope really pointed, and fit that.

        Parameters
        ----------
        stars : int
            How many; not asked for a run that is resumed.
        witness : str or SkyWitness
            Who tells where the telescope points: `simulator`, `command:PROGRAM`, `typed`.
        name : str, optional
            Of the run; by default the moment at which it begins, or the newest to resume or append to.
        resume, append : bool
            Go on with a run that was interrupted; add stars to a run, on another night as well.
        bright : bool
            Go to bright stars, for a witness that must see one; by default to places of the sky.
        settle_s : float
            Between the arrival and the look.
        watch : callable
            Told of each place before and after it.
        ask : callable
            Asks the person for a place, for the witness `typed`; `reply` answers.

        Raises
        ------
        Refused
            Not now; the telescope does not go, or the witness sees nothing. What was seen is kept.
        InputError, WitnessError, PointingError, TooFewStars
            The run, its name or its witness is none; too few stars were seen for a fit.
        """
        from clockdrive.run_taking import RunSettings  # noqa: PLC0415 - as in `runs`

        wanted = RunSettings(stars, name, resume, append, bright, finite("settling for", settle_s, "seconds"))
        return self.runs.report(self.take_run(wanted, witness, watch, ask))

    def take_run(
        self,
        wanted: "RunSettings",
        witness: "str | SkyWitness",
        watch: "Callable[[RunProgress], object]",
        ask: Callable[[str], object],
    ) -> str:
        """Take a run as `pointing_run` does, and fit nothing; return its name."""
        from clockdrive.run_taking import RunTaking  # noqa: PLC0415 - as in `runs`

        taking = RunTaking(self._session, self._slewing, self.runs)
        seer = self._sky_witness(witness, ask)
        who = witness if isinstance(witness, str) else type(witness).__name__
        name = self._control.call(lambda: taking.begun(wanted, who))
        self._perform(taking.observing.run(name, seer, wanted.settle_s, watch))
        return name

    def try_witness(
        self, witness: "str | SkyWitness" = "simulator", *, ask: Callable[[str], object] = print
    ) -> dict[str, object]:
        """Let a witness look once where the telescope rests, and say how far off it is seen; nothing moves.

        Raises
        ------
        Refused, WitnessError
            The telescope does not rest; the witness sees nothing.
        """
        from clockdrive.observing import Observing  # noqa: PLC0415 - as in `runs`

        seer = self._sky_witness(witness, ask)
        return self._perform(Observing(self._session, self._slewing, self.runs.store).tried(seer))

    def polar_alignment(
        self,
        witness: "str | SkyWitness" = "simulator",
        *,
        pole: "Pole" = "true",
        goal_arcsec: float = 20.0,
        scatter_arcsec: float = 1.0,
        settle_s: float = 1.0,
        report: Callable[[str], object] = lambda text: None,  # noqa: ARG005 - nobody reads
        ask: Callable[[str], object] = print,
    ) -> "Alignment":
        """Look at three stars and say what to turn on the mount; each `look()` at the result says what is left.

        Parameters
        ----------
        witness, settle_s, ask
            As for `pointing_run`.
        pole : str
            To which a polar axis shall point: the `true` pole, or the `refracted` one.
        goal_arcsec : float
            How near is near enough.
        scatter_arcsec : float
            What a look scatters beyond what its witness says: periodic error, flexure without a model.
        report : callable
            Told of each star.

        Raises
        ------
        Refused, WitnessError
            Not now; too few stars were seen.
        """
        from clockdrive.aligning import AlignmentSettings  # noqa: PLC0415 - as in `runs`
        from clockdrive.alignment import Alignment  # noqa: PLC0415 - likewise

        seer = self._sky_witness(witness, ask)
        settings = AlignmentSettings(
            pole,
            finite("a goal of", goal_arcsec, "arcseconds"),
            finite("a scatter of", scatter_arcsec, "arcseconds"),
            finite("settling for", settle_s, "seconds"),
        )
        return Alignment.begun(
            self._session,
            self._slewing,
            self.runs,
            self._registers,
            seer,
            settings,
            self._control,
            self._perform,
            report,
        )

    def use_model(self, model: "Fit | PointingModel | RunReport | str | Path | None") -> None:
        """Point with another pointing model from now on, beyond the end of this process; `status` names it.

        A sync that comes after it changes the index of the axes alone. `clear("pointing model")` ends it, and the
        one of `[mount] pointing_model` is in force again.

        Parameters
        ----------
        model : RunReport, Fit, PointingModel, path or None
            The model, or a file of one; None for none.

        Raises
        ------
        Refused, PointingError
            The telescope is not at rest; it is no model of this mount.
        """
        self._control.call(lambda: self._model.use(model))

    # Commissioning ---------------------------------------------------------------------------------------------

    def commission(
        self,
        only: Sequence[str] = (),
        witness: "str | SkyWitness" = "encoders",
        watch: "Callable[[Stage], object]" = lambda stage: None,  # noqa: ARG005 - nobody watches
        *,
        written: Mapping[str, object] | None = None,
        ask: Callable[[str], object] = print,
    ) -> "list[Finding]":
        """Find out by small moves what the mount really is; nothing is written to the configuration.

        Parameters
        ----------
        only : sequence of str
            Steps by name, with those they need; all by default.
        witness : str or SkyWitness
            Who tells where the telescope points: `encoders`, `simulator`, `command:PROGRAM`, `typed`.
        watch : callable
            Told of each step before and after it.
        written : mapping, optional
            Values of the configuration file where this telescope was opened with others.
        ask : callable
            Asks the person for a place, for the witness `typed`; `reply` answers.
        """
        from clockdrive.commission import Commissioning  # noqa: PLC0415 - seldom needed

        seer = self._witness(witness, ask)
        return self._perform(Commissioning(self._session, self.configuration, seer, written).run(only, watch))

    def reply(self, text: str | None) -> None:
        """Answer what the witness `typed` has asked; None where nobody types any more, which ends what asked."""
        self._replies.put(text)

    def _sky_witness(self, witness: "str | SkyWitness", ask: Callable[[str], object]) -> "SkyWitness":
        """A witness that sees the sky."""
        seer = self._witness(witness, ask, encoders=False)
        if seer is None:
            raise ArgumentError("encoders see no sky: take the witness simulator, command:PROGRAM or typed")
        return seer

    def _witness(
        self, witness: "str | SkyWitness", ask: Callable[[str], object], *, encoders: bool = True
    ) -> "SkyWitness | None":
        if not isinstance(witness, str):
            return witness
        from clockdrive.witness import witness_of  # noqa: PLC0415 - seldom needed

        planner, sky = self._session.planner, self.true_sky
        return witness_of(witness, planner, self.clock, sky, self._replies, ask, encoders=encoders)

    def left_alone(self) -> str:
        """What comes of a drive that tracks whatever it is told, without this program; empty for one that stops."""
        left = self._control.call(lambda: self._session.left_alone)
        if left is not None:
            return left.said(self.clock.now())
        return "" if self._session.drive.capabilities.can_stop else NOWHERE

    # Leaving ---------------------------------------------------------------------------------------------------

    @property
    def tracks_alone(self) -> bool:
        """Whether its drive goes on tracking without this program."""
        capabilities = self._session.drive.capabilities
        return (capabilities.holds_rate_alone and capabilities.bounds_itself) or not capabilities.can_stop

    @property
    def is_tracking(self) -> bool:
        """Whether it follows a target, as far as was last seen."""
        return self._session.doing == "tracking"

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

    def _gone_to(self, target: Target, progress: Report, ahead: PassPlan | None, hold: Hold | None) -> Steps[Arrival]:
        """Slew to a new target; what was found of the last one is not taken along."""
        self._session.require_free()
        with self._session.holding(hold):
            if ahead is None:
                self._session.plan(target)  # what is refused leaves all as it was
        self._session.forget_target()
        return (yield from self._slewing.goto(target, progress, ahead))

    def _notes(self, plan: Plan, target: Target | None = None) -> tuple[str, ...]:
        said = notes_at(self._session.surroundings, plan.arrival, plan.observed, target)
        left = self._session.left_alone
        return (*said, *self._instruments.notes, *(() if left is None else (left.said(self.clock.now()),)))

    def _arrived(self, arrival: Arrival, target: Target | None = None) -> Answer:
        session = self._session
        return arrival_answer(
            arrival, session.planner, self._notes(arrival.plan, target), target, warnings=session.warnings
        )

    def _answered(self, plan: Plan) -> PlanAnswer:
        return plan_answer(plan, self._session.planner, self._notes(plan))

    def _planned(self, target: Target, time: float | None, hold: Hold | None) -> Plan | PassPlan:
        """Plan on the caller's thread: a refusal may search the whole day, and the control thread has a telescope."""
        wanted, start, timing = self._control.call(lambda: self._session.whence(target, time))
        return plan_or_pass(self._session.planner, wanted, start, timing, hold)

    def _perform(self, steps: Steps[T]) -> T:
        """Run a command that moves the telescope; an interruption of the waiting stops it first."""
        try:
            return self._control.perform(steps)
        except KeyboardInterrupt:
            with suppress(StillMoving):  # an event says so
                self.stop()
            raise

    def _configured(self, name: str) -> tuple[float, float]:
        one, two = (math.radians(getattr(section, name)) for section in self.configuration.axes)
        return one, two

    def _time(self, at: "TimeLike | None") -> float:
        return self.clock.now() if at is None else posix(at)

    def _target(self, given: "TargetLike", time: float, drift: Drift | None = None) -> Target:
        return drifting(resolve(given, self._session.planner, time, sources_of(self.configuration)), drift, time)
