"""The sections of a configuration as a kind of drives has them, with its own keys."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from clockdrive.configuration_sections import AxisSection, DriveSection, SimulatorSection

if TYPE_CHECKING:
    from clockdrive.configuration import Configuration

Drive = TypeVar("Drive", bound=DriveSection)
One = TypeVar("One", bound=AxisSection)
Two = TypeVar("Two", bound=AxisSection)
Simulator = TypeVar("Simulator", bound=SimulatorSection)


@dataclass(frozen=True)
class OwnSections(Generic[Drive, One, Two, Simulator]):
    """What `[drive]`, `[axis1]`, `[axis2]` and `[simulator]` are of one kind."""

    drive: type[Drive]
    axis1: type[One]
    axis2: type[Two]
    simulator: type[Simulator]

    def drive_of(self, configuration: "Configuration") -> Drive:
        """`[drive]` of a configuration."""
        return configuration.section(self.drive, "drive")

    def axes_of(self, configuration: "Configuration") -> tuple[One, Two]:
        """`[axis1]` and `[axis2]` of a configuration."""
        return configuration.section(self.axis1, "axis1"), configuration.section(self.axis2, "axis2")

    def simulator_of(self, configuration: "Configuration") -> Simulator:
        """`[simulator]` of a configuration."""
        return configuration.section(self.simulator, "simulator")
