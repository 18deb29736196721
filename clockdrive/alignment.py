"""An alignment under way, as a person has it in hand: turn the knobs, look, read what is left."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

from clockdrive.aligning import Aligning, AlignmentSettings, AlignmentState
from clockdrive.control import Control, Steps
from clockdrive.mount_registers import MountRegisters
from clockdrive.observing import Observing
from clockdrive.session import Session
from clockdrive.witness import SkyWitness

if TYPE_CHECKING:
    from clockdrive.pointing_runs import PointingRuns
    from clockdrive.slewing import Slewing

Perform = Callable[[Steps[Any]], Any]
Tell = Callable[[str], object]


class Alignment:
    """The alignment of axis 1.

        alignment = scope.polar_alignment("command:solve.sh")
        alignment.text          # raise the polar axis by 12.31′ ± 0.05′ …
        alignment.look()        # after turning the knobs

    Parameters
    ----------
    registers : MountRegisters
        Where the lean is written, where nobody turns knobs.
    aligning : Aligning
        Does the work.
    control : Control
        Runs it.
    perform : callable
        Runs its steps.
    report : callable
        Told of each star.
    """

    def __init__(
        self, registers: MountRegisters, aligning: Aligning, control: Control, perform: Perform, report: Tell
    ) -> None:
        self._registers, self._aligning = registers, aligning
        self._control, self._perform, self._report = control, perform, report

    @classmethod
    def begun(
        cls,
        session: Session,
        slewing: "Slewing",
        runs: "PointingRuns",
        registers: MountRegisters,
        witness: SkyWitness,
        settings: AlignmentSettings,
        control: Control,
        perform: Perform,
        report: Tell,
    ) -> "Alignment":
        """Look at three stars, and begin with what they tell."""
        observing = Observing(session, slewing, runs.store)
        aligning = control.call(lambda: Aligning(session, observing, witness, settings))
        perform(aligning.begin(report))
        return cls(registers, aligning, control, perform, report)

    def look(self, *, turned: bool = True, another: bool = False) -> AlignmentState:
        """Look again; return what is left.

        Parameters
        ----------
        turned : bool
            Whether the knobs were turned since the last look.
        another : bool
            Go to the star that tells most first; by default the telescope stays where it is.

        Raises
        ------
        WitnessError
            The witness sees nothing, or something that cannot be: look again.
        Refused
            Not now, or what the alignment rests on has changed.
        """
        state: AlignmentState = self._perform(self._aligning.look(self._report, turned=turned, another=another))
        return state

    def anew(self) -> AlignmentState:
        """Forget all looks, and look at three stars again; where that fails what was known stays.

        Raises
        ------
        Refused
            Not now, or too few stars were seen.
        """
        aligning = self._control.call(self._aligning.anew)
        state: AlignmentState = self._perform(aligning.begin(self._report))
        self._aligning = aligning
        return state

    def write_mount(self) -> tuple[int, int]:
        """Point with the lean of axis 1 as it is, instead of turning knobs, until the telescope is closed.

        `drive.push()` writes it into a drive that keeps these registers; `clear("mount x")` ends it.

        The telescope stops; `sync` on a star afterwards, for what is left is an index error.

        Returns
        -------
        tuple of int
            `[mount] mount_x_mas` and `mount_y_mas`, whole, which put it in force for good.

        Raises
        ------
        Refused
            Not now; the last look was not taken, or none since the knobs were turned.
        """

        def write() -> tuple[int, int]:
            x_mas, y_mas = self._aligning.registers
            self._registers.write(x_mas, y_mas)
            return x_mas, y_mas

        return self._control.call(write)

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
        """What to turn; above it why that may not be what to turn now, where a look was not taken."""
        return "\n".join(filter(None, (self._aligning.doubt, self.state.text)))

    def __repr__(self) -> str:
        return "\n".join(filter(None, (self._aligning.doubt, repr(self.state))))

    def _repr_html_(self) -> str:
        doubt = self._aligning.doubt
        return (f"<p>{escape(doubt)}</p>" if doubt else "") + self.state._repr_html_()
