"""Finding out what a mount really is: guided small moves that test every assumption against a witness."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from clockdrive.commission.run import Commissioning, Stage, steps_of
    from clockdrive.commission.witness import CommandWitness, SimulatedSky, SkyWitness, TypedWitness, witness_of

__all__ = [
    "CommandWitness",
    "Commissioning",
    "SimulatedSky",
    "SkyWitness",
    "Stage",
    "TypedWitness",
    "steps_of",
    "witness_of",
]

_OF_RUN = {"Commissioning", "Stage", "steps_of"}


def __getattr__(name: str) -> object:
    """Load what is asked for: the mathematics behind it takes a while, and no other command needs it."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{'run' if name in _OF_RUN else 'witness'}"), name)
