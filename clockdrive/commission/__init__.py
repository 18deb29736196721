"""Finding out what a mount really is: guided small moves that test every assumption against a witness."""

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
