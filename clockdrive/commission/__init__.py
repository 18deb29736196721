"""Finding out what a mount really is: guided small moves that test every assumption against a witness.

The names below are loaded when they are first used: the mathematics behind them takes a while, and no other command
needs it.
"""

from typing import TYPE_CHECKING

from pointing.lazy_names import lazy_names

if TYPE_CHECKING:
    from clockdrive.commission.run import Commissioning, Stage, steps_of

__all__ = [
    "Commissioning",
    "Stage",
    "steps_of",
]

_HOME = {
    "Commissioning": "clockdrive.commission.run",
    "Stage": "clockdrive.commission.run",
    "steps_of": "clockdrive.commission.run",
}

__getattr__ = lazy_names(__name__, _HOME)
