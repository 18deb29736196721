"""What a telescope finds out of itself by a witness: pointing runs, polar alignment, commissioning."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from clockdrive.errors import ArgumentError, finite
from clockdrive.telescope.asking import Asking

if TYPE_CHECKING:
    from pathlib import Path

    from clockdrive.alignment import Alignment
    from clockdrive.commission import Stage
    from clockdrive.observing import RunProgress
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.run_report import RunReport
    from clockdrive.run_taking import RunSettings
    from clockdrive.witness import SkyWitness
    from mounts.commissioning import Finding
    from pointing.model.fitted import Fit
    from pointing.model.pointing_model import PointingModel
    from pointing.model.words import Pole

_PATIENCE_S = 0.5  # with another process that writes runs: the control thread has a telescope


class Looking(Asking):
    """Looks through a witness, and what they are good for."""

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
