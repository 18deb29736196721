"""An alignment under way, as a person has it in hand: turn the knobs, look, read what is left."""

from collections.abc import Callable
from typing import Any

from clockdrive.aligning import Aligning, AlignmentState
from clockdrive.control import Steps
from clockdrive.observing import Observing
from clockdrive.pointing_runs import PointingRuns
from clockdrive.session import Session
from clockdrive.slewing import Slewing
from clockdrive.witness import SkyWitness
from pointing.model.words import Pole

Perform = Callable[[Steps[Any]], Any]


class Alignment:
    """The alignment of axis 1.

        alignment = scope.polar_alignment("command:solve.sh")
        alignment.text          # raise the polar axis by 12.31′ ± 0.05′ …
        alignment.look()        # after turning the knobs

    Parameters
    ----------
    aligning : Aligning
        Does the work.
    perform : callable
        Runs its steps.
    """

    def __init__(self, aligning: Aligning, perform: Perform) -> None:
        self._aligning = aligning
        self._perform = perform

    @classmethod
    def begun(
        cls,
        session: Session,
        slewing: Slewing,
        runs: PointingRuns,
        witness: SkyWitness,
        pole: Pole,
        settle_s: float,
        perform: Perform,
        report: Callable[[str], object],
    ) -> "Alignment":
        """Look at three stars, and begin with what they tell."""
        aligning = Aligning(session, Observing(session, slewing, runs.store), witness, pole, settle_s)
        perform(aligning.begin(report))
        return cls(aligning, perform)

    def look(self) -> AlignmentState:
        """Look again, after the knobs were turned; return what is left.

        Raises
        ------
        WitnessError
            The witness sees nothing, or something that cannot be: look again.
        Refused
            Not now.
        """
        state: AlignmentState = self._perform(self._aligning.look())
        return state

    @property
    def states(self) -> tuple[AlignmentState, ...]:
        """What was known after each look, the oldest first."""
        return tuple(self._aligning.states)

    @property
    def state(self) -> AlignmentState:
        """What is known now."""
        return self._aligning.states[-1]

    @property
    def text(self) -> str:
        """What to turn."""
        return self.state.text

    def __repr__(self) -> str:
        return repr(self.state)

    def _repr_html_(self) -> str:
        return self.state._repr_html_()
