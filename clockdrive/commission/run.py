"""A commissioning: its steps one after the other, each within its bound, interruptible everywhere.

Whatever ends a step early, the telescope is stopped first and the registers it changed are given back then; what this
process cannot give back, the next one does when it connects. A step that cannot be done is skipped with its reason.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from clockdrive.commission.bench import CommissioningBench, Impossible
from clockdrive.commission.steps import FIRST, LAST
from clockdrive.configuration import Configuration
from clockdrive.control import Steps
from clockdrive.drives import commissioning_of
from clockdrive.errors import ClockdriveError, InputError, Refused
from clockdrive.session import Session
from clockdrive.state import Event
from clockdrive.witness import SkyWitness, WitnessError
from mounts.commissioning import BACK, Encoder, Finding, Step
from mounts.drive import Drive
from mounts.errors import DriveError
from pointing.errors import Unreachable
from transports.errors import TransportError


@dataclass(frozen=True)
class Stage:
    """A step about to begin, or just done with what it found."""

    step: Step
    number: int
    of: int
    findings: tuple[Finding, ...] | None = None


Watch = Callable[[Stage], object]


def steps_of(kind: str, only: Sequence[str] = ()) -> tuple[Step, ...]:
    """The steps for a drive, in order; with `only`, those and the ones they need.

    Raises
    ------
    InputError
        There is no such step.
    """
    own = commissioning_of(kind)
    left_out: frozenset[str] = getattr(own, "LEFT_OUT", frozenset())
    shared, last = ([step for step in steps if step.name not in left_out] for steps in (FIRST, LAST))
    steps = (*own.BEFORE, *shared, *own.AFTER, *last)
    names = {step.name for step in steps}
    for name in only:
        if name not in names:
            raise InputError(f"no step {name!r}; there is {', '.join(step.name for step in steps)}")
    wanted = set(only or names)
    for step in reversed(steps):
        wanted |= set(step.needs) if step.name in wanted else set()
    return tuple(step for step in steps if step.name in wanted)


@runtime_checkable
class Borrows(Protocol):
    """A drive of which a step may change registers for a while."""

    def give_back(self) -> None:
        """Write back what was borrowed."""
        ...


@runtime_checkable
class Learns(Protocol):
    """A drive that dares more once the configuration was confirmed."""

    def commissioned(self, confirmed: Collection[str]) -> None:
        """These keys were."""
        ...


def _encoders(kind: str, drive: Drive) -> "tuple[Encoder | None, Encoder | None]":
    """What absolute encoders read, of a drive that has some."""
    encoders: Callable[[Drive], tuple[Encoder | None, Encoder | None]] | None
    encoders = getattr(commissioning_of(kind), "encoders", None)
    return (None, None) if encoders is None else encoders(drive)


class Commissioning:
    """Finds out what a telescope really is.

    Parameters
    ----------
    session : Session
        The telescope.
    configuration : Configuration
        What is compared.
    witness : SkyWitness or None
        Tells where it points on the sky; None for the encoders alone.
    written : mapping, optional
        Values of the configuration file where the telescope was opened with others.
    """

    def __init__(
        self,
        session: Session,
        configuration: Configuration,
        witness: SkyWitness | None,
        written: Mapping[str, object] | None = None,
    ) -> None:
        self._session = session
        self._kind = configuration.drive.kind
        self._bench = CommissioningBench(
            session,
            configuration,
            witness,
            lambda: _encoders(self._kind, session.drive),
            dict(written or {}),
        )
        self._still_only = ""  # why nothing may be moved any more

    def run(self, only: Sequence[str], watch: Watch) -> Steps[list[Finding]]:
        """Take all steps; return everything found.

        Raises
        ------
        Refused
            The telescope is busy or parked, or was stopped meanwhile.
        """
        session, steps = self._session, steps_of(self._kind, only)
        session.require_free()
        if session.doing != "idle" or session.pursuit is not None:
            raise Refused(f"the telescope is {session.doing}; `stop` it, then commission it")
        findings: list[Finding] = []
        for number, step in enumerate(steps, start=1):
            watch(Stage(step, number, len(steps)))
            found = yield from self._taken(step)
            findings += found
            self._record(step, found)
            watch(Stage(step, number, len(steps), tuple(found)))
        if isinstance(session.drive, Learns):
            session.drive.commissioned({each.key for each in findings if each.verdict == "confirmed"})
        return findings

    def _taken(self, step: Step) -> Steps[list[Finding]]:
        """Take one step, and leave the telescope at rest with its own registers whatever happens."""
        if not step.applies(self._bench):
            return []
        if step.moves and self._still_only:
            return [Finding(step.name, "untested", f"nothing is moved: {self._still_only}")]
        done = False
        try:
            self._bench.begin(step)
            found = yield from step.run(self._bench)
            done = True
        except (Impossible, WitnessError, DriveError, TransportError, Unreachable) as error:
            found = [Finding(step.name, "untested", str(error))]
        finally:
            self._leave(stopped=done or not self._bench.moved)
        if not done and self._bench.moved:
            found += yield from self._returned(step)
        if step.allows_motion and any(each.verdict == "refuted" for each in found):
            self._still_only = next(each.detail for each in found if each.verdict == "refuted")
        return found

    def _returned(self, step: Step) -> Steps[list[Finding]]:
        """Go back to where a step began that was broken off."""
        try:
            yield from self._bench.move(BACK)
        except (DriveError, TransportError, Unreachable) as error:
            self._still_only = f"the step `{step.name}` could not be taken back ({error})"
            self._leave(stopped=False)
        return []

    def _leave(self, *, stopped: bool) -> None:
        """Stop first, so that a register given back does not drive the axis on."""
        session = self._session
        if not stopped:
            session.stop_and_fail("the commissioning was broken off")
        with suppress(DriveError, TransportError):  # the next connection gives back what this one cannot
            if isinstance(session.drive, Borrows):
                session.drive.give_back()
        if session.doing == "commissioning":
            session.now_doing("idle")

    def _record(self, step: Step, findings: Iterable[Finding]) -> None:
        with suppress(ClockdriveError):
            for found in findings:
                text = f"{found.subject}: {found.verdict}; {found.detail}"
                self._session.store.record_event(
                    Event(self._session.clock.now(), "commission", text, {"step": step.name})
                )
