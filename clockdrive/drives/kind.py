"""What the application must know of a kind of drives: its axes, its law of motion, its driver, its simulator."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from pointing.plan import Axis, Timing

if TYPE_CHECKING:
    from clockdrive.configuration import Configuration
    from clockdrive.drives.by_hand import AtRest, ByHand
    from mounts.drive import Drive
    from transports.link import Clock
    from transports.memory import Device

DEAD_MAN_LOG = "dead-man.log"  # in the state directory
Remember = Callable[[Mapping[str, object]], None]


class Simulated(Protocol):
    """A simulated drive, embedded or hosted."""

    @property
    def lines(self) -> "tuple[Device, ...]":
        """What answers at the far end of each of its links, in the order in which the drive opens them."""
        ...

    def advance(self, t: float) -> None:
        """Let the motors run until POSIX `t`."""
        ...

    def true_position(self, axis: int) -> float:
        """Where axis 1 or 2 truly is, in the drive's own units, as of the last `advance`."""
        ...

    def snapshot(self) -> Mapping[str, object]:
        """What `simulated` must be given to go on from here."""
        ...


@runtime_checkable
class Geared(Protocol):
    """A simulated drive with the gears of its mount: its axes follow its motors through their play."""

    @property
    def plays(self) -> tuple[float, float]:
        """Play of each axis, in the drive's own units."""
        ...


class Kind(Protocol):
    """One kind of drives; the module `kind` of its folder."""

    def axes(self, configuration: "Configuration") -> tuple[Axis, Axis]:
        """The pointing axes: gearing, and the travel that the drive can be held to."""
        ...

    def timing(self, configuration: "Configuration") -> Timing:
        """How the configured drive moves by its own law, with nothing learnt."""
        ...

    def drive(
        self,
        configuration: "Configuration",
        clock: "Clock",
        lines: "tuple[Device, ...]",
        memory: Mapping[str, object],
        remember: Remember,
    ) -> "tuple[Drive, Configuration]":
        """Make the drive, not yet connected, and complete the configuration from the unit.

        Parameters
        ----------
        configuration : Configuration
            Where it is. Keys that nobody has given are read from the unit, where it holds them itself.
        clock : Clock
            Stamps the times of the links.
        lines : tuple of Device
            The lines of the embedded simulator; empty for links of the configuration.
        memory : Mapping
            What the drive asked to be given back.
        remember : callable
            Keeps such a memory.

        Raises
        ------
        ConfigurationError, DriveError, TransportError
            The unit contradicts itself or the configuration; nothing answers.
        """
        ...

    def simulated(
        self, configuration: "Configuration", time: float, snapshot: Mapping[str, object] | None
    ) -> Simulated:
        """A simulated drive, as it was left or new at its park position."""
        ...

    def memory_at_park(self, configuration: "Configuration", time: float) -> dict[str, object]:
        """What the driver of a simulator never used before remembers: it is synchronised, at park."""
        ...

    def by_hand(self, at_rest: "AtRest") -> "ByHand":
        """The drive in a person's hands."""
        ...
