"""Finding out what a mount really is: guided small moves that test every assumption against a witness.

The names below are loaded when they are first used: the mathematics behind them takes a while, and no other command
needs it.
"""

from typing import TYPE_CHECKING

from pointing.lazy_names import lazy_names

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

_HOME = {
    "CommandWitness": "clockdrive.commission.witness",
    "Commissioning": "clockdrive.commission.run",
    "SimulatedSky": "clockdrive.commission.witness",
    "SkyWitness": "clockdrive.commission.witness",
    "Stage": "clockdrive.commission.run",
    "TypedWitness": "clockdrive.commission.witness",
    "steps_of": "clockdrive.commission.run",
    "witness_of": "clockdrive.commission.witness",
}

__getattr__ = lazy_names(__name__, _HOME)
