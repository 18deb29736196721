"""The pointing runs of a telescope as a person uses them: list, look, fit, mask, import, export. Nothing moves."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import numpy as np

from clockdrive.configuration import Configuration
from clockdrive.errors import InputError
from clockdrive.fitting import Wanted
from clockdrive.mount_registers import configured
from clockdrive.run_report import RunReport, pointing_run, report_of, stored_of, worst
from clockdrive.run_store import RunStore, StoredRun
from clockdrive.state import StateStore, Zero
from pointing.model.cross_validation import fewest_predicted
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run
from pointing.model.tpoint_file import write_tpoint
from pointing.model.words import Places
from pointing.site import Weather

T = TypeVar("T")


class PointingRuns:
    """The runs that are kept of one telescope.

    Parameters
    ----------
    store : RunStore
        Where they are kept.
    registers : callable
        Tells the mount registers X and Y in force, radians; models come on top of them.
    zero : callable
        Tells what axis angles are counted from now; by default as when a run's last star was seen.
    """

    def __init__(
        self,
        store: RunStore,
        registers: Callable[[], tuple[float, float]] = lambda: (0.0, 0.0),
        zero: Callable[[], Zero | None] = lambda: None,
    ) -> None:
        self.store = store
        self._registers = registers
        self._zero = zero

    @classmethod
    def open(cls, configuration: Configuration) -> Self:
        """Open the runs of the telescope of a configuration; no drive is contacted.

        Raises
        ------
        StateError
            The file cannot be read or written.
        """
        directory, telescope = configuration.state_directory, configuration.identity

        def known(ask: Callable[[StateStore], T]) -> T:
            with StateStore(directory, telescope) as state:
                return ask(state)

        return cls(
            RunStore(directory, telescope),
            lambda: known(lambda state: configured(configuration, state)),
            lambda: known(StateStore.zero),
        )

    @classmethod
    def beside(cls, configuration: Configuration, frame: Mapping[str, Any]) -> Self:
        """Open the runs of a telescope that another owns, which has told the `frame` in force."""
        one, two = frame["registers"]
        zero = Zero(int(frame["zero"]["lost"]), tuple(frame["zero"]["moved_deg"]))
        return cls(RunStore(configuration.state_directory, configuration.identity), lambda: (one, two), lambda: zero)

    @property
    def frame(self) -> dict[str, Any]:
        """What a model of today is fitted for, as it travels in JSON: mount registers, radians, and zero points."""
        return {"registers": list(self._registers()), "zero": vars(self._zero() or Zero())}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; closing twice is harmless."""
        self.store.close()

    @property
    def names(self) -> tuple[str, ...]:
        """All runs, oldest first."""
        return self.store.names()

    def __getitem__(self, name: str) -> StoredRun:
        """The run of a name as it is kept."""
        return self.store.read(name)

    def observations(self, name: str | None = None) -> PointingRun:
        """What fits read of a run, by default the newest."""
        return pointing_run(self.store.read(name), self._registers(), self._zero())

    def report(self, name: str | None = None, wanted: Wanted | None = None) -> RunReport:
        """Fit a run, by default the newest with the terms that it asks for.

        Raises
        ------
        InputError, TooFewStars, PointingError
            There is none; it cannot be fitted.
        """
        return report_of(self.store.read(name), self._registers(), wanted, self._zero())

    def mask(self, name: str, indices: Sequence[int], reason: str = "by hand") -> None:
        """Let observations, counted from 0, take no part in fits."""
        self.store.mask(name, indices, reason or "by hand")

    def unmask(self, name: str, indices: Sequence[int]) -> None:
        """Let observations take part again."""
        self.store.mask(name, indices, "")

    def mask_worst(self, name: str, count: int = 1) -> tuple[int, ...]:
        """Mask the observations that lie farthest from the fit; return their indices.

        Raises
        ------
        InputError
            None would be masked, or fewer would be left than a fit needs.
        """
        report = self.report(name)
        needed = fewest_predicted(Wanted().free(report.run.mount))
        most = int(np.count_nonzero(report.run.kept)) - needed
        if not 1 <= count <= most:
            bound = f"1 to {most} can be masked" if most > 0 else "no more can be masked"
            raise InputError(f"the worst {count} of {name}: {bound}, as a fit needs {needed} stars")
        found = worst(report, count)
        self.store.mask(name, found, "the worst of its fit")
        return found

    def rename(self, name: str, to: str) -> None:
        """Give a run another name; Refused while it is being taken."""
        self.store.rename(name, to)

    def forget(self, name: str) -> None:
        """Delete a run with its observations; Refused while it is being taken."""
        self.store.forget(name)

    def take_in(
        self,
        path: str | Path,
        name: str,
        began: float,
        *,
        places: Places | None = None,
        weather: Weather | None = None,
    ) -> StoredRun:
        """Keep a run from a TPOINT, SPK or ECSV file.

        Raises
        ------
        InputError, PointingError
            There is a run of this name; the file cannot be read.
        """
        run = stored_of(read_run(path, places=places, weather=weather), name, began)
        self.store.begin(run)
        return run

    def write(self, name: str | None, path: str | Path) -> None:
        """Write a run into a file: ECSV, or TPOINT's where the name ends in `.dat`.

        Places are those of the sky, whatever mount registers are in force; masks, weights and times go along, counts
        and what was in force do not.

        Raises
        ------
        InputError, PointingError
            There is no such run; the file cannot be written.
        """
        run = pointing_run(self.store.read(name), zero=self._zero())
        if Path(path).suffix == ".ecsv":
            from pointing.model.ecsv_run import write_ecsv  # noqa: PLC0415 - takes astropy along

            write_ecsv(run, path)
        elif Path(path).suffix == ".dat":
            write_tpoint(run, path)
        else:
            raise InputError(
                f"{path}: name a file that ends in .ecsv, with weights and times, or in .dat, TPOINT's own"
            )
