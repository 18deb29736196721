"""A pointing run while it is taken: what is still to be visited, and each place written as soon as it is known.

The run is read once. Where its file is held by another process, what was seen is kept here and the write is tried
again between the steps, so that the telescope is looked after and nothing is lost.
"""

from collections.abc import Callable
from dataclasses import replace

from clockdrive.control import Steps
from clockdrive.errors import StateError
from clockdrive.run_store import Observation, PlacedStar, RunStore

_TRIES = 2  # of a place where nothing was seen
_AGAIN_S = 1.0
_PATIENCE_S = 300.0  # with a file that cannot be written


class RunUnderWay:
    """The places of a run, and what became of them.

    Parameters
    ----------
    store : RunStore
        Keeps it.
    name : str
        Of the run.
    """

    def __init__(self, store: RunStore, name: str) -> None:
        self._store, self.name = store, name
        self._places = {each.number: each for each in store.read(name).places}
        self.seen = 0
        """Places that were seen since it was begun or resumed."""
        self.blind = 0
        """Places where nothing was seen since then."""

    @property
    def of(self) -> int:
        """How many places it has."""
        return len(self._places)

    def count(self, state: str) -> int:
        """How many places are `planned`, `observed` or `skipped`."""
        return sum(each.state == state for each in self._places.values())

    def next(self) -> PlacedStar | None:
        """The first place that was not visited, else one that was skipped and may be tried again."""
        pending = (each for each in self._places.values() if each.state == "planned")
        again = (each for each in self._places.values() if each.state == "skipped" and each.tries < _TRIES)
        return next(pending, None) or next(again, None)

    def observed(self, placed: PlacedStar, seen: Observation) -> Steps[None]:
        """Keep what was seen at a place.

        Raises
        ------
        StateError
            It could not be written, however long that was tried.
        """
        yield from self._written(lambda: self._store.observed(self.name, placed.number, seen))
        self.seen += 1
        self._note(replace(placed, state="observed", reason="", tries=placed.tries + 1))

    def skipped(self, placed: PlacedStar, reason: str) -> Steps[None]:
        """Keep why nothing was seen at a place.

        Raises
        ------
        StateError
            As for `observed`.
        """
        yield from self._written(lambda: self._store.skipped(self.name, placed.number, reason))
        self.blind += 1
        self._note(replace(placed, state="skipped", reason=reason, tries=placed.tries + 1))

    def _note(self, placed: PlacedStar) -> None:
        self._places[placed.number] = placed

    def _written(self, write: Callable[[], None]) -> Steps[None]:
        waited = 0.0
        while True:
            try:
                write()
            except StateError:
                if waited >= _PATIENCE_S:
                    raise
            else:
                return
            yield _AGAIN_S
            waited += _AGAIN_S
